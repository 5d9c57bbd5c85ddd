/* The XML of an E57 file, streamed through expat: an element's place is its path, and rows of tables say which of them
 * mean something. Prefixes are taken as they are written, so one that nobody declared does no harm; a document type,
 * and with it every entity, is refused.
 *
 * Invariant: `path` is the path of the innermost open element, and `text` what it holds so far. Owned by the thread
 * that reads the file. */
#include "cloud/e57/document.h"

#include <expat.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/text.h"
#include "cloud/e57/parser.h"
#include "cloud/fields.h"

enum { xml_bytes_max = 64 << 20, depth_max = 32, block = 1 << 16, token_max = 1 << 20 };

static const char scan_path[] = "/e57Root/data3D/vectorChild", image_path[] = "/e57Root/images2D/vectorChild";

int spl_e57_parser_fail(struct spl_e57_parser *p, const char *field, const char *format, ...)
{
    char reason[256];
    va_list args;
    va_start(args, format);
    vsnprintf(reason, sizeof reason, format, args);
    va_end(args);
    if (p->code == SPL_OK)
        p->code = spl_source_fail(p->source, SPL_E_INPUT, field, p->err, "line %lu of its XML: %s",
                                  (unsigned long)XML_GetCurrentLineNumber(p->xml), reason);
    XML_StopParser(p->xml, XML_FALSE);
    return p->code;
}

static void fail_memory(struct spl_e57_parser *p)
{
    p->code = SPL_E_NOMEM;
    XML_StopParser(p->xml, XML_FALSE);
}

/* What of the path lies below `place`: "" for the place itself, NULL elsewhere. */
static const char *path_below(const struct spl_e57_parser *p, const char *place)
{
    size_t length = strlen(place);
    return strncmp(p->path, place, length) == 0 && (p->path[length] == '/' || !p->path[length]) ? p->path + length
                                                                                                : NULL;
}

bool spl_e57_parser_number(struct spl_e57_parser *p, const char *name, const char *text, double *value)
{
    size_t length = strlen(text);
    if (spl_fields_blank(text, length)) {
        *value = 0; /* as the standard has it */
        return true;
    }
    struct spl_fields fields = spl_fields_begin(text, length, ' ');
    if (spl_fields_number(&fields, value) == SPL_FIELD_OK && fields.p == fields.end)
        return true;
    spl_e57_parser_fail(p, name, "'%.40s' is not a number", text);
    return false;
}

bool spl_e57_parser_integer(struct spl_e57_parser *p, const char *name, const char *text, int64_t *value)
{
    const char *start = text + strspn(text, " \t\r\n"), *end = start + strlen(start), *past;
    uint64_t magnitude = 0;
    bool negative = *start == '-';
    start += negative || *start == '+';
    past = spl_integer_parse(start, end, &magnitude);
    if (!past || !spl_fields_blank(past, (size_t)(end - past)) || magnitude > (uint64_t)INT64_MAX + negative) {
        spl_e57_parser_fail(p, name, "'%.40s' is not a whole number of 64 bits", text);
        return false;
    }
    *value = negative ? (int64_t)(0 - magnitude) : (int64_t)magnitude;
    return true;
}

const char *spl_e57_parser_get(const char **attributes, const char *name)
{
    for (; *attributes; attributes += 2)
        if (!strcmp(attributes[0], name))
            return attributes[1];
    return NULL;
}

static void begin_scan(struct spl_e57_parser *p)
{
    struct spl_e57_document *d = p->document;
    if (d->scan_count == SPL_E57_SCANS_MAX) {
        spl_e57_parser_fail(p, "data3D", "more than %d scans", SPL_E57_SCANS_MAX);
    } else if (spl_array_reserve(d->scans, d->scan_capacity, d->scan_count + 1, p->err)) {
        fail_memory(p);
    } else {
        struct spl_e57_scan *scan = &d->scans[d->scan_count++];
        *scan = (struct spl_e57_scan){.first_field = d->field_count, .pose.rotation = {1}};
        for (int i = 0; i < SPL_E57_ROLES; i++)
            scan->field[i] = -1;
        for (int i = 0; i < 2; i++)
            scan->intensity_limits[i] = scan->color_limits[0][i] = scan->color_limits[1][i] = scan->color_limits[2][i] =
                NAN;
    }
}

static void begin_image(struct spl_e57_parser *p)
{
    struct spl_e57_document *d = p->document;
    if (d->image_count == SPL_E57_IMAGES_MAX)
        spl_e57_parser_fail(p, "images2D", "more than %d images", SPL_E57_IMAGES_MAX);
    else if (spl_array_reserve(d->images, d->image_capacity, d->image_count + 1, p->err))
        fail_memory(p);
    else
        d->images[d->image_count++] = (struct spl_e57_image){.pose.rotation = {1}};
}

