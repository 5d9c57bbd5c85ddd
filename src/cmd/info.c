/* splatd info: what a dataset holds, what each attribute costs, and how many bits the scene needed. Everything is
 * gathered into a struct first, which both outputs print. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jansson.h>

#include "cmd/dictionary.h"
#include "cmd/output.h"
#include "dataset/chunk_clip.h"
#include "dataset/dataset.h"
#include "dataset/texture.h"

enum { width_max = 32, levels_max = 64 };

/* Fixed-width codes whose widths each chunk chose. */
static const struct {
    const char *name; /* as in JSON */
    const char *label;
    enum spl_attribute attribute;
    unsigned shifts[3], shift_count, bits;
} codes[] = {
    {"position_axis",
     "position, an axis",
     SPL_ATTRIBUTE_POSITION,
     {SPL_GEOMETRY_X, SPL_GEOMETRY_Y, SPL_GEOMETRY_Z},
     3,
     5},
    {"radius", "radius", SPL_ATTRIBUTE_RADIUS, {SPL_GEOMETRY_RADIUS}, 1, 4},
    {"normal_coordinate", "normal, a coordinate", SPL_ATTRIBUTE_NORMAL, {SPL_GEOMETRY_U, SPL_GEOMETRY_V}, 2, 4},
    {"color_component", "color, a component", SPL_ATTRIBUTE_COLOR, {SPL_COLOR_Y, SPL_COLOR_U, SPL_COLOR_V}, 3, 4},
};
enum { code_count = sizeof codes / sizeof *codes };

static const char bar[] = "########################################";
enum { bar_max = sizeof bar - 1 };

struct report {
    const struct spl_dataset *dataset;
    const struct spl_dataset_info *info;
    struct level {
        uint64_t nodes, chunks, splats;
        double spacing;   /* mean over the splats */
    } levels[levels_max]; /* deeper ones are counted with the last */
    uint32_t level_count;
    double widths[code_count + SPL_STREAMS_MAX][width_max + 1]; /* shares of the codes; streams last */
    uint64_t atoms[SPL_ATOMS_MAX + 1];        /* splats by number of atoms */
    uint64_t linear;                          /* points on wires, poles and cables */
    uint64_t clips;                           /* splats that end at a clip line */
};

static void usage(FILE *out)
{
    fprintf(out,
            "usage: splatd info [--json] [--no-verify] [--dictionary PNG] NAME.spld…\n\n"
            "Says what packed datasets hold: splats by level of detail, bounds, bytes a splat by attribute, and the\n"
            "histogram of bits that the scene needed. Every section's checksum is verified first.\n\n"
            "A table to read:\n"
            "  splatd info courtyard.spld\n"
            "Only check that files are whole (exit code 2 when one is not):\n"
            "  splatd info *.spld >/dev/null\n"
            "One line of JSON a dataset, for scripts:\n"
            "  splatd info --json courtyard.spld | jq .bytes_per_splat.total\n"
            "The atoms that textures are sums of, the most used first, as a picture:\n"
            "  splatd info hall.spld --dictionary atoms.png\n\n"
            "      --json       one JSON object a line\n"
            "      --dictionary PNG  where the picture goes; one dataset with textures\n"
            "      --verify     check the pages' checksums too (default)\n"
            "      --no-verify  trust the pages; everything else is always checked\n");
}

static uint32_t code_word(const struct spl_chunk *chunk, enum spl_attribute attribute)
{
    return attribute == SPL_ATTRIBUTE_COLOR ? chunk->color_bits : chunk->geometry_bits;
}

static void gather_widths(struct report *report)
{
    uint64_t chunk_count;
    uint32_t stream_count;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(report->dataset, &chunk_count);
    const struct spl_stream *streams = spl_dataset_get_streams(report->dataset, &stream_count);
    for (uint64_t c = 0; c < chunk_count; c++) {
        double share = chunks[c].count / (double)report->info->splats;
        for (int k = 0; k < code_count; k++)
            for (unsigned s = 0; s < codes[k].shift_count; s++) {
                uint32_t width = code_word(&chunks[c], codes[k].attribute) >> codes[k].shifts[s];
                report->widths[k][width & ((1u << codes[k].bits) - 1)] += share / codes[k].shift_count;
            }
        for (uint32_t s = 0; s < stream_count; s++)
            report->widths[code_count + s][streams[s].width[c]] += share;
    }
}

