/* Files whose checksums hold but whose content does not: each forged field is refused, naming section and item. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#include <xxhash.h>

#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/writer.h"
#include "support/make_dataset.h"

static char folder[256], path[300];

/* A dataset of two levels, taken apart; the forgers below change it before it is written anew. */
struct parts {
    struct spl_node *nodes;
    struct spl_chunk *chunks;
    uint64_t node_count, chunk_count;
    json_t *meta;
    uint32_t *words;
    size_t word_count;
    struct spl_stream streams[3]; /* class, uncertainty, room for another */
    uint32_t stream_count;
    uint32_t *bases[2];
    uint8_t *widths[2];
};

static void *copy(const void *from, size_t bytes)
{
    return memcpy(malloc(bytes + 128), from, bytes);
}

static struct parts take_apart(void)
{
    enum { count = 400 };
    struct make_splat splats[count];
    for (int i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {i % 20, i / 20, i % 3},
                                        .normal = {0, 0, 1},
                                        .radius = 1 + i % 2,
                                        .color = {(uint8_t)i},
                                        .classification = (uint8_t)(i % 4)};
    struct spl_dataset *dataset = make_dataset_levels(splats, count, 2);
    struct parts p = {0};
    size_t bytes;
    p.nodes = (struct spl_node *)spl_dataset_get_nodes(dataset, &p.node_count);
    p.nodes = copy(p.nodes, p.node_count * sizeof *p.nodes);
    p.chunks = (struct spl_chunk *)spl_dataset_get_chunks(dataset, &p.chunk_count);
    p.chunks = copy(p.chunks, p.chunk_count * sizeof *p.chunks);
    const uint32_t *page = spl_dataset_get_page(dataset, 0, &bytes);
    p.word_count = bytes / 4 - SPL_PAGE_TAIL_WORDS;
    p.words = copy(page, bytes);
    const struct spl_stream *streams = spl_dataset_get_streams(dataset, &p.stream_count);
    assert_int_equal(p.stream_count, 2);
    for (int s = 0; s < 2; s++) {
        p.streams[s] = spl_streams_known[s];
        p.streams[s].base = p.bases[s] = copy(streams[s].base, p.chunk_count * sizeof *p.bases[s]);
        p.streams[s].width = p.widths[s] = copy(streams[s].width, p.chunk_count);
    }
    p.meta = json_deep_copy(spl_dataset_get_meta(dataset));
    spl_dataset_close(dataset);
    assert_true(p.node_count == 5 && p.chunk_count >= 5);
    return p;
}

static void write_parts(const struct parts *p)
{
    struct spl_dataset_writer *writer;
    uint32_t page;
    assert_int_equal(spl_dataset_writer_create(path, &writer, NULL), SPL_OK);
    assert_int_equal(spl_dataset_writer_add_node(writer, p->words, p->word_count, NULL, 0, &page, NULL), SPL_OK);
    spl_dataset_writer_set_streams(writer, p->streams, p->stream_count);
    assert_int_equal(
        spl_dataset_writer_finish(writer, p->nodes, p->node_count, p->chunks, p->chunk_count, p->meta, NULL), SPL_OK);
    spl_dataset_writer_destroy(writer);
}

static void release(struct parts *p)
{
    free(p->nodes);
    free(p->chunks);
    free(p->words);
    for (int s = 0; s < 2; s++) {
        free(p->bases[s]);
        free(p->widths[s]);
    }
    json_decref(p->meta);
}

static void expect(const char *what, int code, const char *part)
{
    struct spl_dataset *dataset = NULL;
    struct spl_error err = {0};
    int rc = spl_dataset_open(path, true, &dataset, &err);
    spl_dataset_close(dataset);
    if (rc != code || (rc && (!strstr(err.message, part) || !strstr(err.message, path))))
        fail_msg("%s: expected %d '%s', got %d '%s'", what, code, part, rc, err.message);
}

#define FORGE(name, statement)                                                                                         \
    static void name(struct parts *p)                                                                                  \
    {                                                                                                                  \
        statement;                                                                                                     \
    }
