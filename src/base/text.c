/* What of a text can be shown as it is. A file's texts are anybody's: an escape sequence in one would be carried out by
 * the reader's terminal, a line end would forge a line of ours.
 *
 * Invariant: what comes out is UTF-8, and one line. Pure; any thread. */
#include "base/text.h"

#include <stdint.h>
#include <string.h>

/* The character's number, and its bytes; -1 where none is encoded, in the shortest form alone (RFC 3629). */
static int32_t decode(const unsigned char *text, size_t *length)
{
    static const int32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
    size_t bytes = *text < 0x80 ? 1 : *text >> 5 == 6 ? 2 : *text >> 4 == 14 ? 3 : *text >> 3 == 30 ? 4 : 0;
    *length = 1;
    if (bytes < 2)
        return bytes ? *text : -1;
    int32_t c = *text & (0x7f >> bytes);
    for (size_t i = 1; i < bytes; i++) {
        if (text[i] >> 6 != 2) // the end too
            return -1;
        c = c << 6 | (text[i] & 0x3f);
    }
    if (c < least[bytes] || c > 0x10ffff || (c >= 0xd800 && c <= 0xdfff))
        return -1;
    *length = bytes;
    return c;
}

static bool is_printable(int32_t c)
{
    bool control = c < 0x20 || (c >= 0x7f && c < 0xa0) || c == 0x2028 || c == 0x2029;
    bool turns =
        c == 0x61c || c == 0x200e || c == 0x200f || (c >= 0x202a && c <= 0x202e) || (c >= 0x2066 && c <= 0x2069);
    return !control && !turns && c != 0xfeff;
}

size_t spl_text_next(const char *text, bool *printable)
{
    size_t length = 0;
    *printable = *text && is_printable(decode((const unsigned char *)text, &length));
    return length;
}

const char *spl_text_show(const char *text, char *out, size_t size)
{
    size_t used = 0, length;
    bool printable;
    for (; (length = spl_text_next(text, &printable)); text += length) {
        size_t bytes = printable ? length : 1;
        if (used + bytes >= size)
            break;
        memmove(out + used, printable ? text : "?", bytes);
        used += bytes;
    }
    out[used] = '\0';
    return out;
}

void spl_text_clean(char *text)
{
    spl_text_show(text, text, strlen(text) + 1);
}

int spl_text_get_hex(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}
