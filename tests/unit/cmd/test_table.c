/* A table of options: what is parsed, what is refused and with which words, what was probably meant, and --help. */
#include <getopt.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>

#include "cmd/options.h"
#include "cmd/table.h"

enum color { RED, GREEN, BLUE };

struct arguments {
    const char *output, *name;
    bool json;
    double lod, far, eye[3];
    uint64_t seed, memory, limit;
    uint32_t threads, size[2];
    enum color color;
    int sum, shade;
};

static const char *const colors[] = {"red", "green", "blue", NULL};

/* Adds up what is given, "1,2,3", and cuts it in place. */
static int take_sum(void *arguments, const char *option, char *text, struct spl_error *err)
{
    struct arguments *a = arguments;
    for (char *piece; (piece = strsep(&text, ","));) {
        if (!*piece)
            return spl_fail(err, SPL_E_USAGE, "%s takes numbers", option);
        a->sum += atoi(piece);
    }
    return SPL_OK;
}

static int shade_from_name(const char *name)
{
    return strcmp(name, "grey") && strcmp(name, "gray") ? -1 : 0;
}

static const char *name_of_shade(int shade)
{
    return shade ? "dark" : "grey";
}

static int take_shade(void *arguments, const char *option, char *text, struct spl_error *err)
{
    return spl_cmd_take_name(option, text, shade_from_name, name_of_shade, 2, &((struct arguments *)arguments)->shade,
                             err);
}

static void print_shades(FILE *out, size_t column)
{
    fprintf(out, "%*sall shades\n", (int)column, "");
}

static const struct spl_cmd_option options[] = {
    {.help = "Things:"},
    {"output", "FILE", "where it goes", .letter = 'o', SPL_CMD_TEXT(struct arguments, output)},
    {"name", "NAME", "what it is called", .fallback = "nobody", SPL_CMD_TEXT(struct arguments, name)},
    {"json", NULL, "as JSON", SPL_CMD_FLAG(struct arguments, json)},
    {"lod", "L", "pixels a splat", .fallback = "1.5", SPL_CMD_REAL(struct arguments, lod, 0, 64)},
    {"seed", "S", "of the noise", SPL_CMD_COUNT(struct arguments, seed, 0, UINT64_MAX)},
    {"memory", "MIB", "at most", .fallback = "2048", SPL_CMD_MIB(struct arguments, memory, 64, 1 << 20)},
    {"threads", "N", "", .otherwise = "all cores", SPL_CMD_COUNT_32(struct arguments, threads, 1, 64)},
    {"size", "WxH", "of the image", .fallback = "1280x720", SPL_CMD_PIXELS(struct arguments, size)},
    {"color", "C", "of the rest, about which there is more to say than stands on one line, because it is long, and so "
                   "on, and so forth", .fallback = "green", SPL_CMD_CHOICE(struct arguments, color, colors)},
    {"sum", "LIST", "numbers", .fallback = "1,1", .take = take_sum},
    {"limit", "BYTES", "of the rest", SPL_CMD_BYTES(struct arguments, limit, 1, UINT64_MAX)},
    {"eye", "X,Y,Z", "where", SPL_CMD_VECTOR(struct arguments, eye)},
    {"far", "F", "how far", SPL_CMD_REAL(struct arguments, far, 1e-9, 1e12)},
    {.help = "Shades:", .print = print_shades},
    {"shade", "NAME", NULL, .take = take_shade},
};

static const struct spl_cmd_table table = {
    .command = "try", .before = "usage: try\n", .after = "the end\n", .options = options,
    .count = sizeof options / sizeof *options,
};

/* Parses `line`, words between blanks. */
static int parse(const char *line, struct arguments *a, struct spl_error *err)
{
    static char words[1024], *argv[64];
    char *rest = words, *word;
    int argc = 0;
    snprintf(words, sizeof words, "try %s", line);
    while ((word = strsep(&rest, " ")))
        if (*word)
            argv[argc++] = word;
    argv[argc] = NULL;
    optind = 0; // getopt begins anew
    *a = (struct arguments){0};
    *err = (struct spl_error){0};
    return spl_cmd_table_parse(&table, argc, argv, a, err);
}

static void defaults_are_those_of_the_rows(void **state)
{
    (void)state;
    struct arguments a;
    struct spl_error err;
    assert_int_equal(parse("", &a, &err), 0);
    assert_null(a.output);
    assert_string_equal(a.name, "nobody");
    assert_false(a.json);
    assert_true(a.lod == 1.5);
    assert_int_equal(a.memory, UINT64_C(2048) << 20);
    assert_int_equal(a.threads, 0);
    assert_int_equal(a.size[0], 1280);
    assert_int_equal(a.size[1], 720);
    assert_int_equal(a.color, GREEN);
    assert_int_equal(a.sum, 2);
}

