/* Pictures to H.264 in an MP4 file: libswscale to YUV 4:2:0 (BT.709, limited range, and the file says so), libavcodec,
 * libavformat with the index in front, so that a browser starts before it has all of it.
 *
 * One encoder thread, x264's arithmetic that is the same on every processor, and no dates or versions in the file: the
 * same pictures give the same bytes. FFmpeg's errors are told in its own words. A video belongs to one thread. */
#include "image/video.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/memory.h"
#include "image/ffmpeg.h"

struct spl_video {
    const struct spl_ffmpeg *ff; /* its libraries' functions */
    char *path;
    AVFormatContext *file;
    AVCodecContext *codec;
    AVFrame *frame;
    AVPacket *packet;
    struct SwsContext *scaler;
    int64_t next;
    bool begun; /* the header is written */
};

static int fail_av(struct spl_error *err, const struct spl_video *video, int code, const char *what)
{
    char text[AV_ERROR_MAX_STRING_SIZE] = "";
    int reason = AVERROR(code);
    if (reason == ENOSPC || reason == EDQUOT || reason == EFBIG)
        return spl_fail_errno(err, reason, "%s: cannot be written", video->path);
    video->ff->av_strerror(code, text, sizeof text);
    return spl_fail(err, code == AVERROR(ENOMEM) ? SPL_E_NOMEM : SPL_E_IO, "%s: %s: %s", video->path, what, text);
}

int spl_video_check(uint32_t width, uint32_t height, struct spl_error *err)
{
    const struct spl_ffmpeg *ff = spl_ffmpeg_open(err);
    if (!ff)
        return SPL_E_UNSUPPORTED;
    if (!ff->avcodec_find_encoder(AV_CODEC_ID_H264))
        return spl_fail_field(err, SPL_E_UNSUPPORTED, "video", "this machine's libavcodec has no H.264 encoder");
    if (width % 2 || height % 2)
        return spl_fail_field(err, SPL_E_INPUT, width % 2 ? "width" : "height",
                              "H.264 needs even sides; %u x %u are not", width, height);
    return 0;
}

static int open_codec(struct spl_video *video, uint32_t width, uint32_t height, double fps, struct spl_error *err)
{
    const AVCodec *encoder = video->ff->avcodec_find_encoder(AV_CODEC_ID_H264);
    AVCodecContext *codec = video->codec = video->ff->avcodec_alloc_context3(encoder);
    if (!codec)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the encoder");
    codec->width = (int)width;
    codec->height = (int)height;
    codec->pix_fmt = AV_PIX_FMT_YUV420P;
    codec->framerate = video->ff->av_d2q(fps, 1000000);
    codec->time_base = av_inv_q(codec->framerate);
    codec->gop_size = fps < 2 ? 1 : (int)(2 * fps);
    codec->thread_count = 1;
    codec->color_range = AVCOL_RANGE_MPEG;
    codec->colorspace = AVCOL_SPC_BT709;
    codec->color_primaries = AVCOL_PRI_BT709;
    codec->color_trc = AVCOL_TRC_IEC61966_2_1;
    codec->flags |= AV_CODEC_FLAG_BITEXACT;
    if (video->file->oformat->flags & AVFMT_GLOBALHEADER)
        codec->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    video->ff->av_opt_set(codec->priv_data, "preset", "veryfast", 0); /* x264's; other encoders have their own ways */
    video->ff->av_opt_set(codec->priv_data, "crf", "20", 0);
    /* Without it what later frames owe to blocks (mbtree) is computed by each processor's own code, with other results.
     * AVX-512's in x264 164 even depends on what memory held before, where a row's blocks are no multiple of 8. */
    video->ff->av_opt_set(codec->priv_data, "x264-params", "cpu-independent=1", 0);
    int rc = video->ff->avcodec_open2(codec, encoder, NULL);
    return rc < 0 ? fail_av(err, video, rc, encoder->name) : 0;
}

static int open_file(struct spl_video *video, struct spl_error *err)
{
    AVStream *stream = video->ff->avformat_new_stream(video->file, NULL);
    AVDictionary *options = NULL;
    if (!stream)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for the stream");
    stream->time_base = video->codec->time_base;
    stream->avg_frame_rate = video->codec->framerate;
    int rc = video->ff->avcodec_parameters_from_context(stream->codecpar, video->codec);
    if (rc >= 0)
        rc = video->ff->avio_open(&video->file->pb, video->path, AVIO_FLAG_WRITE);
    if (rc < 0)
        return fail_av(err, video, rc, "cannot be opened");
    video->ff->av_dict_set(&options, "movflags", "+faststart", 0);
    video->file->flags |= AVFMT_FLAG_BITEXACT;
    rc = video->ff->avformat_write_header(video->file, &options);
    video->ff->av_dict_free(&options);
    video->begun = rc >= 0;
    return rc < 0 ? fail_av(err, video, rc, "header") : 0;
}