/* The section that a CompressedVector or a Blob lies in. */
static bool read_section(struct spl_e57_parser *p, const char **attributes, const char *type, const char *count_name,
                         uint64_t *at, uint64_t *count)
{
    const char *name = strrchr(p->path, '/') + 1, *is = spl_e57_parser_get(attributes, "type");
    const char *offset = spl_e57_parser_get(attributes, "fileOffset"),
               *number = spl_e57_parser_get(attributes, count_name);
    int64_t a = 0, c = 0;
    if (!is || strcmp(is, type)) {
        spl_e57_parser_fail(p, name, "type '%.40s' where %s belongs", is ? is : "", type);
        return false;
    }
    if (!offset || !number) {
        spl_e57_parser_fail(p, name, "%s is missing", offset ? count_name : "fileOffset");
        return false;
    }
    if (!spl_e57_parser_integer(p, "fileOffset", offset, &a) || !spl_e57_parser_integer(p, count_name, number, &c))
        return false;
    if (a < 0 || c < 0) {
        spl_e57_parser_fail(p, a < 0 ? "fileOffset" : count_name, "%lld is below 0", (long long)(a < 0 ? a : c));
        return false;
    }
    *at = (uint64_t)a;
    *count = (uint64_t)c;
    return true;
}

static void begin_in_scan(struct spl_e57_parser *p, const char *below, const char **attributes)
{
    struct spl_e57_document *d = p->document;
    struct spl_e57_scan *scan = &d->scans[d->scan_count - 1];
    if (!strcmp(below, "/points")) {
        scan->first_field = d->field_count;
        scan->fields = 0;
        for (int i = 0; i < SPL_E57_ROLES; i++)
            scan->field[i] = -1;
        read_section(p, attributes, "CompressedVector", "recordCount", &scan->at, &scan->points);
    } else if (!strcmp(below, "/pose")) {
        scan->pose.given = true;
    } else if (!strncmp(below, "/points/prototype/", 18)) {
        spl_e57_parser_add_field(p, scan, attributes);
    }
}

static void begin_in_image(struct spl_e57_parser *p, const char *below, const char **attributes)
{
    static const char *const kinds[] = {"", "/visualReferenceRepresentation", "/pinholeRepresentation",
                                        "/sphericalRepresentation", "/cylindricalRepresentation"};
    struct spl_e57_image *image = &p->document->images[p->document->image_count - 1];
    if (!strcmp(below, "/pose"))
        image->pose.given = true;
    for (int kind = SPL_E57_VISUAL; kind <= SPL_E57_CYLINDRICAL; kind++) {
        size_t length = strlen(kinds[kind]);
        const char *inner = below + length;
        if (strncmp(below, kinds[kind], length) || (*inner && *inner != '/'))
            continue;
        if (!*inner && kind != SPL_E57_VISUAL) /* one that has a projection counts more than a picture to look at */
            image->kind = (int)kind;
        if (!*inner && image->kind == SPL_E57_NO_IMAGE)
            image->kind = SPL_E57_VISUAL;
        bool jpeg = !strcmp(inner, "/jpegImage"), png = !strcmp(inner, "/pngImage");
        if ((int)image->kind == kind && (jpeg || png) &&
            read_section(p, attributes, "Blob", "length", &image->at, &image->bytes))
            image->coding = jpeg ? SPL_E57_JPEG : SPL_E57_PNG;
    }
}

static void XMLCALL begin_element(void *context, const char *name, const char **attributes)
{
    struct spl_e57_parser *p = context;
    size_t length = strlen(name);
    const char *below;
    if (p->code < 0)
        return;
    if (p->depth == 0 && strcmp(name, "e57Root")) {
        spl_e57_parser_fail(p, "e57Root", "the document is a '%.40s'", name);
        return;
    }
    if (++p->depth > depth_max || p->length + length + 2 > sizeof p->path) {
        spl_e57_parser_fail(p, "", "elements lie more than %d deep, or have names too long", depth_max);
        return;
    }
    p->path[p->length] = '/';
    memcpy(p->path + p->length + 1, name, length + 1);
    p->length += length + 1;
    p->text_length = 0;
    p->text[0] = 0;
    p->leaf = true;
    p->scale = 1;
    p->offset = 0;
    const char *type = spl_e57_parser_get(attributes, "type");
    if (type && !strcmp(type, "ScaledInteger")) {
        const char *scale = spl_e57_parser_get(attributes, "scale"), *offset = spl_e57_parser_get(attributes, "offset");
        if ((scale && !spl_e57_parser_number(p, "scale", scale, &p->scale)) ||
            (offset && !spl_e57_parser_number(p, "offset", offset, &p->offset)))
            return;
    }
    if (!strcmp(p->path, scan_path))
        begin_scan(p);
    else if (!strcmp(p->path, image_path))
        begin_image(p);
    else if ((below = path_below(p, scan_path)))
        begin_in_scan(p, below, attributes);
    else if ((below = path_below(p, image_path)))
        begin_in_image(p, below, attributes);
}

