/* A dataset's own coordinate system comes from a file that anybody may have made, and PROJ's texts can name files and
 * pipelines: only codes of EPSG and plain WKT get through here. A point must lie within reach of the dataset, so that
 * latitude before longitude is an error and no empty picture.
 *
 * Transforms are kept for all datasets together, since the tiles of a country have one coordinate system, and each
 * takes some 0.4 MiB; so is what PROJ refused, which it would refuse again. Invariant: they are used under the mutex,
 * made outside it, and at most `kept` live. Any thread. */
#include "service/place/places.h"

#include <ctype.h>
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/memory.h"
#include "geom/unit.h"
#include "service/place/transform.h"

enum { kept = 64, made_max = 4, wkt_bytes_max = 64 << 10 };
static const double reach_m = 1e6, degree_m = 111195; /* of a great circle */

struct slot {
    uint32_t crs;                    /* 0 = none */
    char *world;                     // owned; META's text
    struct spl_transform *transform; // owned; NULL = refused
    struct spl_error refusal;
    uint64_t used;
};

static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
static struct slot slots[kept]; // guarded by: mutex
static uint64_t uses;           // guarded by: mutex

struct spl_places {
    char *crs;                      // META's, "" where it has none
    uint32_t epsg;                  /* of it; 0 = WKT */
    const char *fault;              // why it cannot be used; NULL = it may
    double low[3], high[3], unit_m; /* 0 = not known */
    uint32_t missing;               // owned by: loop
};

/* "EPSG:2994" and what says its heights' system as well: "EPSG:2994+EPSG:5703", "EPSG:2994+5703"; 0 for other texts. */
static uint32_t read_epsg(const char *text)
{
    static const char digits[] = "0123456789";
    if (strncasecmp(text, "EPSG:", 5))
        return 0;
    size_t count = strspn(text += 5, digits);
    const char *rest = text + count;
    if (*rest == '+') {
        rest += 1 + (strncasecmp(rest + 1, "EPSG:", 5) ? 0 : 5);
        size_t vertical = strspn(rest, digits);
        rest = vertical ? rest + vertical : "bad";
    }
    return count && count <= 6 && !*rest ? (uint32_t)strtoul(text, NULL, 10) : 0;
}

/* What in a WKT makes PROJ read files or run a pipeline of the text's: an extension, a grid, a method whose name is a
 * text of PROJ's own ("PROJ utm zone=10", "PROJ defmodel model=FILE"; no other word of WKT ends so), a setting. */
static bool names_files(const char *wkt)
{
    static const char *const words[] = {"@", "EXTENSION", "PARAMETERFILE", "grids", "="};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        if (strcasestr(wkt, words[i]))
            return true;
    for (const char *at = wkt; (at = strcasestr(at, "PROJ")); at++)
        if (!isalpha((unsigned char)at[4]))
            return true;
    return false;
}

static const char *find_fault(const struct spl_places *places)
{
    if (!*places->crs)
        return "the dataset does not say where on earth it lies; pack it with --crs EPSG:N";
    if (places->epsg)
        return NULL;
    if (strlen(places->crs) > wkt_bytes_max || !isalpha((unsigned char)places->crs[0]) || !strchr(places->crs, '['))
        return "the dataset's coordinate system is neither EPSG:N nor WKT of at most 64 KiB; pack it with --crs EPSG:N";
    return names_files(places->crs)
               ? "the WKT of the dataset's coordinate system has extensions, grids or files; pack it with --crs EPSG:N"
               : NULL;
}

static int to_world(const struct spl_camera_places *hook, uint32_t crs, const char *name, const double in[3],
                    double out[3], struct spl_error *err);

void spl_places_hook_init(struct spl_places_hook *hook, struct spl_places *places, bool waits)
{
    *hook = (struct spl_places_hook){{to_world}, places, waits, 0};
}

int spl_places_create(const struct spl_dataset *dataset, struct spl_places **out, struct spl_error *err)
{
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    const char *crs = json_string_value(json_object_get(spl_dataset_get_meta(dataset), "crs"));
    struct spl_places *places = *out = spl_alloc(1, sizeof *places, err);
    if (!places)
        return SPL_E_NOMEM;
    size_t length = crs ? strlen(crs) : 0;
    if (!(places->crs = spl_alloc(length + 1, 1, err))) {
        free(places);
        *out = NULL;
        return SPL_E_NOMEM;
    }
    memcpy(places->crs, crs ? crs : "", length);
    places->epsg = read_epsg(places->crs);
    places->fault = find_fault(places);
    spl_unit_parse(info->unit, &places->unit_m); // else 0
    memcpy(places->low, info->bounds_min, sizeof places->low);
    memcpy(places->high, info->bounds_max, sizeof places->high);
    return 0;
}

