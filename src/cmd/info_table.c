/* What splatd info says of a dataset, as a table to read: what it holds, its levels, what each attribute takes and what
 * codes its splats needed. The command's thread. */
#include "cmd/info_report.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cmd/output.h"
#include "dataset/classes.h"
#include "render/soft/suggest.h"

static const char bar[] = "########################################";
enum { bar_max = sizeof bar - 1 };
/* As figure 9 of the sparse-coding paper. A bar's full length is the largest share. */
static void print_atoms(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    char text[32];
    uint64_t most = 1;
    printf("\n  textures of %u x %u from %s atoms, %.1f MB resident; splats by number of atoms\n", info->texture_size,
           info->texture_size, spl_cmd_group(info->atoms, text), (double)info->dictionary_bytes / 1e6);
    for (int count = 0; count <= SPL_ATOMS_MAX; count++)
        most = report->atoms[count] > most ? report->atoms[count] : most;
    for (int count = 0; count <= SPL_ATOMS_MAX; count++) {
        int length = (int)((double)bar_max * (double)report->atoms[count] / (double)most + 0.5);
        printf("  %-6d%12s%8.1f %%%s%.*s\n", count, spl_cmd_group(report->atoms[count], text),
               100.0 * (double)report->atoms[count] / (double)info->splats, length ? "  " : "", length, bar);
    }
}

/* "4 stations of 1024 texels a side, …" */
static void print_maps(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    uint32_t count, least = UINT32_MAX, most = 0;
    const struct spl_map_row *row = spl_dataset_get_maps(report->dataset, &count);
    char a[32], b[32], c[32];
    for (uint32_t i = 0; i < count; i++) {
        least = row[i].side < least ? row[i].side : least;
        most = row[i].side > most ? row[i].side : most;
    }
    printf("  maps          %s station%s of side %u", spl_cmd_group(count, a), count == 1 ? "" : "s", least);
    if (most > least)
        printf(" to %u", most);
    printf(", %s texels, %s bytes (%.3f a texel)\n", spl_cmd_group(info->map_texels, b),
           spl_cmd_group(info->map_bytes, c), (double)info->map_bytes / (double)info->map_texels);
}

/* Those of coarser levels stand for the same points once more. */
static void print_panels(const struct spl_info_report *report, enum spl_chunk_kind kind)
{
    const struct spl_dataset_info *info = report->info;
    char a[32], b[32];
    if (report->items[kind])
        printf("  %s        %s for %s points (%.2f %%), %.1f kB; points off them %.3g %s, %.3g at most\n",
               spl_chunk_get_codec(kind)->name, spl_cmd_group(report->items[kind], a),
               spl_cmd_group(report->points[kind], b),
               100.0 * (double)report->points[kind] / (double)info->leaf_splats, (double)report->bytes[kind] / 1e3,
               spl_info_error_mean(report, kind), spl_unit_word(info), report->error_most[kind]);
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
            printf("%-16s%s: %s points, with the poses of ", label, from, spl_cmd_group(points, text));
        } else if (!photographs) {
            printf("%-16s%s: %s points of ", label, from, spl_cmd_group(points, text));
        } else if (kept && json_array_size(colors) == 2) {
            printf("%-16s%s: the other %s points, of ", label, from, spl_cmd_group(kept, text));
        } else if (kept) {
            printf("%-16s%s: of the other %s points, those of ", label, from, spl_cmd_group(kept, text));
        } else {
            continue;
        }
        spl_cmd_put_text(stdout, source, 0);
        printf("\n");
    }
}

/* ", name (unit, in what steps, where it comes from)" */
static void print_stream(const struct spl_stream *stream)
{
    const char *about = NULL, *unit = stream->unit;
    char steps[48] = "";
    if (stream->steps_a_unit > 0)
        snprintf(steps, sizeof steps, "%sin steps of %.3g", *unit ? ", " : "", 1 / stream->steps_a_unit);
    for (int k = 0; k < SPL_STREAM_KNOWN_COUNT; k++)
        if (!strcmp(spl_streams_known[k].name, stream->name))
            about = spl_streams_known[k].about;
    printf(", ");
    spl_cmd_put_text(stdout, stream->name, 0);
    if (!about && !*unit && !*steps)
        return;
    printf(" (");
    spl_cmd_put_text(stdout, unit, 0);
    printf("%s%s%s)", steps, about && (*unit || *steps) ? ", " : "", about ? about : "");
}

/* "2 ground 67.2 %, 5 high vegetation 8.1 %, …" */
static void print_classes(const struct spl_dataset_info *info)
{
    enum { shown = 20 };
    char text[32];
    for (uint32_t s = 0; s < info->stream_count; s++) {
        const struct spl_stream_values *values = spl_dataset_info_get_values(info, s);
        if (!values || strcmp(info->streams[s].name, "class"))
            continue;
        for (uint32_t i = 0; i < values->kind_count && i < shown; i++) {
            const struct spl_value_count *kind = &values->kinds[i];
            const char *name = spl_class_name(kind->value);
            printf("%s%g%s%s %s (%.1f %%)", i ? ", " : "  classes       ", kind->value, name ? " " : "",
                   name ? name : "", spl_cmd_group(kind->count, text),
                   100.0 * (double)kind->count / (double)values->count);
        }
        if (values->kind_count > shown)
            printf(" and %u more", values->kind_count - shown);
        printf("%s", values->kind_count ? "\n" : "");
    }
}

