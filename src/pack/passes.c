/* The passes over a packed scan, in their order: photographs, then maps and pruning, which one rewriting does. What
 * they need is loaded before anything is packed, so that a wrong path is known before hours of work. The caller's
 * thread. */
#include "pack/passes.h"

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "dataset/dataset.h"
#include "dataset/rewrite.h"
#include "pack/prune.h"
#include "pack/texture/pass.h"
#include "pack/warn.h"

/* Two names of one file, which need not be there yet. */
static bool is_same(const char *a, const char *b)
{
    const char *const paths[2] = {a, b}, *names[2];
    struct stat files[2], folders[2];
    bool there[2];
    for (int i = 0; i < 2; i++) {
        char folder[4096];
        const char *slash = strrchr(paths[i], '/');
        names[i] = slash ? slash + 1 : paths[i];
        snprintf(folder, sizeof folder, "%.*s", slash ? (int)(slash + 1 - paths[i]) : 1, slash ? paths[i] : ".");
        there[i] = stat(paths[i], &files[i]) == 0;
        if (stat(folder, &folders[i]))
            return false;
    }
    if (there[0] && there[1])
        return files[0].st_dev == files[1].st_dev && files[0].st_ino == files[1].st_ino;
    return !strcmp(names[0], names[1]) && folders[0].st_dev == folders[1].st_dev &&
           folders[0].st_ino == folders[1].st_ino;
}

/* The file of textures replaces nothing that is read, nor the dataset. */
static int check_kept(const struct spl_pack_options *o, const struct spl_view_list *photographs, struct spl_error *err)
{
    const char *kept = o->photos->keep_textures;
    if (!kept)
        return SPL_OK;
    bool input = is_same(kept, o->photos->cameras);
    for (size_t i = 0; i < o->input_count && !input; i++)
        input = is_same(kept, o->inputs[i]);
    for (size_t i = 0; i < photographs->count && !input; i++)
        input = is_same(kept, photographs->views[i].photograph);
    if (!input && !(o->output && is_same(kept, o->output)))
        return SPL_OK;
    return spl_fail_field(err, SPL_E_USAGE, "keep-textures", "--keep-textures %s is an %s too; choose another name",
                          kept, input ? "input" : "output");
}

/* A dataset that the next pass reads, without its name, so that nothing of it is left when the process dies. */
static int open_part(const char *path, struct spl_dataset **dataset, struct spl_error *err)
{
    int rc = spl_dataset_open_whole(path, false, dataset, err);
    unlink(path);
    return rc;
}

/* Nobody asked for what was found beside the scan, but by saying what shall come of its maps. */
static bool is_asked_for(const struct spl_map_options *maps)
{
    return maps->export_to || maps->edits;
}

static void warn_of_none(const struct spl_pack_options *options, const struct spl_error *why)
{
    spl_pack_warn(options->warn, options->progress_context, "%s; so there are no maps", why->message);
}

int spl_passes_run(struct spl_passes *p, const char *part, const char *points, struct spl_error *err)
{
    const struct spl_pack_options *o = p->options;
    struct spl_dataset *dataset = NULL, *discs = NULL;
    bool more = o->maps || o->prune > 1;
    int rc = open_part(part, &dataset, err);
    if (!rc && points)
        rc = open_part(points, &discs, err);
    if (!rc && o->photos) {
        rc = spl_photos_apply(o->photos, &p->photographs, dataset, more ? part : o->output, p->stage, &p->photos, err);
        spl_dataset_close(dataset);
        dataset = NULL;
        if (!rc && more)
            rc = open_part(part, &dataset, err);
    }
    bool maps = o->maps;
    if (!rc && maps) {
        struct spl_error why = {0};
        rc = spl_maps_apply(o, &p->pictures, dataset, discs ? discs : dataset, p->stage, &p->maps, &why);
        if (rc == SPL_E_INPUT && o->maps->find && !is_asked_for(o->maps)) {
            warn_of_none(o, &why);
            p->maps = (struct spl_map_report){0};
            maps = false;
            rc = SPL_OK;
        } else if (rc)
            spl_fail_field(err, rc, why.field, "%s", why.message);
    }
    if (!rc && !maps && more)
        rc = o->prune > 1 ? spl_prune_apply(dataset, o->prune, o->output, NULL, p->stage, err)
                          : spl_dataset_rewrite(&(struct spl_rewrite){.from = dataset}, o->output, err);
    spl_dataset_close(dataset);
    spl_dataset_close(discs);
    return rc;
}

static void warn_of_picture(void *context, const struct spl_error *why)
{
    const struct spl_pack_options *options = context;
    if (options->warn)
        options->warn(options->progress_context, why->message);
}

int spl_passes_find_pictures(struct spl_passes *p, struct spl_pack_options *options, struct spl_error *err)
{
    struct spl_map_sources found;
    struct spl_error why = {0};
    int rc = spl_map_sources_find(options->inputs, options->input_count, &found, &why);
    p->with = *options->maps;
    if (!p->with.refused) {
        p->with.refused = warn_of_picture;
        p->with.context = options;
    }
    if (!rc && !found.count && (p->with.export_to || p->with.edits))
        rc = spl_fail_field(&why, SPL_E_USAGE, "panoramas",
                            "these scans bring no panoramas along, so there are no maps to be edited: name --panoramas "
                            "PATH, or scan");
    if (!rc && found.count)
        rc = spl_maps_load(&p->with, &found, &p->pictures, &p->maps, &why);
    options->maps = p->pictures.count ? &p->with : NULL;
    spl_map_sources_finish(&found);
    if (rc && rc != SPL_E_NOMEM && rc != SPL_E_USAGE && !is_asked_for(&p->with)) {
        warn_of_none(options, &why);
        return SPL_OK;
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

int spl_passes_load(struct spl_passes *p, struct spl_error *err)
{
    const struct spl_pack_options *options = p->options;
    int rc = SPL_OK;
    if (options->photos && !(rc = spl_photos_load(options->photos, &p->photographs, &p->photos, err)))
        rc = check_kept(options, &p->photographs, err);
    if (!rc && options->maps && !p->pictures.count)
        rc = spl_maps_load(options->maps, &(struct spl_map_sources){0}, &p->pictures, &p->maps, err);
    return rc;
}

void spl_passes_finish(struct spl_passes *p)
{
    spl_view_list_finish(&p->photographs);
    spl_view_list_finish(&p->pictures);
}
