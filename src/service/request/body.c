/* Bodies of JSON into documents. jansson takes a tenth of a second and a hundred megabytes for a MiB of empty arrays,
 * so values are counted before it is asked: what stands outside strings tells how many there can be. It copies a long
 * text many times over, and reads a number of a million digits in 30 ms, so both have a limit too.
 *
 * Invariant: a document has no more values, is no deeper and has no longer text or number than was said. Pure
 * functions, any thread. */
#include "service/request/body.h"

#include <ctype.h>

#include "geom/camera_json.h"

enum { depth_max = 64, number_max = 2048 /* bytes; no double's exact digits are more than 1100 */ };

struct size {
    size_t values, depth, text, number; /* the last two in bytes of the longest */
};

/* How many bytes go on with a number. */
static size_t span(const char *body, size_t length)
{
    size_t n = 0;
    while (n < length && (isdigit((unsigned char)body[n]) || body[n] == '.' || body[n] == 'e' || body[n] == 'E' ||
                          body[n] == '+' || body[n] == '-'))
        n++;
    return n;
}

/* An upper bound of the values in valid JSON, exact but for an empty array's or object's inside, and how deep it goes.
 * In broken JSON it is one for what lies before the fault, and no parser looks further. */
static struct size measure(const char *body, size_t length)
{
    struct size size = {.values = 1};
    size_t open = 0;
    for (size_t i = 0; i < length; i++) {
        const size_t begin = i;
        switch (body[i]) {
        case '"':
            while (++i < length && body[i] != '"')
                i += body[i] == '\\';
            size.text = i - begin - 1 > size.text ? i - begin - 1 : size.text;
            break;
        case '[':
        case '{':
            size.values++;
            size.depth = ++open > size.depth ? open : size.depth;
            break;
        case ']':
        case '}':
            open -= open > 0;
            break;
        case ',':
            size.values++;
            break;
        default:
            if (!isdigit((unsigned char)body[i]))
                break;
            i += span(body + i + 1, length - i - 1);
            size.number = i - begin + 1 > size.number ? i - begin + 1 : size.number;
        }
    }
    return size;
}

json_t *spl_body_parse(const char *body, size_t length, size_t values_max, size_t text_max, struct spl_error *err)
{
    const struct size size = measure(body, length);
    json_error_t where;
    if (size.values > values_max || size.depth > depth_max || size.text > text_max) {
        spl_fail_field(
            err, SPL_E_INPUT, "body",
            "the body has %zu values, is %zu deep and has a text of %zu bytes; the limits are %zu, %d and %zu",
            size.values, size.depth, size.text, values_max, depth_max, text_max);
        return NULL;
    }
    if (size.number > number_max) {
        spl_fail_field(err, SPL_E_INPUT, "body", "the body has a number of %zu bytes; the limit is %d", size.number,
                       number_max);
        return NULL;
    }
    json_t *document = spl_json_load(length ? body : "", length, &where);
    if (!document)
        spl_fail_field(err, SPL_E_INPUT, "body", "broken JSON at line %d, column %d: %s", where.line, where.column,
                       spl_json_fault(&where));
    return document;
}