static void XMLCALL add_text(void *context, const char *text, int length)
{
    struct spl_e57_parser *p = context;
    size_t room = sizeof p->text - 1 - p->text_length;
    if (p->code < 0)
        return;
    if ((size_t)length > room) {
        spl_e57_parser_fail(p, strrchr(p->path, '/') + 1, "more than %zu bytes of text", sizeof p->text - 1);
        return;
    }
    memcpy(p->text + p->text_length, text, (size_t)length);
    p->text_length += (size_t)length;
    p->text[p->text_length] = 0;
}

static void XMLCALL end_element(void *context, const char *name)
{
    struct spl_e57_parser *p = context;
    struct spl_e57_document *d = p->document;
    const char *below;
    if (p->code < 0)
        return;
    if (p->leaf && (below = path_below(p, scan_path)))
        spl_e57_parser_set_scan(p, &d->scans[d->scan_count - 1], below);
    else if (p->leaf && (below = path_below(p, image_path)))
        spl_e57_parser_set_image(p, &d->images[d->image_count - 1], below);
    else if (p->leaf && !strcmp(p->path, "/e57Root/coordinateMetadata") && p->text_length && !d->coordinates) {
        d->coordinates = spl_alloc_raw(p->text_length + 1, 1, p->err);
        if (!d->coordinates)
            fail_memory(p);
        else
            memcpy(d->coordinates, p->text, p->text_length + 1);
    }
    p->leaf = false;
    p->text_length = 0;
    p->length -= strlen(name) + 1;
    p->path[p->length] = 0;
    p->depth--;
}

static void XMLCALL refuse_doctype(void *context, const char *name, const char *system, const char *public, int subset)
{
    (void)name, (void)system, (void)public, (void)subset;
    spl_e57_parser_fail(context, "DOCTYPE", "E57 has no document type, and none is taken");
}

static int parse(struct spl_e57_parser *p, struct spl_e57_pages *pages)
{
    uint64_t at = pages->xml_at, end = at + pages->xml_bytes;
    while (at < end && p->code == SPL_OK) {
        size_t count = end - at < block ? (size_t)(end - at) : block;
        void *room = XML_GetBuffer(p->xml, block);
        if (!room)
            return spl_fail(p->err, SPL_E_NOMEM, "%s: its XML needs more memory than there is", p->source->path);
        int code = spl_e57_read(pages, at, room, count, p->err);
        if (code < 0)
            return code;
        at += count;
        if (XML_ParseBuffer(p->xml, (int)count, at == end) == XML_STATUS_ERROR && p->code == SPL_OK)
            return spl_source_fail(p->source, SPL_E_INPUT, "", p->err, "line %lu of its XML: %s",
                                   (unsigned long)XML_GetCurrentLineNumber(p->xml),
                                   XML_ErrorString(XML_GetErrorCode(p->xml)));
        /* expat begins again with each block at what is not whole yet */
        if (p->code == SPL_OK && (int64_t)(at - pages->xml_at) - XML_GetCurrentByteIndex(p->xml) > token_max)
            return spl_e57_parser_fail(p, "", "a tag, a name or a comment of more than %d bytes", token_max);
    }
    return p->code;
}

int spl_e57_document_read(struct spl_e57_document *document, struct spl_e57_pages *pages, struct spl_error *err)
{
    *document = (struct spl_e57_document){0};
    if (pages->xml_bytes > xml_bytes_max)
        return spl_source_fail(pages->source, SPL_E_LIMIT, "XML length", err, "%llu bytes; at most %d are read",
                               (unsigned long long)pages->xml_bytes, xml_bytes_max);
    struct spl_e57_parser *p = spl_alloc(1, sizeof *p, err);
    if (!p)
        return SPL_E_NOMEM;
    p->source = pages->source;
    p->document = document;
    p->err = err;
    p->xml = XML_ParserCreate(NULL);
    int code = p->xml ? SPL_OK : spl_fail(err, SPL_E_NOMEM, "%s: no memory for its XML", p->source->path);
    if (code == SPL_OK) {
        XML_SetUserData(p->xml, p);
        XML_SetElementHandler(p->xml, begin_element, end_element);
        XML_SetCharacterDataHandler(p->xml, add_text);
        XML_SetStartDoctypeDeclHandler(p->xml, refuse_doctype);
        code = parse(p, pages);
    }
    if (p->xml)
        XML_ParserFree(p->xml);
    free(p);
    if (code < 0)
        spl_e57_document_finish(document);
    return code;
}

void spl_e57_document_finish(struct spl_e57_document *document)
{
    free(document->scans);
    free(document->fields);
    free(document->images);
    free(document->coordinates);
    *document = (struct spl_e57_document){0};
}
