/* splatd sign: a URL that may be used without a token until it expires. */
#include "cmd/cmd.h"

#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cmd/table.h"
#include "service/access/sign.h"

/* "90s", "15m", "1h", "7d" to seconds. */
static int parse_expiry(const char *text, int64_t *seconds, struct spl_error *err)
{
    enum { most_s = 10 * 366 * 24 * 3600 };
    static const char units[] = "smhd";
    static const int64_t factors[] = {1, 60, 3600, 24 * 3600};
    char *end;
    errno = 0;
    long long count = strtoll(text, &end, 10);
    const char *unit = *end && !end[1] ? strchr(units, *end) : NULL;
    if (!isdigit((unsigned char)*text) || errno || !unit || !count || count > most_s / factors[unit - units])
        return spl_fail(err, SPL_E_USAGE, "--expires takes a time such as 90s, 15m, 1h or 7d, up to 10 years, not '%s'",
                        text);
    *seconds = count * factors[unit - units];
    return 0;
}

struct arguments {
    const char *key, *expires;
};

static const struct spl_cmd_option options[] = {
    {"key", "FILE", "the key, 32 bytes or more; newlines at its end do not count", .letter = 'k',
     SPL_CMD_TEXT(struct arguments, key)},
    {"expires", "TIME", "from now, with s, m, h or d", .letter = 'e', .fallback = "1h",
     SPL_CMD_TEXT(struct arguments, expires)},
};

static const struct spl_cmd_table table = {
    .command = "sign",
    .before =
        "usage: splatd sign URL --key FILE [--expires TIME]\n\n"
        "Prints URL with a signature that lets anybody GET it, and nothing else, until it expires: for an <img> in a\n"
        "page of yours, a report, a mail. The service needs the same key, 'splatd serve --url-key FILE'. Reading a\n"
        "dataset, its profile, views, picks, places, legend and thumbnail can be signed, all of its map tiles at once, "
        "and the\n"
        "page /embed/ID: who has that URL may look at this dataset from wherever they like until it expires, and do\n"
        "nothing else.\n\n"
        "Make a key, once:\n"
        "  openssl rand -hex 32 >url.key; chmod 600 url.key\n"
        "A picture for a dashboard, for a day:\n"
        "  splatd sign 'https://scans.example/v1/datasets/vault/view?eye=8,0,2&target=0,0,1' --key url.key "
        "--expires 1d\n"
        "The path alone will do, for a page on the same host:\n"
        "  splatd sign '/v1/datasets/vault/view?width=640' --key url.key\n"
        "A view to move in, for an <iframe>; camera and settings stand behind '#' and may be changed:\n"
        "  splatd sign 'https://scans.example/embed/vault#eye=8,0,2&target=0,0,1' --key url.key --expires 7d\n"
        "All tiles of a map, drawn as the parameters say, for Leaflet, QGIS, Grafana; tiles.json for what reads "
        "TileJSON:\n"
        "  splatd sign 'https://scans.example/v1/datasets/vault/tiles/{z}/{x}/{y}.png?class=!3-5' --key url.key "
        "--expires 7d\n\n",
    .after = "\nThe signature is base64url(HMAC-SHA-256(key, path?query&exp=UNIX-SECONDS)), without padding, so any\n"
             "program that knows the key can make such URLs; of a page it is /embed/ID?exp=UNIX-SECONDS, without the\n"
             "fragment, of tiles and tiles.json the path is /v1/datasets/ID/tiles/, whichever tile is asked for.\n",
    .options = options,
    .count = sizeof options / sizeof *options,
};

static int sign(const char *url, const char *key_path, const char *expires, struct spl_error *err)
{
    struct spl_sign_key key = {0};
    int64_t seconds = 0;
    char *result = NULL;
    int rc = parse_expiry(expires, &seconds, err);
    if (!rc)
        rc = spl_sign_key_read(key_path, &key, err);
    if (!rc)
        rc = spl_sign_url(&key, url, (int64_t)time(NULL) + seconds, &result, err);
    if (!rc && (puts(result) < 0 || fflush(stdout)))
        rc = spl_fail_errno(err, errno, "cannot write the URL");
    free(result);
    spl_sign_key_finish(&key);
    return rc;
}

int spl_cmd_sign(int argc, char **argv)
{
    struct arguments a = {0};
    struct spl_error err = {0};
    int rc = spl_cmd_table_parse(&table, argc, argv, &a, &err);
    if (rc == SPL_CMD_DONE)
        return 0;
    if (!rc && (optind + 1 != argc || !a.key))
        rc = spl_fail(&err, SPL_E_USAGE, "sign takes one URL and --key FILE; 'splatd sign --help' shows examples");
    if (!rc)
        rc = sign(argv[optind], a.key, a.expires, &err);
    return rc ? spl_cmd_fail(&err) : 0;
}
