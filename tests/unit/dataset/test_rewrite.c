/* Datasets that have lost nodes: what stays is what it was, splat for splat, with its attributes, lines, textures and
 * stations; numbers and counts are those of what stays. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "base/memory.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "dataset/texture.h"
#include "dataset/writer.h"
#include "support/make_dataset.h"
#include "support/make_maps.h"
#include "support/make_textures.h"

static char folder[256], path[300];

static void must(int rc, const struct spl_error *err)
{
    if (rc)
        fail_msg("%s", err->message);
}

static struct spl_dataset *open_it(uint64_t tables_bytes)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    const struct spl_dataset_opening how = {.verify = true, .tables_bytes = tables_bytes};
    must(spl_dataset_open_as(path, &how, &dataset, &err), &err);
    return dataset;
}

/* Hilly ground with an intensity, under wires, in two scans: several levels of discs and of lines, and streams. */
static struct spl_dataset *pack_some(void)
{
    char scans[2][300];
    const char *inputs[2];
    struct spl_error err = {0};
    struct spl_pack_options options;
    for (int k = 0; k < 2; k++) {
        snprintf(scans[k], sizeof scans[k], "%s/%d.xyz", folder, k);
        inputs[k] = scans[k];
        FILE *f = fopen(scans[k], "w");
        assert_non_null(f);
        fprintf(f, "x y z red green blue intensity\n");
        for (int i = 0; i < 40000; i++) {
            double x = 0.2 * (i % 200) + 40 * k, y = 0.2 * (i / 200.0);
            fprintf(f, "%.4f %.4f %.4f %d %d %d %d\n", x, y, 3 * sin(x / 7) * cos(y / 9), i % 256, (i / 256) % 256, 77,
                    i % 900);
        }
        for (int i = 0; i < 3000; i++) {
            double x = 0.08 * (i % 500) + 40 * k;
            fprintf(f, "%.4f %d %.4f 30 30 30 5\n", x, 3 + 6 * (i / 500), 12 + 0.002 * (x - 40) * (x - 40));
        }
        assert_int_equal(fclose(f), 0);
    }
    spl_pack_options_init(&options);
    options.inputs = inputs;
    options.input_count = 2;
    options.output = path;
    must(spl_pack(&options, NULL, &err), &err);
    unlink(scans[0]);
    unlink(scans[1]);
    return open_it(UINT64_MAX);
}

/* The same with textures and maps, on pages of a few nodes. */
static struct spl_dataset *make_whole(void)
{
    struct spl_dataset *packed = pack_some();
    struct spl_dictionary dictionary = make_dictionary(60, 8, 3);
    make_textured_file(packed, &dictionary, 3, 4, path);
    spl_dataset_close(packed);
    spl_dictionary_finish(&dictionary);
    struct spl_dataset *textured = open_it(UINT64_MAX);
    struct make_maps maps = make_maps(textured, 5, 6);
    struct spl_rewrite what = {.from = textured,
                               .context = &maps,
                               .maps = maps.rows,
                               .map_count = maps.count,
                               .stations = maps.stations,
                               .get_map = make_maps_get,
                               .page_bytes = 60000};
    struct spl_error err = {0};
    must(spl_dataset_rewrite(&what, path, &err), &err);
    free_maps(&maps);
    spl_dataset_close(textured);
    return open_it(UINT64_MAX);
}

/* What one chunk has, in both files. */
struct side {
    const struct spl_dataset *dataset;
    const struct spl_node *nodes;
    const struct spl_chunk *chunks;
    const struct spl_stream *streams;
    uint64_t node_count, chunk_count;
    uint32_t stream_count;
    uint32_t *textures;
    uint32_t page; /* whose textures they are, plus 1 */
};

static struct side take_side(const struct spl_dataset *dataset)
{
    struct side s = {.dataset = dataset};
    s.nodes = spl_dataset_get_nodes(dataset, &s.node_count);
    s.chunks = spl_dataset_get_chunks(dataset, &s.chunk_count);
    s.streams = spl_dataset_get_streams(dataset, &s.stream_count);
    return s;
}

static void get_code(struct side *s, uint32_t page, uint64_t chunk, struct spl_chunk_code *code)
{
    if (s->page != page + 1) {
        s->textures = realloc(s->textures, spl_dataset_get_texture_bytes(s->dataset, page));
        assert_int_equal(spl_dataset_read_textures(s->dataset, page, s->textures, NULL), SPL_OK);
        s->page = page + 1;
    }
    uint32_t texture = spl_dataset_get_chunk_textures(s->dataset)[chunk];
    spl_texture_decode(s->textures + spl_texture_word(texture), spl_texture_planes(texture), s->chunks[chunk].count,
                       code);
}