FORGE(nothing, (void)p)
FORGE(root_depth, p->nodes[0].depth = 1)
FORGE(child_depth, p->nodes[3].depth = 2)
FORGE(children_missing, p->nodes[0].child_count = 3)
FORGE(children_beyond, p->nodes[0].child_count = 8)
FORGE(grandchild, p->nodes[4].child_count = 1)
FORGE(own_child, (p->nodes[0].child_count = 3, p->nodes[4].child_count = 1))
FORGE(origin_nan, p->nodes[1].origin[1] = NAN)
FORGE(size_zero, p->nodes[0].size = 0)
FORGE(size_huge, p->nodes[2].size *= 2)
FORGE(child_moved, p->nodes[2].origin[0] += 1e4)
FORGE(child_nan_size, p->nodes[2].size = NAN)
FORGE(spacing_negative, p->nodes[0].spacing = -1)
FORGE(box_turned, p->nodes[0].box_min[2] = p->nodes[0].box_max[2] + 1)
FORGE(box_infinite, p->nodes[0].box_max[0] = INFINITY)
FORGE(count_zero, p->chunks[0].count = 0)
FORGE(count_large, p->chunks[1].count = 129)
FORGE(step_zero, p->chunks[0].step = 0)
FORGE(step_nan, p->chunks[0].step = NAN)
FORGE(step_overflows, (p->chunks[0].step = 1e35f, p->chunks[0].geometry_bits |= 24))
FORGE(wide_position, p->chunks[0].geometry_bits |= 25)
FORGE(wide_normal, p->chunks[0].geometry_bits |= 13u << SPL_GEOMETRY_U)
FORGE(radius_negative, p->chunks[0].radius_min = -1)
FORGE(mean_radius_zero, p->chunks[0].radius_mean = 0)
FORGE(normal_off, p->chunks[0].normal_u = 5)
FORGE(normal_step, p->chunks[0].normal_step = -1)
FORGE(axis_three, p->chunks[0].geometry_bits |= 3u << SPL_GEOMETRY_AXIS)
FORGE(unknown_bit, p->chunks[0].geometry_bits |= 3u << SPL_GEOMETRY_LINEAR)
FORGE(wide_color, p->chunks[0].color_bits |= 15)
FORGE(color_base, p->chunks[0].color_base = 0x7fff)
static void add_stream(struct parts *p, const char *name, const char *type, const char *unit)
{
    p->streams[p->stream_count] = p->streams[0]; // of the words of the first
    p->streams[p->stream_count].name = name;
    p->streams[p->stream_count].type = type;
    p->streams[p->stream_count++].unit = unit;
}
FORGE(wide_class, p->widths[0][0] = 33)
FORGE(class_past_page, p->widths[0][p->chunk_count - 1] = 32)
FORGE(no_streams, p->stream_count = 0)
FORGE(two_of_a_name, add_stream(p, "class", "uint", ""))
FORGE(empty_name, add_stream(p, "", "uint", ""))
FORGE(long_name, add_stream(p, "a-name-of-thirty-two-characters-", "uint", ""))
FORGE(long_unit, add_stream(p, "a", "uint", "a-unit-of-thirty-two-characters-"))
FORGE(taken_name, add_stream(p, "position", "uint", ""))
FORGE(total_name, add_stream(p, "total", "uint", ""))
FORGE(uncertainty_negative, p->bases[1][0] = 0xbf800000)
FORGE(uncertainty_wide, p->widths[1][0] = 6)
FORGE(unit_text, json_object_set_new(p->meta, "unit", json_string("furlong")))
FORGE(unit_number, json_object_set_new(p->meta, "unit", json_integer(1)))
FORGE(unit_gone, (json_object_del(p->meta, "unit"), json_object_del(p->meta, "crs")))
FORGE(crs_number, json_object_set_new(p->meta, "crs", json_integer(2056)))
FORGE(crs_long, json_object_set_new(p->meta, "crs", json_sprintf("%*s", (64 << 10) + 1, "")))
FORGE(crs_null, json_object_set_new(p->meta, "crs", json_null()))
FORGE(many_lines, p->chunks[0].extra_bits |= 255u << SPL_EXTRA_CLIP)
FORGE(lines_past_page,
      p->chunks[p->chunk_count - 1].extra_bits |= p->chunks[p->chunk_count - 1].count << SPL_EXTRA_CLIP)
