/* The PCD header, versions .5 to .7: its keys in any order up to DATA, every word and number checked, nothing allocated
 * by what it says. What is left out has the defaults of the Point Cloud Library: fields are floats of 4 bytes, one of
 * each, and HEIGHT is 1. Pure but for the source's cursor. */
#include "cloud/pcd.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "cloud/fields.h"

enum key { VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS, DATA, KEYS, NO_KEY = KEYS };
enum { header_bytes_max = 1 << 20 };

static const char *const keys[KEYS] = {"VERSION", "FIELDS", "SIZE",      "TYPE",   "COUNT",
                                       "WIDTH",   "HEIGHT", "VIEWPOINT", "POINTS", "DATA"};

struct parser {
    struct spl_source *source;
    struct spl_pcd_header *header;
    uint64_t line[KEYS];   /* where each was, 0 = nowhere */
    unsigned number[KEYS]; /* of values, of the keys that have one a field */
    uint64_t size[SPL_PCD_FIELDS], count[SPL_PCD_FIELDS];
    char type[SPL_PCD_FIELDS];
};

static bool is_word(const char *word, size_t length, const char *text)
{
    return length == strlen(text) && memcmp(word, text, length) == 0;
}

static enum key find_key(const char *word, size_t length)
{
    enum key key = VERSION;
    while (key < KEYS && !is_word(word, length, keys[key]))
        key++;
    return key == NO_KEY && is_word(word, length, "COLUMNS") ? FIELDS : key; /* its name up to version .5 */
}

bool spl_pcd_is_header(const char *bytes, size_t available)
{
    const char *end = bytes + available;
    unsigned known = 0;
    for (const char *p = bytes; p < end && known < 2;) {
        const char *stop = memchr(p, '\n', (size_t)(end - p));
        size_t line = (size_t)((stop ? stop : end) - p), length;
        struct spl_fields fields = spl_fields_begin(p, line, ' ');
        if (*p == '#') {
            static const char title[] = "# .PCD v";
            if (line >= sizeof title - 1 && memcmp(p, title, sizeof title - 1) == 0)
                return true;
        } else if (spl_fields_text(&fields, &length) == SPL_FIELD_OK) {
            if (find_key(fields.start, length) == NO_KEY)
                return false;
            known++;
        }
        p += line + 1;
    }
    return known == 2;
}

static int fail_text(const struct parser *p, enum key key, const struct spl_fields *fields, const char *what,
                     struct spl_error *err)
{
    char text[32];
    return spl_source_fail_line(p->source, p->source->line, keys[key], err, "\"%s\" is %s",
                                spl_fields_show(fields, text), what);
}

static int take_integer(const struct parser *p, enum key key, struct spl_fields *fields, uint64_t *value,
                        struct spl_error *err)
{
    size_t length;
    if (spl_fields_text(fields, &length) != SPL_FIELD_OK)
        return spl_source_fail_line(p->source, p->source->line, keys[key], err, "has no number");
    if (spl_integer_parse(fields->start, fields->start + length, value) != fields->start + length)
        return fail_text(p, key, fields, "not a whole number of 64 bits", err);
    return SPL_OK;
}

static int take_viewpoint(const struct parser *p, struct spl_fields *fields, struct spl_error *err)
{
    for (unsigned i = 0; i < 7; i++) {
        enum spl_field got = spl_fields_number(fields, &p->header->viewpoint[i]);
        if (got == SPL_FIELD_BAD)
            return fail_text(p, VIEWPOINT, fields, "not a number", err);
        if (got == SPL_FIELD_END)
            return spl_source_fail_line(p->source, p->source->line, keys[VIEWPOINT], err,
                                        "%u numbers; it has 7: x y z, then the quaternion w x y z", i);
    }
    p->header->has_viewpoint = true;
    return SPL_OK;
}

static int take_data(const struct parser *p, struct spl_fields *fields, struct spl_error *err)
{
    static const char *const names[] = {"ascii", "binary", "binary_compressed"};
    size_t length;
    if (spl_fields_text(fields, &length) != SPL_FIELD_OK)
        length = 0;
    for (unsigned i = 0; i < 3; i++)
        if (is_word(fields->start, length, names[i])) {
            p->header->data = i;
            return SPL_OK;
        }
    return fail_text(p, DATA, fields, "none of ascii, binary and binary_compressed", err);
}

