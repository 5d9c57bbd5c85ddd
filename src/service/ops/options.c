/* Values of parameters: text in, checked values out, one range check for flags and config files alike.
 *
 * Invariant: every TEXT and every item of a LIST is ours, malloc'd, and no TEXT is NULL. Not for several threads; the
 * service reads its options only. */
#include "service/ops/options.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "base/array.h"
#include "base/memory.h"
#include "service/access/host.h"
#include "service/listen.h"

const struct spl_parameter spl_parameters[SPL_PARAMETERS] = {
#define PARAMETER(field, name, type, fallback, least, most, unit, text)                                                \
    {name, SPL_PARAMETER_##type, fallback, least, most, unit, text, offsetof(struct spl_service_options, field)},
#include "service/ops/params.def"
#undef PARAMETER
};

static void *member(struct spl_service_options *options, size_t index)
{
    return (char *)options + spl_parameters[index].offset;
}

size_t spl_parameter_find(const char *name)
{
    size_t i = 0;
    while (i < SPL_PARAMETERS && strcmp(name, spl_parameters[i].name))
        i++;
    return i;
}

/* The number in `text`, all of it; false when it is none or beyond the parameter's range. */
static bool parse_number(const struct spl_parameter *parameter, const char *text, uint64_t *out)
{
    bool plain = parameter->type != SPL_PARAMETER_BYTES && text[strspn(text, "0123456789")];
    return !plain && spl_bytes_from_text(text, 1, out) && *out >= parameter->least && *out <= parameter->most;
}

/* Where `text` stands in the names of a CHOICE. */
static bool parse_choice(const char *names, const char *text, uint64_t *out)
{
    size_t length = strlen(text);
    *out = 0;
    for (const char *at = names; length && !strchr(text, '|'); (*out)++) {
        if (!strncmp(at, text, length) && (at[length] == '|' || !at[length]))
            return true;
        if (!(at = strchr(at, '|')))
            return false;
        at++;
    }
    return false;
}

static bool is_address(const char *text)
{
    char host[SPL_LISTEN_TEXT], *name, *port;
    return spl_listen_split(text, host, &name, &port);
}

static bool is_address_or_none(const char *text)
{
    return !*text || is_address(text);
}

/* scheme "://" host [":" port], as a browser writes it. */
static bool is_origin(const char *text)
{
    const char *authority = strstr(text, "://");
    static const struct spl_text_list none;
    return !strcmp(text, "*") || (authority && authority > text && spl_origin_is_ours(text, authority + 3, &none));
}

static bool is_name(const char *text)
{
    return !strcmp(text, "*") || spl_host_is_name(text);
}

static bool is_some(const char *text)
{
    return *text;
}

/* The forms of TEXT and LIST that can be told without looking outside; the first that fits counts. */
static const struct form {
    const char *unit, *name; // may be NULL: any parameter of that unit
    bool (*is)(const char *text);
    const char *shown;
} forms[] = {
    {"ADDR:PORT", "ops-listen", is_address_or_none, "ADDR:PORT such as 127.0.0.1:8081 or [::1]:8081, or nothing"},
    {"ADDR:PORT", NULL, is_address, "ADDR:PORT such as 127.0.0.1:8080 or [::1]:8080"},
    {"ORIGIN", NULL, is_origin, "an origin such as https://dash.example, or *"},
    {"NAME", NULL, is_name, "a host's name without a port such as scans.example, or *"},
    {"PATH", NULL, is_some, "a value (PATH)"},
};

/* NULL: anything goes. */
static const struct form *form_of(const struct spl_parameter *parameter)
{
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++)
        if (!strcmp(forms[i].unit, parameter->unit) && (!forms[i].name || !strcmp(forms[i].name, parameter->name)))
            return &forms[i];
    return NULL;
}

static int refuse(const struct spl_parameter *parameter, const char *text, const char *where, struct spl_error *err)
{
    char range[160];
    switch (parameter->type) {
    case SPL_PARAMETER_FLAG:
        snprintf(range, sizeof range, "true or false");
        break;
    case SPL_PARAMETER_CHOICE:
        snprintf(range, sizeof range, "one of %s", parameter->unit);
        break;
    case SPL_PARAMETER_COUNT:
    case SPL_PARAMETER_BYTES:
        snprintf(range, sizeof range, "a whole number of %s from %" PRIu64 " to %" PRIu64 "%s", parameter->unit,
                 parameter->least, parameter->most,
                 parameter->type == SPL_PARAMETER_BYTES ? ", or such with K, M, G or T" : "");
        break;
    default:
        snprintf(range, sizeof range, "%s", form_of(parameter)->shown);
        break;
    }
    return spl_fail_field(err, SPL_E_USAGE, parameter->name, "%.200s%s takes %s, not '%.80s'", where, parameter->name,
                          range, text);
}

