/* The writer: streams as whole strings of bits first, then cut into packets, sections, at last pages. One thread. */
#include "support/e57_writer.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { page = 1024, page_data = 1020, header = 48 };

static uint64_t physical(uint64_t logical)
{
    return logical / page_data * page + logical % page_data;
}

static void put(struct e57_writer *w, const void *bytes, size_t length)
{
    if (w->length + length > w->capacity) {
        w->capacity = 2 * (w->length + length);
        w->data = realloc(w->data, w->capacity);
        if (!w->data)
            abort();
    }
    if (length)
        memcpy(w->data + w->length, bytes, length);
    w->length += length;
}

static void set(uint8_t *to, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++)
        to[i] = (uint8_t)(value >> 8 * i);
}

static void print(char **text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void print(char **text, const char *format, ...)
{
    va_list args;
    char *old = *text, *more;
    va_start(args, format);
    if (vasprintf(&more, format, args) < 0 || asprintf(text, "%s%s", old ? old : "", more) < 0)
        abort();
    va_end(args);
    free(old);
    free(more);
}

const char *e57_pose(double w, double x, double y, double z, double tx, double ty, double tz)
{
    static char text[1024];
    snprintf(text, sizeof text,
             "<pose type=\"Structure\"><rotation type=\"Structure\"><w type=\"Float\">%.17g</w>"
             "<x type=\"Float\">%.17g</x><y type=\"Float\">%.17g</y><z type=\"Float\">%.17g</z></rotation>"
             "<translation type=\"Structure\"><x type=\"Float\">%.17g</x><y type=\"Float\">%.17g</y>"
             "<z type=\"Float\">%.17g</z></translation></pose>",
             w, x, y, z, tx, ty, tz);
    return text;
}

void e57_begin(struct e57_writer *w)
{
    *w = (struct e57_writer){0};
    put(w, (uint8_t[header]){0}, header);
    print(&w->scans, "%s", "");
}

/* All values of a field as bits, from the low end of each byte. */
static uint8_t *make_stream(const struct e57_field *f, size_t points, size_t *length)
{
    unsigned bits = f->type == E57_DOUBLE ? 64 : f->type == E57_SINGLE ? 32 : 0;
    if (f->type == E57_INTEGER || f->type == E57_SCALED)
        for (uint64_t span = (uint64_t)f->most - (uint64_t)f->least; span; span >>= 1)
            bits++;
    if (f->type == E57_TEXT) /* each "a": its length doubled, its byte */
        bits = 16;
    uint8_t *stream = calloc(points * bits / 8 + 1, 1);
    if (!stream)
        abort();
    for (size_t i = 0, at = 0; i < points; i++) {
        uint64_t value = f->type == E57_TEXT ? 'a' << 8 | 2 : 0;
        float single = f->values ? (float)f->values[i] : 0;
        if (f->type == E57_DOUBLE && f->values)
            memcpy(&value, &f->values[i], sizeof value);
        else if (f->type == E57_SINGLE)
            memcpy(&value, &single, sizeof single);
        else if (f->raw)
            value = (uint64_t)f->raw[i] - (uint64_t)f->least;
        for (unsigned b = 0; b < bits; b++, at++)
            stream[at / 8] |= (uint8_t)((value >> b & 1) << at % 8);
    }
    *length = (points * bits + 7) / 8;
    return stream;
}

static void put_others(struct e57_writer *w)
{
    uint8_t index[32] = {0, 0, 31, 0, 1}, ignored[8] = {2, 0, 7, 0};
    put(w, index, sizeof index);
    put(w, ignored, sizeof ignored);
    put(w, (uint8_t[4]){2, 0, 3, 0}, 4);
}

static void put_packets(struct e57_writer *w, const struct e57_scan *scan)
{
    uint8_t **streams = calloc(scan->field_count + 1, sizeof *streams);
    size_t *left = calloc(scan->field_count + 1, sizeof *left), *at = calloc(scan->field_count + 1, sizeof *at);
    size_t rest = 0;
    for (size_t i = 0; i < scan->field_count; i++) {
        streams[i] = make_stream(&scan->fields[i], scan->points, &left[i]);
        rest += left[i];
    }
    while (rest) {
        uint8_t head[6] = {1, 0};
        size_t start = w->length, sizes = start + sizeof head;
        if (scan->packets & E57_OTHER_PACKETS) {
            put_others(w);
            start = w->length;
            sizes = start + sizeof head;
        }
        set(head + 4, scan->field_count, 2);
        put(w, head, sizeof head);
        for (size_t i = 0; i < scan->field_count; i++)
            put(w, (uint8_t[2]){0}, 2);
        for (size_t i = 0; i < scan->field_count; i++) {
            size_t step = scan->fields[i].step ? scan->fields[i].step : 100, count = step < left[i] ? step : left[i];
            set(w->data + sizes + 2 * i, count, 2);
            put(w, streams[i] + at[i], count);
            at[i] += count;
            left[i] -= count;
            rest -= count;
        }
        put(w, (uint8_t[4]){0}, (4 - (w->length - start) % 4) % 4);
        set(w->data + start + 2, w->length - start - 1, 2);
    }
    for (size_t i = 0; i < scan->field_count; i++)
        free(streams[i]);
    free(streams);
    free(left);
    free(at);
}

static void print_field(char **xml, const struct e57_field *f)
{
    print(xml, "<%s type=\"%s\"", f->name,
          f->type == E57_INTEGER  ? "Integer"
          : f->type == E57_SCALED ? "ScaledInteger"
          : f->type == E57_TEXT   ? "String"
                                  : "Float");
    if (f->type == E57_SINGLE)
        print(xml, " precision=\"single\"");
    if (f->type == E57_INTEGER || f->type == E57_SCALED)
        print(xml, " minimum=\"%lld\" maximum=\"%lld\"", (long long)f->least, (long long)f->most);
    if (f->type == E57_SCALED)
        print(xml, " scale=\"%.17g\" offset=\"%.17g\"", f->scale, f->offset);
    print(xml, "/>\n");
}

void e57_add_scan(struct e57_writer *w, const struct e57_scan *scan)
{
    uint8_t section[32] = {1};
    put(w, (uint8_t[4]){0}, (4 - w->length % 4) % 4);
    size_t at = w->length;
    put(w, section, sizeof section);
    put_packets(w, scan);
    set(w->data + at + 8, w->length - at, 8);
    set(w->data + at + 16, physical(at + sizeof section), 8);
    print(
        &w->scans,
        "<vectorChild type=\"Structure\"><guid type=\"String\">{%s}</guid><name type=\"String\"><![CDATA[%s]]></name>%s"
        "<points type=\"CompressedVector\" fileOffset=\"%llu\" recordCount=\"%zu\"><prototype type=\"Structure\">\n",
        scan->name, scan->name, scan->more ? scan->more : "", (unsigned long long)physical(at), scan->points);
    for (size_t i = 0; i < scan->field_count; i++)
        print_field(&w->scans, &scan->fields[i]);
    print(&w->scans, "</prototype><codecs type=\"Vector\"/></points></vectorChild>\n");
}

uint64_t e57_add_blob(struct e57_writer *w, const void *bytes, size_t length)
{
    uint8_t section[16] = {0};
    put(w, (uint8_t[4]){0}, (4 - w->length % 4) % 4);
    size_t at = w->length;
    set(section + 8, sizeof section + length, 8);
    put(w, section, sizeof section);
    put(w, bytes, length);
    return physical(at);
}

void e57_add_image(struct e57_writer *w, const char *format, ...)
{
    va_list args;
    char *text;
    va_start(args, format);
    if (vasprintf(&text, format, args) < 0)
        abort();
    va_end(args);
    print(&w->images, "<vectorChild type=\"Structure\">%s</vectorChild>\n", text);
    free(text);
}

uint8_t *e57_end(struct e57_writer *w, const char *root, size_t *length)
{
    char *xml = NULL;
    print(&xml,
          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<e57Root type=\"Structure\" "
          "xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\">%s\n<data3D type=\"Vector\">\n%s</data3D>\n",
          root ? root : "", w->scans);
    if (w->images)
        print(&xml, "<images2D type=\"Vector\">%s</images2D>", w->images);
    print(&xml, "</e57Root>\n");
    put(w, xml, strlen(xml));
    uint8_t *file = e57_make(w->data + header, w->length - header, strlen(xml), length);
    free(xml);
    free(w->data);
    free(w->scans);
    free(w->images);
    *w = (struct e57_writer){0};
    return file;
}

uint8_t *e57_make(const void *data, size_t length, size_t xml, size_t *out)
{
    size_t logical = header + length, pages = (logical + page_data - 1) / page_data;
    uint8_t *file = calloc(pages, page), h[header] = "ASTM-E57";
    if (!file)
        abort();
    set(h + 8, 1, 4);
    set(h + 16, pages * page, 8);
    set(h + 24, physical(logical - xml), 8);
    set(h + 32, xml, 8);
    set(h + 40, page, 8);
    for (size_t i = 0; i < logical; i++)
        file[physical(i)] = i < header ? h[i] : ((const uint8_t *)data)[i - header];
    *out = pages * page;
    e57_seal(file, *out);
    return file;
}

void e57_seal(uint8_t *file, size_t length)
{
    for (size_t at = 0; at + page <= length; at += page) {
        uint32_t crc = ~0u;
        for (size_t i = 0; i < page_data; i++) {
            crc ^= file[at + i];
            for (int bit = 0; bit < 8; bit++)
                crc = crc >> 1 ^ (crc & 1 ? 0x82f63b78 : 0);
        }
        for (int i = 0; i < 4; i++)
            file[at + page_data + (size_t)i] = (uint8_t)(~crc >> (24 - 8 * i));
    }
}
