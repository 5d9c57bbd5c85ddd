/* The PLY header: line by line, every keyword and number checked, nothing allocated by what it says. Lines may end in
 * \n, \r\n or \r; the data begins right behind the ending of "end_header", whatever byte comes first there. */
#include "cloud/ply.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "cloud/fields.h"
#include "cloud/packed.h"

static const struct {
    const char *name;
    enum spl_number type;
} types[] = {
    {"char", SPL_NUMBER_INT8},       {"int8", SPL_NUMBER_INT8},       {"uchar", SPL_NUMBER_UINT8},
    {"uint8", SPL_NUMBER_UINT8},     {"short", SPL_NUMBER_INT16},     {"int16", SPL_NUMBER_INT16},
    {"ushort", SPL_NUMBER_UINT16},   {"uint16", SPL_NUMBER_UINT16},   {"int", SPL_NUMBER_INT32},
    {"int32", SPL_NUMBER_INT32},     {"uint", SPL_NUMBER_UINT32},     {"uint32", SPL_NUMBER_UINT32},
    {"float", SPL_NUMBER_FLOAT32},   {"float32", SPL_NUMBER_FLOAT32}, {"double", SPL_NUMBER_FLOAT64},
    {"float64", SPL_NUMBER_FLOAT64}, {"int64", SPL_NUMBER_INT64},     {"uint64", SPL_NUMBER_UINT64},
};

struct words {
    const char *word[5];
    size_t length[5];
    size_t count;
};

static bool word_is(const struct words *words, size_t i, const char *text)
{
    return i < words->count && words->length[i] == strlen(text) && memcmp(words->word[i], text, words->length[i]) == 0;
}

static void split(const char *line, size_t length, struct words *words)
{
    struct spl_fields fields = spl_fields_begin(line, length, ' ');
    words->count = 0;
    while (words->count < 5 && spl_fields_text(&fields, &words->length[words->count]) == SPL_FIELD_OK)
        words->word[words->count++] = fields.start;
}

static enum spl_number find_type(const struct words *words, size_t i)
{
    for (size_t k = 0; k < sizeof types / sizeof *types; k++)
        if (word_is(words, i, types[k].name))
            return types[k].type;
    return SPL_NUMBER_NONE;
}

static void copy_name(char *name, size_t room, const struct words *words, size_t i)
{
    snprintf(name, room, "%.*s", (int)words->length[i], words->word[i]);
    for (char *p = name; *p; p++)
        if (*p < ' ' || *p > '~')
            *p = '?';
}

static int parse_format(const struct spl_source *source, const struct words *words, struct spl_ply_header *header,
                        struct spl_error *err)
{
    if (word_is(words, 1, "ascii"))
        header->format = SPL_PLY_ASCII;
    else if (word_is(words, 1, "binary_little_endian"))
        header->format = SPL_PLY_LITTLE;
    else if (word_is(words, 1, "binary_big_endian"))
        header->format = SPL_PLY_BIG;
    else
        return spl_source_fail_line(source, source->line, "format", err,
                                    "must be ascii, binary_little_endian or binary_big_endian");
    if (!word_is(words, 2, "1.0"))
        return spl_source_fail_line(source, source->line, "format", err, "version must be 1.0");
    return SPL_OK;
}

static int parse_element(const struct spl_source *source, const struct words *words, struct spl_ply_header *header,
                         struct spl_error *err)
{
    uint64_t count;
    if (words->count != 3)
        return spl_source_fail_line(source, source->line, "element", err, "must read \"element NAME COUNT\"");
    if (spl_integer_parse(words->word[2], words->word[2] + words->length[2], &count) !=
        words->word[2] + words->length[2])
        return spl_source_fail_line(source, source->line, "element", err, "\"%.*s\" is not a count",
                                    (int)words->length[2], words->word[2]);
    if (header->element_count == SPL_PLY_ELEMENTS)
        return spl_source_fail_line(source, source->line, "element", err, "more than %d elements", SPL_PLY_ELEMENTS);
    if (word_is(words, 1, "vertex")) {
        if (header->vertex_line)
            return spl_source_fail_line(source, source->line, "element vertex", err, "is declared twice");
        header->vertex = header->element_count;
        header->vertex_line = source->line;
    }
    struct spl_ply_element *element = &header->elements[header->element_count++];
    copy_name(element->name, sizeof element->name, words, 1);
    element->count = count;
    element->first = header->property_count;
    return SPL_OK;
}

static bool has_vertex_property(const struct spl_ply_header *header, const char *name)
{
    const struct spl_ply_element *element = &header->elements[header->vertex];
    for (unsigned i = 0; i < element->properties; i++)
        if (!strcmp(header->properties[element->first + i].name, name))
            return true;
    return false;
}

/* Of "label" and "class", in whatever order, it is the second that the column is called by. What had it is kept under
 * its own name, if anybody asks for that. */
static void prefer_own_name(struct spl_cloud *cloud, struct spl_ply_header *header, struct spl_ply_property *p)
{
    const int column = spl_column_from_name(p->name, strlen(p->name));
    if (p->column >= 0 || column < 0 || strcasecmp(p->name, spl_column_name(column)))
        return;
    for (unsigned i = header->elements[header->vertex].first; i < header->property_count; i++) {
        struct spl_ply_property *q = &header->properties[i];
        if (q->column != column || q->packed || !strcasecmp(q->name, p->name))
            continue;
        q->column = (int8_t)spl_keep_find_column(&cloud->keep, cloud->columns, q->name, strlen(q->name));
        cloud->columns |= q->column >= 0 ? 1u << q->column : 0;
        p->column = (int8_t)column;
    }
}