FORGE(unknown_extra, p->chunks[0].extra_bits |= 1u << 8)
FORGE(discs_as_lines, p->chunks[0].extra_bits |= (uint32_t)SPL_CHUNK_LINES << SPL_EXTRA_KIND)
FORGE(uncertainty_nan, p->bases[1][0] = 0x7fc00000)
FORGE(past_page, p->chunks[p->chunk_count - 1].geometry_word += 1 + 16)
FORGE(word_wraps, p->chunks[0].geometry_word = UINT32_MAX)
FORGE(levels, json_object_set_new(p->meta, "levels", json_integer(3)))
FORGE(levels_few, json_object_set_new(p->meta, "levels", json_integer(1)))
FORGE(levels_many, json_object_set_new(p->meta, "levels", json_integer(257)))
FORGE(leaf_splats, json_object_set_new(p->meta, "leaf_splats", json_integer(399)))
FORGE(points_few, json_object_set_new(p->meta, "points", json_integer(399)))
FORGE(part_of_less, json_object_set_new(p->meta, "part_of", json_integer(400)))
FORGE(part_of_text, json_object_set_new(p->meta, "part_of", json_string("all")))
FORGE(points_text, json_object_set_new(p->meta, "points", json_string("400")))
FORGE(pruned_right, json_object_set_new(p->meta, "pruned", json_pack("{s:i}", "of", 400)))
FORGE(pruned_less, json_object_set_new(p->meta, "pruned", json_pack("{s:i}", "of", 399)))
FORGE(pruned_more, json_object_set_new(p->meta, "pruned", json_pack("{s:i}", "of", 401)))
FORGE(pruned_text, json_object_set_new(p->meta, "pruned", json_string("of")))
FORGE(points_gone, json_object_del(p->meta, "points"))
FORGE(radius_gone, json_object_del(p->meta, "splat_radius"))
FORGE(bounds_turned, json_array_set_new(json_object_get(json_object_get(p->meta, "bounds"), "min"), 0, json_real(1e9)))
FORGE(bounds_short, json_array_remove(json_object_get(json_object_get(p->meta, "bounds"), "max"), 2))
FORGE(fov, json_object_set_new(json_object_get(p->meta, "default_view"), "fov", json_real(180)))
FORGE(fit_right, json_object_set_new(json_object_get(p->meta, "default_view"), "fit", json_pack("[f, i]", 60.5, 45)))
FORGE(fit_wide, json_object_set_new(json_object_get(p->meta, "default_view"), "fit", json_pack("[i, i]", 60, 180)))
FORGE(fit_short, json_object_set_new(json_object_get(p->meta, "default_view"), "fit", json_pack("[i]", 60)))
FORGE(title_right, json_object_set_new(p->meta, "title", json_string("The hall")))
FORGE(title_number, json_object_set_new(p->meta, "title", json_integer(5)))
FORGE(description_list, json_object_set_new(p->meta, "description", json_array()))
static void set_view(struct parts *p, const char *name, double eye)
{
    json_object_set_new(p->meta, "views",
                        json_pack("[{s:s, s:[f, f, f], s:[f, f, f], s:s}]", "name", name, "eye", eye, 0.0, 0.0,
                                  "target", 0.0, 0.0, 0.0, "later", "more"));
}
FORGE(view_right, set_view(p, "door", 1))
FORGE(view_name, set_view(p, "a/b", 1))
FORGE(view_blind, set_view(p, "door", 0))
FORGE(views_text, json_object_set_new(p->meta, "views", json_string("door")))
FORGE(eye, json_object_set(json_object_get(p->meta, "default_view"), "eye",
                           json_object_get(json_object_get(p->meta, "default_view"), "target")))
FORGE(up, json_array_set_new(json_object_get(json_object_get(p->meta, "default_view"), "up"), 1, json_string("north")))
FORGE(flags, json_object_del(json_object_get(p->meta, "attributes"), "color"))
FORGE(sources, json_object_set_new(p->meta, "sources", json_pack("[i]", 1)))
FORGE(stations, json_object_set_new(p->meta, "stations", json_pack("[[i]]", 1)))
/* An upright pose but for one number. */
static void set_station(struct parts *p, size_t at, double number)
{
    json_t *pose = json_array();
    for (size_t i = 0; i < 16; i++)
        json_array_append_new(pose, json_real(i == at ? number : i % 5 == 0));
    json_object_set_new(p->meta, "stations", json_pack("[o]", pose));
}
FORGE(station_right, set_station(p, 3, -1e15))
FORGE(station_mirrored, set_station(p, 10, -1))
FORGE(station_far, set_station(p, 7, 2e15))
FORGE(station_columns, set_station(p, 12, 4))
FORGE(station_scaled, set_station(p, 15, 0))
static void set_color(struct parts *p, const char *from, int points)
{
    json_object_set_new(p->meta, "color",
                        json_pack("[{s:s, s:s, s:i}]", "source", "a", "from", from, "points", points));
}
FORGE(color, set_color(p, "rgb", 400))
FORGE(color_text, json_object_set_new(p->meta, "color", json_string("rgb")))
FORGE(color_few, set_color(p, "rgb", -1))
FORGE(color_what, set_color(p, "xyz", 1))