static void same_chunk(struct side *a, const struct spl_node *an, uint64_t ac, struct side *b,
                       const struct spl_node *bn, uint64_t bc)
{
    const struct spl_chunk *x = &a->chunks[ac], *y = &b->chunks[bc];
    assert_true(x->count == y->count && x->extra_bits == y->extra_bits && x->radius_mean == y->radius_mean);
    size_t ignored;
    const uint32_t *ap = spl_dataset_get_page(a->dataset, an->page, &ignored) + x->geometry_word;
    const uint32_t *bp = spl_dataset_get_page(b->dataset, bn->page, &ignored) + y->geometry_word;
    uint32_t words = spl_chunk_words(x) + spl_dataset_get_stream_words(a->dataset, a->stream_count, ac);
    assert_int_equal(words, spl_chunk_words(y) + spl_dataset_get_stream_words(b->dataset, b->stream_count, bc));
    assert_memory_equal(ap, bp, words * sizeof *ap);
    for (uint32_t i = 0; i < x->count; i += 41) { /* by id, through the tables of its page */
        struct spl_splat p = {0}, q = {0};
        assert_true(spl_dataset_find_splat(a->dataset, x->first_id + i, &p) &&
                    spl_dataset_find_splat(b->dataset, y->first_id + i, &q));
        assert_memory_equal(p.position, q.position, sizeof p.position);
        for (uint32_t s = 0; s < a->stream_count && spl_chunk_kind(x) == SPL_CHUNK_DISCS; s++) {
            double v = -1, w = -2;
            assert_true(spl_dataset_find_value(a->dataset, (int)s, x->first_id + i, &v) &&
                        spl_dataset_find_value(b->dataset, (int)s, y->first_id + i, &w) && v == w);
        }
    }
    struct spl_chunk_code p, q;
    get_code(a, an->page, ac, &p);
    get_code(b, bn->page, bc, &q);
    assert_memory_equal(&p, &q, sizeof p);
    assert_memory_equal(&spl_dataset_get_chunk_stations(a->dataset)[ac],
                        &spl_dataset_get_chunk_stations(b->dataset)[bc], sizeof(struct spl_chunk_stations));
}

/* Walks the old tree from the top, keeping what no leaf stands above, and holds the new one against it. */
static void same_but_pruned(const struct spl_dataset *from, const bool *leaf, const struct spl_dataset *to)
{
    struct side a = take_side(from), b = take_side(to);
    bool *stays = calloc(a.node_count, 1);
    uint64_t node = 0, chunk = 0, leaf_splats = 0, pieces = 0;
    uint32_t levels = 0;
    stays[0] = true;
    for (uint64_t n = 0; n < a.node_count; n++) {
        for (uint32_t c = 0; c < a.nodes[n].child_count && stays[n] && !leaf[n]; c++)
            stays[a.nodes[n].first_child + c] = true;
        if (!stays[n])
            continue;
        const struct spl_node *x = &a.nodes[n], *y = &b.nodes[node++];
        bool ends = leaf[n] || !x->child_count;
        assert_true(node <= b.node_count && y->first_chunk == chunk);
        assert_memory_equal(x, y, offsetof(struct spl_node, child_count));
        assert_true(y->depth == x->depth && y->child_count == (ends ? 0 : x->child_count));
        levels = x->depth + 1u > levels ? x->depth + 1u : levels;
        for (uint32_t c = 0; c < x->chunk_count; c++, chunk++) {
            const struct spl_chunk *header = &b.chunks[chunk];
            same_chunk(&a, x, x->first_chunk + c, &b, y, chunk);
            leaf_splats += ends && spl_chunk_kind(header) == SPL_CHUNK_DISCS ? header->count : 0;
            pieces += spl_chunk_count_pieces(header);
        }
    }
    const struct spl_dataset_info *info = spl_dataset_get_info(to), *old = spl_dataset_get_info(from);
    assert_true(node == b.node_count && chunk == b.chunk_count && info->levels == levels);
    assert_true(info->leaf_splats == leaf_splats && info->pieces == pieces && info->points == old->points);
    assert_memory_equal(info->bounds_min, old->bounds_min, sizeof info->bounds_min);
    assert_true(info->maps == old->maps && info->map_bytes == old->map_bytes && info->atoms == old->atoms);
    for (uint32_t i = 0; i < info->maps; i++) {
        size_t bytes = spl_dataset_get_map_bytes(to, i);
        uint32_t *x = malloc(bytes), *y = malloc(bytes);
        assert_true(!spl_dataset_read_map(from, i, x, NULL) && !spl_dataset_read_map(to, i, y, NULL));
        assert_memory_equal(x, y, bytes);
        free(x);
        free(y);
    }
    free(stays);
    free(a.textures);
    free(b.textures);
}

