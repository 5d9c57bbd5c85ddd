/* getopt_long reads the command line, from a table that is made of the rows, so that options may be cut short and stand
 * behind operands as everywhere. What it would say itself is said here, with what was probably meant. One thread. */
#include "cmd/table.h"

#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/memory.h"
#include "base/near_name.h"
#include "cmd/options.h"

enum {
    first_row = 256,    /* what getopt returns for a row: this and its index */
    help_column = 29,   /* of what an option is for, at most */
    names_room = 2 << 8 /* for the names of a choice */
};

/* "a, b or c" */
static void join(const char *const *names, char out[names_room])
{
    size_t used = 0;
    out[0] = '\0';
    for (size_t i = 0; names[i] && used < names_room; i++) {
        const char *before = !i ? "" : names[i + 1] ? ", " : " or ";
        used += (size_t)snprintf(out + used, names_room - used, "%s%s", before, names[i]);
    }
}

static int take_choice(const struct spl_cmd_option *o, const char *option, const char *text, int *out,
                       struct spl_error *err)
{
    char all[names_room];
    for (int i = 0; o->names[i]; i++)
        if (!strcmp(text, o->names[i])) {
            *out = i;
            return SPL_OK;
        }
    join(o->names, all);
    return spl_fail_field(err, SPL_E_USAGE, o->name, "%s takes %s, not '%.32s'", option, all, text);
}

int spl_cmd_take_name(const char *option, const char *text, int (*from_name)(const char *),
                      const char *(*name_of)(int place), int count, int *out, struct spl_error *err)
{
    const char *names[SPL_CMD_NAMES_MAX + 1] = {0};
    char all[names_room];
    *out = from_name(text);
    if (*out >= 0)
        return SPL_OK;
    spl_assert(count <= SPL_CMD_NAMES_MAX);
    for (int i = 0; i < count; i++)
        names[i] = name_of(i);
    join(names, all);
    return spl_fail_field(err, SPL_E_USAGE, option + strspn(option, "-"), "%s takes %s, not '%.32s'", option, all,
                          text);
}

static int take_count_32(const struct spl_cmd_option *o, const char *option, const char *text, uint32_t *out,
                         struct spl_error *err)
{
    uint64_t count = 0;
    int rc = spl_cmd_parse_count(option, text, o->least, o->most, &count, err);
    if (!rc)
        *out = (uint32_t)count;
    return rc;
}

static int take(const struct spl_cmd_option *o, void *arguments, char *text, struct spl_error *err)
{
    char option[64];
    void *member = (char *)arguments + o->offset;
    snprintf(option, sizeof option, "--%s", o->name);
    switch (o->kind) {
    case SPL_CMD_KIND_FLAG:
        *(bool *)member = true;
        return SPL_OK;
    case SPL_CMD_KIND_TEXT:
        *(const char **)member = text;
        return SPL_OK;
    case SPL_CMD_KIND_REAL:
        return spl_cmd_parse_real(option, text, o->from, o->to, member, err);
    case SPL_CMD_KIND_COUNT:
        return spl_cmd_parse_count(option, text, o->least, o->most, member, err);
    case SPL_CMD_KIND_COUNT_32:
        return take_count_32(o, option, text, member, err);
    case SPL_CMD_KIND_MIB:
        return spl_cmd_parse_bytes(option, text, 1 << 20, o->least, o->most, member, err);
    case SPL_CMD_KIND_BYTES:
        return spl_cmd_parse_bytes(option, text, 1, o->least, o->most, member, err);
    case SPL_CMD_KIND_VECTOR:
        return spl_cmd_parse_vector(option, text, member, err);
    case SPL_CMD_KIND_PIXELS:
        return spl_cmd_parse_size(option, text, member, (uint32_t *)member + 1, err);
    case SPL_CMD_KIND_CHOICE:
        return take_choice(o, option, text, member, err);
    case SPL_CMD_KIND_OWN:
        break;
    }
    return o->take(arguments, option, text, err);
}

/* A copy, since what takes an argument may cut it in place. Only kinds that keep no pointer into it have one. */
static int take_fallback(const struct spl_cmd_option *o, void *arguments, struct spl_error *err)
{
    char text[64];
    if (!o->name || !o->fallback)
        return SPL_OK;
    if (o->kind == SPL_CMD_KIND_TEXT) {
        *(const char **)(void *)((char *)arguments + o->offset) = o->fallback;
        return SPL_OK;
    }
    snprintf(text, sizeof text, "%s", o->fallback);
    int rc = take(o, arguments, text, err);
    spl_assert(!rc);
    return rc;
}

/* What stands behind the text of a row: " (3 to 64; default: 12)". */
static void print_limits(const struct spl_cmd_option *o, char *out, size_t room)
{
    const char *fallback = o->fallback ? o->fallback : o->otherwise;
    bool counted = o->kind == SPL_CMD_KIND_COUNT || o->kind == SPL_CMD_KIND_COUNT_32;
    char range[64] = "";
    if (counted && o->most != UINT64_MAX)
        snprintf(range, sizeof range, "%" PRIu64 " to %" PRIu64, o->least, o->most);
    else if (o->kind == SPL_CMD_KIND_REAL && (o->from > 0 ? o->to / o->from : o->to - o->from) < 1e8)
        snprintf(range, sizeof range, "%g to %g", o->from, o->to);
    out[0] = '\0';
    if (*range || fallback)
        snprintf(out, room, "%s(%s%s%s%s)", o->help[0] ? " " : "", range, *range && fallback ? "; " : "",
                 fallback ? "default: " : "", fallback ? fallback : "");
}

