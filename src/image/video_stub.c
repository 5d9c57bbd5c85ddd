/* Videos in a build without FFmpeg's libraries: every call says so. */
#include "image/video.h"

static int refuse(struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_UNSUPPORTED, "video",
                          "this build makes no videos; configure it with -Dvideo=enabled and libavcodec, libavformat "
                          "and libswscale");
}

int spl_video_check(uint32_t width, uint32_t height, struct spl_error *err)
{
    (void)width;
    (void)height;
    return refuse(err);
}

int spl_video_create(const char *path, uint32_t width, uint32_t height, double fps, struct spl_video **out,
                     struct spl_error *err)
{
    (void)path;
    (void)width;
    (void)height;
    (void)fps;
    *out = NULL;
    return refuse(err);
}

int spl_video_add(struct spl_video *video, const struct spl_image *image, struct spl_error *err)
{
    (void)video;
    (void)image;
    return refuse(err);
}

int spl_video_finish(struct spl_video *video, struct spl_error *err)
{
    (void)video;
    return refuse(err);
}

void spl_video_destroy(struct spl_video *video)
{
    (void)video;
}