/* A line a term, as options of render take them. */
static void print_suggestions(const struct spl_dataset_info *info)
{
    char terms[SPL_SUGGESTIONS_MAX][SPL_SUGGESTION_MAX];
    const uint32_t count = spl_soft_suggest(info, terms);
    for (uint32_t i = 0; i < count; i++) {
        printf("%s", i ? "                --soft '" : "  soft          --soft '");
        spl_cmd_put_text(stdout, terms[i], 0);
        printf("'\n");
    }
}

/* Those that render takes by number: the first, and how many more. */
static void print_stations(const struct spl_dataset_info *info)
{
    enum { shown = 8 };
    char text[32];
    for (uint32_t i = 0; i < info->station_count && i < shown; i++) {
        const double *pose = info->stations[i];
        printf("%s--station %u at %.10g %.10g %.10g%s\n", i ? "                " : "  stations      ", i, pose[3],
               pose[7], pose[11], !i && info->stations_of_maps ? ", of panoramas" : "");
    }
    if (info->station_count > shown)
        printf("                and %s more\n", spl_cmd_group(info->station_count - shown, text));
}

static void print_bytes(const char *attribute, double bytes, int width)
{
    printf("  ");
    spl_cmd_put_text(stdout, attribute, width);
    printf("%6.2f\n", bytes);
}

/* A line each. What META says of all tiles is said all the same. */
static void print_lost(const struct spl_info_report *report)
{
    char text[32];
    if (report->lost_count)
        printf("  lost tiles    %s, of which nothing that cannot be read is counted in levels, lines, linear and clip "
               "lines:\n",
               spl_cmd_group(report->lost_count, text));
    for (uint32_t i = 0; i < report->lost_count && i < SPL_INFO_LOST_MAX; i++)
        spl_cmd_put_row("", report->lost[i].reason);
    if (report->lost_count > SPL_INFO_LOST_MAX)
        printf("                and %s more\n", spl_cmd_group(report->lost_count - SPL_INFO_LOST_MAX, text));
}

/* How many points there were before nodes were dropped; NULL where none was. */
static const json_t *get_pruned(const json_t *meta)
{
    return json_object_get(json_object_get(meta, "pruned"), "of");
}

/* The points, and what stands for them. */
static void print_splats(const struct spl_info_report *report, const json_t *meta)
{
    const struct spl_dataset_info *info = report->info;
    const json_t *whole = json_object_get(meta, "part_of"), *pruned = get_pruned(meta);
    const uint64_t discs = info->leaf_splats - info->panel_points - info->mesh_points;
    char a[32], b[32], c[32];
    printf("  points        %s read, %s kept\n", spl_cmd_group(info->points, a), spl_cmd_group(info->leaf_splats, b));
    if (pruned)
        printf("  pruned        of %s points\n", spl_cmd_group((uint64_t)json_integer_value(pruned), a));
    if (whole)
        printf("  a part of     %s points of the sources\n", spl_cmd_group((uint64_t)json_integer_value(whole), a));
    printf("  splats        %s: %s points and %s for coarser levels", spl_cmd_group(info->splats, a),
           spl_cmd_group(discs, b), spl_cmd_group(info->splats - discs, c));
    if (discs)
        printf(" (%.1f %%)", 100.0 * (double)(info->splats - discs) / (double)discs);
    printf("\n");
}

static void print_levels(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    char a[32], b[32], c[32], d[32];
    printf("  %-6s%12s%14s%16s%12s", "level", "nodes", "chunks", "splats", "pieces");
    if (info->panels)
        printf("%12s", "panels");
    if (info->meshes)
        printf("%12s", "meshes");
    printf("%12s\n", "spacing");
    for (uint32_t level = 0; level < report->level_count; level++) {
        const struct spl_info_level *l = &report->levels[level];
        printf("  %-6u%12s%14s%16s%12s", level, spl_cmd_group(l->nodes, a), spl_cmd_group(l->chunks, b),
               spl_cmd_group(l->splats, c), spl_cmd_group(l->pieces, d));
        if (info->panels)
            printf("%12s", spl_cmd_group(l->panels, a));
        if (info->meshes)
            printf("%12s", spl_cmd_group(l->meshes, a));
        printf("%12.4g\n", l->spacing);
    }
}