static void options_set_their_members(void **state)
{
    (void)state;
    struct arguments a;
    struct spl_error err;
    assert_int_equal(parse("one -o x --json --lod=0.25 --seed 18446744073709551615 --memory 1G --threads 64 --size 640 "
                           "--color blue --sum 3,4 two", &a, &err), 0);
    assert_string_equal(a.output, "x");
    assert_true(a.json);
    assert_true(a.lod == 0.25);
    assert_true(a.seed == UINT64_MAX);
    assert_int_equal(a.memory, 1 << 30);
    assert_int_equal(a.threads, 64);
    assert_int_equal(a.size[1], 360); // the default's ratio
    assert_int_equal(a.color, BLUE);
    assert_int_equal(a.sum, 9);
    assert_int_equal(optind, 17); // one and two stand behind
    assert_int_equal(parse("--limit 3 --eye 1,-2,3e2 --shade gray --far 1e12", &a, &err), 0);
    assert_int_equal(a.limit, 3); // bytes
    assert_true(a.eye[0] == 1 && a.eye[1] == -2 && a.eye[2] == 300 && a.far == 1e12);
    assert_int_equal(parse("--limit 18446744073709551615", &a, &err), 0);
    assert_true(a.limit == UINT64_MAX);
    assert_int_equal(parse("--out y --js", &a, &err), 0); // cut short
    assert_string_equal(a.output, "y");
    assert_true(a.json);
}

static void what_is_wrong_is_said(void **state)
{
    (void)state;
    static const struct {
        const char *line, *says, *also;
    } bad[] = {
        {"--lod 65", "--lod takes a number from 0 to 64, not '65'", ""},
        {"--lod nan", "--lod", "not 'nan'"},
        {"--lod 0x10", "--lod", "not '0x10'"},
        {"--seed 0x10", "--seed", "not '0x10'"},
        {"--limit 0x10", "--limit", "not '0x10'"},
        {"--eye 1,0x2,3", "--eye", "not '1,0x2,3'"},
        {"--seed -1", "--seed takes a whole number", "not '-1'"},
        {"--seed 0.5", "--seed takes a whole number", "not '0.5'"},
        {"--seed 1e", "--seed takes a whole number", "not '1e'"},
        {"--seed 1e300", "--seed takes a whole number", "not '1e300'"},
        {"--threads 0", "--threads takes a whole number from 1 to 64, not '0'", ""},
        {"--threads 65", "--threads", "'65'"},
        {"--memory 1", "--memory takes a whole number from 64 to 1048576 MiB", "K, M, G or T"},
        {"--size 3x", "--size", "1280x720"},
        {"--limit 0", "--limit takes a whole number from 1 to", "K, M, G or T"},
        {"--eye 1,2", "--eye takes three numbers X,Y,Z, not '1,2'", ""},
        {"--eye 1,2,inf", "--eye", "not '1,2,inf'"},
        {"--far 0", "--far takes a number from 1e-09 to 1e+12, not '0'", ""},
        {"--shade blue", "--shade takes grey or dark, not 'blue'", ""},
        {"--shad", "--shade requires an argument, NAME", ""},
        {"--color pink", "--color takes red, green or blue, not 'pink'", ""},
        {"--sum 1,,2", "--sum takes numbers", ""},
        {"--output", "--output requires an argument, FILE", "'splatd try --help' shows how"},
        {"-o", "--output requires an argument, FILE", "--help"},
        {"--json=yes", "--json takes no argument", "--help"},
        {"--jsno", "'--jsno' is no option of try; did you mean --json? 'splatd try", "'splatd try --help' shows how"},
        {"--thread-count 3", "'--thread-count' is no option of try; 'splatd", ""},
        {"--sized=3x3", "did you mean --size?", ""},
        {"a --nothing-like-it b", "'--nothing-like-it' is no option of try; 'splatd", ""},
        {"-x", "'-x' is no option of try; 'splatd", ""},
    };
    struct arguments a;
    struct spl_error err;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        if (parse(bad[i].line, &a, &err) != SPL_E_USAGE || !strstr(err.message, bad[i].says) ||
            !strstr(err.message, bad[i].also))
            fail_msg("'%s' says: %s", bad[i].line, err.message);
}

static void help_follows_from_the_rows(void **state)
{
    (void)state;
    static const char *const lines[] = {
        "usage: try\n",
        "\nThings:\n",
        "\n  -o, --output FILE  where it goes\n",
        "\n      --name NAME    what it is called (default: nobody)\n",
        "\n      --json         as JSON\n",
        "\n      --lod L        pixels a splat (0 to 64; default: 1.5)\n",
        "\n      --seed S       of the noise\n",
        "\n      --threads N    (1 to 64; default: all cores)\n",
        "\n      --far F        how far\n",
        "\nShades:\n                     all shades\nthe end\n",
        "because it is long,\n                     and so on, and so forth (default: green)\n",
        "the end\n",
    };
    char text[4096], path[] = "/tmp/splatd-help-XXXXXX";
    struct arguments a;
    struct spl_error err;
    int kept = dup(STDOUT_FILENO), file = mkstemp(path);
    fflush(stdout);
    dup2(file, STDOUT_FILENO);
    int rc = parse("--json --help --no-such-option", &a, &err);
    fflush(stdout);
    dup2(kept, STDOUT_FILENO);
    ssize_t length = pread(file, text, sizeof text - 1, 0);
    unlink(path);
    close(file);
    close(kept);
    assert_int_equal(rc, SPL_CMD_DONE);
    assert_true(length > 0);
    text[length] = '\0';
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
        if (!strstr(text, lines[i]))
            fail_msg("no '%s' in:\n%s", lines[i], text);
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n"))
        assert_in_range(strlen(line), 1, 112);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(defaults_are_those_of_the_rows), cmocka_unit_test(options_set_their_members),
        cmocka_unit_test(what_is_wrong_is_said),
        cmocka_unit_test(help_follows_from_the_rows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
