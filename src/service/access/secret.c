/* SHA-256, HMAC-SHA-256 (RFC 2104) and constant-time comparison by libcrypto, and files that hold secrets.
 *
 * Invariant: no message of an error holds any of their bytes. */
#include "service/access/secret.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>

#include "base/log.h"
#include "base/memory.h"

int spl_sha256(const void *data, size_t length, uint8_t out[SPL_DIGEST_BYTES], struct spl_error *err)
{
    if (EVP_Digest(data, length, out, NULL, EVP_sha256(), NULL) != 1)
        return spl_fail(err, SPL_E_INTERNAL, "libcrypto has no SHA-256");
    return 0;
}

int spl_hmac_sha256(const void *key, size_t key_length, const void *data, size_t length, uint8_t out[SPL_DIGEST_BYTES],
                    struct spl_error *err)
{
    if (key_length > INT32_MAX || !HMAC(EVP_sha256(), key, (int)key_length, data, length, out, NULL))
        return spl_fail(err, SPL_E_INTERNAL, "libcrypto has no HMAC-SHA-256");
    return 0;
}

void spl_digest_to_base64url(const uint8_t digest[SPL_DIGEST_BYTES], char out[SPL_DIGEST_TEXT])
{
    unsigned char text[SPL_DIGEST_TEXT + 1]; // one '=' and NUL
    EVP_EncodeBlock(text, digest, SPL_DIGEST_BYTES);
    for (int i = 0; i < SPL_DIGEST_TEXT - 1; i++)
        out[i] = text[i] == '+' ? '-' : text[i] == '/' ? '_' : (char)text[i];
    out[SPL_DIGEST_TEXT - 1] = '\0';
}

bool spl_secret_is_equal(const void *a, const void *b, size_t length)
{
    return !CRYPTO_memcmp(a, b, length);
}

void spl_secret_wipe(void *data, size_t length)
{
    OPENSSL_cleanse(data, length);
}

int spl_secret_read(const char *path, size_t most, char **out, size_t *length, struct spl_error *err)
{
    struct stat status;
    char *bytes = NULL;
    size_t used = 0;
    int rc = 0, fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0 || fstat(fd, &status)) {
        rc = spl_fail(err, SPL_E_USAGE, "cannot open '%s': %s", path, strerror(errno));
        goto done;
    }
    if (!S_ISREG(status.st_mode) || (uint64_t)status.st_size > most) {
        rc = spl_fail(err, SPL_E_USAGE, "'%s' is no regular file of at most %zu bytes", path, most);
        goto done;
    }
    if (!(bytes = spl_alloc(most + 1, 1, err))) {
        rc = SPL_E_NOMEM;
        goto done;
    }
    for (ssize_t got; used < most && (got = read(fd, bytes + used, most - used)); used += (size_t)got)
        if (got < 0) {
            rc = spl_fail(err, SPL_E_USAGE, "cannot read '%s': %s", path, strerror(errno));
            goto done;
        }
    if (status.st_mode & S_IROTH)
        spl_log_warn("'%s' can be read by every user of this machine; chmod o-r it", path);
    *out = bytes;
    *length = used;
    bytes = NULL;
done:
    if (fd >= 0)
        close(fd);
    free(bytes);
    return rc;
}
