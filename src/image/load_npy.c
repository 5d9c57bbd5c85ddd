/* NPY 1.0 to 3.0 in: the layer's own numbers, no conversion.
 *
 * The header is a Python dictionary with three keys that numpy always writes; its values are looked for by key, each of
 * which is there once, so that their order does not matter. The file must be as long as its header says before anything
 * is allocated. Any thread. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "image/decode.h"

enum { prefix_bytes = 10 };

static const struct {
    const char *type;
    unsigned channels; /* 0: two dimensions */
} rows[] = {
    [SPL_PIXEL_RGBA8] = {"|u1", 4},
    [SPL_PIXEL_F32] = {"<f4", 0},
    [SPL_PIXEL_F32X3] = {"<f4", 3},
    [SPL_PIXEL_U32] = {"<u4", 0},
};

static int fail(const char *path, const char *field, const char *what, struct spl_error *err)
{
    return spl_fail_field(err, SPL_E_INPUT, field, "%s: NPY header: %s", path, what);
}

/* A key that is there twice means one thing to us and another to numpy, which takes the last. */
static int check_keys(const char *path, const char *header, struct spl_error *err)
{
    static const char *const keys[] = {"'descr'", "'fortran_order'", "'shape'"}, *const fields[] = {
                                                                                     "descr", "fortran_order", "shape"};
    for (int i = 0; i < 3; i++) {
        const char *at = strstr(header, keys[i]);
        at = at ? strstr(at + strlen(keys[i]), keys[i]) : NULL;
        if (at) {
            char what[64];
            snprintf(what, sizeof what, "%s is there twice", keys[i]);
            return fail(path, fields[i], what, err);
        }
    }
    return SPL_OK;
}

/* The text between magic and pixels, as a string; the file stands at the pixels. */
int spl_npy_read_header(FILE *file, const char *path, char text[SPL_NPY_HEADER_MAX], struct spl_error *err)
{
    unsigned char prefix[prefix_bytes + 2];
    size_t length = 0, more = 0;
    if (fread(prefix, 1, prefix_bytes, file) == prefix_bytes && !memcmp(prefix, "\x93NUMPY", 6)) {
        length = prefix[8] | (size_t)prefix[9] << 8;
        more = prefix[6] > 1 ? 2 : 0; /* from 2.0 on the length has four bytes */
    }
    if (more && fread(prefix + prefix_bytes, 1, more, file) == more)
        length |= (size_t)prefix[10] << 16 | (size_t)prefix[11] << 24;
    if (length == 0 || prefix[6] < 1 || prefix[6] > 3)
        return fail(path, "version", "broken, or of a version other than 1, 2 and 3", err);
    if (length >= SPL_NPY_HEADER_MAX)
        return fail(path, "header", "longer than that of any image", err);
    if (fread(text, 1, length, file) != length)
        return fail(path, "header", "cut off", err);
    text[length] = 0;
    return check_keys(path, text, err);
}

/* What stands behind 'key': */
const char *spl_npy_find(const char *header, const char *key)
{
    const char *at = strstr(header, key);
    at = at ? at + strlen(key) : NULL;
    at = at ? at + strspn(at, " ") : NULL;
    return at && *at == ':' ? at + 1 + strspn(at + 1, " ") : NULL;
}

unsigned spl_npy_parse_shape(const char *at, uint64_t shape[SPL_NPY_SHAPE_MAX])
{
    unsigned count = 0;
    if (!at || *at++ != '(')
        return 0;
    for (at += strspn(at, " "); *at >= '0' && *at <= '9' && count < SPL_NPY_SHAPE_MAX; at += strspn(at, " ,")) {
        char *end;
        errno = 0;
        shape[count++] = strtoull(at, &end, 10);
        if (errno)
            return 0;
        at = end;
    }
    return *at == ')' ? count : 0;
}

int spl_decode_npy(FILE *file, const char *path, struct spl_image *out, struct spl_error *err)
{
    char header[SPL_NPY_HEADER_MAX];
    uint64_t shape[SPL_NPY_SHAPE_MAX];
    const char *wanted = rows[out->type].type;
    unsigned channels = rows[out->type].channels, dimensions = channels ? 3 : 2;
    int rc = spl_npy_read_header(file, path, header, err);
    if (rc)
        return rc;
    const char *descr = spl_npy_find(header, "'descr'"), *order = spl_npy_find(header, "'fortran_order'");
    if (!descr || *descr++ != '\'' || strncmp(descr, wanted, strlen(wanted)) || descr[strlen(wanted)] != '\'')
        return spl_fail_field(err, SPL_E_INPUT, "descr", "%s: layer %s is stored as '%s', not '%.*s'", path,
                              spl_layer_name(out->layer), wanted, descr ? (int)strcspn(descr, "'}") : 0,
                              descr ? descr : "");
    if (!order || strncmp(order, "False", 5))
        return fail(path, "fortran_order", "rows must come first: fortran_order must be False", err);
    const char *given = spl_npy_find(header, "'shape'"), *text = given ? given : "none";
    size_t length = strcspn(text, ")}\n");
    unsigned count = spl_npy_parse_shape(given, shape);
    if (count != dimensions || (channels && shape[2] != channels))
        return spl_fail_field(err, SPL_E_INPUT, "shape", "%s: layer %s has the shape (height, width%s), not %.*s", path,
                              spl_layer_name(out->layer),
                              channels == 4 ? ", 4"
                              : channels    ? ", 3"
                                            : "",
                              length < 60 ? (int)length + (text[length] == ')') : 60, text);
    long start = ftell(file);
    struct stat status;
    uint64_t limit = SPL_IMAGE_PIXELS_MAX, pixel_bytes = spl_pixel_bytes(out->type);
    if (start < 0 || fstat(fileno(file), &status))
        return spl_fail_errno(err, errno, "%s: cannot be read", path);
    /* sizes beyond the limit are the next call's to name; below it nothing overflows */
    if (shape[0] <= limit && shape[1] <= limit && shape[0] * shape[1] <= limit &&
        (uint64_t)status.st_size != (uint64_t)start + shape[0] * shape[1] * pixel_bytes)
        return spl_fail_field(err, SPL_E_INPUT, "shape",
                              "%s: %llu bytes behind the header, %llu x %llu pixels need %llu", path,
                              (unsigned long long)(status.st_size - start), (unsigned long long)shape[1],
                              (unsigned long long)shape[0], (unsigned long long)(shape[0] * shape[1] * pixel_bytes));
    if ((rc = spl_decode_begin(path, shape[1], shape[0], out, err)))
        return rc;
    size_t pixels = (size_t)out->width * out->height;
    if (fread(out->pixels, pixel_bytes, pixels, file) != pixels)
        return ferror(file) ? spl_fail_errno(err, errno, "%s: cannot be read", path)
                            : spl_fail(err, SPL_E_INPUT, "%s: became shorter while it was read", path);
    return SPL_OK;
}