static int gather(struct report *report, const struct spl_dataset *dataset, struct spl_error *err)
{
    uint64_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    *report = (struct report){.dataset = dataset, .info = spl_dataset_get_info(dataset)};
    for (uint64_t n = 0; n < node_count; n++) {
        uint32_t depth = nodes[n].depth < levels_max ? nodes[n].depth : levels_max - 1;
        struct level *level = &report->levels[depth];
        report->level_count = depth + 1 > report->level_count ? depth + 1 : report->level_count;
        level->nodes++;
        level->chunks += nodes[n].chunk_count;
        for (uint32_t c = 0; c < nodes[n].chunk_count; c++) {
            uint32_t splats = chunks[nodes[n].first_chunk + c].count;
            level->splats += splats;
            level->spacing += (double)nodes[n].spacing * splats;
        }
    }
    for (uint32_t i = 0; i < report->level_count; i++)
        report->levels[i].spacing /= (double)report->levels[i].splats;
    for (uint64_t c = 0; c < chunk_count; c++)
        report->clips += spl_clip_count(&chunks[c]);
    gather_widths(report);
    int rc = spl_dataset_count_linear(dataset, &report->linear, err);
    return rc ? rc : spl_dataset_count_atoms(dataset, report->atoms, err);
}

/* What is counted, by name: the attributes that every dataset has, then its own. */
static const char *name_of(const struct spl_dataset_info *info, int attribute)
{
    return attribute < SPL_ATTRIBUTE_COUNT ? spl_attribute_name((enum spl_attribute)attribute)
                                           : info->streams[attribute - SPL_ATTRIBUTE_COUNT].name;
}

static int count_of(const struct spl_dataset_info *info)
{
    return SPL_ATTRIBUTE_COUNT + (int)info->stream_count;
}

static double bytes_per_splat(const struct spl_dataset_info *info, int attribute)
{
    uint64_t bits = attribute < SPL_ATTRIBUTE_COUNT ? info->attribute_bits[attribute]
                                                    : info->streams[attribute - SPL_ATTRIBUTE_COUNT].bits;
    return (double)bits / 8 / (double)info->splats;
}

static double total_bytes_per_splat(const struct spl_dataset_info *info)
{
    double total = 0;
    for (int a = 0; a < count_of(info); a++)
        total += bytes_per_splat(info, a);
    return total;
}

/* 1234567 -> "1,234,567" */
static const char *grouped(uint64_t value, char text[32])
{
    char digits[24];
    int length = snprintf(digits, sizeof digits, "%" PRIu64, value), used = 0;
    for (int i = 0; i < length; i++) {
        if (i && (length - i) % 3 == 0)
            text[used++] = ',';
        text[used++] = digits[i];
    }
    text[used] = 0;
    return text;
}

/* As figure 9 of the sparse-coding paper. A bar's full length is the largest share. */
static void print_atoms(const struct report *report)
{
    const struct spl_dataset_info *info = report->info;
    char text[32];
    uint64_t most = 1;
    printf("\n  textures of %u x %u from %s atoms, %.1f MB resident; splats by number of atoms\n", info->texture_size,
           info->texture_size, grouped(info->atoms, text), (double)info->dictionary_bytes / 1e6);
    for (int count = 0; count <= SPL_ATOMS_MAX; count++)
        most = report->atoms[count] > most ? report->atoms[count] : most;
    for (int count = 0; count <= SPL_ATOMS_MAX; count++) {
        int length = (int)((double)bar_max * (double)report->atoms[count] / (double)most + 0.5);
        printf("  %-6d%12s%8.1f %%%s%.*s\n", count, grouped(report->atoms[count], text),
               100.0 * (double)report->atoms[count] / (double)info->splats, length ? "  " : "", length, bar);
    }
}