/* A value a field: of FIELDS, SIZE, TYPE and COUNT. */
static int take_list(struct parser *p, enum key key, struct spl_fields *fields, struct spl_error *err)
{
    unsigned n = 0;
    size_t length;
    for (struct spl_fields ahead = *fields; spl_fields_text(&ahead, &length) == SPL_FIELD_OK; n++) {
        struct spl_pcd_field *field = &p->header->fields[n];
        int code = SPL_OK;
        if (n == SPL_PCD_FIELDS)
            return spl_source_fail_line(p->source, p->source->line, keys[key], err, "more than %d fields",
                                        SPL_PCD_FIELDS);
        if (key == FIELDS) {
            snprintf(field->name, sizeof field->name, "%.*s", (int)length, ahead.start);
            for (char *c = field->name; *c; c++)
                *c = *c < ' ' || *c > '~' ? '?' : *c;
        } else if (key == TYPE) {
            if (length != 1 || !memchr("IUF", *ahead.start, 3))
                return fail_text(p, key, &ahead, "none of I, U and F", err);
            p->type[n] = *ahead.start;
        } else {
            struct spl_fields one = *fields;
            code = take_integer(p, key, &one, key == SIZE ? &p->size[n] : &p->count[n], err);
        }
        if (code < 0)
            return code;
        *fields = ahead;
    }
    p->number[key] = n;
    return SPL_OK;
}

static int take_line(struct parser *p, const char *line, size_t length, struct spl_error *err)
{
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    size_t word;
    uint64_t *const numbers[KEYS] = {
        [WIDTH] = &p->header->width, [HEIGHT] = &p->header->height, [POINTS] = &p->header->points};
    if (*line == '#' || spl_fields_text(&fields, &word) == SPL_FIELD_END)
        return SPL_OK;
    enum key key = find_key(fields.start, word);
    if (key == NO_KEY) {
        char text[32];
        return spl_source_fail_line(p->source, p->source->line, "", err,
                                    "\"%s\" is no PCD header keyword (comments begin with #)",
                                    spl_fields_show(&fields, text));
    }
    if (p->line[key])
        return spl_source_fail_line(p->source, p->source->line, keys[key], err, "is given in line %llu already",
                                    (unsigned long long)p->line[key]);
    p->line[key] = p->source->line;
    if (numbers[key])
        return take_integer(p, key, &fields, numbers[key], err);
    if (key == VIEWPOINT)
        return take_viewpoint(p, &fields, err);
    if (key == DATA)
        return take_data(p, &fields, err);
    return key == VERSION ? SPL_OK : take_list(p, key, &fields, err); /* versions differ in what they leave out */
}

static enum spl_number find_type(char type, uint64_t size)
{
    static const struct {
        char type;
        uint8_t size, number;
    } types[] = {{'I', 1, SPL_NUMBER_INT8},   {'I', 2, SPL_NUMBER_INT16},  {'I', 4, SPL_NUMBER_INT32},
                 {'I', 8, SPL_NUMBER_INT64},  {'U', 1, SPL_NUMBER_UINT8},  {'U', 2, SPL_NUMBER_UINT16},
                 {'U', 4, SPL_NUMBER_UINT32}, {'U', 8, SPL_NUMBER_UINT64}, {'F', 4, SPL_NUMBER_FLOAT32},
                 {'F', 8, SPL_NUMBER_FLOAT64}};
    for (size_t i = 0; i < sizeof types / sizeof *types; i++)
        if (types[i].type == type && types[i].size == size)
            return types[i].number;
    return SPL_NUMBER_NONE;
}

