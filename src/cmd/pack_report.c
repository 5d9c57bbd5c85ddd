/* What splatd pack says on stderr: warnings and what is left out while it runs, the summary when all is done. The
 * command's thread. */
#include "cmd/pack_report.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/array.h"
#include "cmd/output.h"

static void print_textures(const struct spl_photo_report *r, const uint64_t *bits, double splats)
{
    fprintf(stderr, "%llu textures of %u x %u: ", (unsigned long long)r->textured, r->texture_size, r->texture_size);
    if (isnan(r->resampling_psnr))
        fprintf(stderr, "resampled without a pixel to compare with, ");
    else
        fprintf(stderr, "resampled at %.2f dB, ", r->resampling_psnr);
    fprintf(stderr, "coded at %.2f dB with %u atoms; %.2f bytes a splat\n", r->texture_psnr, r->atoms,
            (double)(bits[SPL_ATTRIBUTE_TEXTURE] + bits[SPL_ATTRIBUTE_DICTIONARY]) / 8 / splats);
    fprintf(stderr, "atoms a splat:");
    for (int i = 0; i <= 8; i++)
        fprintf(stderr, " %d: %.1f %%%s", i, 100 * (double)r->histogram[i] / (double)(r->textured ? r->textured : 1),
                i < 8 ? "," : "\n");
}

static void print_primitives(const char *what, uint64_t count, uint64_t points, uint64_t all)
{
    if (count)
        fprintf(stderr, "%llu %s of all levels stand for %llu of %llu points (%.1f %%)\n", (unsigned long long)count,
                what, (unsigned long long)points, (unsigned long long)all, 100 * (double)points / (double)all);
}

static void print_drawing(const char *path, const struct spl_drawing_report *d)
{
    const char *unit = strcmp(d->unit, "unknown") ? d->unit : "units";
    fprintf(stderr,
            "%s: %llu planes as %llu polygons of %.2f square %s, %llu meshes as %llu triangles of %.2f square %s, "
            "%llu lines of %.2f %s\n",
            path, (unsigned long long)d->planes, (unsigned long long)d->polygons, d->polygon_area, unit,
            (unsigned long long)d->meshes, (unsigned long long)d->triangles, d->triangle_area, unit,
            (unsigned long long)d->lines, d->line_length, unit);
}