static int by_size(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* To half a hundredth. */
static void radius_is_the_median(const struct spl_dataset *dataset)
{
    struct side s = take_side(dataset);
    float *radii = malloc(spl_dataset_get_info(dataset)->leaf_splats * sizeof *radii);
    size_t count = 0, ignored;
    for (uint64_t n = 0; n < s.node_count; n++)
        for (uint32_t c = 0; c < s.nodes[n].chunk_count && !s.nodes[n].child_count; c++) {
            const struct spl_chunk *chunk = &s.chunks[s.nodes[n].first_chunk + c];
            const uint32_t *page = spl_dataset_get_page(dataset, s.nodes[n].page, &ignored);
            for (uint32_t i = 0; i < chunk->count && spl_chunk_kind(chunk) == SPL_CHUNK_DISCS; i++) {
                struct spl_splat splat;
                spl_chunk_decode(chunk, page, i, &splat);
                radii[count++] = splat.radius;
            }
        }
    qsort(radii, count, sizeof *radii, by_size);
    double said = spl_dataset_get_info(dataset)->splat_radius;
    assert_true(fabs(said / (double)radii[count / 2] - 1) < 0.005);
    free(radii);
}

static json_int_t pruned_of(const struct spl_dataset *dataset)
{
    return json_integer_value(json_object_get(json_object_get(spl_dataset_get_meta(dataset), "pruned"), "of"));
}

static struct spl_dataset *prune(const struct spl_dataset *from, const bool *leaf, uint64_t tables_bytes)
{
    const struct spl_rewrite what = {.from = from, .leaf = leaf, .page_bytes = 60000};
    struct spl_error err = {0};
    must(spl_dataset_rewrite(&what, path, &err), &err);
    return open_it(tables_bytes);
}

static void what_stays_is_what_it_was(void **state)
{
    struct spl_dataset *from = *state;
    struct side s = take_side(from);
    const struct spl_dataset_info *info = spl_dataset_get_info(from);
    assert_true(info->levels > 3 && info->pages > 3 && info->pieces > 100 && info->stream_count >= 3 && info->atoms);
    bool *leaf = calloc(s.node_count, 1);
    for (int way = 0; way < 5; way++) {
        for (uint64_t n = 0; n < s.node_count; n++)
            leaf[n] = way == 0   ? n == 0                       /* the root alone is left */
                      : way == 1 ? n * 2654435761u % 100 < 20   /* one here and there, some below others */
                      : way == 2 ? s.nodes[n].depth == 2        /* whole levels go */
                      : way == 3 ? n == s.nodes[0].first_child  /* a branch */
                                 : n % 3 == 0 && s.nodes[n].depth + 2u >= info->levels;
        struct spl_dataset *to = prune(from, leaf, UINT64_MAX);
        same_but_pruned(from, leaf, to);
        radius_is_the_median(to);
        assert_true(pruned_of(to) == (json_int_t)info->leaf_splats);
        assert_true(spl_dataset_get_info(to)->nodes < s.node_count);
        /* pruned once more it says of how many it is in all */
        struct spl_dataset *again = prune(to, (const bool[]){true, [4095] = false}, 0);
        assert_true(spl_dataset_get_info(again)->nodes == 1 && pruned_of(again) == (json_int_t)info->leaf_splats);
        spl_dataset_close(again);
        spl_dataset_close(to);
    }
    free(leaf);
}

static void nothing_dropped_is_nothing_changed(void **state)
{
    struct spl_dataset *from = *state;
    struct side s = take_side(from);
    bool *leaf = calloc(s.node_count, 1);
    struct spl_dataset *plain = prune(from, NULL, UINT64_MAX), *none = prune(from, leaf, UINT64_MAX);
    for (uint64_t n = 0; n < s.node_count; n++)
        leaf[n] = !s.nodes[n].child_count;
    struct spl_dataset *leaves = prune(from, leaf, 0);
    uint64_t version = spl_dataset_get_info(plain)->version;
    assert_true(spl_dataset_get_info(none)->version == version && spl_dataset_get_info(leaves)->version == version);
    assert_true(version == spl_dataset_get_info(from)->version && !pruned_of(plain));
    spl_dataset_close(plain);
    spl_dataset_close(none);
    spl_dataset_close(leaves);
    free(leaf);
}

/* Panels and meshes are copied as they are, and counted. */
static void panels_and_meshes_stay(void **state)
{
    (void)state;
    struct spl_panel panels[40] = {0};
    struct spl_relief reliefs[40] = {0};
    for (int i = 0; i < 40; i++) {
        panels[i].column = (uint8_t)i;
        panels[i].cells[i % 16] = (uint16_t)(i * 1601 + 1);
        reliefs[i].level = 3;
        for (int k = 0; k < SPL_RELIEF_POINTS_MAX; k++)
            reliefs[i].height[k] = 0.01f * (float)((i * k) % 17);
    }
    const struct spl_panel_plane plane = {.normal = {0, 0.6f, 0.8f}, .cell = 0.1f, .points = 90};
    const struct make_panels made[2] = {{.plane = plane, .panels = panels, .count = 40},
                                        {.plane = plane, .panels = panels, .reliefs = reliefs, .count = 40}};
    make_dataset_file_panels(path, NULL, 0, made, 2, 1);
    struct spl_dataset *from = open_it(UINT64_MAX), *copy = prune(from, NULL, UINT64_MAX);
    const struct spl_dataset_info *a = spl_dataset_get_info(from), *b = spl_dataset_get_info(copy);
    struct side s[2] = {take_side(from), take_side(copy)};
    size_t bytes[2];
    assert_true(b->panels == 40 && b->panel_points == 90 && b->meshes == 40 && b->mesh_points == 90);
    assert_memory_equal(a->attribute_bits, b->attribute_bits, sizeof a->attribute_bits);
    assert_true(s[0].chunk_count == 4 && s[1].chunk_count == 4);
    assert_memory_equal(s[0].chunks, s[1].chunks, 4 * sizeof *s[0].chunks);
    const void *words = spl_dataset_get_page(from, 0, &bytes[0]), *copied = spl_dataset_get_page(copy, 0, &bytes[1]);
    assert_true(bytes[0] == bytes[1] && bytes[0] > 40 * 4 * (2 + 2 + 21));
    assert_memory_equal(words, copied, bytes[0]);
    spl_dataset_close(from);
    spl_dataset_close(copy);
}

struct coding {
    const struct spl_dictionary *dictionary;
    struct side *from;
    uint64_t asked, last;
};

static int code_chunk(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err)
{
    struct coding *c = context;
    (void)err;
    assert_true(chunk < c->from->chunk_count && (!c->asked++ || chunk > c->last));
    c->last = chunk;
    make_code(c->dictionary, 4, 8, (uint32_t)chunk, c->from->chunks[chunk].count, code);
    return SPL_OK;
}

/* New colours and codes are given by what the old file numbers. */
static void new_colors_and_codes_go_by_old_numbers(void **state)
{
    struct spl_dataset *from = *state;
    struct side s = take_side(from);
    bool *leaf = calloc(s.node_count, 1);
    uint64_t ids = spl_dataset_get_info(from)->ids, node = 0;
    uint8_t(*colors)[3] = malloc(ids * sizeof *colors);
    for (uint64_t id = 0; id < ids; id++)
        memcpy(colors[id], (uint8_t[3]){(uint8_t)id, (uint8_t)(id >> 8), (uint8_t)(id >> 16)}, 3);
    leaf[s.nodes[0].first_child] = true;
    struct spl_dictionary dictionary = make_dictionary(30, 16, 9);
    struct coding coding = {.dictionary = &dictionary, .from = &s};
    const struct spl_rewrite what = {.from = from,
                                     .colors = (const uint8_t(*)[3])colors,
                                     .dictionary = &dictionary,
                                     .code_chunk = code_chunk,
                                     .context = &coding,
                                     .leaf = leaf};
    struct spl_error err = {0};
    must(spl_dataset_rewrite(&what, path, &err), &err);
    struct spl_dataset *to = open_it(UINT64_MAX);
    struct side b = take_side(to);
    assert_true(coding.asked == b.chunk_count && b.chunk_count < s.chunk_count);
    for (uint64_t n = 0; n < s.node_count; n++) { /* of the root's first child only its children are gone, and theirs */
        uint64_t up = n;
        while (up && up != s.nodes[0].first_child) {
            uint64_t parent = 0;
            while (up < s.nodes[parent].first_child ||
                   up >= s.nodes[parent].first_child + s.nodes[parent].child_count || !s.nodes[parent].child_count)
                parent++;
            up = parent;
        }
        if (up && n != up)
            continue;
        const struct spl_chunk *x = &s.chunks[s.nodes[n].first_chunk], *y = &b.chunks[b.nodes[node].first_chunk];
        struct spl_splat splat;
        struct spl_chunk_code wanted, code;
        assert_true(spl_dataset_find_splat(to, y->first_id + y->count - 1, &splat));
        assert_memory_equal(splat.color, colors[x->first_id + x->count - 1], 3);
        make_code(&dictionary, 4, 8, (uint32_t)s.nodes[n].first_chunk, x->count, &wanted);
        get_code(&b, b.nodes[node].page, b.nodes[node].first_chunk, &code);
        assert_true(wanted.planes == code.planes && !memcmp(&wanted.splat, &code.splat, sizeof code.splat));
        node++;
    }
    assert_int_equal(node, b.node_count);
    spl_dataset_close(to);
    spl_dictionary_finish(&dictionary);
    free(b.textures);
    free(colors);
    free(leaf);
}

/* Whatever allocation fails: an error, and nothing left of the file. */
static void refused_memory_leaves_nothing(void **state)
{
    struct spl_dataset *from = *state;
    bool *leaf = calloc(spl_dataset_get_info(from)->nodes, 1);
    leaf[take_side(from).nodes[0].first_child] = true;
    const struct spl_rewrite what = {.from = from, .leaf = leaf, .page_bytes = 60000};
    long n = 1;
    unlink(path);
    for (;; n++) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = spl_dataset_rewrite(&what, path, &err);
        spl_memory_fail_after(0);
        if (!rc)
            break;
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(access(path, F_OK), -1);
    }
    assert_true(n > 20);
    free(leaf);
}