/* Photographs first: they have taken the place of the others, of which only the sum that is left is known. */
static void print_colors(const json_t *colors, uint64_t kept)
{
    const json_t *color;
    bool photographs = false;
    char text[32];
    size_t i;
    json_array_foreach(colors, i, color)
    {
        const char *from = json_string_value(json_object_get(color, "from"));
        const char *source = json_string_value(json_object_get(color, "source")), *label = i ? "" : "  color from";
        uint64_t points = (uint64_t)json_integer_value(json_object_get(color, "points"));
        if (!strcmp(from, "photographs")) {
            photographs = true;
            kept -= points < kept ? points : kept;
            printf("%-16s%s: %s points, with the poses of %s\n", label, from, grouped(points, text), source);
        } else if (!photographs) {
            printf("%-16s%s: %s points of %s\n", label, from, grouped(points, text), source);
        } else if (kept && json_array_size(colors) == 2) {
            printf("%-16s%s: the other %s points, of %s\n", label, from, grouped(kept, text), source);
        } else if (kept) {
            printf("%-16s%s: of the other %s points, those of %s\n", label, from, grouped(kept, text), source);
        }
    }
}

/* ", name (unit, where it comes from)" */
static void print_stream(const struct spl_stream_info *stream)
{
    const char *about = NULL, *unit = stream->unit;
    for (int k = 0; k < SPL_STREAM_KNOWN_COUNT; k++)
        if (!strcmp(spl_streams_known[k].name, stream->name))
            about = spl_streams_known[k].about;
    printf(", %s", stream->name);
    if (about || *unit)
        printf(" (%s%s%s)", unit, about && *unit ? ", " : "", about ? about : "");
}

static void print_table(const struct report *report)
{
    const struct spl_dataset_info *info = report->info;
    const json_t *sources = json_object_get(spl_dataset_get_meta(report->dataset), "sources"), *source;
    const json_t *crs = json_object_get(spl_dataset_get_meta(report->dataset), "crs");
    char a[32], b[32], c[32], d[32];
    size_t i;
    printf("%s  version %016" PRIx64 ", %.1f MB\n", info->id, info->version, (double)info->file_bytes / 1e6);
    json_array_foreach(sources, i, source) printf("%-16s%s\n", i ? "" : "  source", json_string_value(source));
    printf("  points        %s read, %s kept\n", grouped(info->points, a), grouped(info->leaf_splats, b));
    printf("  splats        %s: %s points and %s for coarser levels (%.1f %%)\n", grouped(info->splats, a),
           grouped(info->leaf_splats, b), grouped(info->splats - info->leaf_splats, c),
           100.0 * (double)(info->splats - info->leaf_splats) / (double)info->leaf_splats);
    printf("  attributes    %s", info->has_color ? "color" : "no color");
    for (uint32_t s = 0; s < info->stream_count; s++)
        print_stream(&info->streams[s]);
    printf("\n");
    print_colors(json_object_get(spl_dataset_get_meta(report->dataset), "color"), info->leaf_splats);
    printf("  surface       %s\n", info->has_surface ? "normals and radii" : "none (packed with --points-only)");
    printf("  linear        %s points on wires, poles and cables (%.2f %%)\n", grouped(report->linear, a),
           100.0 * (double)report->linear / (double)info->leaf_splats);
    printf("  clip lines    %s splats (%.2f %%)\n", grouped(report->clips, a),
           100.0 * (double)report->clips / (double)info->splats);
    printf("  bounds        %.10g %.10g %.10g to\n                %.10g %.10g %.10g\n", info->bounds_min[0],
           info->bounds_min[1], info->bounds_min[2], info->bounds_max[0], info->bounds_max[1], info->bounds_max[2]);
    printf("  unit          %s\n", info->unit);
    if (json_is_string(crs))
        printf("  crs           %s\n", json_string_value(crs));
    printf("  default view  --eye %.10g,%.10g,%.10g --target %.10g,%.10g,%.10g --up %g,%g,%g --fov %g\n",
           info->default_eye[0], info->default_eye[1], info->default_eye[2], info->default_target[0],
           info->default_target[1], info->default_target[2], info->default_up[0], info->default_up[1],
           info->default_up[2], info->default_fov);
    printf("  splat radius  %.4g (median)\n", info->splat_radius);
    printf("  pages         %s, %.1f MB resident\n\n", grouped(info->pages, a), (double)info->page_bytes / 1e6);

    printf("  %-6s%12s%14s%16s%12s\n", "level", "nodes", "chunks", "splats", "spacing");
    for (uint32_t level = 0; level < report->level_count; level++) {
        const struct level *l = &report->levels[level];
        printf("  %-6u%12s%14s%16s%12.4g\n", level, grouped(l->nodes, a), grouped(l->chunks, b), grouped(l->splats, d),
               l->spacing);
    }
    printf("\n  bytes a splat\n");
    for (int attribute = 0; attribute < count_of(info); attribute++)
        if (info->atoms || (attribute != SPL_ATTRIBUTE_TEXTURE && attribute != SPL_ATTRIBUTE_DICTIONARY))
            printf("  %-14s%6.2f\n", name_of(info, attribute), bytes_per_splat(info, attribute));
    printf("  %-14s%6.2f\n\n  bits that the scene needed (share of the splats)\n", "total",
           total_bytes_per_splat(info));
    for (int k = 0; k < code_count + (int)info->stream_count; k++) {
        printf("  %-22s", k < code_count ? codes[k].label : info->streams[k - code_count].name);
        for (int width = 0; width <= width_max; width++)
            if (report->widths[k][width] > 0)
                printf("  %d: %.1f %%", width, 100 * report->widths[k][width]);
        printf("\n");
    }
    if (!info->atoms)
        return;
    print_atoms(report);
}

