/* COLMAP's text model: cameras.txt (CAMERA_ID MODEL WIDTH HEIGHT PARAMS…) and images.txt (two lines an image: IMAGE_ID
 * QW QX QY QZ TX TY TZ CAMERA_ID NAME, then its points as triples, which may be none).
 *
 * What is wrong is named with file, line and field. Any thread; no state. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/decimal.h"
#include "cloud/colmap_model.h"
#include "cloud/fields.h"

enum { text_max = 1024 };

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
    const char *word = strtok_r(NULL, " \t", words), *end = word ? spl_decimal_parse(word, out) : NULL;
    if (!end || *end)
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

static int read_id(const struct spl_source *source, const char *word, const char *field, uint64_t *id,
                   struct spl_error *err)
{
    const char *end = word ? spl_integer_parse(word, word + strlen(word), id) : NULL;
    return end && !*end
               ? SPL_OK
               : spl_source_fail_line(source, source->line, field, err, "'%.32s' is no whole number", word ? word : "");
}

/* The same fault, with its place in front. */
static int fail_here(const struct spl_source *source, int rc, const struct spl_error *why, struct spl_error *err)
{
    return rc == SPL_E_INPUT ? spl_source_fail_line(source, source->line, why->field, err, "%s", why->message)
                             : spl_source_fail(source, rc, why->field, err, "%s", why->message);
}

static int read_camera(struct spl_colmap *model, const struct spl_source *source, char *text, struct spl_error *err)
{
    char *words = NULL;
    struct spl_colmap_camera camera = {0};
    struct spl_error why = {0}, place = {0};
    int rc = read_id(source, strtok_r(text, " \t", &words), "CAMERA_ID", &camera.id, err);
    const char *name = rc ? NULL : strtok_r(NULL, " \t", &words);
    if (rc)
        return rc;
    if ((rc = spl_value_from_choice(&camera.model, SPL_KIND_MODEL, "MODEL", name ? name : "", &why))) {
        fail_here(source, rc, &why, &place);
        if ((rc = spl_view_list_refuse(model->photographs, rc, &place, err)))
            return rc;
        camera.refused = true;
    }
    if ((rc = read_numbers(source, &words, "WIDTH", 1, &camera.width, err)) ||
        (rc = read_numbers(source, &words, "HEIGHT", 1, &camera.height, err)))
        return rc;
    while (*(words += strspn(words, " \t")) && camera.params.count < SPL_VALUE_NUMBERS)
        if ((rc = read_numbers(source, &words, "PARAMS", camera.params.count + 1, &camera.params, err)))
            return rc;
    if (*words)
        return spl_source_fail_line(source, source->line, "PARAMS", err, "more than %d numbers", SPL_VALUE_NUMBERS);
    why = (struct spl_error){0};
    rc = spl_colmap_add_camera(model, &camera, &why);
    return rc ? fail_here(source, rc, &why, err) : SPL_OK;
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

static int read_image(struct spl_colmap *model, const struct spl_source *source, char *text, struct spl_error *err)
{
    char *words = NULL, *name;
    struct spl_colmap_image image = {0};
    struct spl_error why = {0}, place = {0};
    int rc = read_id(source, strtok_r(text, " \t", &words), "IMAGE_ID", &image.camera, err);
    if (rc || (rc = read_numbers(source, &words, "QUATERNION", 4, &image.q, err)) ||
        (rc = read_numbers(source, &words, "TRANSLATION", 3, &image.t, err)) ||
        (rc = read_id(source, strtok_r(NULL, " \t", &words), "CAMERA_ID", &image.camera, err)))
        return rc;
    name = words + strspn(words, " \t");
    for (size_t length = strlen(name); length && strchr(" \t", name[length - 1]); length--)
        name[length - 1] = 0;
    if (!*name)
        return spl_source_fail_line(source, source->line, "NAME", err, "the image has no name");
    image.name = name;
    if (!(rc = spl_colmap_add_image(model, source->path, &image, &why)))
        return SPL_OK;
    fail_here(source, rc, &why, &place);
    return spl_view_list_refuse(model->photographs, rc, &place, err);
}

static int open_part(struct spl_source *source, const char *folder, const char *name, struct spl_error *err)
{
    char *path = spl_view_list_print(err, "%s/%s", folder, name);
    int rc = path ? spl_source_open(source, path, err) : SPL_E_NOMEM;
    free(path);
    return rc;
}

int spl_view_list_read_colmap(struct spl_view_list *list, struct spl_source *cameras, struct spl_source *images,
                              const char *folder, const struct spl_photograph_options *photographs,
                              struct spl_error *err)
{
    struct spl_colmap model = {.list = list, .folder = folder, .photographs = photographs};
    char text[text_max];
    int rc;
    while ((rc = next_line(cameras, text, err)) > 0 && !(rc = read_camera(&model, cameras, text, err)))
        ;
    while (!rc && (rc = next_line(images, text, err)) > 0) {
        rc = read_image(&model, images, text, err);
        rc = rc ? rc : skip_points(images, err);
    }
    free(model.cameras);
    return rc;
}

int spl_view_list_load_colmap(struct spl_view_list *list, const char *folder,
                              const struct spl_photograph_options *photographs, struct spl_error *err)
{
    struct spl_source cameras, images;
    int rc = open_part(&cameras, folder, "cameras.txt", err);
    if (rc)
        return rc;
    if (!(rc = open_part(&images, folder, "images.txt", err))) {
        rc = spl_view_list_read_colmap(list, &cameras, &images, folder, photographs, err);
        spl_source_close(&images);
    }
    spl_source_close(&cameras);
    return rc;
}