static const struct {
    void (*forge)(struct parts *p);
    const char *part; /* of the message; NULL: opens */
} rows[] = {
    {nothing, NULL},
    {root_depth, "section HEAD 0: node 0 is the root"},
    {child_depth, "section HEAD 0: node 3 lies deeper than META's"},
    {children_missing, "section PDIR: page 1 closes it"},
    {children_beyond, "section PDIR: page 1 closes it"},
    {grandchild, "section PDIR: page 1 closes it"},
    {own_child, "section HEAD 0: node 4 is no node's child"},
    {origin_nan, "section HEAD 0: node 1 has no finite origin"},
    {size_zero, "section HEAD 0: node 0 has a size"},
    {size_huge, "section HEAD 0: node 2 is larger than half"},
    {child_moved, "section HEAD 0: node 2 lies outside"},
    {child_nan_size, "section HEAD 0: node 2 has a size"},
    {spacing_negative, "section HEAD 0: node 0 has a size or spacing"},
    {box_turned, "section HEAD 0: node 0 has a box"},
    {box_infinite, "section HEAD 0: node 0 has no finite box"},
    {count_zero, "section HEAD 0: chunk 0 has no splats"},
    {count_large, "section HEAD 0: chunk 1 has no splats, or more"},
    {step_zero, "section HEAD 0: chunk 0 has a step"},
    {step_nan, "section HEAD 0: chunk 0 has a step"},
    {step_overflows, "section HEAD 0: chunk 0 has positions"},
    {wide_position, "section HEAD 0: chunk 0 has positions"},
    {wide_normal, "section HEAD 0: chunk 0 has normals"},
    {radius_negative, "section HEAD 0: chunk 0 has a step or radius"},
    {mean_radius_zero, "section HEAD 0: chunk 0 has a step or radius"},
    {normal_off, "section HEAD 0: chunk 0 has normals off"},
    {normal_step, "section HEAD 0: chunk 0 has a step"},
    {axis_three, "section HEAD 0: chunk 0 has geometry bits"},
    {unknown_bit, "section HEAD 0: chunk 0 has geometry bits"},
    {wide_color, "section HEAD 0: chunk 0 has colours"},
    {color_base, "section HEAD 0: chunk 0 has colours"},
    {wide_class, "section HEAD 0: attribute class of chunk 0 has codes of more than 32 bits"},
    {class_past_page, "reaches beyond the end of its page"},
    {no_streams, NULL},
    {two_of_a_name, "section META: \"streams[2].name\" is \"class\", and must be another: a stream"},
    {empty_name, "section META: \"streams[2].name\" is \"\", and must be a text of 1"},
    {long_name, "section META: \"streams[2].name\" is \"a-name-of"},
    {long_unit,
     "section META: \"streams[2].unit\" is \"a-unit-of-thirty-two-characters-\", and must be a text of at most"},
    {taken_name, "section META: \"streams[2].name\" is \"position\", and must be another: this is what every"},
    {total_name, "section META: \"streams[2].name\" is \"total\", and"},
    {uncertainty_negative, "section HEAD 0: attribute uncertainty of chunk 0 has a largest value that is negative"},
    {uncertainty_wide,
     "section HEAD 0: attribute uncertainty of chunk 0 has a largest value that is negative or not finite, or codes"},
    {unit_text, "section META: \"unit\" is \"furlong\", and must be m, ft"},
    {unit_number, "section META: \"unit\" is 1, and must be m, ft"},
    {unit_gone, NULL},
    {crs_number, "section META: \"crs\" is 2056, and must be a text"},
    {crs_long, "section META: \"crs\" is "},
    {crs_null, NULL},
    {many_lines, "section HEAD 0: chunk 0 has more clip lines than splats"},
    {lines_past_page, "reaches beyond the end of its page"},
    {unknown_extra, "section HEAD 0: chunk 0 has extra bits"},
    {discs_as_lines, "section HEAD 0: chunk 0 has fields that lines"},
    {uncertainty_nan, "section HEAD 0: attribute uncertainty of chunk 0 has a largest value"},
    {past_page, "reaches beyond the end of its page"},
    {word_wraps, "section HEAD 0: chunk 0 reaches beyond"},
    {levels, "section META: \"levels\" is not what the nodes"},
    {levels_few, "section HEAD 0: node 1 lies deeper than META's"},
    {levels_many, "section META: \"levels\" is 257, and must be a whole number from 1 to 256"},
    {leaf_splats, "section META: \"leaf_splats\" is not what the nodes"},
    {points_few, "section META: \"leaf_splats\" is 400, and must be at most \"points\""},
    {part_of_less, "section META: \"part_of\" is 400, and must be more than \"points\""},
    {part_of_text, "section META: \"part_of\" is \"all\", and must be a whole number"},
    {points_text, "section META: \"points\" is \"400\", and must be a whole number"},
    {pruned_right, NULL},
    {pruned_less, "section META: \"pruned.of\" is 399, and must be a whole number from \"leaf_splats\" to"},
    {pruned_more, "section META: \"pruned.of\" is 401, and must be a whole number from \"leaf_splats\" to"},
    {pruned_text, "section META: \"pruned.of\" is missing, and must be"},
    {points_gone, "section META: \"points\" is missing, and must be"},
    {radius_gone, "section META: \"splat_radius\" is missing, and must be"},
    {bounds_turned, "section META: \"bounds.min[0]\" is 1000000000.0, and must be at most that of"},
    {bounds_short, "section META: \"bounds.max\" is an array of 2, and must be an array of three"},
    {fov, "section META: \"default_view.fov\" is 180.0, and must be"},
    {fit_right, NULL},
    {fit_wide, "section META: \"default_view.fit\" is an array of 2, and must be two numbers of degrees"},
    {fit_short, "section META: \"default_view.fit\" is an array of 1, and must be two numbers of degrees"},
    {title_right, NULL},
    {title_number, "section META: \"title\" is 5, and must be a text of at most 200 bytes"},
    {description_list, "section META: \"description\" is an array of 0, and must be a text of at most 4000 bytes"},
    {view_right, NULL},
    {view_name, "section META: view 0: 'a/b' is no name of a view"},
    {view_blind, "section META: view 0: "},
    {views_text, "section META: views must be an array"},
    {up, "section META: \"default_view.up[1]\" is \"north\", and must be a coordinate"},
    {eye, "section META: \"default_view\" is no view: "},
    {flags, "section META: \"attributes.color\" is missing, and must be true"},
    {sources, "section META: \"sources[0]\" is 1, and must be a name"},
    {stations, "section META: \"stations[0]\" is an array of 1, and must be a matrix"},
    {station_right, NULL},
    {station_mirrored, NULL},
    {station_far, "section META: \"stations[0]\" is an array of 16, and must be numbers from -1e15 to 1e15"},
    {station_columns, "\"stations[0]\" is an array of 16, and must be a pose by rows, whose last row is 0 0 0 1"},
    {station_scaled, "and must be a pose by rows, whose last row is 0 0 0 1"},
    {color, NULL},
    {color_text, "section META: \"color\" is \"rgb\", and must be an array"},
    {color_few, "section META: \"color[0].points\" is -1, and must be"},
    {color_what, "section META: \"color[0].from\" is \"xyz\", and must be rgb"},
};