static int print_names(const struct spl_cmd_option *o, char *out, size_t room)
{
    char letter[] = "    ";
    if (o->letter)
        snprintf(letter, sizeof letter, "-%c, ", o->letter);
    return snprintf(out, room, "  %s--%s%s%s", letter, o->name, o->form ? " " : "", o->form ? o->form : "");
}

void spl_cmd_table_print_help(const struct spl_cmd_table *table)
{
    char names[96], text[1024];
    size_t column = 0;
    for (size_t i = 0; i < table->count; i++)
        if (table->options[i].name && table->options[i].help) {
            size_t length = (size_t)print_names(&table->options[i], names, sizeof names) + 2;
            column = length > column && length <= help_column ? length : column;
        }
    fputs(table->before, stdout);
    for (size_t i = 0; i < table->count; i++) {
        const struct spl_cmd_option *o = &table->options[i];
        if (!o->name) {
            puts(o->help);
            if (o->print)
                o->print(stdout, column);
        }
        if (!o->name || !o->help)
            continue;
        int length = print_names(o, names, sizeof names);
        size_t used = (size_t)snprintf(text, sizeof text, "%s", o->help);
        print_limits(o, text + used, sizeof text - used);
        printf("%s", names);
        spl_cmd_print_wrapped(stdout, (size_t)length, column, text);
    }
    fputs(table->after ? table->after : "", stdout);
}

/* What getopt has refused; `word` is of the command line. */
static int refuse(const struct spl_cmd_table *table, int what, const char *word, struct spl_error *err)
{
    const char *names[SPL_CMD_NAMES_MAX + 1] = {"help"};
    char letter[] = {'-', (char)optopt, '\0'};
    bool known = optopt >= first_row, is_letter = optopt && !known;
    const struct spl_cmd_option *o = known ? &table->options[optopt - first_row] : NULL;
    size_t count = 1;
    for (size_t i = 0; i < table->count; i++) {
        if (table->options[i].name && count < SPL_CMD_NAMES_MAX)
            names[count++] = table->options[i].name;
        if (is_letter && table->options[i].letter == optopt)
            o = &table->options[i];
    }
    if (what == ':' && o)
        return spl_fail(err, SPL_E_USAGE, "--%s requires an argument, %s; 'splatd %s --help' shows how", o->name,
                        o->form, table->command);
    if (known)
        return spl_fail(err, SPL_E_USAGE, "--%s takes no argument; 'splatd %s --help' shows how", o->name,
                        table->command);
    const char *near = is_letter ? NULL : spl_near_name_find(word, names);
    return spl_fail(err, SPL_E_USAGE, "'%.80s' is no option of %s; %s%s%s'splatd %s --help' shows how",
                    is_letter ? letter : word, table->command, near ? "did you mean --" : "", near ? near : "",
                    near ? "? " : "", table->command);
}

static int parse(const struct spl_cmd_table *table, const char *letters, const struct option *options, int argc,
                 char **argv, void *arguments, struct spl_error *err)
{
    int rc = SPL_OK;
    for (size_t i = 0; !rc && i < table->count; i++)
        rc = take_fallback(&table->options[i], arguments, err);
    opterr = 0;
    for (int c; !rc && (c = getopt_long(argc, argv, letters, options, NULL)) >= 0;) {
        if (c == 'h') {
            spl_cmd_table_print_help(table);
            return SPL_CMD_DONE;
        }
        if (c == '?' || c == ':')
            return refuse(table, c, argv[optind - 1], err);
        size_t row = (size_t)c - first_row;
        for (size_t i = 0; c < first_row && i < table->count; i++)
            if (table->options[i].letter == c)
                row = i;
        rc = take(&table->options[row], arguments, optarg, err);
    }
    return rc;
}

int spl_cmd_table_parse(const struct spl_cmd_table *table, int argc, char **argv, void *arguments,
                        struct spl_error *err)
{
    struct option *options = spl_alloc(table->count + 2, sizeof *options, err);
    char *letters = spl_alloc(2 * table->count + 3, 1, err);
    size_t count = 0;
    int rc = SPL_E_NOMEM;
    if (options && letters) {
        char *at = stpcpy(letters, ":h");
        options[count++] = (struct option){"help", no_argument, NULL, 'h'};
        for (size_t i = 0; i < table->count; i++) {
            const struct spl_cmd_option *o = &table->options[i];
            if (!o->name)
                continue;
            options[count++] = (struct option){o->name, o->form ? required_argument : no_argument, NULL,
                                               first_row + (int)i};
            if (o->letter)
                at += sprintf(at, "%c%s", o->letter, o->form ? ":" : "");
        }
        rc = parse(table, letters, options, argc, argv, arguments, err);
    }
    free(options);
    free(letters);
    return rc;
}