void spl_cmd_pack_print(const char *output, const char *drawing, const struct spl_pack_report *r)
{
    uint64_t total = 0;
    double splats = (double)r->splats;
    fprintf(stderr,
            "%s: %llu points in (%llu skipped, %llu duplicates), %llu splats out, %u levels, %llu nodes, %u pages\n",
            output, (unsigned long long)r->points_read, (unsigned long long)r->points_skipped,
            (unsigned long long)r->duplicates, (unsigned long long)r->splats, r->levels,
            (unsigned long long)r->nodes, r->pages);
    bool primitives = r->panels || r->meshes;
    print_primitives("panels", r->panels, r->panel_points, r->leaf_splats);
    print_primitives("meshes", r->meshes, r->mesh_points, r->leaf_splats);
    if (!primitives)
        fprintf(stderr, "levels of detail add %.1f %% to %llu leaf splats\n",
                100 * (splats / (double)r->leaf_splats - 1), (unsigned long long)r->leaf_splats);
    if (r->pruned_of)
        fprintf(stderr, "pruned: %llu of %llu leaf splats are left, one of %.1f\n", (unsigned long long)r->leaf_splats,
                (unsigned long long)r->pruned_of, (double)r->pruned_of / (double)r->leaf_splats);
    double divisor = primitives ? (double)r->leaf_splats : splats; /* what they stand for is no splat */
    fprintf(stderr, "bytes a %s:", primitives ? "point" : "splat");
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++) {
        total += r->attribute_bits[a];
        if (r->attribute_bits[a])
            fprintf(stderr, " %s %.2f,", spl_attribute_name(a), (double)r->attribute_bits[a] / 8 / divisor);
    }
    for (uint32_t s = 0; s < r->stream_count; s++) {
        total += r->streams[s].bits;
        fputc(' ', stderr);
        spl_cmd_put_text(stderr, r->streams[s].name, 0);
        fprintf(stderr, " %.2f,", (double)r->streams[s].bits / 8 / divisor);
    }
    fprintf(stderr, " in all %.2f\n", (double)total / 8 / divisor);
    fprintf(stderr, "mean errors: position %.2f %% of the radius, normal %.2f degrees\n", 100 * r->position_error,
            r->normal_error);
    if (r->part_of)
        fprintf(stderr, "a part (--max-points) of the %llu points that the scans have\n",
                (unsigned long long)r->part_of);
    if (r->linear)
        fprintf(stderr, "%llu points on wires, poles and cables, joined by %llu pieces of all levels\n",
                (unsigned long long)r->linear, (unsigned long long)r->pieces);
    if (r->photos.photographs)
        fprintf(stderr, "%u photographs in %.1f s (%u could not be used); %.1f %% of the splats are on none\n",
                r->photos.photographs, r->photos.seconds, r->photos.refused, 100 * (double)r->photos.unseen / splats);
    if (r->photos.texture_size)
        print_textures(&r->photos, r->attribute_bits, splats);
    if (r->maps.stations)
        fprintf(stderr,
                "maps of %u station%s from %u picture%s (%u could not be used), up to %u texels a quarter turn: %.1f "
                "MB, %.2f bytes a texel, blocks at %.1f dB\n",
                r->maps.stations, r->maps.stations == 1 ? "" : "s", r->maps.pictures,
                r->maps.pictures == 1 ? "" : "s", r->maps.refused, r->maps.side,
                (double)r->maps.bytes / 1e6, (double)r->maps.bytes / (double)r->maps.texels, r->maps.block_psnr);
    if (r->maps.edits)
        fprintf(stderr, "colours of %u of these stations are those of --maps\n", r->maps.edited);
    if (drawing)
        print_drawing(drawing, &r->drawing);
    struct stat file;
    if (!stat(output, &file))
        fprintf(stderr, "%.2f MB in ", (double)file.st_size / 1e6);
    fprintf(stderr, "%.1f s, %.0f points/s\n", r->seconds, (double)r->points_read / r->seconds);
}

void spl_cmd_pack_say_trained(void *context, uint32_t epoch, double seconds, double psnr, double atoms_per_splat,
                        uint32_t atoms)
{
    (void)context;
    spl_cmd_progress_clear();
    fprintf(stderr, "training: epoch %u, %.0f s, %.2f dB, %.2f atoms a splat of %u\n", epoch, seconds, psnr,
            atoms_per_splat, atoms);
}

static void say(void *context, const char *what, const char *text)
{
    spl_cmd_progress_finish(context);
    fprintf(stderr, "splatd: %s: ", what);
    spl_cmd_put_text(stderr, text, 0);
    fputc('\n', stderr);
}

void spl_cmd_pack_say_warning(void *context, const char *text)
{
    say(context, "warning", text);
}

void spl_cmd_pack_say_note(void *context, const char *text)
{
    say(context, "note", text);
}

void spl_cmd_pack_name_refused(void *context, const struct spl_error *why)
{
    spl_cmd_progress_finish(context);
    fprintf(stderr, "splatd: left out: %s\n", why->message);
}

void spl_cmd_pack_say_left_out(void *context, const struct spl_error *why)
{
    struct spl_cmd_pack_listener *listener = context;
    spl_cmd_progress_finish(&listener->progress);
    fprintf(stderr, "splatd: left out: ");
    spl_cmd_put_text(stderr, why->message, 0);
    fputc('\n', stderr);
    char *copy = spl_array_reserve(listener->left_out, listener->capacity, listener->count + 1, NULL)
                     ? NULL
                     : strdup(why->message);
    if (copy)
        listener->left_out[listener->count++] = copy;
}

void spl_cmd_pack_finish_left_out(struct spl_cmd_pack_listener *listener, bool say)
{
    if (say && listener->count)
        fprintf(stderr, "%zu scans were left out:\n", listener->count);
    for (size_t i = 0; i < listener->count; i++) {
        if (say) {
            fprintf(stderr, "  ");
            spl_cmd_put_text(stderr, listener->left_out[i], 0);
            fputc('\n', stderr);
        }
        free(listener->left_out[i]);
    }
    free(listener->left_out);
}