static void test_forged_content(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct parts p = take_apart();
        char what[32];
        snprintf(what, sizeof what, "row %zu", i);
        rows[i].forge(&p);
        write_parts(&p);
        expect(what, rows[i].part ? SPL_E_CORRUPT : SPL_OK, rows[i].part);
        unlink(path);
        release(&p);
    }
}

/* Header and table, with room for more sections. */
struct raw {
    uint8_t *data;
    size_t size;
    struct spl_file_header *header;
    struct spl_section *table;
};

/* Loads the written file, its table moved to the end of a larger block. */
static struct raw load_raw(void)
{
    FILE *file = fopen(path, "rb");
    struct raw raw = {.data = calloc(1, 1 << 20)};
    raw.size = fread(raw.data, 1, 1 << 20, file);
    fclose(file);
    raw.header = (struct spl_file_header *)raw.data;
    raw.table = (struct spl_section *)(raw.data + raw.header->table_offset);
    return raw;
}

static void save_raw(struct raw *raw)
{
    size_t table_bytes = raw->header->section_count * sizeof *raw->table;
    if (table_bytes < 4096) {
        raw->header->table_hash = XXH3_64bits(raw->table, table_bytes);
    }
    raw->header->header_hash = XXH3_64bits(raw->header, offsetof(struct spl_file_header, header_hash));
    FILE *file = fopen(path, "wb");
    assert_int_equal(fwrite(raw->data, 1, raw->size, file), raw->size);
    fclose(file);
}

/* The sections in their order. */
enum { PAGE, META, PDIR, HEAD };

static void rehash(struct raw *r, int section)
{
    r->table[section].hash = XXH3_64bits(r->data + r->table[section].offset, r->table[section].bytes);
}

/* The directory's row `row`. */
static struct spl_page_row *row_of(struct raw *r, int row)
{
    return (struct spl_page_row *)(void *)(r->data + r->table[PDIR].offset) + row;
}

static void set_node(struct raw *r, uint32_t node, size_t offset, const void *value, size_t bytes)
{
    memcpy(r->data + r->table[HEAD].offset + (size_t)node * SPL_NODE_BYTES + offset, value, bytes);
    rehash(r, HEAD);
}

static void set_children(struct raw *r, uint32_t node, uint8_t count)
{
    set_node(r, node, offsetof(struct spl_node, child_count), &count, 1);
}

static void set_chunks(struct raw *r, uint32_t node, uint16_t count)
{
    set_node(r, node, offsetof(struct spl_node, chunk_count), &count, 2);
}

/* Puts `with` (no longer) for `text` in META. */
static void set_meta(struct raw *r, const char *text, const char *with)
{
    char *at = memmem(r->data + r->table[META].offset, r->table[META].bytes, text, strlen(text));
    assert_non_null(at);
    memset(at, ' ', strlen(text));
    memcpy(at, with, strlen(with));
    rehash(r, META);
}

#define FORGE_RAW(name, statement)                                                                                     \
    static void name(struct raw *r)                                                                                    \
    {                                                                                                                  \
        statement;                                                                                                     \
    }