static int parse_property(struct spl_cloud *cloud, const struct words *words, struct spl_ply_header *header,
                          struct spl_error *err)
{
    const struct spl_source *source = &cloud->source;
    bool list = word_is(words, 1, "list");
    size_t name = list ? 4 : 2;
    if (words->count != name + 1)
        return spl_source_fail_line(source, source->line, "property", err,
                                    "must read \"property TYPE NAME\" or \"property list COUNT_TYPE TYPE NAME\"");
    if (header->element_count == 0)
        return spl_source_fail_line(source, source->line, "property", err, "comes before any element");
    if (header->property_count == SPL_PLY_PROPERTIES)
        return spl_source_fail_line(source, source->line, "property", err, "more than %d properties",
                                    SPL_PLY_PROPERTIES);
    struct spl_ply_property p = {.type = find_type(words, name - 1), .column = SPL_COLUMN_SKIP};
    if (list) {
        p.count_type = find_type(words, 2);
        if (!p.count_type || p.count_type >= SPL_NUMBER_FLOAT32)
            return spl_source_fail_line(source, source->line, "property", err,
                                        "\"%.*s\" is no type for a list's length", (int)words->length[2],
                                        words->word[2]);
    }
    if (!p.type)
        return spl_source_fail_line(source, source->line, "property", err, "unknown type \"%.*s\"",
                                    (int)words->length[name - 1], words->word[name - 1]);
    struct spl_ply_element *element = &header->elements[header->element_count - 1];
    copy_name(p.name, sizeof p.name, words, name);
    p.offset = (uint16_t)element->row_bytes;
    if (header->vertex_line && element == &header->elements[header->vertex]) {
        const char *told = cloud->info.unused + strlen(cloud->info.unused);
        if (has_vertex_property(header, p.name))
            spl_cloud_add_unused(cloud, p.name, strlen(p.name), "again");
        p.packed = spl_packed_take(cloud, p.name, strlen(p.name), spl_number_bytes(p.type), list);
        if (p.packed)
            p.column = SPL_COLUMN_RED;
        else if (!list)
            p.column = (int8_t)spl_cloud_take_column(cloud, words->word[name], words->length[name]);
        if (!list)
            prefer_own_name(cloud, header, &p);
        p.told = *told;
    }
    element->row_bytes += spl_number_bytes(list ? p.count_type : p.type);
    element->lists |= list;
    element->properties++;
    header->properties[header->property_count++] = p;
    return SPL_OK;
}

/* The centres of 3D Gaussians look like points, but what is seen lies between them, and their normals mean nothing.
 * Returns the property that gives them away, whatever gives them colours; NULL: they are none. */
static const char *find_gaussians(const struct spl_ply_header *header)
{
    static const char *const names[][3] = {{"opacity", "scale_0", "rot_0"},
                                           {"packed_position", "packed_rotation", "packed_rotation"}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        bool all = true;
        for (int k = 0; k < 3; k++)
            all &= has_vertex_property(header, names[i][k]);
        if (all)
            return names[i][0];
    }
    return NULL;
}

/* Sets source->newline by the ending of the first line. */
static int find_newline(struct spl_source *source, struct spl_error *err)
{
    const uint8_t *bytes;
    size_t available;
    int code = spl_source_peek(source, 256, &bytes, &available, err);
    if (code < 0)
        return code;
    for (size_t i = 0; i < available && i < 255 && bytes[i] != '\n'; i++)
        if (bytes[i] == '\r') {
            source->newline = i + 1 < available && bytes[i + 1] == '\n' ? '\n' : '\r';
            break;
        }
    return SPL_OK;
}

int spl_ply_parse_header(struct spl_cloud *cloud, struct spl_ply_header *header, struct spl_error *err)
{
    struct spl_source *source = &cloud->source;
    const char *line;
    size_t length;
    struct words words;
    bool have_format = false;

    memset(header, 0, sizeof *header);
    int code = find_newline(source, err);
    while (code == SPL_OK) {
        code = spl_source_line(source, &line, &length, err);
        if (code < 0)
            return code;
        if (code == 0)
            return spl_source_fail_line(source, source->line, "end_header", err,
                                        "is missing: the file ends inside its header");
        code = SPL_OK;
        split(line, length, &words);
        if (words.count == 0 || word_is(&words, 0, "comment") || word_is(&words, 0, "obj_info") || source->line == 1)
            continue;
        if (word_is(&words, 0, "end_header"))
            break;
        if (word_is(&words, 0, "format")) {
            code = parse_format(source, &words, header, err);
            have_format = true;
        } else if (word_is(&words, 0, "element")) {
            code = parse_element(source, &words, header, err);
        } else if (word_is(&words, 0, "property")) {
            code = parse_property(cloud, &words, header, err);
        } else {
            struct spl_fields shown = spl_fields_begin(line, length, ' ');
            char text[32];
            return spl_source_fail_line(source, source->line, "", err,
                                        "\"%s\" is no PLY header keyword (comments begin with \"comment\")",
                                        spl_fields_show(&shown, text));
        }
    }
    if (code < 0)
        return code;
    if (!have_format)
        return spl_source_fail_line(source, source->line, "format", err, "is missing from the header");
    if (!header->vertex_line && header->element_count)
        return spl_source_fail_line(source, source->line, "element vertex", err,
                                    "is missing from the header, which has \"%s\": there are no points to read",
                                    header->elements[0].name);
    if (!header->vertex_line)
        return spl_source_fail_line(source, source->line, "element vertex", err,
                                    "is missing from the header: there are no points to read");
    const char *gaussians = find_gaussians(header);
    if (gaussians)
        return spl_source_fail_line(source, header->vertex_line, gaussians, err,
                                    "is a model of 3D Gaussians (opacity, scale, rot), and no scan: pack takes the "
                                    "points that it was made of, such as a scan or COLMAP's");
    return SPL_OK;
}
