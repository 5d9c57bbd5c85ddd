/* The page: src/measure/page.html with its places filled in. What comes from files is text (escaped) or JSON in which
 * no '<' stands, so that no name can end the script element that holds it. Any thread. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <splatd/method.h>

#include "base/memory.h"
#include "measure/markup.h"
#include "measure/page_html.h" /* made from page.html: unsigned char page_html[] */
#include "measure/report.h"

struct page {
    const struct spl_report *report;
    const struct spl_peers *peers;
    const char *svg;
    FILE *out;
};

static int write_report(struct page *page, struct spl_error *err)
{
    json_t *root = spl_report_to_json(page->report, page->peers);
    char *text = root ? json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(6)) : NULL;
    json_decref(root);
    if (!text)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the report could not be written");
    for (const char *c = text; *c; c++)
        if (*c == '<')
            fputs("\\u003c", page->out);
        else
            fputc(*c, page->out);
    free(text);
    return SPL_OK;
}

static int write_picture(struct page *page, enum spl_sweep_picture kind, size_t view, size_t setting,
                         struct spl_error *err)
{
    char path[4096], part[3 << 12];
    spl_sweep_picture_path(page->report->sweep->options, kind, view, setting, path);
    FILE *file = fopen(path, "r");
    if (!file)
        return spl_fail_errno(err, errno, "cannot open %s; measure anew with --restart", path);
    size_t length;
    fputc('"', page->out);
    while ((length = fread(part, 1, sizeof part, file)) > 0)
        spl_markup_base64(page->out, part, length);
    fputc('"', page->out);
    int rc = ferror(file) ? spl_fail(err, SPL_E_IO, "cannot read %s", path) : SPL_OK;
    fclose(file);
    return rc;
}

static int write_row(struct page *page, const char *key, enum spl_sweep_picture kind, size_t view,
                     struct spl_error *err)
{
    int rc = SPL_OK;
    fprintf(page->out, ",\n\"%s\":[", key);
    for (size_t s = 0; !rc && s < page->report->profile.count; s++) {
        fputs(s ? ",\n" : "", page->out);
        rc = write_picture(page, kind, view, s, err);
    }
    fputc(']', page->out);
    return rc;
}

/* The picture that settings are compared with, of all that are solid, or of all that are not; null where none is. */
static int write_reference(struct page *page, size_t view, bool soft, struct spl_error *err)
{
    const struct spl_profile *profile = &page->report->profile;
    size_t s = 0;
    while (s < profile->count && (profile->points[s].setting.soft > 0) != soft)
        s++;
    if (s < profile->count)
        return write_picture(page, SPL_SWEEP_REFERENCE, view, s, err);
    fputs("null", page->out);
    return SPL_OK;
}

static int write_pictures(struct page *page, struct spl_error *err)
{
    size_t views = page->report->sweep->options->views->count;
    int rc = SPL_OK;
    fputc('[', page->out);
    for (size_t i = 0; !rc && i < spl_sweep_page_views(views); i++) {
        size_t view = spl_sweep_page_view(views, i);
        fprintf(page->out, "%s{\"view\":%zu,\"reference\":", i ? ",\n" : "", view);
        rc = write_reference(page, view, false, err);
        if (!rc) {
            fputs(",\n\"soft_reference\":", page->out);
            rc = write_reference(page, view, true, err);
        }
        if (!rc)
            rc = write_row(page, "render", SPL_SWEEP_RENDER, view, err);
        if (!rc)
            rc = write_row(page, "error", SPL_SWEEP_ERROR, view, err);
        fputc('}', page->out);
    }
    fputc(']', page->out);
    return rc;
}

static int write_title(struct page *page, struct spl_error *err)
{
    (void)err;
    spl_markup_text(page->out, page->report->profile.dataset_id);
    fputs(": accuracy against time", page->out);
    return SPL_OK;
}

static int write_svg(struct page *page, struct spl_error *err)
{
    (void)err;
    fputs(page->svg, page->out);
    return SPL_OK;
}

static int write_method(struct page *page, struct spl_error *err)
{
    (void)err;
    spl_markup_text(page->out, spl_method_name(SPL_METHOD_DEFAULT));
    return SPL_OK;
}

static int write_atoms(struct page *page, struct spl_error *err)
{
    (void)err;
    fprintf(page->out, "%g", spl_method_param_get(SPL_PARAM_atoms)->otherwise);
    return SPL_OK;
}

static int fill_template(struct page *page, struct spl_error *err)
{
    static const struct {
        const char *mark;
        int (*write)(struct page *, struct spl_error *);
    } places[] = {{"@TITLE@", write_title}, {"@METHOD@", write_method}, {"@ATOMS@", write_atoms},
                  {"@CHART@", write_svg},   {"@REPORT@", write_report}, {"@PICTURES@", write_pictures}};
    int rc = SPL_OK;
    for (const char *at = (const char *)page_html; !rc && *at;) {
        size_t i = 0, count = sizeof places / sizeof *places;
        while (*at == '@' && i < count && strncmp(at, places[i].mark, strlen(places[i].mark)))
            i++;
        if (*at != '@' || i == count) {
            fputc(*at++, page->out);
            continue;
        }
        at += strlen(places[i].mark);
        rc = places[i].write(page, err);
    }
    return rc;
}

int spl_page_write(const struct spl_report *report, const struct spl_peers *peers, const char *svg, char **html,
                   size_t *length, struct spl_error *err)
{
    *html = NULL;
    *length = 0;
    struct page page = {.report = report, .peers = peers, .svg = svg, .out = open_memstream(html, length)};
    if (!page.out)
        return spl_fail(err, SPL_E_NOMEM, "out of memory: the page could not be written");
    int rc = fill_template(&page, err);
    bool failed = ferror(page.out);
    failed |= fclose(page.out) != 0;
    if (!rc && failed)
        rc = spl_fail(err, SPL_E_NOMEM, "out of memory: the page could not be written");
    if (rc) {
        free(*html);
        *html = NULL;
        *length = 0;
    }
    return rc;
}