static json_t *vector(const double v[3])
{
    return json_pack("[f,f,f]", v[0], v[1], v[2]);
}

/* null where there are none; NULL when memory is refused. */
static json_t *textures_to_json(const struct report *report)
{
    const struct spl_dataset_info *info = report->info;
    json_t *counts = info->atoms ? json_array() : NULL;
    if (!info->atoms)
        return json_null();
    for (int count = 0; count <= SPL_ATOMS_MAX; count++)
        json_array_append_new(counts, json_integer((json_int_t)report->atoms[count]));
    return json_pack("{s:I, s:I, s:I, s:o}", "size", (json_int_t)info->texture_size, "atoms", (json_int_t)info->atoms,
                     "dictionary_bytes", (json_int_t)info->dictionary_bytes, "splats_by_atoms", counts);
}

/* NULL when memory is refused: json_pack passes it on. */
static json_t *to_json(const struct report *report)
{
    const struct spl_dataset_info *info = report->info;
    json_t *bytes = json_pack("{s:f}", "total", total_bytes_per_splat(info));
    for (int a = 0; a < count_of(info); a++)
        json_object_set_new(bytes, name_of(info, a), json_real(bytes_per_splat(info, a)));
    json_t *levels = json_array();
    for (uint32_t i = 0; i < report->level_count; i++) {
        const struct level *l = &report->levels[i];
        json_array_append_new(levels,
                              json_pack("{s:I, s:I, s:I, s:f}", "nodes", (json_int_t)l->nodes, "chunks",
                                        (json_int_t)l->chunks, "splats", (json_int_t)l->splats, "spacing", l->spacing));
    }
    json_t *widths = json_object();
    for (int k = 0; k < code_count + (int)info->stream_count; k++) {
        json_t *histogram = json_object();
        for (int width = 0; width <= width_max; width++) {
            char key[16];
            snprintf(key, sizeof key, "%d", width);
            if (report->widths[k][width] > 0)
                json_object_set_new(histogram, key, json_real(report->widths[k][width]));
        }
        json_object_set_new(widths, k < code_count ? codes[k].name : info->streams[k - code_count].name, histogram);
    }
    return json_pack(
        "{s:s, s:o, s:I, s:I, s:I, s:I, s:i, s:I, s:I, s:I, s:{s:o, s:o}, s:{s:o, s:o, s:o, s:f}, s:f, s:{s:b, s:b, "
        "s:b, s:b}, s:I, s:I, s:I, s:o, s:o, s:o, s:o, s:O, s:O?, s:O?, s:s, s:O?}",
        "id", info->id, "version", json_sprintf("%016" PRIx64, info->version), "file_bytes",
        (json_int_t)info->file_bytes, "points", (json_int_t)info->points, "leaf_splats", (json_int_t)info->leaf_splats,
        "splats", (json_int_t)info->splats, "levels", (int)info->levels, "nodes", (json_int_t)info->nodes, "chunks",
        (json_int_t)info->chunks, "pages", (json_int_t)info->pages, "bounds", "min", vector(info->bounds_min), "max",
        vector(info->bounds_max), "default_view", "eye", vector(info->default_eye), "target",
        vector(info->default_target), "up", vector(info->default_up), "fov", info->default_fov, "splat_radius",
        info->splat_radius, "attributes", "color", (int)info->has_color, "class", (int)info->has_class, "uncertainty",
        (int)info->has_uncertainty, "surface", (int)info->has_surface, "linear", (json_int_t)report->linear,
        "clip_lines", (json_int_t)report->clips, "page_bytes", (json_int_t)info->page_bytes, "bytes_per_splat", bytes,
        "by_level", levels, "widths", widths, "textures", textures_to_json(report), "sources",
        json_object_get(spl_dataset_get_meta(report->dataset), "sources"), "color",
        json_object_get(spl_dataset_get_meta(report->dataset), "color"), "streams",
        json_object_get(spl_dataset_get_meta(report->dataset), "streams"), "unit", info->unit, "crs",
        json_object_get(spl_dataset_get_meta(report->dataset), "crs"));
}

