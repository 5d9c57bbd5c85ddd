/* FFmpeg's libraries behind dlopen: a hundred and twenty libraries come with them, which took two thirds of the time
 * that a command needs to begin. A file that includes this calls their functions by their names, after
 * spl_ffmpeg_open(). */
#ifndef SPL_IMAGE_FFMPEG_H
#define SPL_IMAGE_FFMPEG_H

#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libswscale/swscale.h>

#include "base/error.h"

/* F(library, function) */
#define SPL_FFMPEG(F)                                                                                                  \
    F(avutil, av_d2q)                                                                                                  \
    F(avutil, av_dict_free)                                                                                            \
    F(avutil, av_dict_set)                                                                                             \
    F(avutil, av_frame_alloc)                                                                                          \
    F(avutil, av_frame_free)                                                                                           \
    F(avutil, av_frame_get_buffer)                                                                                     \
    F(avutil, av_frame_make_writable)                                                                                  \
    F(avutil, av_log_set_level)                                                                                        \
    F(avutil, av_opt_set)                                                                                              \
    F(avutil, av_rescale_q)                                                                                            \
    F(avutil, av_strerror)                                                                                             \
    F(avcodec, av_packet_alloc)                                                                                        \
    F(avcodec, av_packet_free)                                                                                         \
    F(avcodec, av_packet_rescale_ts)                                                                                   \
    F(avcodec, avcodec_alloc_context3)                                                                                 \
    F(avcodec, avcodec_find_encoder)                                                                                   \
    F(avcodec, avcodec_free_context)                                                                                   \
    F(avcodec, avcodec_open2)                                                                                          \
    F(avcodec, avcodec_parameters_from_context)                                                                        \
    F(avcodec, avcodec_receive_packet)                                                                                 \
    F(avcodec, avcodec_send_frame)                                                                                     \
    F(avformat, av_interleaved_write_frame)                                                                            \
    F(avformat, av_write_trailer)                                                                                      \
    F(avformat, avformat_alloc_output_context2)                                                                        \
    F(avformat, avformat_free_context)                                                                                 \
    F(avformat, avformat_new_stream)                                                                                   \
    F(avformat, avformat_write_header)                                                                                 \
    F(avformat, avio_closep)                                                                                           \
    F(avformat, avio_open)                                                                                             \
    F(swscale, sws_freeContext)                                                                                        \
    F(swscale, sws_getCoefficients)                                                                                    \
    F(swscale, sws_getContext)                                                                                         \
    F(swscale, sws_scale)                                                                                              \
    F(swscale, sws_setColorspaceDetails)

#define SPL_FFMPEG_FUNCTION(library, name) __typeof__(name) *name;
struct spl_ffmpeg {
    SPL_FFMPEG(SPL_FFMPEG_FUNCTION)
};
#undef SPL_FFMPEG_FUNCTION

/* Loads them the first time, which takes a tenth of a second. NULL: SPL_E_UNSUPPORTED, field "video", names what is
 * missing. Any thread. */
const struct spl_ffmpeg *spl_ffmpeg_open(struct spl_error *err);

#endif
