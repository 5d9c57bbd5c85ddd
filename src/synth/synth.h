/* Analytic scenes and the scanners that sample them: exact truth for tests, and the sample scan of the quickstart. */
#ifndef SPL_SYNTH_SYNTH_H
#define SPL_SYNTH_SYNTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <splatd/error.h>
#include <splatd/pack.h>

struct spl_synth_options {
    const char *scene;        /* a name of spl_synth_scene_name() */
    const char *directory;    /* created when missing; SCENE.FORMAT is written there, temp file + rename */
    uint64_t points;          /* wanted returns over all passes, 10^3 .. 10^10; what comes is within 2 % */
    uint64_t seed;
    double noise;             /* range noise sigma, metres; negative = the scene's default */
    double mixed;             /* 0..1: share of the pulses on an edge whose range lies between both surfaces */
    double dropout;           /* 0..0.9: share of returns lost; more where it is dark, grazing or far */
    double misregister;       /* 0..10 metres by which each station's, head's or flight line's pose is off */
    const char *formats;      /* of "ptx,ply,las"; NULL = ptx,ply of scenes scanned from tripods, ply,las of others */
    bool classes;             /* each point's class is written (spl_scene_class()), and PTX, which has none, is not */
    const char *without, *only; /* as of spl_scene_create_part() */
    unsigned threads;         /* 0 = all cores; the files do not depend on it */
    void (*progress)(void *context, const struct spl_progress *progress);
    void *progress_context;
    void (*file)(void *context, const char *path); /* each file as it is complete; may be NULL */
    void *file_context;
};

/* Deterministic by scene, points, seed, noise and faults; streams, so memory does not grow with points. */
int spl_synth(const struct spl_synth_options *options, uint64_t *points_written, struct spl_error *err);

/* The i-th scene's name and one-line description, NULL past the end. */
const char *spl_synth_scene_name(size_t i);
const char *spl_synth_scene_help(size_t i);

/* The scene's sample cameras at that size, as the JSON of named views in world coordinates:
 * {"views": [{"name": ..., "width": ..., "height": ..., "camera": {"eye": ..., "target": ..., "fov": ...}}, ...]}.
 * *json is a text that the caller frees with free(). SPL_E_USAGE names "scene" or "size". */
int spl_synth_print_views(const char *scene, uint32_t width, uint32_t height, char **json, struct spl_error *err);

#endif
