/* Cameras of photographs: stood where people could stand, turned to what is there. Pure functions; any thread. */
#ifndef SPL_SYNTH_PHOTOS_H
#define SPL_SYNTH_PHOTOS_H

#include <stdio.h>

#include <splatd/camera.h>

#include "synth/scene.h"

/* The camera of photograph `number` (world coordinates) of a scene with sample cameras: reached from one of those along
 * free paths, so never inside of an object, at least 0.5 m away from every surface that it was tested against, and with
 * geometry in most of its picture where the scene has that. It depends on its arguments alone, so more photographs are
 * the same ones and others. */
struct spl_camera spl_photo_place(const struct spl_scene *scene, uint64_t seed, size_t number, uint32_t width,
                                  uint32_t height);

/* COLMAP's text model: the camera as a line of cameras.txt (model PINHOLE), and its pose as the two lines of images.txt
 * (the second, which would list matched points, is empty). Numbers read back as the same doubles. */
void spl_photo_print_camera(FILE *out, size_t id, const struct spl_camera *camera);
void spl_photo_print_image(FILE *out, size_t id, const struct spl_camera *camera, const char *name);

#endif
