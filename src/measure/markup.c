/* Escapes and base64. Names come from files and the command line: whatever they hold, the document stays well-formed.
 * Pure but for the stream; any thread. */
#include "measure/markup.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

/* Bytes of the UTF-8 sequence at `s`; 0 when it is none, an overlong form, a surrogate or beyond U+10FFFF. */
static size_t sequence(const unsigned char *s)
{
    static const uint32_t least[5] = {0, 0, 0x80, 0x800, 0x10000};
    size_t length = s[0] < 0x80 ? 1 : s[0] >> 5 == 6 ? 2 : s[0] >> 4 == 14 ? 3 : s[0] >> 3 == 30 ? 4 : 0;
    uint32_t code = length == 1 ? s[0] : s[0] & (0x7fu >> length);
    for (size_t i = 1; i < length; i++) {
        if (s[i] >> 6 != 2)
            return 0;
        code = code << 6 | (s[i] & 0x3fu);
    }
    bool refused = code < least[length] || code > 0x10ffff || (code >= 0xd800 && code < 0xe000);
    return refused ? 0 : length;
}

void spl_markup_text(FILE *out, const char *text)
{
    for (const unsigned char *s = (const unsigned char *)text; *s;) {
        const char *entity = *s == '&'    ? "&amp;"
                             : *s == '<'  ? "&lt;"
                             : *s == '>'  ? "&gt;"
                             : *s == '"'  ? "&quot;"
                             : *s == '\'' ? "&#39;"
                                          : NULL;
        size_t length = sequence(s);
        if (entity)
            fputs(entity, out);
        else if (!length || (*s < 0x20 && *s != '\t' && *s != '\n') || *s == 0x7f)
            fputc('?', out);
        else
            fwrite(s, 1, length, out);
        s += length ? length : 1;
    }
}

void spl_markup_base64(FILE *out, const void *bytes, size_t length)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const uint8_t *in = bytes;
    for (size_t i = 0; i < length; i += 3) {
        uint32_t word = (uint32_t)in[i] << 16;
        word |= i + 1 < length ? (uint32_t)in[i + 1] << 8 : 0;
        word |= i + 2 < length ? in[i + 2] : 0;
        char four[4] = {digits[word >> 18], digits[word >> 12 & 63], i + 1 < length ? digits[word >> 6 & 63] : '=',
                        i + 2 < length ? digits[word & 63] : '='};
        fwrite(four, 1, 4, out);
    }
}
