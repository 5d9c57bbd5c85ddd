/* The sample cameras of a scene as the JSON that renders, benchmarks and exact images are asked for with. Numbers are
 * printed so that they read back as the same doubles, with as few digits as that takes. Any thread. */
#include "synth/synth.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/decimal.h"
#include "synth/scene.h"

static void print_number(FILE *out, double value)
{
    char text[SPL_DECIMAL_MAX];
    fputs(spl_decimal_print(value, text), out);
}

static void print_vector(FILE *out, const char *key, const double value[3])
{
    fprintf(out, "\"%s\": [", key);
    for (int i = 0; i < 3; i++) {
        fputs(i ? ", " : "", out);
        print_number(out, value[i]);
    }
    fputs("], ", out);
}

int spl_synth_print_views(const char *name, uint32_t width, uint32_t height, char **json, struct spl_error *err)
{
    struct spl_scene *scene = NULL;
    char *text = NULL;
    size_t bytes;
    if (!width || !height)
        return spl_fail_field(err, SPL_E_USAGE, "size", "views of %u x %u pixels; both must be at least 1", width,
                              height);
    int result = spl_scene_create(name, &scene, err);
    if (result)
        return result;
    FILE *out = open_memstream(&text, &bytes);
    if (!out) {
        result = spl_fail(err, SPL_E_NOMEM, "out of memory for the views of %s", name);
        goto done;
    }
    fputs("{\"views\": [", out);
    for (size_t i = 0; i < scene->camera_count; i++) {
        const struct spl_named_camera *c = &scene->cameras[i];
        double eye[3], target[3];
        for (int a = 0; a < 3; a++) {
            eye[a] = c->eye[a] + scene->offset[a];
            target[a] = c->target[a] + scene->offset[a];
        }
        fprintf(out, "%s\n  {\"name\": \"%s\", \"width\": %u, \"height\": %u, \"camera\": {", i ? "," : "", c->name,
                width, height);
        print_vector(out, "eye", eye);
        print_vector(out, "target", target);
        fputs("\"fov\": ", out);
        print_number(out, c->fov);
        fputs("}}", out);
    }
    fputs("\n]}\n", out);
    int failed = ferror(out);
    if (fclose(out) || failed)
        result = spl_fail(err, SPL_E_NOMEM, "out of memory for the views of %s", name);
done:
    if (result)
        free(text);
    else
        *json = text;
    spl_scene_destroy(scene);
    return result;
}
