/* COLMAP's text model: cameras.txt (CAMERA_ID MODEL WIDTH HEIGHT PARAMS…) and images.txt (two lines an image: IMAGE_ID
 * QW QX QY QZ TX TY TZ CAMERA_ID NAME, then its points as triples, which may be none).
 *
 * Numbers go through the same values as those of JSON, so that both mean the same. What is wrong is named with file,
 * line and field. Any thread; no state. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/memory.h"
#include "cloud/source.h"
#include "cloud/view_list.h"

enum { text_max = 1024, cameras_max = 65536 };

struct colmap_camera {
    unsigned long id;
    struct spl_value width, height, model, params;
};

struct model {
    struct colmap_camera *cameras;
    size_t count;
};

/* The next line that says something, as a string in `text`; 0 at the end. */
static int next_line(struct spl_source *source, char text[text_max], struct spl_error *err)
{
    const char *line;
    size_t length, blank;
    int got;
    while ((got = spl_source_line(source, &line, &length, err)) > 0) {
        for (blank = 0; blank < length && (line[blank] == ' ' || line[blank] == '\t'); blank++)
            ;
        if (blank == length || line[blank] == '#')
            continue;
        if (length - blank >= text_max || memchr(line, 0, length))
            return spl_source_fail_line(source, source->line, "", err, "no line of a COLMAP model: %s",
                                        length - blank >= text_max ? "too long" : "it holds a NUL byte");
        memcpy(text, line + blank, length - blank);
        text[length - blank] = 0;
        return 1;
    }
    return got;
}

static int read_number(const struct spl_source *source, char **words, const char *field, double *out,
                       struct spl_error *err)
{
    char *word = strtok_r(NULL, " \t", words), *end = word;
    /* strtod alone would also take hex floats, "nan" and "infinity" */
    if (word && strspn(word, "0123456789+-.eE") == strlen(word))
        *out = strtod(word, &end);
    if (!word || end == word || *end)
        return spl_source_fail_line(source, source->line, field, err, "'%.32s' is no number", word ? word : "");
    return SPL_OK;
}

static int read_numbers(const struct spl_source *source, char **words, const char *field, unsigned count,
                        struct spl_value *value, struct spl_error *err)
{
    int rc = SPL_OK;
    for (value->given = true; !rc && value->count < count; value->count++)
        rc = read_number(source, words, field, &value->n[value->count], err);
    return rc;
}

static int read_id(const struct spl_source *source, const char *word, const char *field, unsigned long *id,
                   struct spl_error *err)
{
    char *end = NULL;
    if (word && word[0] >= '0' && word[0] <= '9')
        *id = strtoul(word, &end, 10);
    return end && !*end
               ? SPL_OK
               : spl_source_fail_line(source, source->line, field, err, "'%.32s' is no whole number", word ? word : "");
}

/* The same fault, with its place in front. */
static int fail_here(const struct spl_source *source, int rc, const struct spl_error *why, struct spl_error *err)
{
    return rc == SPL_E_INPUT ? spl_source_fail_line(source, source->line, why->field, err, "%s", why->message)
                             : spl_fail_field(err, rc, why->field, "%s", why->message);
}

static int read_camera(struct model *model, const struct spl_source *source, char *text, struct spl_error *err)
{
    char *words = NULL;
    struct colmap_camera camera = {0};
    struct spl_error why = {0};
    int rc = read_id(source, strtok_r(text, " \t", &words), "CAMERA_ID", &camera.id, err);
    const char *name = rc ? NULL : strtok_r(NULL, " \t", &words);
    if (rc)
        return rc;
    if ((rc = spl_value_from_choice(&camera.model, SPL_KIND_MODEL, "MODEL", name ? name : "", &why)))
        return fail_here(source, rc, &why, err);
    camera.model.given = true;
    if ((rc = read_numbers(source, &words, "WIDTH", 1, &camera.width, err)) ||
        (rc = read_numbers(source, &words, "HEIGHT", 1, &camera.height, err)))
        return rc;
    if ((rc = spl_value_check(&camera.width, SPL_KIND_COUNT, "WIDTH", &why)) ||
        (rc = spl_value_check(&camera.height, SPL_KIND_COUNT, "HEIGHT", &why)))
        return fail_here(source, rc, &why, err);
    while (*(words += strspn(words, " \t")) && camera.params.count < SPL_VALUE_NUMBERS)
        if ((rc = read_numbers(source, &words, "PARAMS", camera.params.count + 1, &camera.params, err)))
            return rc;
    if (*words)
        return spl_source_fail_line(source, source->line, "PARAMS", err, "more than %d numbers", SPL_VALUE_NUMBERS);
    camera.params.given = true;
    for (size_t i = 0; i < model->count; i++)
        if (model->cameras[i].id == camera.id)
            return spl_source_fail_line(source, source->line, "CAMERA_ID", err, "camera %lu is there twice", camera.id);
    if (model->count == cameras_max)
        return spl_source_fail(source, SPL_E_LIMIT, "", err, "more than %d cameras", cameras_max);
    struct colmap_camera *grown = spl_realloc(model->cameras, model->count + 1, sizeof *grown, err);
    if (!grown)
        return SPL_E_NOMEM;
    model->cameras = grown;
    model->cameras[model->count++] = camera;
    return SPL_OK;
}