void spl_places_destroy(struct spl_places *places)
{
    if (!places)
        return;
    free(places->crs);
    free(places);
}

/* With the mutex held; NULL: it is not there. */
static const struct slot *find(const struct spl_places *places, uint32_t crs)
{
    for (int i = 0; i < kept; i++)
        if (slots[i].crs == crs && !strcmp(slots[i].world, places->crs)) {
            slots[i].used = ++uses;
            return &slots[i];
        }
    return NULL;
}

/* What was refused, if it was. */
static int tell(struct spl_error *err, const struct spl_error *refusal)
{
    return refusal->code ? spl_fail_field(err, refusal->code, refusal->field, "%s", refusal->message) : 0;
}

/* Puts what is new in the place of the one that was not used for longest, and leaves what is to be freed in it. */
static void keep(const struct spl_places *places, struct slot *slot)
{
    pthread_mutex_lock(&mutex);
    if (!find(places, slot->crs)) {
        struct slot *oldest = slots;
        for (int i = 1; i < kept; i++)
            if (slots[i].used < oldest->used)
                oldest = &slots[i];
        struct slot old = *oldest;
        slot->used = ++uses;
        *oldest = *slot;
        *slot = old;
    }
    pthread_mutex_unlock(&mutex);
}

static void get_middle(const struct spl_places *places, double middle[2])
{
    for (int i = 0; i < 2; i++)
        middle[i] = (places->low[i] + places->high[i]) / 2;
}

int spl_places_prepare(struct spl_places *places, uint32_t crs, struct spl_error *err)
{
    struct slot slot = {.crs = crs};
    double middle[2], ignored[2];
    pthread_mutex_lock(&mutex);
    const struct slot *there = find(places, crs);
    int rc = there ? tell(err, &there->refusal) : 0;
    pthread_mutex_unlock(&mutex);
    if (there)
        return rc;
    if (spl_transform_is_built && places->fault)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "%s", places->fault);
    if (!(slot.world = strdup(places->crs)))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a coordinate system");
    rc = spl_transform_create(crs, places->epsg, places->crs, &slot.transform, &slot.refusal);
    if (!rc) {
        get_middle(places, middle);
        spl_transform_apply(slot.transform, false, middle,
                            ignored); // reads what grids there are, here and not on the loop
    }
    tell(err, &slot.refusal);
    if (rc != SPL_E_NOMEM)
        keep(places, &slot);
    spl_transform_destroy(slot.transform);
    free(slot.world);
    return rc;
}

/* Leaves the mutex held where it succeeds. `made` counts what was made; may be NULL. */
static int enter(struct spl_places *places, uint32_t crs, bool waits, unsigned *made, struct spl_transform **out,
                 struct spl_error *err)
{
    if (spl_transform_is_built && places->fault)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "%s", places->fault);
    for (;;) { // another thread may need other ones in between
        pthread_mutex_lock(&mutex);
        const struct slot *slot = find(places, crs);
        if (slot && (*out = slot->transform))
            return 0;
        int refused = slot ? tell(err, &slot->refusal) : 0;
        pthread_mutex_unlock(&mutex);
        if (refused)
            return refused;
        if (!waits) {
            places->missing = crs;
            return spl_fail_field(err, SPL_E_BUSY, "crs", "EPSG:%u is being looked up; come back later", crs);
        }
        if (made && ++*made > made_max)
            return spl_fail_field(err, SPL_E_INPUT, "crs", "a request may name %d new coordinate systems", made_max);
        int rc = spl_places_prepare(places, crs, err);
        if (rc)
            return rc;
    }
}

/* Metres a unit of the world, with a transform of it. */
static double get_world_m(const struct spl_places *places, const struct spl_transform *transform)
{
    double axes_m = spl_transform_get_world_m(transform);
    return places->unit_m > 0 ? places->unit_m : axes_m > 0 ? axes_m : 1;
}

