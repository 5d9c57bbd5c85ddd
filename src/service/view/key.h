/* Which bytes a request stands for: its canonical form, hashed together with the dataset's version and the renderer.
 *
 * Two requests with one key get the same bytes, whoever renders them; the ETag of a reply is its key. Known before
 * anything is rendered. Pure functions, any thread. */
#ifndef SPL_SERVICE_KEY_H
#define SPL_SERVICE_KEY_H

#include "service/request/request.h"

struct spl_key {
    uint64_t words[2];
};

enum { SPL_ETAG_BYTES = 40 };

/* What renders: driver, device, and the program itself, since another build may draw other pixels. Reads the program's
 * file; blocks on disk. */
uint64_t spl_renderer_hash(const struct spl_device_info *device);

/* Parameters that cannot change the reply are left out: quality of a PNG, the background of a depth layer, atoms of a
 * dataset without textures, all that begins with soft_ where nothing is soft, wait: it stands for the complete view,
 * and what is less is nobody's to keep. Not for planned requests, whose bytes nobody knows yet. */
struct spl_key spl_key_make(const struct spl_view_request *request, const struct spl_dataset_info *dataset,
                            uint64_t renderer);

static inline bool spl_key_equal(const struct spl_key *a, const struct spl_key *b)
{
    return a->words[0] == b->words[0] && a->words[1] == b->words[1];
}

/* The strong validator, quoted. */
void spl_key_etag(const struct spl_key *key, char etag[SPL_ETAG_BYTES]);

/* Whether the value of an If-None-Match or If-Match header (RFC 9110, 13.1) names `etag`: '*', or a list, in which weak
 * validators count as well where the comparison is not `strong` (8.8.3.2). What is malformed matches nothing. */
bool spl_etag_matches(const char *list, const char *etag, bool strong);

#endif
