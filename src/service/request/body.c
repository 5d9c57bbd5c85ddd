/* Bodies of JSON into documents. jansson takes a tenth of a second and a hundred megabytes for a MiB of empty arrays,
 * so values are counted before it is asked: what stands outside strings tells how many there can be.
 *
 * Invariant: a document has no more values, and is no deeper, than was said. Pure functions, any thread. */
#include "service/request/body.h"

enum { depth_max = 64 };

/* An upper bound of the values in valid JSON, exact but for an empty array's or object's inside, and how deep it goes.
 * In broken JSON it is one for what lies before the fault, and no parser looks further. */
static void measure(const char *body, size_t length, size_t *values, size_t *depth)
{
    size_t open = 0;
    *values = 1;
    *depth = 0;
    for (size_t i = 0; i < length; i++) {
        switch (body[i]) {
        case '"':
            while (++i < length && body[i] != '"')
                i += body[i] == '\\';
            break;
        case '[':
        case '{':
            ++*values;
            *depth = ++open > *depth ? open : *depth;
            break;
        case ']':
        case '}':
            open -= open > 0;
            break;
        case ',':
            ++*values;
            break;
        }
    }
}

json_t *spl_body_parse(const char *body, size_t length, size_t values_max, struct spl_error *err)
{
    size_t values, depth;
    json_error_t where;
    measure(body, length, &values, &depth);
    if (values > values_max || depth > depth_max) {
        spl_fail_field(err, SPL_E_INPUT, "body", "the body has %zu values and is %zu deep; the limits are %zu and %d",
                       values, depth, values_max, depth_max);
        return NULL;
    }
    json_t *document = json_loadb(length ? body : "", length, JSON_REJECT_DUPLICATES, &where);
    if (!document)
        spl_fail_field(err, SPL_E_INPUT, "body", "broken JSON at line %d, column %d: %s", where.line, where.column,
                       where.text);
    return document;
}