FORGE_RAW(raw_nothing, (void)r)
FORGE_RAW(raw_four_billion, r->header->section_count = UINT32_MAX)
FORGE_RAW(raw_no_sections, r->header->section_count = 0)
FORGE_RAW(raw_table_offset, r->header->table_offset = UINT64_MAX - 7)
FORGE_RAW(raw_table_at_header, r->header->table_offset = 0)
FORGE_RAW(raw_header_size, r->header->header_bytes = 64)
FORGE_RAW(raw_version, r->header->version = 1)
FORGE_RAW(raw_later_version, r->header->version = 3)
FORGE_RAW(raw_long, r->header->file_bytes += 1000)
FORGE_RAW(raw_page_beyond, r->table[0].bytes = UINT64_MAX)
FORGE_RAW(raw_offset_wraps, (r->table[0].offset = UINT64_MAX - 65535, r->table[0].bytes = 65536))
FORGE_RAW(raw_misaligned, (r->table[0].offset += 64, r->table[0].bytes -= 64))
FORGE_RAW(raw_overlap, r->table[1].offset = r->table[0].offset)
FORGE_RAW(raw_over_table, r->table[HEAD].bytes += 72)
FORGE_RAW(raw_tiny_page, r->table[0].bytes = 4)
FORGE_RAW(raw_page_index, r->table[0].index = 1)
FORGE_RAW(raw_two_metas, r->table[2].type = SPL_SECTION_META)
FORGE_RAW(raw_no_meta, r->table[1].type = SPL_FOURCC('X', 'X', 'X', 'X'))
FORGE_RAW(raw_half_row, r->table[PDIR].bytes -= 1)
FORGE_RAW(raw_row_short, (r->table[PDIR].bytes -= sizeof(struct spl_page_row), rehash(r, PDIR)))
FORGE_RAW(raw_no_directory, r->table[PDIR].type = SPL_FOURCC('X', 'X', 'X', 'X'))
FORGE_RAW(raw_no_head, r->table[HEAD].type = SPL_FOURCC('X', 'X', 'X', 'X'))
FORGE_RAW(raw_head_index, r->table[HEAD].index = 1)
FORGE_RAW(raw_head_tiny, r->table[HEAD].bytes = SPL_NODE_BYTES)
FORGE_RAW(raw_head_short, (r->table[HEAD].bytes -= 1, rehash(r, HEAD)))
FORGE_RAW(raw_row_begins, (row_of(r, 0)->first_node = 1, rehash(r, PDIR)))
FORGE_RAW(raw_row_begins_id, (row_of(r, 0)->first_id = 1, rehash(r, PDIR)))
FORGE_RAW(raw_row_begins_child, (row_of(r, 0)->first_child = 0, rehash(r, PDIR)))
FORGE_RAW(raw_row_empty, (row_of(r, 1)->first_chunk = 0, rehash(r, PDIR)))
FORGE_RAW(raw_row_nodes, (row_of(r, 1)->first_node -= 1, rehash(r, PDIR)))
FORGE_RAW(raw_row_nodes_wrap, (row_of(r, 1)->first_node += 1ull << 62, rehash(r, PDIR))) // times 60 it is the same
FORGE_RAW(raw_row_chunks_wrap, (row_of(r, 1)->first_chunk += 1ull << 63, rehash(r, PDIR)))
FORGE_RAW(raw_row_ids_few, (row_of(r, 1)->first_id = 1, rehash(r, PDIR)))
FORGE_RAW(raw_row_ids_many, (row_of(r, 1)->first_id = UINT64_MAX, rehash(r, PDIR)))
FORGE_RAW(raw_row_ids, (row_of(r, 1)->first_id += 1, rehash(r, PDIR)))
FORGE_RAW(raw_row_children, (row_of(r, 1)->first_child += 1, rehash(r, PDIR)))
FORGE_RAW(raw_row_children_wrap, (row_of(r, 1)->first_child = 0, rehash(r, PDIR)))
FORGE_RAW(raw_many_children, set_children(r, 0, 9))
FORGE_RAW(raw_children_beyond, set_children(r, 0, 5))
FORGE_RAW(raw_fewer_children, set_children(r, 0, 3))
FORGE_RAW(raw_chunks_none, set_chunks(r, 1, 0))
FORGE_RAW(raw_chunks_beyond, set_chunks(r, 4, 4096))
FORGE_RAW(raw_chunks_many, set_chunks(r, 4, 4097))
FORGE_RAW(raw_unknown_kind,
          (r->data[r->table[HEAD].offset + 5 * SPL_NODE_BYTES + SPL_CHUNK_BYTES - 1] = SPL_CHUNK_KINDS,
           rehash(r, HEAD)))
FORGE_RAW(raw_head_damaged, r->data[r->table[HEAD].offset] ^= 1)
FORGE_RAW(raw_splats, set_meta(r, "\"splats\": 450", "\"splats\": 449"))
FORGE_RAW(raw_splats_many, set_meta(r, "\"splats\": 450", "\"splats\": 451"))
FORGE_RAW(raw_splats_few, set_meta(r, "\"splats\": 450", "\"splats\": 399"))
FORGE_RAW(raw_splats_negative, set_meta(r, "\"splats\": 450", "\"splats\": -1"))
FORGE_RAW(raw_pieces, set_meta(r, "\"pieces\": 0", "\"pieces\": 1"))
FORGE_RAW(raw_linear, set_meta(r, "\"linear_chunks\": 0", "\"linear_chunks\": 1"))
FORGE_RAW(raw_no_bits, set_meta(r, "\"bits\"", "\"bots\""))
FORGE_RAW(raw_stream_bits, set_meta(r, "\"stream_bits\"", "\"strom_bits\""))
FORGE_RAW(raw_fewer_streams, set_meta(r, "\"streams\"", "\"strooms\""))
FORGE_RAW(raw_stream_type, set_meta(r, "\"type\": \"uint\"", "\"type\": 7"))
FORGE_RAW(raw_meta_array, (memcpy(r->data + r->table[1].offset, "[]", 2), r->table[1].bytes = 2,
                           r->table[1].hash = XXH3_64bits("[]", 2)))
