/* Pages of an E57 file, read some at a time and each checked before a byte of it is used.
 *
 * Invariant: the buffer holds `held` whole pages from page `first` on, of which the first `checked` have their
 * checksum. Owned by the thread that reads the file. */
#include "cloud/e57/pages.h"

#include <endian.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "cloud/e57/crc32c.h"

enum { span = 128, few = 4 }; /* pages that are read at once: where one follows the other, and behind a jump */

uint16_t spl_e57_get16(const uint8_t *p)
{
    uint16_t v;
    memcpy(&v, p, sizeof v);
    return le16toh(v);
}

uint32_t spl_e57_get32(const uint8_t *p)
{
    uint32_t v;
    memcpy(&v, p, sizeof v);
    return le32toh(v);
}

uint64_t spl_e57_get64(const uint8_t *p)
{
    uint64_t v;
    memcpy(&v, p, sizeof v);
    return le64toh(v);
}

bool spl_e57_to_logical(const struct spl_e57_pages *pages, uint64_t physical, uint64_t *logical)
{
    if (physical / SPL_E57_PAGE >= pages->count || physical % SPL_E57_PAGE >= SPL_E57_PAGE_DATA)
        return false;
    *logical = physical / SPL_E57_PAGE * SPL_E57_PAGE_DATA + physical % SPL_E57_PAGE;
    return true;
}

/* Pages from `page` on, until it is among those that were checked. */
static int hold(struct spl_e57_pages *pages, uint64_t page, struct spl_error *err)
{
    if (page < pages->first || page - pages->first >= pages->held) {
        uint64_t left = pages->count - page, most = page == pages->first + pages->held ? span : few;
        size_t count = left < most ? (size_t)left : (size_t)most;
        pages->held = pages->checked = 0;
        int code = spl_source_read_at(pages->source, page * SPL_E57_PAGE, pages->buffer, count * SPL_E57_PAGE, err);
        if (code < 0)
            return code;
        pages->first = page;
        pages->held = count;
    }
    while (pages->first + pages->checked <= page) {
        const uint8_t *bytes = pages->buffer + pages->checked * SPL_E57_PAGE;
        uint32_t stated, computed = spl_crc32c(bytes, SPL_E57_PAGE_DATA);
        memcpy(&stated, bytes + SPL_E57_PAGE_DATA, sizeof stated);
        stated = be32toh(stated);
        if (stated != computed)
            return spl_source_fail_at(
                pages->source, (pages->first + pages->checked) * SPL_E57_PAGE, "checksum", err,
                "the page of 1024 bytes has CRC-32C %08x and says %08x: the file is damaged, copy "
                "or export it again",
                computed, stated);
        pages->checked++;
    }
    return SPL_OK;
}

int spl_e57_read(struct spl_e57_pages *pages, uint64_t logical, uint8_t *out, size_t length, struct spl_error *err)
{
    while (length) {
        uint64_t page = logical / SPL_E57_PAGE_DATA;
        size_t at = (size_t)(logical % SPL_E57_PAGE_DATA), count = SPL_E57_PAGE_DATA - at;
        int code = hold(pages, page, err);
        if (code < 0)
            return code;
        count = count < length ? count : length;
        memcpy(out, pages->buffer + (page - pages->first) * SPL_E57_PAGE + at, count);
        logical += count;
        out += count;
        length -= count;
    }
    return SPL_OK;
}

static int check_header(struct spl_e57_pages *pages, const uint8_t *h, struct spl_error *err)
{
    const struct spl_source *source = pages->source;
    uint32_t major = spl_e57_get32(h + 8), minor = spl_e57_get32(h + 12);
    uint64_t bytes = spl_e57_get64(h + 16), xml_at = spl_e57_get64(h + 24), xml_bytes = spl_e57_get64(h + 32),
             page = spl_e57_get64(h + 40);
    if (major != 1)
        return spl_source_fail(source, SPL_E_UNSUPPORTED, "version", err,
                               "offset 8: E57 %u.%u is not known here (1.0 is): export it as 1.0", major, minor);
    if (page != SPL_E57_PAGE)
        return spl_source_fail(source, SPL_E_UNSUPPORTED, "page size", err,
                               "offset 40: %llu; E57 1.0 has pages of 1024 bytes", (unsigned long long)page);
    if (bytes == 0 || bytes % SPL_E57_PAGE)
        return spl_source_fail_at(source, 16, "file length", err, "%llu bytes are no whole pages of 1024",
                                  (unsigned long long)bytes);
    if (bytes > source->size)
        return spl_source_fail_at(source, 16, "file length", err,
                                  "%llu bytes, but there are %llu: the file is cut off, copy or export it again",
                                  (unsigned long long)bytes, (unsigned long long)source->size);
    pages->count = bytes / SPL_E57_PAGE;
    if (!spl_e57_to_logical(pages, xml_at, &pages->xml_at))
        return spl_source_fail_at(source, 24, "XML offset", err, "%llu lies outside the data of the file's %llu bytes",
                                  (unsigned long long)xml_at, (unsigned long long)bytes);
    if (xml_bytes == 0 || xml_bytes > spl_e57_logical_bytes(pages) - pages->xml_at)
        return spl_source_fail_at(source, 32, "XML length", err,
                                  "%llu bytes from offset %llu do not fit the file's %llu",
                                  (unsigned long long)xml_bytes, (unsigned long long)xml_at, (unsigned long long)bytes);
    pages->xml_bytes = xml_bytes;
    return SPL_OK;
}

int spl_e57_pages_init(struct spl_e57_pages *pages, const struct spl_source *source, struct spl_error *err)
{
    uint8_t header[SPL_E57_HEADER];
    *pages = (struct spl_e57_pages){.source = source};
    if (source->size < sizeof header)
        return spl_source_fail_at(source, source->size, "", err, "the file ends inside the E57 header of %d bytes",
                                  SPL_E57_HEADER);
    int code = spl_source_read_at(source, 0, header, sizeof header, err);
    if (code == SPL_OK)
        code = check_header(pages, header, err);
    if (code == SPL_OK && !(pages->buffer = spl_alloc_raw(span, SPL_E57_PAGE, err)))
        code = SPL_E_NOMEM;
    if (code == SPL_OK)
        code = spl_e57_read(pages, 0, header, sizeof header, err);
    if (code < 0)
        spl_e57_pages_finish(pages);
    return code;
}

void spl_e57_pages_finish(struct spl_e57_pages *pages)
{
    free(pages->buffer);
    *pages = (struct spl_e57_pages){0};
}