/* What each attribute takes, and the codes that chunks chose. */
static void print_attributes(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    int name_width = 14;
    printf("\n  bytes a %s\n", spl_info_has_primitives(info) ? "point" : "splat");
    for (uint32_t s = 0; s < info->stream_count; s++) {
        const int length = (int)strlen(info->streams[s].name);
        name_width = length > name_width ? length : name_width;
    }
    for (int attribute = 0; attribute < spl_info_count(info); attribute++)
        if (info->atoms || (attribute != SPL_ATTRIBUTE_TEXTURE && attribute != SPL_ATTRIBUTE_DICTIONARY))
            print_bytes(spl_info_name(info, attribute), spl_info_bytes_per_splat(info, attribute), name_width);
    print_bytes("total", spl_info_total_bytes_per_splat(info), name_width);
    printf("\n  bits that the scene needed (share of the splats)\n");
    for (int k = 0; k < SPL_INFO_CODES + (int)info->stream_count; k++) {
        printf("  ");
        spl_cmd_put_text(stdout, k < SPL_INFO_CODES ? spl_info_codes[k].label : info->streams[k - SPL_INFO_CODES].name,
                         22);
        for (int width = 0; width <= SPL_INFO_WIDTH_MAX; width++)
            if (report->widths[k][width] > 0)
                printf("  %d: %.1f %%", width, 100 * report->widths[k][width]);
        printf("\n");
    }
    if (info->atoms)
        print_atoms(report);
}

void spl_info_print_table(const struct spl_info_report *report)
{
    const struct spl_dataset_info *info = report->info;
    const json_t *meta = spl_dataset_get_meta(report->dataset), *source;
    const json_t *crs = json_object_get(meta, "crs"), *pruned = get_pruned(meta);
    uint32_t streams;
    const struct spl_stream *stream = spl_dataset_get_streams(report->dataset, &streams);
    char a[32];
    size_t i;
    spl_cmd_put_text(stdout, info->id, 0);
    printf("  version %016" PRIx64 ", %.1f MB\n", info->version, (double)info->file_bytes / 1e6);
    if (info->title)
        spl_cmd_put_row("title", info->title);
    if (info->tiles)
        printf("  tiles         %s, which take %.1f MB more\n", spl_cmd_group(info->tiles, a),
               (double)info->tile_bytes / 1e6);
    print_lost(report);
    json_array_foreach(json_object_get(meta, "sources"), i, source)
        spl_cmd_put_row(i ? "" : "source", json_string_value(source));
    print_splats(report, meta);
    printf("  attributes    %s", info->has_color ? "color" : "no color");
    for (uint32_t s = 0; s < streams; s++)
        print_stream(&stream[s]);
    printf("\n");
    print_classes(info);
    print_colors(json_object_get(meta, "color"), pruned ? (uint64_t)json_integer_value(pruned) : info->leaf_splats);
    if (info->maps)
        print_maps(report);
    printf("  surface       %s\n", info->has_surface ? "normals and radii" : "none (packed with --points-only)");
    printf("  linear        %s points on wires, poles and cables (%.2f %%)\n", spl_cmd_group(report->linear, a),
           100.0 * (double)report->linear / (double)info->leaf_splats);
    printf("  lines         %s pieces between them, %.1f kB\n", spl_cmd_group(info->pieces, a),
           (double)report->bytes[SPL_CHUNK_LINES] / 1e3);
    print_panels(report, SPL_CHUNK_PANELS);
    print_panels(report, SPL_CHUNK_MESHES);
    printf("  clip lines    %s splats (%.2f %%)\n", spl_cmd_group(report->clips, a),
           100.0 * (double)report->clips / fmax((double)info->splats, 1));
    printf("  bounds        %.10g %.10g %.10g to\n                %.10g %.10g %.10g\n", info->bounds_min[0],
           info->bounds_min[1], info->bounds_min[2], info->bounds_max[0], info->bounds_max[1], info->bounds_max[2]);
    printf("  unit          %s\n", info->unit);
    if (json_is_string(crs))
        spl_cmd_put_row("crs", json_string_value(crs));
    printf("  default view  --eye %.10g,%.10g,%.10g --target %.10g,%.10g,%.10g --up %g,%g,%g --fov %g\n",
           info->default_eye[0], info->default_eye[1], info->default_eye[2], info->default_target[0],
           info->default_target[1], info->default_target[2], info->default_up[0], info->default_up[1],
           info->default_up[2], info->default_fov);
    print_stations(info);
    for (uint32_t v = 0; v < info->view_count; v++)
        printf("  view          --view %s\n", info->views[v].name);
    print_suggestions(info);
    printf("  splat radius  %.4g %s (median)\n", info->splat_radius, spl_unit_word(info));
    printf("  pages         %s, %.1f MB resident", spl_cmd_group(info->pages, a),
           (double)(info->page_bytes - info->map_bytes) / 1e6);
    if (info->maps)
        printf(", %.1f MB with all maps", (double)info->page_bytes / 1e6);
    printf("\n\n");
    print_levels(report);
    if (!info->tiles)
        print_attributes(report);
}
