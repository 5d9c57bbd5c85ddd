/* Coordinate systems as headers write them: WKT (1 and 2), GeoTIFF keys, EPSG numbers. Of a system only as much is
 * understood as packing needs: its number or text, its name, and what its coordinates are in. */
#ifndef SPL_CLOUD_CRS_H
#define SPL_CLOUD_CRS_H

#include "cloud/cloud.h"

enum { SPL_CRS_TEXT_MAX = 1 << 16 }; /* bytes of WKT */

/* What a text says, in place of what `crs` says, whose precision stays: `length` bytes, or up to a NUL. SPL_E_INPUT
 * with the byte and the reason, crs untouched, for what is no WKT, is not closed, or holds no system. Any thread. */
int spl_crs_read_wkt(const char *text, size_t length, struct spl_cloud_coordinates *crs, struct spl_error *err);

/* Contents of the three GeoTIFF records; NULL and 0 where there is none. */
struct spl_crs_keys {
    const uint8_t *keys, *doubles, *text;
    size_t keys_bytes, doubles_bytes, text_bytes;
};

/* The same of GeoTIFF keys; what is odd among them counts as not said. */
void spl_crs_read_keys(const struct spl_crs_keys *keys, struct spl_cloud_coordinates *crs);

/* The same of what a user says: "EPSG:25832", "EPSG:2994+EPSG:6360" or "EPSG:2994+6360", or the name of a file that
 * holds WKT. Errors are SPL_E_USAGE and name `--crs`. */
int spl_crs_read_option(const char *text, struct spl_cloud_coordinates *crs, struct spl_error *err);

/* Metres a unit of the system's coordinates: from EPSG's register, which is complete up to its release of 2022; 0 and
 * *angles for longitudes and latitudes; 0 for what cannot be a number of a system. */
double spl_crs_get_unit(uint32_t epsg, bool *angles);

/* What a number of the register is a system of. */
enum spl_crs_kind { SPL_CRS_PLACES, SPL_CRS_HEIGHTS /* alone */, SPL_CRS_GEOCENTRIC /* z is not up */ };
enum spl_crs_kind spl_crs_get_kind(uint32_t epsg);

/* Metres of EPSG's unit of length with this number; 0: none. */
double spl_crs_get_length(uint32_t unit);

/* Puts what has been read of a system, `said`, which is used up, into `crs`, whose precision stays: settled, so that
 * units are there which only the numbers say, and no number beside which another unit stands. */
void spl_crs_replace(struct spl_cloud_coordinates *crs, const struct spl_cloud_coordinates *said);

/* Of a system that has a name and neither number nor text: a text of its name and unit, and what is lost of it. */
void spl_crs_keep_name(struct spl_cloud_coordinates *crs);

/* As META has it: "EPSG:N", "EPSG:N+EPSG:M", WKT. The caller frees it. NULL: nothing is said, or there is no memory. */
char *spl_crs_print(const struct spl_cloud_coordinates *crs);

/* Whether it says which system it is. */
static inline bool spl_crs_is_said(const struct spl_cloud_coordinates *crs)
{
    return crs->epsg || crs->name[0] || crs->wkt;
}

/* Releases what the text holds; leaves it zeroed. */
void spl_crs_finish(struct spl_cloud_coordinates *crs);

#endif