static int lay_out(struct parser *p, struct spl_error *err)
{
    struct spl_pcd_header *h = p->header;
    uint64_t bytes = 0;
    h->field_count = p->number[FIELDS];
    h->fields_line = p->line[FIELDS];
    if (h->field_count == 0)
        return spl_source_fail_line(p->source, p->source->line, "FIELDS", err,
                                    "is missing from the header: there are no points to read");
    for (enum key key = SIZE; key <= COUNT; key++)
        if (p->line[key] && p->number[key] != h->field_count)
            return spl_source_fail_line(p->source, p->line[key], keys[key], err, "%u values for the %u names of FIELDS",
                                        p->number[key], h->field_count);
    for (unsigned i = 0; i < h->field_count; i++) {
        struct spl_pcd_field *field = &h->fields[i];
        uint64_t size = p->line[SIZE] ? p->size[i] : 4, count = p->line[COUNT] ? p->count[i] : 1;
        char type = p->line[TYPE] ? p->type[i] : 'F';
        field->type = (uint8_t)find_type(type, size);
        field->column = SPL_COLUMN_SKIP;
        if (field->type == SPL_NUMBER_NONE)
            return spl_source_fail_line(p->source, p->line[SIZE] ? p->line[SIZE] : p->line[TYPE], field->name, err,
                                        "type %c has no size of %llu bytes (I and U: 1, 2, 4, 8; F: 4, 8)", type,
                                        (unsigned long long)size);
        if (count == 0 || count > SPL_SOURCE_WINDOW || bytes + count * size > SPL_SOURCE_WINDOW)
            return spl_source_fail_line(p->source, p->line[COUNT] ? p->line[COUNT] : h->fields_line, field->name, err,
                                        "a COUNT of %llu; a field has at least 1, and a point at most %d bytes",
                                        (unsigned long long)count, SPL_SOURCE_WINDOW);
        field->count = (uint32_t)count;
        field->bytes = (uint32_t)(count * size);
        field->offset = (uint32_t)bytes;
        bytes += field->bytes;
        h->numbers += field->count;
    }
    h->point_bytes = (uint32_t)bytes;
    return SPL_OK;
}

/* POINTS, WIDTH and HEIGHT say the same where they are all there. */
static int count_points(struct parser *p, struct spl_error *err)
{
    struct spl_pcd_header *h = p->header;
    uint64_t cells;
    if (!p->line[HEIGHT])
        h->height = 1;
    if (!p->line[WIDTH] && !p->line[POINTS])
        return spl_source_fail_line(p->source, p->source->line, "POINTS", err,
                                    "neither POINTS nor WIDTH says how many points there are");
    h->points_line = p->line[p->line[POINTS] ? POINTS : WIDTH];
    if (!p->line[WIDTH])
        return SPL_OK;
    if (__builtin_mul_overflow(h->width, h->height, &cells))
        return spl_source_fail_line(p->source, p->line[WIDTH], "WIDTH", err, "%llu x %llu points exceed 64 bits",
                                    (unsigned long long)h->width, (unsigned long long)h->height);
    if (p->line[POINTS] && h->points != cells)
        return spl_source_fail_line(p->source, p->line[POINTS], "POINTS", err, "%llu, but WIDTH x HEIGHT is %llu",
                                    (unsigned long long)h->points, (unsigned long long)cells);
    h->points = cells;
    return SPL_OK;
}

int spl_pcd_parse_header(struct spl_source *source, struct spl_pcd_header *header, struct spl_error *err)
{
    struct parser parser = {.source = source, .header = header};
    const char *line;
    size_t length;
    int code = SPL_OK;

    memset(header, 0, sizeof *header);
    while (code == SPL_OK && !parser.line[DATA]) {
        if (spl_source_tell(source) > header_bytes_max)
            return spl_source_fail_line(source, source->line, "DATA", err, "is missing from the first %d bytes",
                                        header_bytes_max);
        code = spl_source_line(source, &line, &length, err);
        if (code < 0)
            return code;
        if (code == 0)
            return spl_source_fail_line(source, source->line, "DATA", err,
                                        "is missing: the file ends inside its header");
        code = take_line(&parser, line, length, err);
    }
    if (code == SPL_OK)
        code = lay_out(&parser, err);
    return code == SPL_OK ? count_points(&parser, err) : code;
}
