/* Opening a packed dataset from wherever its bytes come (source.h): what describes it is read into memory and checked
 * from the outside in (sections.c, meta.c, structure.c, maps.c, textures.c) before anyone else sees it. After that
 * nothing changes, so every accessor runs on any thread. What is trusted without a look is only the pages' codes, and
 * any code decodes to finite numbers. */
#include "dataset/dataset.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/memory.h"
#include "base/sized.h"
#include "dataset/open.h"
#include "dataset/remote.h"
#include "dataset/tiles.h"
#include "geom/fit.h"

static const uint64_t patience_ns = 10 * SPL_NS_PER_S;

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "the file is read as it lies, which is little-endian");

/* The id is the file's name without folder and extension; it becomes part of URLs, so it is kept plain. */
static int set_id(struct spl_dataset *dataset, struct spl_error *err)
{
    size_t length;
    const char *stem = spl_remote_get_stem(dataset->name, &length);
    if (length == 0 || length >= sizeof dataset->info.id || stem[0] == '.' || strspn(stem, SPL_NAME_LETTERS) < length)
        return spl_fail(err, SPL_E_INPUT,
                        "%s: '%.*s' cannot be a dataset's id; rename the file to at most %zu letters, digits, '.', '_' "
                        "and '-', the first of them not a '.'",
                        dataset->name, (int)length, stem, sizeof dataset->info.id - 1);
    memcpy(dataset->info.id, stem, length);
    return SPL_OK;
}

static int check_path(const char *path, struct spl_error *err)
{
    return path ? SPL_OK
                : spl_fail_field(err, SPL_E_USAGE, "path", "a dataset needs a path, or with a reader a name");
}

int spl_dataset_open(const char *path, bool verify, struct spl_dataset **out, struct spl_error *err)
{
    *out = NULL;
    int rc = check_path(path, err);
    return rc ? rc : spl_dataset_open_until(path, verify, NULL, out, err);
}

int spl_dataset_open_with(const char *path, const struct spl_open_options *options, struct spl_dataset **out,
                          struct spl_error *err)
{
    struct spl_open_options known = {0};
    *out = NULL;
    int rc = check_path(path, err);
    if (rc)
        return rc;
    rc = spl_sized_read(options, &known, sizeof known, "spl_open_options", err);
    if (rc)
        return rc;
    const struct spl_dataset_opening how = {.verify = known.verify,
                                            .tables_bytes = known.tables_bytes ? known.tables_bytes : SPL_TABLES_BYTES,
                                            .cancelled = spl_cancel_get_flag(known.cancel)};
    if (!known.reader)
        return spl_dataset_open_as(path, &how, out, err);
    struct spl_reader reader = {0};
    if ((rc = spl_sized_read(known.reader, &reader, sizeof reader, "spl_reader", err)))
        return rc;
    if (!reader.read)
        return spl_fail_field(err, SPL_E_USAGE, "read", "struct spl_reader of %s has no read function", path);
    const struct spl_dataset_source source = {
        .size = reader.bytes, .read = reader.read, .close = reader.close, .context = reader.context};
    return spl_dataset_open_source_as(&source, path, &how, out, err);
}

/* What describes a dataset may have been spoilt on its way, or been so before it was kept: then it is asked for
 * anew. */
