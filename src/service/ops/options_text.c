/* The table of parameters as text: flags for --help, the manual page of the config file, JSON for /v1/status. Pure
 * functions of the table and of values. */
#include <inttypes.h>
#include <string.h>

#include "service/ops/options.h"

enum { column = 30, width = 120 };

/* Range and default, for those types that have them. */
static void print_facts(FILE *out, const struct spl_parameter *p)
{
    switch (p->type) {
    case SPL_PARAMETER_COUNT:
    case SPL_PARAMETER_BYTES:
        if (p->most == UINT64_MAX)
            fprintf(out, "from %" PRIu64 " %s on", p->least, p->unit);
        else
            fprintf(out, "%" PRIu64 " to %" PRIu64 " %s", p->least, p->most, p->unit);
        fprintf(out, "; default %s", p->fallback);
        break;
    case SPL_PARAMETER_CHOICE:
        fprintf(out, "%s; default %s", p->unit, p->fallback);
        break;
    case SPL_PARAMETER_FLAG:
        fprintf(out, "true or false; default %s", p->fallback);
        break;
    case SPL_PARAMETER_TEXT:
        fprintf(out, "default %s", *p->fallback ? p->fallback : "none");
        break;
    case SPL_PARAMETER_LIST:
        fprintf(out, "may be given several times");
        break;
    }
}

static const char *placeholder(const struct spl_parameter *p)
{
    switch (p->type) {
    case SPL_PARAMETER_FLAG:
        return "";
    case SPL_PARAMETER_COUNT:
        return "N";
    case SPL_PARAMETER_BYTES:
        return "BYTES";
    case SPL_PARAMETER_CHOICE:
        return "NAME";
    default:
        return p->unit;
    }
}

/* Words of `text`, broken before `width`, each line from `column` on. */
static void print_wrapped(FILE *out, const char *text, int at)
{
    bool first = true;
    while (*(text += strspn(text, " "))) {
        int length = (int)strcspn(text, " ");
        if (!first && at + 1 + length > width) {
            fprintf(out, "\n%*s", column, "");
            at = column;
            first = true;
        }
        fprintf(out, "%s%.*s", first ? "" : " ", length, text);
        at += length + !first;
        first = false;
        text += length;
    }
}

void spl_parameters_print_help(FILE *out)
{
    for (size_t i = 0; i < SPL_PARAMETERS; i++) {
        const struct spl_parameter *p = &spl_parameters[i];
        char flag[64], facts[1024] = "";
        bool on = p->type == SPL_PARAMETER_FLAG && !strcmp(p->fallback, "true");
        snprintf(flag, sizeof flag, "--%s%s%s%s", on ? "no-" : "", p->name, *placeholder(p) ? " " : "", placeholder(p));
        FILE *memory = fmemopen(facts, sizeof facts, "w");
        if (memory) {
            fprintf(memory, "%s%s", on ? "do not " : "", p->text);
            if (p->type != SPL_PARAMETER_FLAG) {
                fprintf(memory, " (");
                print_facts(memory, p);
                fprintf(memory, ")");
            }
            fclose(memory);
        }
        fprintf(out, "      %-*s ", column - 7, flag);
        print_wrapped(out, facts, column);
        fputc('\n', out);
    }
}

/* Paths say where things lie on the server, which is no client's business. */
static bool is_path(const struct spl_parameter *p)
{
    return !strcmp(p->unit, "PATH") || !strcmp(p->unit, "FILE") || !strcmp(p->unit, "DIR");
}

/* Text between roff's special characters. */
static void print_roff(FILE *out, const char *text)
{
    for (; *text; text++) {
        if (*text == '\\')
            fputs("\\e", out);
        else if (*text == '\'')
            fputs("\\(aq", out);
        else
            fprintf(out, "%s%c", *text == '-' ? "\\" : "", *text);
    }
}

void spl_parameters_print_manual(FILE *out)
{
    fprintf(out, ".TH SPLATD.CONF 5 \"\" \"splatd %s\"\n.SH NAME\nsplatd.conf \\- parameters of splatd serve\n",
            SPLATD_VERSION);
    fprintf(out,
            ".SH DESCRIPTION\n"
            "Read by \\fBsplatd serve \\-\\-config\\fR \\fIFILE\\fR. One \\fIname\\fR = \\fIvalue\\fR a line; blank "
            "lines and lines that begin with # are left out. There are no quotes and no escapes. Each name is also "
            "a flag, \\-\\-\\fIname\\fR \\fIvalue\\fR (a switch: \\-\\-\\fIname\\fR or \\-\\-no\\-\\fIname\\fR), and "
            "a flag wins over the file. \\fB/v1/status\\fR shows what is in use, but no paths.\n.SH PARAMETERS\n");
    for (size_t i = 0; i < SPL_PARAMETERS; i++) {
        const struct spl_parameter *p = &spl_parameters[i];
        fprintf(out, ".TP\n.B ");
        print_roff(out, p->name);
        fprintf(out, "\n");
        print_roff(out, p->text);
        fprintf(out, " (");
        print_facts(out, p);
        fprintf(out, ").\n");
    }
    fprintf(out, ".SH EXAMPLE\n.nf\n# two scans, a longer queue\ndataset = /srv/scans/hall.spld\n"
                 "dataset = /srv/scans/yard.spld\nqueue = 64\n.fi\n.SH SEE ALSO\nsplatd serve \\-\\-help\n");
}

static json_t *describe_list(const struct spl_text_list *list)
{
    json_t *json = json_array();
    for (size_t i = 0; i < list->count; i++)
        json_array_append_new(json, json_string(list->items[i]));
    return json;
}

static json_t *describe_choice(const char *names, uint64_t index)
{
    while (index--)
        names = strchr(names, '|') + 1;
    return json_stringn(names, strcspn(names, "|"));
}

json_t *spl_service_options_describe(const struct spl_service_options *options)
{
    json_t *json = json_object();
    for (size_t i = 0; i < SPL_PARAMETERS; i++) {
        const struct spl_parameter *p = &spl_parameters[i];
        const void *value = (const char *)options + p->offset;
        json_t *item = NULL;
        if (is_path(p))
            continue;
        switch (p->type) {
        case SPL_PARAMETER_TEXT:
            item = json_string(*(char *const *)value);
            break;
        case SPL_PARAMETER_LIST:
            item = describe_list(value);
            break;
        case SPL_PARAMETER_FLAG:
            item = json_boolean(*(const bool *)value);
            break;
        case SPL_PARAMETER_COUNT:
        case SPL_PARAMETER_BYTES:
            item = json_integer((json_int_t) * (const uint64_t *)value);
            break;
        case SPL_PARAMETER_CHOICE:
            item = describe_choice(p->unit, *(const uint64_t *)value);
            break;
        }
        json_object_set_new(json, p->name, item);
    }
    return json;
}
