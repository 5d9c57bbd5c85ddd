/* H.264 in MP4, through FFmpeg's libraries where the build has them (-Dvideo=enabled). A video belongs to one thread.
 */
#ifndef SPL_IMAGE_VIDEO_H
#define SPL_IMAGE_VIDEO_H

#include <splatd/image.h>

#include "base/error.h"

struct spl_video;

/* Whether a video of this size can be made: SPL_E_UNSUPPORTED, field "video", where the build cannot (says with which
 * option it could); SPL_E_INPUT, field "width" or "height", for odd sides, which 4:2:0 does not have. Any thread. */
int spl_video_check(uint32_t width, uint32_t height, struct spl_error *err);

/* Begins the file `path`, which is replaced. The same pictures give the same bytes. `fps` > 0. Blocks on disk. */
int spl_video_create(const char *path, uint32_t width, uint32_t height, double fps, struct spl_video **out,
                     struct spl_error *err);

/* One picture, RGBA8 of the video's size; alpha is not looked at. Borrowed. */
int spl_video_add(struct spl_video *video, const struct spl_image *image, struct spl_error *err);

/* Writes what is left and the index, and syncs. The video must still be destroyed. */
int spl_video_finish(struct spl_video *video, struct spl_error *err);

/* NULL-safe. Without spl_video_finish() the file is incomplete. */
void spl_video_destroy(struct spl_video *video);

#endif