FORGE_RAW(raw_meta_cut, (r->table[1].bytes -= 1,
                         r->table[1].hash = XXH3_64bits(r->data + r->table[1].offset, r->table[1].bytes)))
FORGE_RAW(raw_no_page, r->table[0].type = SPL_FOURCC('X', 'X', 'X', 'X'))
FORGE_RAW(raw_unknown, (memmove(r->table + 1, r->table, 4 * sizeof *r->table),
                        r->table[0] = (struct spl_section){.type = SPL_FOURCC('N', 'E', 'W', 'S'),
                                                           .offset = 64,
                                                           .bytes = 3,
                                                           .hash = XXH3_64bits("\0\0\0", 3)},
                        r->header->section_count++, r->header->file_bytes += 32, r->size += 32))
FORGE_RAW(raw_unknown_damaged, (raw_unknown(r), r->table[0].hash ^= 1))

static const struct {
    void (*forge)(struct raw *r);
    int code;
    const char *part;
} raw_rows[] = {
    {raw_nothing, SPL_OK, NULL},
    {raw_four_billion, SPL_E_CORRUPT, "section table lies outside the file"},
    {raw_no_sections, SPL_E_CORRUPT, "section table lists no section META"},
    {raw_table_offset, SPL_E_CORRUPT, "section table lies outside the file"},
    {raw_table_at_header, SPL_E_CORRUPT, "section table lies outside the file"},
    {raw_header_size, SPL_E_CORRUPT, "header has a size"},
    {raw_version, SPL_E_UNSUPPORTED, "format version 1, this splatd reads version 2; pack it again"},
    {raw_later_version, SPL_E_UNSUPPORTED, "format version 3, this splatd reads version 2"},
    {raw_long, SPL_E_CORRUPT, "truncated: 1000 of"},
    {raw_page_beyond, SPL_E_CORRUPT, "section PAGE 0 overlaps"},
    {raw_offset_wraps, SPL_E_CORRUPT, "section PAGE 0 overlaps"},
    {raw_misaligned, SPL_E_CORRUPT, "section PAGE 0 is misaligned"},
    {raw_overlap, SPL_E_CORRUPT, "section META overlaps"},
    {raw_over_table, SPL_E_CORRUPT, "section HEAD 0 overlaps"},
    {raw_tiny_page, SPL_E_CORRUPT, "section PAGE 0 has a size"},
    {raw_page_index, SPL_E_CORRUPT, "section PAGE 1 is out of order"},
    {raw_two_metas, SPL_E_CORRUPT, "section META occurs twice"},
    {raw_no_meta, SPL_E_CORRUPT, "section table lists no section META"},
    {raw_half_row, SPL_E_CORRUPT, "section PDIR is not a whole number of rows"},
    {raw_row_short, SPL_E_CORRUPT, "section PDIR has not a row for each page"},
    {raw_no_directory, SPL_E_CORRUPT, "section table lists no section PDIR"},
    {raw_no_head, SPL_E_CORRUPT, "section table lists no section HEAD"},
    {raw_head_index, SPL_E_CORRUPT, "section HEAD 1 is out of order"},
    {raw_head_tiny, SPL_E_CORRUPT, "section HEAD 0 has a size that no head can have"},
    {raw_head_short, SPL_E_CORRUPT, "section PDIR: page 0 has another number of nodes or chunks than its head"},
    {raw_row_begins, SPL_E_CORRUPT, "section PDIR: page 0 does not begin"},
    {raw_row_begins_id, SPL_E_CORRUPT, "section PDIR: page 0 does not begin"},
    {raw_row_begins_child, SPL_E_CORRUPT, "section PDIR: page 0 does not begin"},
    {raw_row_empty, SPL_E_CORRUPT, "section PDIR: page 0 has no nodes or no chunks"},
    {raw_row_nodes, SPL_E_CORRUPT, "section PDIR: page 0 has another number of nodes"},
    {raw_row_nodes_wrap, SPL_E_CORRUPT, "section PDIR: page 0 has another number of nodes"},
    {raw_row_chunks_wrap, SPL_E_CORRUPT, "section PDIR: page 0 has another number of nodes"},
    {raw_row_ids_few, SPL_E_CORRUPT, "section PDIR: page 0 has more or fewer splats"},
    {raw_row_ids_many, SPL_E_CORRUPT, "section PDIR: page 0 has more or fewer splats"},
    {raw_row_ids, SPL_E_CORRUPT, "does not end with the id that PDIR says"},
    {raw_row_children, SPL_E_CORRUPT, "section PDIR: page 1 closes it"},
    {raw_row_children_wrap, SPL_E_CORRUPT, "section PDIR: page 0 has more or fewer children"},
    {raw_many_children, SPL_E_CORRUPT, "section HEAD 0: node 0 has more than 8 children"},
    {raw_children_beyond, SPL_E_CORRUPT, "section HEAD 0: node 0 has more children than PDIR leaves it"},
    {raw_fewer_children, SPL_E_CORRUPT, "section HEAD 0: node 4 is no node's child"},
    {raw_chunks_none, SPL_E_CORRUPT, "section HEAD 0: node 1 has no chunks"},
    {raw_chunks_beyond, SPL_E_CORRUPT, "section HEAD 0: node 4 has more chunks than PDIR leaves it"},
    {raw_chunks_many, SPL_E_CORRUPT, "section HEAD 0: node 4 has no chunks, or too many"},
    {raw_unknown_kind, SPL_E_CORRUPT, "section HEAD 0: chunk 0 is of a kind"},
    {raw_head_damaged, SPL_E_CORRUPT, "section HEAD 0 fails its checksum; copy"},
    {raw_splats, SPL_E_CORRUPT, "section META: \"counts\" is not what the nodes and chunks hold"},
    {raw_splats_many, SPL_E_CORRUPT, "section META: \"counts\" has more splats, pieces, panels or meshes than PDIR"},
    {raw_splats_few, SPL_E_CORRUPT, "section META: \"counts.splats\" is "},
    {raw_splats_negative, SPL_E_CORRUPT, "section META: \"counts\" is an object, and must be"},
    {raw_pieces, SPL_E_CORRUPT, "section META: \"counts\" is not what"},
    {raw_linear, SPL_E_CORRUPT, "section META: \"counts\" is not what"},
    {raw_no_bits, SPL_E_CORRUPT, "section META: \"counts\" is an object, and must be"},
    {raw_stream_bits, SPL_E_CORRUPT, "section META: \"counts\" is an object, and must be"},
    {raw_fewer_streams, SPL_E_CORRUPT, "section META: \"counts\" is an object, and must be"},
    {raw_stream_type, SPL_E_CORRUPT, "section META: \"streams[0].type\" is no text, and must be a text of 1 to 31"},
    {raw_meta_array, SPL_E_CORRUPT, "section META is no JSON object; pack"},
    {raw_meta_cut, SPL_E_CORRUPT, "section META is no JSON object: "},
    {raw_no_page, SPL_E_CORRUPT, "section table lists no section PAGE"},
    {raw_unknown, SPL_OK, NULL},
    {raw_unknown_damaged, SPL_E_CORRUPT, "section NEWS fails its checksum"},
};

