/* Tables of options. A row says all of one: its names, the form of its argument, the member that it sets, its range,
 * its default, what it is for. What is refused, what --help says and what was probably meant follow from the rows. */
#ifndef SPL_CMD_TABLE_H
#define SPL_CMD_TABLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "base/error.h"

enum spl_cmd_kind {
    SPL_CMD_KIND_OWN,      /* `take` says what it means */
    SPL_CMD_KIND_FLAG,     /* bool, true once it is given */
    SPL_CMD_KIND_TEXT,     /* const char *, borrowed from argv */
    SPL_CMD_KIND_REAL,     /* double in [from, to] */
    SPL_CMD_KIND_COUNT,    /* uint64_t in [least, most] */
    SPL_CMD_KIND_COUNT_32, /* uint32_t, the same */
    SPL_CMD_KIND_MIB,      /* uint64_t of bytes; the text and [least, most] count MiB */
    SPL_CMD_KIND_BYTES,    /* the same; they count bytes */
    SPL_CMD_KIND_VECTOR,   /* double[3] */
    SPL_CMD_KIND_PIXELS,   /* uint32_t[2]; a side that is left out follows the default's ratio */
    SPL_CMD_KIND_CHOICE,   /* an enum or int: the place of the text in `names` */
};

struct spl_cmd_option {
    const char *name; /* NULL: no option, a heading of --help */
    const char *form; /* of its argument, "WxH"; NULL: it takes none */
    const char *help; /* without range and default, which stand behind it; lines are broken by --help. NULL: a heading's
                         `print` says it */
    enum spl_cmd_kind kind;
    char letter;           /* of the short form; 0: there is none */
    size_t offset;         /* of the member in the command's arguments */
    double from, to;       /* of a REAL; --help says them where they are less than eight decades apart */
    uint64_t least, most;  /* of the others */
    const char *fallback;  /* parsed as if it stood first on the command line; NULL: the member stays as it was */
    const char *otherwise; /* only said: what stands for an option that is not given; NULL: nothing */
    const char *const *names; /* of a CHOICE, closed by NULL */
    /* `option` is what messages call it, "--lod"; `text` its argument, which may be cut in place, or NULL. */
    int (*take)(void *arguments, const char *option, char *text, struct spl_error *err);
    void (*print)(FILE *out, size_t column); /* of a heading: what stands below it, help from `column` on, or NULL */
};

/* Initialisers of rows: the kind, and a member whose C type it must have. */
#define SPL_CMD_MEMBER(type, member, c_type)                                                                           \
    .offset = offsetof(type, member) +                                                                                 \
              0 * sizeof(char[__builtin_types_compatible_p(__typeof__(((type *)0)->member), c_type) ? 1 : -1])
#define SPL_CMD_FLAG(type, member) .kind = SPL_CMD_KIND_FLAG, SPL_CMD_MEMBER(type, member, bool)
#define SPL_CMD_TEXT(type, member) .kind = SPL_CMD_KIND_TEXT, SPL_CMD_MEMBER(type, member, const char *)
#define SPL_CMD_REAL(type, member, least, most)                                                                        \
    .kind = SPL_CMD_KIND_REAL, SPL_CMD_MEMBER(type, member, double), .from = (least), .to = (most)
#define SPL_CMD_COUNT(type, member, first, last)                                                                       \
    .kind = SPL_CMD_KIND_COUNT, SPL_CMD_MEMBER(type, member, uint64_t), .least = (first), .most = (last)
#define SPL_CMD_COUNT_32(type, member, first, last)                                                                    \
    .kind = SPL_CMD_KIND_COUNT_32, SPL_CMD_MEMBER(type, member, uint32_t), .least = (first), .most = (last)
#define SPL_CMD_MIB(type, member, first, last)                                                                         \
    .kind = SPL_CMD_KIND_MIB, SPL_CMD_MEMBER(type, member, uint64_t), .least = (first), .most = (last)
#define SPL_CMD_BYTES(type, member, first, last)                                                                       \
    .kind = SPL_CMD_KIND_BYTES, SPL_CMD_MEMBER(type, member, uint64_t), .least = (first), .most = (last)
#define SPL_CMD_VECTOR(type, member) .kind = SPL_CMD_KIND_VECTOR, SPL_CMD_MEMBER(type, member, double[3])
#define SPL_CMD_PIXELS(type, member) .kind = SPL_CMD_KIND_PIXELS, SPL_CMD_MEMBER(type, member, uint32_t[2])
#define SPL_CMD_CHOICE(type, member, list)                                                                             \
    .kind = SPL_CMD_KIND_CHOICE,                                                                                       \
    .offset = offsetof(type, member) + 0 * sizeof(char[sizeof(((type *)0)->member) == sizeof(int) ? 1 : -1]),          \
    .names = (list)

struct spl_cmd_table {
    const char *command;                  /* "pack": of messages */
    const char *before, *after;           /* of --help, around the options; after may be NULL */
    const struct spl_cmd_option *options; /* --help, -h is beside them */
    size_t count;
};

/* Finds the place of an argument among names: `from_name` gives it or -1, `name_of` the name of each of `count`, which
 * the message lists. SPL_E_USAGE. */
int spl_cmd_take_name(const char *option, const char *text, int (*from_name)(const char *),
                      const char *(*name_of)(int place), int count, int *out, struct spl_error *err);

enum { SPL_CMD_DONE = 1 };

/* Sets members of `arguments`, defaults first. 0: optind is the first operand. SPL_CMD_DONE: --help was asked for and
 * is on stdout. SPL_E_USAGE, or what `take` says, for the first that is wrong. Moves operands behind options in
 * argv. */
int spl_cmd_table_parse(const struct spl_cmd_table *table, int argc, char **argv, void *arguments,
                        struct spl_error *err);

/* What --help prints, to stdout. */
void spl_cmd_table_print_help(const struct spl_cmd_table *table);

#endif