/* Metres from the dataset's box, roughly. */
static double get_distance_m(const struct spl_places *places, const struct spl_transform *transform, const double at[3])
{
    double axes_m = spl_transform_get_world_m(transform), sum = 0;
    for (int i = 0; i < 3; i++) {
        double beyond = fmax(0, fmax(places->low[i] - at[i], at[i] - places->high[i]));
        beyond *= i == 2 ? get_world_m(places, transform) : axes_m > 0 ? axes_m : degree_m;
        sum += beyond * beyond;
    }
    return sqrt(sum);
}

static int to_world(const struct spl_camera_places *hook, uint32_t crs, const char *name, const double in[3],
                    double out[3], struct spl_error *err)
{
    // the one member that a parser changes is its own count
    struct spl_places_hook *own = (struct spl_places_hook *)(uintptr_t)hook;
    struct spl_places *places = own->places;
    struct spl_transform *transform;
    int rc = enter(places, crs, own->waits, &own->made, &transform, err);
    if (rc || !in) {
        if (!rc)
            pthread_mutex_unlock(&mutex);
        return rc;
    }
    double height_m = spl_transform_get_height_m(transform);
    double at[3] = {0, 0, in[2] * height_m / get_world_m(places, transform)};
    bool good = spl_transform_apply(transform, true, in, at);
    double distance_m = good ? get_distance_m(places, transform, at) : INFINITY;
    pthread_mutex_unlock(&mutex);
    if (distance_m <= reach_m) {
        memcpy(out, at, sizeof at);
        return 0;
    }
    char far[64] = "has no place in the dataset's coordinate system";
    if (isfinite(distance_m))
        snprintf(far, sizeof far, "lies %.0f km from the dataset", distance_m / 1000);
    return spl_fail_field(err, SPL_E_INPUT, name,
                          "%s %.10g,%.10g,%.10g of EPSG:%u %s; at most %.0f km are allowed, and longitude comes before "
                          "latitude, east before north",
                          name, in[0], in[1], in[2], crs, far, reach_m / 1000);
}

int spl_places_from_world(struct spl_places *places, uint32_t crs, bool waits, const double in[3], double out[3],
                          struct spl_error *err)
{
    struct spl_transform *transform;
    int rc = enter(places, crs, waits, NULL, &transform, err);
    if (rc)
        return rc;
    bool good = spl_transform_apply(transform, false, in, out);
    double distance_m = get_distance_m(places, transform, in);
    out[2] = in[2] * get_world_m(places, transform) / spl_transform_get_height_m(transform);
    pthread_mutex_unlock(&mutex);
    if (!(distance_m <= reach_m))
        return spl_fail_field(err, SPL_E_INPUT, "world",
                              "world %.10g,%.10g,%.10g lies %.0f km from the dataset; at most %.0f km are allowed",
                              in[0], in[1], in[2], distance_m / 1000, reach_m / 1000);
    if (good && isfinite(out[2]))
        return 0;
    return spl_fail_field(err, SPL_E_INPUT, "crs", "the world's %.10g,%.10g,%.10g has no place in EPSG:%u", in[0],
                          in[1], in[2], crs);
}

int spl_places_bounds(struct spl_places *places, uint32_t crs, double world[2][3], double out[2][3],
                      struct spl_error *err)
{
    struct spl_transform *transform;
    int rc = enter(places, crs, false, NULL, &transform, err);
    if (rc)
        return rc;
    double box[4];
    bool good =
        spl_transform_bounds(transform, (const double[]){world[0][0], world[0][1], world[1][0], world[1][1]}, box);
    double scale = get_world_m(places, transform) / spl_transform_get_height_m(transform);
    pthread_mutex_unlock(&mutex);
    if (!good)
        return spl_fail_field(err, SPL_E_INPUT, "crs", "the dataset's bounds have no place in EPSG:%u", crs);
    for (int i = 0; i < 2; i++) {
        out[i][0] = box[2 * i];
        out[i][1] = box[2 * i + 1];
        out[i][2] = world[i][2] * scale;
    }
    return 0;
}

double spl_places_get_accuracy(struct spl_places *places, uint32_t crs)
{
    struct spl_transform *transform;
    double middle[2], ignored[2], accuracy = -1;
    get_middle(places, middle);
    if (enter(places, crs, false, NULL, &transform, NULL))
        return accuracy;
    if (spl_transform_apply(transform, false, middle, ignored))
        accuracy = spl_transform_get_accuracy(transform);
    pthread_mutex_unlock(&mutex);
    return accuracy;
}

uint32_t spl_places_get_missing(const struct spl_places *places)
{
    return places->missing;
}

const char *spl_places_get_crs(const struct spl_places *places)
{
    return places->crs;
}