/* Of what a stranger's file says, only what can be shown comes to those who read it; lines of a description stay. */
static void test_texts_that_cannot_be_shown(void **state)
{
    (void)state;
    struct parts p = take_apart();
    struct spl_dataset *dataset;
    json_object_set_new(p.meta, "title", json_string("The \033[2J hall\xc2\x9b\xe2\x80\xae" "gpj"));
    json_object_set_new(p.meta, "description", json_string("One\nt\tw\xc3\xb6\xe2\x81\xa6\a"));
    json_object_set_new(p.meta, "sources", json_pack("[s, s]", "plain", "a\nb\xc2\x85"));
    write_parts(&p);
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const json_t *sources = json_object_get(spl_dataset_get_meta(dataset), "sources");
    assert_string_equal(info->title, "The ?[2J hall??gpj");
    assert_string_equal(info->description, "One\nt\tw\xc3\xb6??");
    assert_string_equal(json_string_value(json_array_get(sources, 0)), "plain");
    assert_string_equal(json_string_value(json_array_get(sources, 1)), "a?b?");
    spl_dataset_close(dataset);
    unlink(path);
    release(&p);
}

static void test_forged_layout(void **state)
{
    (void)state;
    struct parts p = take_apart();
    for (size_t i = 0; i < sizeof raw_rows / sizeof *raw_rows; i++) {
        char what[32];
        snprintf(what, sizeof what, "layout row %zu", i);
        write_parts(&p);
        struct raw raw = load_raw();
        raw_rows[i].forge(&raw);
        save_raw(&raw);
        expect(what, raw_rows[i].code, raw_rows[i].part);
        free(raw.data);
        unlink(path);
    }
    release(&p);
}

/* What a later writer adds, by a type that this reader does not know: it is passed over, and those behind it are read.
 */
static void test_unknown_streams(void **state)
{
    (void)state;
    struct parts p = take_apart();
    p.streams[0].name = "intensity";
    p.streams[0].type = "wavelets";
    write_parts(&p);
    struct spl_dataset *dataset;
    double value = 7;
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_true(info->stream_count == 2 && info->streams[0].bits > 0 && !info->has_class && info->has_uncertainty);
    assert_string_equal(info->streams[0].type, "wavelets");
    assert_int_equal(spl_dataset_find_stream(dataset, "intensity"), -1);
    assert_int_equal(spl_dataset_find_stream(dataset, "uncertainty"), 1);
    assert_true(spl_dataset_find_value(dataset, 1, 5, &value) && value == 0);
    spl_dataset_close(dataset);
    unlink(path);
    release(&p);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_forged_content),
        cmocka_unit_test(test_texts_that_cannot_be_shown),
        cmocka_unit_test(test_forged_layout),
        cmocka_unit_test(test_unknown_streams),
    };
    make_folder(folder);
    snprintf(path, sizeof path, "%s/forged.spld", folder);
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    return rmdir(folder) ? 1 : failed;
}
