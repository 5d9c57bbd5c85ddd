/* Digests and comparisons of secrets; the only file that sees libcrypto. Any thread. */
#ifndef SPL_SERVICE_SECRET_H
#define SPL_SERVICE_SECRET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

enum { SPL_DIGEST_BYTES = 32, SPL_DIGEST_TEXT = 44 /* base64url without padding, and NUL */ };

int spl_sha256(const void *data, size_t length, uint8_t out[SPL_DIGEST_BYTES], struct spl_error *err);
int spl_hmac_sha256(const void *key, size_t key_length, const void *data, size_t length, uint8_t out[SPL_DIGEST_BYTES],
                    struct spl_error *err);

/* RFC 4648 section 5, without padding. */
void spl_digest_to_base64url(const uint8_t digest[SPL_DIGEST_BYTES], char out[SPL_DIGEST_TEXT]);

/* Takes as long whatever the bytes are. */
bool spl_secret_is_equal(const void *a, const void *b, size_t length);

/* Overwrites in a way that is not optimised away. */
void spl_secret_wipe(void *data, size_t length);

/* Reads a whole file of at most `most` bytes; the caller wipes and frees *out, which ends in a NUL beyond *length.
 * SPL_E_USAGE with path and reason. Blocks on disk. */
int spl_secret_read(const char *path, size_t most, char **out, size_t *length, struct spl_error *err);

#endif