/* A root of wires alone, over a child of discs: there must be a splat left. */
static void what_has_lines_alone_is_no_dataset(void **state)
{
    (void)state;
    struct spl_node nodes[2] = {{.size = 4, .spacing = 1, .chunk_count = 1, .child_count = 1, .first_child = 1},
                                {.size = 2, .spacing = 1, .chunk_count = 1, .depth = 1, .first_chunk = 1}};
    struct spl_chunk chunks[2] = {0};
    struct spl_dataset_writer *writer;
    assert_int_equal(spl_dataset_writer_create(path, &writer, NULL), SPL_OK);
    for (int n = 0; n < 2; n++) {
        struct spl_splat splats[4] = {0};
        double position[4][3] = {{0}};
        uint32_t words[SPL_CHUNK_WORDS_MAX + SPL_PAGE_TAIL_WORDS];
        const struct spl_chunk_options how = {0.016, 0.02, 0.05, n ? SPL_CHUNK_DISCS : SPL_CHUNK_LINES};
        for (int i = 0; i < 4; i++) {
            splats[i] = (struct spl_splat){.normal = {0, 0, 1}, .radius = 1, .linear = !n && i < 3};
            position[i][0] = i;
        }
        uint32_t used = spl_chunk_encode(splats, (const double(*)[3])position, 4, &how, &chunks[n], words, NULL);
        assert_int_equal(spl_dataset_writer_add_node(writer, words, used, &chunks[n], 1, &nodes[n].page, NULL), SPL_OK);
        for (int a = 0; a < 3; a++)
            nodes[n].box_max[a] = 5;
    }
    json_t *meta = json_deep_copy(spl_dataset_get_meta(*state));
    json_object_set_new(meta, "leaf_splats", json_integer(4));
    json_object_set_new(meta, "levels", json_integer(2));
    assert_int_equal(spl_dataset_writer_finish(writer, nodes, 2, chunks, 2, meta, NULL), SPL_OK);
    spl_dataset_writer_destroy(writer);
    json_decref(meta);
    struct spl_dataset *from = open_it(UINT64_MAX);
    assert_true(spl_dataset_get_info(from)->pieces == 3 && spl_dataset_get_info(from)->splats == 4);
    const struct spl_rewrite what = {.from = from, .leaf = (const bool[]){true, false}};
    struct spl_error err = {0};
    unlink(path);
    assert_int_equal(spl_dataset_rewrite(&what, path, &err), SPL_E_INPUT);
    assert_non_null(strstr(err.message, "some: no splat would be left of it"));
    assert_int_equal(access(path, F_OK), -1);
    spl_dataset_close(from);
}

static int set_up(void **state)
{
    make_folder(folder);
    snprintf(path, sizeof path, "%s/some.spld", folder);
    *state = make_whole();
    return 0;
}

static int tear_down(void **state)
{
    spl_dataset_close(*state);
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_stays_is_what_it_was),
        cmocka_unit_test(nothing_dropped_is_nothing_changed),
        cmocka_unit_test(panels_and_meshes_stay),
        cmocka_unit_test(new_colors_and_codes_go_by_old_numbers),
        cmocka_unit_test(refused_memory_leaves_nothing),
        cmocka_unit_test(what_has_lines_alone_is_no_dataset),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