/* Skips the line of points, which may be empty. An image's line has 10 words or more: taking it for points shows. */
static int skip_points(struct spl_source *source, struct spl_error *err)
{
    const char *line;
    size_t length, words = 0;
    int got = spl_source_line(source, &line, &length, err);
    if (got <= 0)
        return got;
    for (size_t i = 0; i < length; i++)
        words += line[i] != ' ' && line[i] != '\t' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t');
    return words % 3
               ? spl_source_fail_line(source, source->line, "POINTS2D", err,
                                      "%zu words are no triples; an image without points has an empty line here", words)
               : SPL_OK;
}

static char *find_photograph(const char *folder, const char *name, struct spl_error *err)
{
    static const char *const places[] = {"images", "../images", "../../images", "images"};
    char *path = NULL;
    for (int i = 0; i < 4; i++) {
        free(path);
        path = spl_view_list_print(err, "%s/%s/%s", folder, places[i], name);
        if (!path || !access(path, F_OK))
            break;
    }
    return path;
}

static int add_image(struct spl_view_list *list, const struct model *model, const char *folder,
                     const struct spl_source *source, char *text, struct spl_error *err)
{
    char *words = NULL, *name, *photograph = NULL;
    unsigned long id = 0;
    struct spl_value values[SPL_CAMERA_PARAMS] = {0};
    struct spl_camera camera;
    struct spl_error why = {0};
    int rc = read_id(source, strtok_r(text, " \t", &words), "IMAGE_ID", &id, err);
    if (rc || (rc = read_numbers(source, &words, "QUATERNION", 4, &values[SPL_CAMERA_q], err)) ||
        (rc = read_numbers(source, &words, "TRANSLATION", 3, &values[SPL_CAMERA_t], err)) ||
        (rc = read_id(source, strtok_r(NULL, " \t", &words), "CAMERA_ID", &id, err)))
        return rc;
    const struct colmap_camera *found = NULL;
    for (size_t i = 0; i < model->count && !found; i++)
        found = model->cameras[i].id == id ? &model->cameras[i] : NULL;
    if (!found)
        return spl_source_fail_line(source, source->line, "CAMERA_ID", err, "cameras.txt has no camera %lu", id);
    name = words + strspn(words, " \t");
    for (size_t length = strlen(name); length && strchr(" \t", name[length - 1]); length--)
        name[length - 1] = 0;
    if (!*name)
        return spl_source_fail_line(source, source->line, "NAME", err, "the image has no name");
    values[SPL_CAMERA_width] = found->width;
    values[SPL_CAMERA_height] = found->height;
    values[SPL_CAMERA_model] = found->model;
    values[SPL_CAMERA_params] = found->params;
    if ((rc = spl_value_check(&values[SPL_CAMERA_q], SPL_KIND_QUATERNION, "q", &why)) ||
        (rc = spl_value_check(&values[SPL_CAMERA_t], SPL_KIND_VECTOR, "t", &why)) ||
        (rc = spl_camera_from_values(values, NULL, &spl_view_list_limits, &camera, &why)))
        return fail_here(source, rc, &why, err);
    if (folder && !(photograph = find_photograph(folder, name, err)))
        return SPL_E_NOMEM;
    char *dot = strrchr(name, '.'), *slash = strrchr(name, '/');
    if (dot && dot > (slash ? slash + 1 : name))
        *dot = 0;
    for (char *c = name; *c; c++)
        *c = *c == '/' ? '_' : *c;
    rc = spl_view_list_add(list, source->path, name, &camera, photograph, err);
    free(photograph);
    return rc;
}

static int open_part(struct spl_source *source, const char *folder, const char *name, struct spl_error *err)
{
    char *path = spl_view_list_print(err, "%s/%s", folder, name);
    int rc = path ? spl_source_open(source, path, err) : SPL_E_NOMEM;
    free(path);
    return rc;
}

int spl_view_list_read_colmap(struct spl_view_list *list, struct spl_source *cameras, struct spl_source *images,
                              const char *folder, struct spl_error *err)
{
    struct model model = {0};
    char text[text_max];
    int rc;
    while ((rc = next_line(cameras, text, err)) > 0 && !(rc = read_camera(&model, cameras, text, err)))
        ;
    while (!rc && (rc = next_line(images, text, err)) > 0) {
        rc = add_image(list, &model, folder, images, text, err);
        rc = rc ? rc : skip_points(images, err);
    }
    free(model.cameras);
    return rc;
}

int spl_view_list_load_colmap(struct spl_view_list *list, const char *folder, struct spl_error *err)
{
    struct spl_source cameras, images;
    int rc = open_part(&cameras, folder, "cameras.txt", err);
    if (rc)
        return rc;
    if (!(rc = open_part(&images, folder, "images.txt", err))) {
        rc = spl_view_list_read_colmap(list, &cameras, &images, folder, err);
        spl_source_close(&images);
    }
    spl_source_close(&cameras);
    return rc;
}
