/* Analytic scenes and the scanners that sample them: exact truth for tests, and the sample scan of the quickstart. */
#ifndef SPLATD_SYNTH_H
#define SPLATD_SYNTH_H

#include <stddef.h>
#include <stdint.h>

#include <splatd/error.h>
#include <splatd/pack.h>

struct spl_synth_options {
    const char *scene;        /* a name of spl_synth_scene_name() */
    const char *directory;    /* created when missing; SCENE.ptx and SCENE.ply are written there, temp file + rename */
    uint64_t points;          /* wanted returns over all stations, 10^3 .. 10^10; what comes is within 2 % */
    uint64_t seed;
    double noise;             /* range noise sigma, metres; negative = the scene's default */
    const char *formats;      /* comma-separated "ptx,ply"; NULL = both */
    unsigned threads;         /* 0 = all cores; the files do not depend on it */
    void (*progress)(void *context, const struct spl_progress *progress);
    void *progress_context;
};

/* Deterministic by scene, points, seed and noise; streams, so memory does not grow with points. */
int spl_synth(const struct spl_synth_options *options, uint64_t *points_written, struct spl_error *err);

/* The i-th scene's name and one-line description, NULL past the end. */
const char *spl_synth_scene_name(size_t i);
const char *spl_synth_scene_help(size_t i);

/* The scene's sample cameras at that size, as the JSON of named views in world coordinates:
 * {"views": [{"name": ..., "width": ..., "height": ..., "camera": {"eye": ..., "target": ..., "fov": ...}}, ...]}.
 * *json is a text that the caller frees with free(). SPL_E_USAGE names "scene" or "size". */
int spl_synth_print_views(const char *scene, uint32_t width, uint32_t height, char **json, struct spl_error *err);

#endif
