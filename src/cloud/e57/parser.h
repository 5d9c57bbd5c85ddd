/* Between the walk through the XML (document.c) and the values of its elements (values.c). Inside src/cloud/e57 only.
 */
#ifndef SPL_CLOUD_E57_PARSER_H
#define SPL_CLOUD_E57_PARSER_H

#include <expat.h>

#include "cloud/e57/document.h"

struct spl_e57_parser {
    XML_Parser xml;
    const struct spl_source *source;
    struct spl_e57_document *document;
    struct spl_error *err;
    int code; /* the first error */
    unsigned depth;
    bool leaf;            /* the innermost element has had none inside */
    double scale, offset; /* of its value, if it is a scaled integer */
    size_t length, text_length;
    char path[1024];
    char text[1 << 16];
};

/* Stops the parser with SPL_E_INPUT, naming the line of the XML. */
int spl_e57_parser_fail(struct spl_e57_parser *p, const char *field, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Values from text; "" is the number 0. False: the parser has failed, naming `name`. */
bool spl_e57_parser_number(struct spl_e57_parser *p, const char *name, const char *text, double *value);
bool spl_e57_parser_integer(struct spl_e57_parser *p, const char *name, const char *text, int64_t *value);

/* An attribute's value; NULL where it is not given. */
const char *spl_e57_parser_get(const char **attributes, const char *name);

/* values.c: an element of a scan's prototype; the text of an element `below` a scan or an image. */
void spl_e57_parser_add_field(struct spl_e57_parser *p, struct spl_e57_scan *scan, const char **attributes);
void spl_e57_parser_set_scan(struct spl_e57_parser *p, struct spl_e57_scan *scan, const char *below);
void spl_e57_parser_set_image(struct spl_e57_parser *p, struct spl_e57_image *image, const char *below);

#endif