static int open_remote(const char *url, const struct spl_dataset_opening *how, struct spl_dataset **out,
                       struct spl_error *err)
{
    char shown[1024];
    struct spl_dataset_source source;
    struct spl_error why = {0};
    const struct spl_remote_how remote = {how->page_cache, how->remote_deadline_ms, how->cancelled, how->moved_ns,
                                          how->expected ? &how->expected->version : NULL, how->landed};
    int rc = spl_remote_open(url, &remote, &source, &why);
    if (rc)
        return spl_fail(err, rc, "%s", why.message);
    spl_remote_show(url, shown, sizeof shown);
    rc = spl_dataset_open_source_as(&source, shown, how, out, &why);
    if (rc && source.far->was_remembered(source.context)) { // its state is asked for
        source.far->remember(source.context, false);
        spl_dataset_source_close(&source);
        why = (struct spl_error){0};
        how->expected->differs = NULL;
        rc = spl_remote_open(url, &remote, &source, &why);
        if (rc)
            return spl_fail(err, rc, "%s", why.message);
        rc = spl_dataset_open_source_as(&source, shown, how, out, &why);
    }
    const bool differs = how->expected && how->expected->differs; // as its header says, which holds
    if ((rc == SPL_E_CORRUPT || rc == SPL_E_INPUT || rc == SPL_E_UNSUPPORTED) && !differs &&
        !source.far->has_changed(source.context)) {
        why = (struct spl_error){0};
        source.far->forget(source.context, 0, source.size);
        rc = spl_dataset_open_source_as(&source, shown, how, out, &why);
    }
    source.far->remember(source.context, !rc);
    if (rc)
        spl_dataset_source_close(&source);
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

int spl_dataset_open_as(const char *path, const struct spl_dataset_opening *how, struct spl_dataset **out,
                        struct spl_error *err)
{
    struct spl_dataset_source source;
    struct spl_dataset_opening here = *how;
    *out = NULL;
    here.beside = path;
    if (spl_remote_is_url(path))
        return open_remote(path, &here, out, err);
    int rc = spl_dataset_source_open_file(path, &source, err);
    if (!rc && (rc = spl_dataset_open_source_as(&source, path, &here, out, err)))
        spl_dataset_source_close(&source);
    return rc;
}

int spl_dataset_open_until(const char *path, bool verify, const atomic_bool *cancelled, struct spl_dataset **out,
                           struct spl_error *err)
{
    const struct spl_dataset_opening how = {.verify = verify, .tables_bytes = SPL_TABLES_BYTES, .cancelled = cancelled};
    return spl_dataset_open_as(path, &how, out, err);
}

int spl_dataset_open_whole(const char *path, bool verify, struct spl_dataset **out, struct spl_error *err)
{
    char shown[300];
    *out = NULL;
    if (spl_remote_is_url(path))
        return spl_fail(err, SPL_E_USAGE,
                        "%s: this goes through all of a dataset, and needs it in a file: fetch it first",
                        spl_remote_show(path, shown, sizeof shown));
    const struct spl_dataset_opening how = {.verify = verify, .verify_all = true, .tables_bytes = UINT64_MAX};
    return spl_dataset_open_as(path, &how, out, err);
}

int spl_dataset_open_source(const struct spl_dataset_source *source, const char *name, bool verify,
                            const atomic_bool *cancelled, struct spl_dataset **out, struct spl_error *err)
{
    const struct spl_dataset_opening how = {.verify = verify, .tables_bytes = SPL_TABLES_BYTES, .cancelled = cancelled};
    return spl_dataset_open_source_as(source, name, &how, out, err);
}

int spl_dataset_open_source_as(const struct spl_dataset_source *source, const char *name,
                               const struct spl_dataset_opening *how, struct spl_dataset **out, struct spl_error *err)
{
    *out = NULL;
    if (source->size > INT64_MAX / 2) /* so that no sum of sizes wraps */
        return spl_fail(err, SPL_E_LIMIT, "%s: %llu bytes are more than a dataset can have", name,
                        (unsigned long long)source->size);
    struct spl_dataset *dataset = spl_alloc(1, sizeof *dataset, err);
    if (!dataset)
        return SPL_E_NOMEM;
    int rc = SPL_E_NOMEM;
    atomic_init(&dataset->references, 1);
    dataset->cancelled = how->cancelled;
    dataset->source = *source;
    dataset->remote = source->far;
    dataset->lazily = !(how->verify && how->verify_all) &&
                      (source->far || (how->verify && source->size > SPL_VERIFY_AT_OPEN_MAX));
    dataset->tables_limit = how->tables_bytes;
    dataset->how = how;
    dataset->info.file_bytes = source->size;
    dataset->name = spl_alloc_raw(strlen(name) + 1, 1, err);
    if (!dataset->name)
        goto done;
    strcpy(dataset->name, name);
    rc = spl_dataset_read_sections(dataset, how->verify, err);
    if (!rc)
        rc = spl_dataset_check_sections(dataset, err);
    if (!rc)
        rc = set_id(dataset, err);
done:
    if (how->kind)
        *how->kind = dataset->kind;
    if (rc) {
        dataset->source = (struct spl_dataset_source){0}; /* stays the caller's */
        spl_dataset_close(dataset);
    } else {
        dataset->opened = true;
        dataset->how = NULL;
        *out = dataset;
    }
    return rc;
}

void spl_dataset_hold(const struct spl_dataset *dataset)
{
    unsigned before = atomic_fetch_add(&((struct spl_dataset *)dataset)->references, 1);
    spl_assert(before > 0);
}

static void destroy(struct spl_dataset *dataset)
{
    spl_tiles_destroy(dataset->tiles);
    spl_dataset_source_close(&dataset->source);
    json_decref(dataset->meta);
    free(dataset->stations);
    for (uint32_t i = 0; dataset->copies && i < dataset->section_count; i++)
        free(dataset->copies[i]);
    free(dataset->copies);
    free(dataset->found_all);
    free(dataset->tables);
    free(dataset->whole.nodes);
    free(dataset->whole.chunks);
    free(dataset->whole.textures);
    free(dataset->whole.stations);
    for (uint32_t s = 0; s < SPL_STREAMS_MAX; s++) {
        free(dataset->whole.base[s]);
        free(dataset->whole.width[s]);
    }
    spl_dictionary_finish(&dataset->dictionary);
    free(dataset->sections);
    free(dataset->name);
    free(dataset);
}

void spl_dataset_strip(struct spl_dataset *dataset)
{
    const struct spl_section_list *meta = &dataset->found[SPL_KIND_META];
    for (uint32_t i = 0; i < meta->count; i++) {
        free(dataset->copies[meta->at[i] - dataset->sections]);
        dataset->copies[meta->at[i] - dataset->sections] = NULL;
    }
    free(dataset->stations);
    json_decref(dataset->meta);
    dataset->stations = NULL;
    dataset->meta = NULL;
    dataset->info.title = dataset->info.description = dataset->info.crs = NULL; // were its texts
}

void spl_dataset_let_go(const struct spl_dataset *dataset)
{
    struct spl_dataset *mine = (struct spl_dataset *)dataset;
    if (atomic_fetch_sub(&mine->references, 1) == 1)
        destroy(mine);
}

void spl_dataset_close(struct spl_dataset *dataset)
{
    if (!dataset)
        return;
    uint64_t deadline_ns = spl_now_ns() + patience_ns;
    while (!dataset->source.owned && atomic_load(&dataset->references) > 1 && spl_remaining_ns(deadline_ns))
        usleep(1000); // what a caller lends is read no more when this returns
    spl_dataset_let_go(dataset);
}

const struct spl_dataset_info *spl_dataset_get_info(const struct spl_dataset *dataset)
{
    return &dataset->info;
}

bool spl_dataset_keeps_all(const struct spl_dataset *dataset)
{
    return dataset->whole.nodes && !dataset->tiles;
}

const struct spl_node *spl_dataset_get_nodes(const struct spl_dataset *dataset, uint64_t *count)
{
    spl_assert(spl_dataset_keeps_all(dataset));
    *count = dataset->info.nodes;
    return dataset->whole.nodes;
}

const struct spl_chunk *spl_dataset_get_chunks(const struct spl_dataset *dataset, uint64_t *count)
{
    spl_assert(spl_dataset_keeps_all(dataset));
    *count = dataset->info.chunks;
    return dataset->whole.chunks;
}

const json_t *spl_dataset_get_meta(const struct spl_dataset *dataset)
{
    return dataset->meta;
}

const char *spl_dataset_get_name(const struct spl_dataset *dataset)
{
    return dataset->info.id[0] ? dataset->info.id : dataset->name;
}

bool spl_dataset_is_remote(const struct spl_dataset *dataset)
{
    return dataset->remote;
}

uint64_t spl_dataset_get_moved_ns(const struct spl_dataset *dataset, uint32_t part)
{
    if (part)
        return atomic_load(&dataset->tiles->list[part - 1].moved_ns);
    return dataset->remote ? dataset->source.far->get_moved_ns(dataset->source.context) : 0;
}

bool spl_dataset_has_changed(const struct spl_dataset *dataset)
{
    return dataset->remote && dataset->source.far->has_changed(dataset->source.context);
}

int spl_dataset_get_default_camera(const struct spl_dataset *dataset, uint32_t width, uint32_t height,
                                   struct spl_camera *camera, struct spl_error *err)
{
    const struct spl_dataset_info *info = &dataset->info;
    double fov = info->default_fit[0] > 0 && width && height ? spl_fit_fov(info->default_fit, width, height)
                                                             : info->default_fov;
    int rc = spl_camera_set_fov(camera, fov, width, height, err);
    if (!rc)
        rc = spl_camera_look_at(camera, info->default_eye, info->default_target, info->default_up, err);
    camera->near = info->splat_radius; /* depths are floats, as exact however small it is */
    camera->far = INFINITY;
    return rc;
}

const char *spl_attribute_name(enum spl_attribute attribute)
{
    static const char *const names[SPL_ATTRIBUTE_COUNT] = {
        [SPL_ATTRIBUTE_POSITION] = "position", [SPL_ATTRIBUTE_RADIUS] = "radius",
        [SPL_ATTRIBUTE_NORMAL] = "normal",     [SPL_ATTRIBUTE_COLOR] = "color",
        [SPL_ATTRIBUTE_LINEAR] = "linear",     [SPL_ATTRIBUTE_CLIP] = "clip",
        [SPL_ATTRIBUTE_LINES] = "lines",       [SPL_ATTRIBUTE_PANELS] = "panels",
        [SPL_ATTRIBUTE_MESHES] = "meshes",     [SPL_ATTRIBUTE_CHUNK] = "chunk",
        [SPL_ATTRIBUTE_TEXTURE] = "texture",   [SPL_ATTRIBUTE_DICTIONARY] = "dictionary",
    };
    return (unsigned)attribute < SPL_ATTRIBUTE_COUNT ? names[attribute] : "unknown";
}
