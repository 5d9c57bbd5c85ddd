/* What an object is, by the words of its name, and scenes of which only some objects are there. Classes are those of
 * LAS (ASPRS, table 17), from 64 on, where a table is the user's, what rooms have. Pure; any thread. */
#include "synth/scene.h"

#include <stdlib.h>
#include <string.h>

#include "base/memory.h"

/* The first row decides whose words stand in the name, parted by '-', in that order. */
static const struct {
    const char *words;
    uint8_t class;
} classes[] = {
    {"ground-wire", 13}, {"wire", 14},       {"wires", 14},     {"conductors", 14}, {"droppers", 14}, {"pylon", 15},
    {"poles", 15},       {"cantilevers", 16}, {"insulators", 16}, {"leaves", 5},    {"branches", 5},  {"trunks", 5},
    {"hedge", 5},        {"ground", 2},      {"lawn", 2},       {"field", 2},       {"floor", 2},     {"ballast", 10},
    {"sleepers", 10},    {"rails", 10},      {"road", 11},      {"markings", 11},   {"bridge", 17},   {"facade", 6},
    {"windows", 6},      {"columns", 6},     {"architrave", 6}, {"barn", 6},        {"roof", 6},      {"walls", 6},
    {"wall", 6},         {"room", 6},        {"window", 6},     {"door", 6},        {"ceiling", 64},  {"table", 65},
    {"desk", 65},        {"chair", 65},      {"shelf", 65},     {"books", 65},      {"sofa", 65},     {"cabinet", 65},
    {"lamp", 65},        {"globe", 65},      {"bench", 65},
};

static bool has_words(const char *name, const char *words)
{
    const size_t length = strlen(words);
    for (const char *at = strstr(name, words); at; at = strstr(at + 1, words))
        if ((at == name || at[-1] == '-') && (!at[length] || at[length] == '-'))
            return true;
    return false;
}

uint8_t spl_scene_class(const char *object)
{
    for (size_t i = 0; i < sizeof classes / sizeof *classes; i++)
        if (has_words(object, classes[i].words))
            return classes[i].class;
    return 1;
}

/* Marks the objects that an item of a list means: all of a class ("class:5"), or the one of that name. */
static bool mark(const struct spl_scene *scene, const char *item, size_t length, bool *marks)
{
    static const char prefix[] = "class:";
    const size_t skip = sizeof prefix - 1;
    bool any = false, by_class = length > skip && !strncmp(item, prefix, skip);
    char *end = NULL;
    unsigned long class = by_class ? strtoul(item + skip, &end, 10) : 0;
    if (by_class && (end != item + length || item[skip] < '0' || item[skip] > '9'))
        return false;
    for (size_t i = 0; i < scene->object_count; i++) {
        const char *name = scene->objects[i];
        if (by_class ? spl_scene_class(name) == class : strlen(name) == length && !strncmp(name, item, length))
            any = marks[i] = true;
    }
    return any;
}

static int mark_list(const struct spl_scene *scene, const char *field, const char *list, bool *marks,
                     struct spl_error *err)
{
    for (const char *at = list; at;) {
        const size_t length = strcspn(at, ",");
        if (!mark(scene, at, length, marks)) {
            char names[400] = "";
            for (size_t i = 0; i < scene->object_count; i++)
                if (strlen(names) + strlen(scene->objects[i]) + 3 < sizeof names)
                    strcat(strcat(names, i ? ", " : ""), scene->objects[i]);
            return spl_fail_field(err, SPL_E_USAGE, field,
                                  "%s has no object '%.*s'; it has: %s; or class:5 and the like", scene->name,
                                  (int)length, at, names);
        }
        at = at[length] ? at + length + 1 : NULL;
    }
    return 0;
}

int spl_scene_keep(struct spl_scene *scene, const char *without, const char *only, struct spl_error *err)
{
    if (!without && !only)
        return 0;
    bool *out = spl_alloc(2 * scene->object_count + 1, sizeof *out, err);
    if (!out)
        return SPL_E_NOMEM;
    bool *in = out + scene->object_count;
    int result = without ? mark_list(scene, "without", without, out, err) : 0;
    if (!result && only)
        result = mark_list(scene, "only", only, in, err);
    size_t kept = 0;
    for (size_t i = 0; i < scene->primitive_count && !result; i++) {
        const uint32_t object = scene->primitives[i].object;
        if (!out[object] && (!only || in[object]))
            scene->primitives[kept++] = scene->primitives[i];
    }
    if (!result && !kept)
        result = spl_fail_field(err, SPL_E_USAGE, only ? "only" : "without", "nothing is left of %s", scene->name);
    else if (!result)
        scene->primitive_count = kept;
    free(out);
    return result;
}