static int open_picture(struct spl_video *video, struct spl_error *err)
{
    AVCodecContext *codec = video->codec;
    video->packet = video->ff->av_packet_alloc();
    video->frame = video->ff->av_frame_alloc();
    video->scaler = video->ff->sws_getContext(codec->width, codec->height, AV_PIX_FMT_RGBA, codec->width, codec->height,
                                   codec->pix_fmt, SWS_BICUBIC | SWS_ACCURATE_RND | SWS_BITEXACT, NULL, NULL, NULL);
    if (!video->packet || !video->frame || !video->scaler)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for a video of %d x %d", codec->width, codec->height);
    const int *table = video->ff->sws_getCoefficients(SWS_CS_ITU709);
    video->ff->sws_setColorspaceDetails(video->scaler, table, 1, table, 0, 0, 1 << 16, 1 << 16);
    video->frame->format = codec->pix_fmt;
    video->frame->width = codec->width;
    video->frame->height = codec->height;
    int rc = video->ff->av_frame_get_buffer(video->frame, 0);
    return rc < 0 ? fail_av(err, video, rc, "picture") : 0;
}

int spl_video_create(const char *path, uint32_t width, uint32_t height, double fps, struct spl_video **out,
                     struct spl_error *err)
{
    *out = NULL;
    int rc = spl_video_check(width, height, err);
    struct spl_video *video = rc ? NULL : spl_alloc(1, sizeof *video, err);
    if (!video)
        return rc ? rc : SPL_E_NOMEM;
    video->ff = spl_ffmpeg_open(err); /* it is there: it was checked */
    video->ff->av_log_set_level(AV_LOG_QUIET);
    if (!(video->path = strdup(path)) || video->ff->avformat_alloc_output_context2(&video->file, NULL, "mp4", path) < 0)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory for '%.200s'", path);
    if (!rc && !(rc = open_codec(video, width, height, fps, err)) && !(rc = open_picture(video, err)))
        rc = open_file(video, err);
    if (rc)
        spl_video_destroy(video);
    else
        *out = video;
    return rc;
}

/* Hands a picture, or NULL at the end, to the encoder and writes what comes out of it. */
static int encode(struct spl_video *video, const AVFrame *frame, struct spl_error *err)
{
    int rc = video->ff->avcodec_send_frame(video->codec, frame);
    while (rc >= 0 && (rc = video->ff->avcodec_receive_packet(video->codec, video->packet)) >= 0) {
        video->ff->av_packet_rescale_ts(video->packet, video->codec->time_base, video->file->streams[0]->time_base);
        if (!video->packet->duration)
            video->packet->duration =
                video->ff->av_rescale_q(1, video->codec->time_base, video->file->streams[0]->time_base);
        rc = video->ff->av_interleaved_write_frame(video->file, video->packet);
    }
    if (rc == AVERROR(EAGAIN) || rc == AVERROR_EOF)
        rc = video->file->pb->error;
    return rc < 0 ? fail_av(err, video, rc, "encoding") : 0;
}

int spl_video_add(struct spl_video *video, const struct spl_image *image, struct spl_error *err)
{
    const AVCodecContext *codec = video->codec;
    if (image->type != SPL_PIXEL_RGBA8 || (int)image->width != codec->width || (int)image->height != codec->height)
        return spl_fail(err, SPL_E_INPUT, "%s: picture %lld is %u x %u, the video %d x %d", video->path,
                        (long long)video->next + 1, image->width, image->height, codec->width, codec->height);
    int rc = video->ff->av_frame_make_writable(video->frame);
    if (rc < 0)
        return fail_av(err, video, rc, "picture");
    const uint8_t *const rows[] = {image->pixels};
    const int pitch[] = {4 * (int)image->width};
    video->ff->sws_scale(video->scaler, rows, pitch, 0, codec->height, video->frame->data, video->frame->linesize);
    video->frame->pts = video->next++;
    return encode(video, video->frame, err);
}

int spl_video_finish(struct spl_video *video, struct spl_error *err)
{
    int rc = encode(video, NULL, err);
    if (rc)
        return rc;
    video->begun = false;
    int av = video->ff->av_write_trailer(video->file);
    if (av >= 0)
        av = video->file->pb->error;
    int closed = video->ff->avio_closep(&video->file->pb);
    if (av < 0 || closed < 0)
        return fail_av(err, video, av < 0 ? av : closed, "index");
    int fd = open(video->path, O_RDONLY | O_CLOEXEC);
    if (fd < 0 || fsync(fd))
        rc = spl_fail_errno(err, errno, "%s: cannot be written", video->path);
    if (fd >= 0)
        close(fd);
    return rc;
}

void spl_video_destroy(struct spl_video *video)
{
    if (!video)
        return;
    video->ff->sws_freeContext(video->scaler);
    video->ff->av_frame_free(&video->frame);
    video->ff->av_packet_free(&video->packet);
    video->ff->avcodec_free_context(&video->codec);
    if (video->file && video->file->pb)
        video->ff->avio_closep(&video->file->pb);
    video->ff->avformat_free_context(video->file);
    free(video->path);
    free(video);
}
