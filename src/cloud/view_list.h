/* Between the readers of view lists and the list itself. Inside src/cloud only. `photographs` NULL: views to be drawn,
 * which are pinholes. */
#ifndef SPL_CLOUD_VIEW_LIST_H
#define SPL_CLOUD_VIEW_LIST_H

#include "cloud/source.h"
#include "cloud/views.h"
#include "geom/camera_json.h"

/* The largest image that a view may have. */
extern const struct spl_camera_limits spl_view_list_limits;

/* Appends a view; copies `name` and `photograph` (may be NULL). Refuses a name that no file can carry, a name that is
 * taken, and more than SPL_VIEW_LIST_MAX views; errors start with `path`. */
int spl_view_list_add(struct spl_view_list *list, const char *path, const char *name, const struct spl_camera *camera,
                      const char *photograph, struct spl_error *err);

/* Appends the view of image file `name`, and is called after it: without the extension, '/' as '_'. `distortion` may be
 * NULL. `folder` NULL: no photograph is looked for. */
int spl_view_list_add_image(struct spl_view_list *list, const char *path, const char *name,
                            const struct spl_camera *camera, const struct spl_distortion *distortion,
                            const char *folder, const struct spl_photograph_options *photographs,
                            struct spl_error *err);

/* Where image file `name` of the model in `folder` lies, as views.h says; the caller frees it. NULL: SPL_E_NOMEM. */
char *spl_view_list_find(const char *folder, const char *name, const struct spl_photograph_options *photographs,
                         struct spl_error *err);

bool spl_view_list_is_file(const char *path);

/* The same of a path that a JSON at `path` names: beside it unless absolute, or in the images' folder. */
char *spl_view_list_find_beside(const char *path, const char *name, const struct spl_photograph_options *photographs,
                                struct spl_error *err);

/* spl_view_list_add() of a photograph that is, or is cut out of, `inner`, which is copied; NULL: of none. */
int spl_view_list_add_inner(struct spl_view_list *list, const char *path, const char *name,
                            const struct spl_camera *camera, const char *photograph,
                            const struct spl_inner_photograph *inner, struct spl_error *err);

/* A panorama's faces, as views NAME-front and so on; those that would show nothing of it are left out. `rotation` (to
 * the world, row-major) and `position` are the panorama's. */
struct spl_face_options {
    const char *path, *name, *photograph;
    const double *rotation, *position;
    const struct spl_inner_photograph *inner; /* its panorama's rotation is the face's, and set here */
    uint32_t panorama;                        /* as of struct spl_named_view */
    bool photographs;
};
int spl_view_list_add_faces(struct spl_view_list *list, const struct spl_face_options *options, struct spl_error *err);

/* What becomes of the fault `why` of one view: 0 when the caller of the list goes on without it, else rc. */
int spl_view_list_refuse(const struct spl_photograph_options *photographs, int rc, const struct spl_error *why,
                         struct spl_error *err);

/* `format` printed into memory that the caller frees; NULL and SPL_E_NOMEM on failure. */
char *spl_view_list_print(struct spl_error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* views_colmap.c: cameras.txt and images.txt from open sources, which stay the caller's. */
int spl_view_list_load_colmap(struct spl_view_list *list, const char *folder,
                              const struct spl_photograph_options *photographs, struct spl_error *err);
int spl_view_list_read_colmap(struct spl_view_list *list, struct spl_source *cameras, struct spl_source *images,
                              const char *folder, const struct spl_photograph_options *photographs,
                              struct spl_error *err);

/* views_colmap_bin.c */
int spl_view_list_load_colmap_bin(struct spl_view_list *list, const char *folder,
                                  const struct spl_photograph_options *photographs, struct spl_error *err);

/* views_json.c: ours, transforms.json, Open3D's. */
int spl_view_list_load_json(struct spl_view_list *list, const char *path,
                            const struct spl_photograph_options *photographs, struct spl_error *err);
int spl_view_list_read_transforms(struct spl_view_list *list, const char *path, const json_t *document,
                                  const struct spl_photograph_options *photographs, struct spl_error *err);
int spl_view_list_read_open3d(struct spl_view_list *list, const char *path, const json_t *document,
                              const struct spl_photograph_options *photographs, struct spl_error *err);

/* views_panoramas.c */
int spl_view_list_read_panoramas(struct spl_view_list *list, const char *path, const json_t *document,
                                 const struct spl_photograph_options *photographs, struct spl_error *err);

/* views_e57.c */
bool spl_view_list_is_e57(const char *path);
int spl_view_list_load_e57(struct spl_view_list *list, const char *path,
                           const struct spl_photograph_options *photographs, struct spl_error *err);
void spl_inner_photograph_destroy(struct spl_inner_photograph *inner);

/* views_poses.c */
int spl_view_list_load_poses(struct spl_view_list *list, const char *folder,
                             const struct spl_photograph_options *photographs, struct spl_error *err);

#endif