static int print_json(const struct report *report, struct spl_error *err)
{
    json_t *json = to_json(report);
    char *text = json ? json_dumps(json, JSON_COMPACT | JSON_REAL_PRECISION(17)) : NULL;
    json_decref(json);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the description of %s", report->info->id);
    puts(text);
    free(text);
    return SPL_OK;
}

int spl_cmd_info(int argc, char **argv)
{
    enum { opt_json = 256, opt_verify, opt_no_verify, opt_dictionary };
    static const struct option options[] = {
        {"json", no_argument, NULL, opt_json},
        {"verify", no_argument, NULL, opt_verify},
        {"no-verify", no_argument, NULL, opt_no_verify},
        {"dictionary", required_argument, NULL, opt_dictionary},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    bool json = false, verify = true;
    const char *picture = NULL;
    for (int c; (c = getopt_long(argc, argv, "h", options, NULL)) >= 0;) {
        switch (c) {
        case opt_json:
            json = true;
            break;
        case opt_verify:
        case opt_no_verify:
            verify = c == opt_verify;
            break;
        case opt_dictionary:
            picture = optarg;
            break;
        case 'h':
            usage(stdout);
            return 0;
        default:
            fprintf(stderr, "'splatd info --help' shows how\n");
            return 2;
        }
    }
    if (optind == argc) {
        fprintf(stderr, "splatd: info needs at least one dataset: splatd info hall.spld; "
                        "'splatd info --help' shows more\n");
        return 2;
    }
    if (picture && argc - optind > 1) {
        fprintf(stderr, "splatd: --dictionary is the picture of one dataset, not of %d\n", argc - optind);
        return 2;
    }
    struct spl_error wrong = {0};
    if (picture && spl_cmd_check_ending("--dictionary", picture, "png", &wrong))
        return spl_cmd_fail(&wrong);
    int worst = 0; /* the remaining files are still told of */
    for (int i = optind; i < argc; i++) {
        struct spl_dataset *dataset = NULL;
        struct spl_error err = {0};
        struct report report;
        int rc = spl_dataset_open(argv[i], verify, &dataset, &err);
        if (!rc)
            rc = gather(&report, dataset, &err);
        if (!rc && json)
            rc = print_json(&report, &err);
        else if (!rc)
            print_table(&report);
        if (!rc && picture)
            rc = spl_cmd_write_dictionary(dataset, picture, &err);
        spl_dataset_close(dataset);
        int code = rc ? spl_cmd_fail(&err) : 0;
        worst = code > worst ? code : worst;
    }
    return fflush(stdout) ? spl_cmd_fail(&(struct spl_error){.code = SPL_E_IO, .message = "cannot write to stdout"})
                          : worst;
}