static int add_item(struct spl_text_list *list, const char *text, struct spl_error *err)
{
    if (spl_array_reserve(list->items, list->capacity, list->count + 1, err))
        return SPL_E_NOMEM;
    if (!(list->items[list->count] = strdup(text)))
        return spl_fail(err, SPL_E_NOMEM, "out of memory for '%.80s'", text);
    list->count++;
    return 0;
}

static void clear_list(struct spl_text_list *list)
{
    for (size_t i = 0; i < list->count; i++)
        free(list->items[i]);
    free(list->items);
    *list = (struct spl_text_list){0};
}

static int set_text(char **out, const char *text, struct spl_error *err)
{
    char *copy = strdup(text);
    if (!copy)
        return spl_fail(err, SPL_E_NOMEM, "out of memory for '%.80s'", text);
    free(*out);
    *out = copy;
    return 0;
}

int spl_service_options_set(struct spl_service_options *options, size_t index, const char *text, enum spl_origin origin,
                            const char *where, struct spl_error *err)
{
    const struct spl_parameter *parameter = &spl_parameters[index];
    void *out = member(options, index);
    struct spl_service_options scratch; /* a weaker origin's value is checked all the same */
    bool weaker = origin < options->origin[index], valid = true;
    if (weaker) {
        memset(&scratch, 0, sizeof scratch);
        out = member(&scratch, index);
    }
    int rc = 0;
    switch (parameter->type) {
    case SPL_PARAMETER_TEXT:
        valid = !form_of(parameter) || form_of(parameter)->is(text);
        rc = weaker || !valid ? 0 : set_text(out, text, err);
        break;
    case SPL_PARAMETER_LIST:
        valid = form_of(parameter)->is(text);
        if (!weaker && origin > options->origin[index])
            clear_list(out);
        rc = weaker || !valid ? 0 : add_item(out, text, err);
        break;
    case SPL_PARAMETER_FLAG:
        valid = !strcmp(text, "true") || !strcmp(text, "false");
        *(bool *)out = valid ? text[0] == 't' : *(bool *)out;
        break;
    case SPL_PARAMETER_COUNT:
    case SPL_PARAMETER_BYTES:
        valid = parse_number(parameter, text, out);
        break;
    case SPL_PARAMETER_CHOICE:
        valid = parse_choice(parameter->unit, text, out);
        break;
    }
    if (!valid)
        return refuse(parameter, text, where, err);
    if (!rc && !weaker) {
        options->origin[index] = origin;
        free(options->where[index]);
        options->where[index] = origin == SPL_FROM_FILE ? strdup(where) : NULL; // without memory only a message is less
    }
    return rc;
}

void spl_service_options_locate(const struct spl_service_options *options, const char *name, char *out,
                                size_t capacity)
{
    size_t index = spl_parameter_find(name);
    bool known = index < SPL_PARAMETERS && options->where[index];
    snprintf(out, capacity, "%s", known ? options->where[index] : "");
}

int spl_service_options_check(const struct spl_service_options *options, struct spl_error *err)
{
    const enum spl_origin *origin = options->origin;
    size_t port = strlen(options->listen) - 2;
    if (*options->url_key && !*options->tokens)
        return spl_fail_field(err, SPL_E_USAGE, "url-key", "--url-key without --tokens: everybody may view anyway");
    if (!strcmp(options->listen, options->ops_listen) && strcmp(options->listen + port, ":0"))
        return spl_fail_field(err, SPL_E_USAGE, "ops-listen", "--ops-listen must differ from --listen, not be %s",
                              options->ops_listen);
    if (origin[SPL_PARAMETER_connections_per_address] && options->connections_per_address > options->connections)
        return spl_fail_field(err, SPL_E_USAGE, "connections-per-address",
                              "--connections-per-address takes at most what --connections allows in all, %" PRIu64
                              ", not %" PRIu64, options->connections, options->connections_per_address);
    if (options->rate_limit_total && options->rate_limit > options->rate_limit_total)
        return spl_fail_field(err, SPL_E_USAGE, "rate-limit",
                              "--rate-limit takes at most what --rate-limit-total allows all together, %" PRIu64
                              ", not %" PRIu64, options->rate_limit_total, options->rate_limit);
    return 0;
}

int spl_service_options_init(struct spl_service_options *options, struct spl_error *err)
{
    int rc = 0;
    memset(options, 0, sizeof *options);
    for (size_t i = 0; !rc && i < SPL_PARAMETERS; i++)
        if (spl_parameters[i].type != SPL_PARAMETER_LIST)
            rc = spl_service_options_set(options, i, spl_parameters[i].fallback, SPL_FROM_DEFAULT, "default: ", err);
    if (rc)
        spl_service_options_finish(options);
    return rc;
}

void spl_service_options_finish(struct spl_service_options *options)
{
    for (size_t i = 0; i < SPL_PARAMETERS; i++) {
        free(options->where[i]);
        if (spl_parameters[i].type == SPL_PARAMETER_TEXT)
            free(*(char **)member(options, i));
        if (spl_parameters[i].type == SPL_PARAMETER_LIST)
            clear_list(member(options, i));
    }
    memset(options, 0, sizeof *options);
}
