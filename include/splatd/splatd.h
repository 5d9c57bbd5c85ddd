/* Everything of libsplatd's public API. */
#ifndef SPLATD_SPLATD_H
#define SPLATD_SPLATD_H

#include <splatd/api.h>
#include <splatd/camera.h>
#include <splatd/cancel.h>
#include <splatd/collect.h>
#include <splatd/color.h>
#include <splatd/dataset.h>
#include <splatd/error.h>
#include <splatd/image.h>
#include <splatd/log.h>
#include <splatd/method.h>
#include <splatd/soft.h>
#include <splatd/terms.h>
#include <splatd/pack.h>
#include <splatd/render.h>

#endif
