/* The token file: parsed into digests, so that the texts themselves are not kept in memory.
 *
 * Invariant: a lookup compares the digest of what was shown with every token's, each in constant time, so that its time
 * says nothing of how much was right. Messages never hold a token. */
#include "service/access/tokens.h"

#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "base/array.h"
#include "base/memory.h"
#include "base/text.h"
#include "service/access/secret.h"

enum { tokens_max = 4096, line_max = 1024, file_max = 1 << 20, token_least = 16, token_most = 256 };

const char *const spl_scope_names[SPL_SCOPES] = {"", "view", "tour", "admin"};

struct spl_token {
    uint8_t digest[SPL_DIGEST_BYTES];
    unsigned scopes;         // bit per enum spl_scope
    char patterns[line_max]; /* each closed by NUL, the last by two */
    size_t line;
};

struct spl_tokens {
    struct spl_token *items;
    size_t count, capacity;
};

struct place {
    const char *path;
    size_t line;
};

static int parse_token(struct spl_token *token, const char *text, const struct place *at, struct spl_error *err)
{
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~+/=";
    size_t length = strlen(text);
    if (!strncmp(text, "sha256:", 7)) {
        bool good = length == 7 + 2 * SPL_DIGEST_BYTES;
        for (int i = 0; good && i < SPL_DIGEST_BYTES; i++) {
            int high = spl_text_get_hex(text[7 + 2 * i]), low = spl_text_get_hex(text[8 + 2 * i]);
            good = high >= 0 && low >= 0;
            token->digest[i] = (uint8_t)(good ? 16 * high + low : 0);
        }
        return good ? 0
                    : spl_fail(err, SPL_E_USAGE,
                               "%s, line %zu: sha256: takes %d hex digits; printf %%s TOKEN | sha256sum", at->path,
                               at->line, 2 * SPL_DIGEST_BYTES);
    }
    if (length < token_least || length > token_most || strspn(text, allowed) != length)
        return spl_fail(
            err, SPL_E_USAGE,
            "%s, line %zu: a token has %d to %d letters, digits and -._~+/=; openssl rand -hex 32 makes one", at->path,
            at->line, (int)token_least, (int)token_most);
    return spl_sha256(text, length, token->digest, err);
}

static int parse_scopes(struct spl_token *token, char *text, const struct place *at, struct spl_error *err)
{
    for (char *rest = text, *name; (name = strsep(&rest, ","));) {
        int scope = SPL_SCOPE_VIEW;
        while (scope < SPL_SCOPES && strcmp(name, spl_scope_names[scope]))
            scope++;
        bool secret = strlen(name) >= token_least; // what is that long may be a token in the wrong place
        if (scope == SPL_SCOPES)
            return spl_fail(err, SPL_E_USAGE,
                            "%s, line %zu: the second field holds %s%s%s; it takes view, tour, admin, joined by commas",
                            at->path, at->line, secret ? "" : "'", secret ? "something long" : name, secret ? "" : "'");
        token->scopes |= 1u << scope;
    }
    return 0;
}

static int parse_patterns(struct spl_token *token, const char *text, const struct place *at, struct spl_error *err)
{
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-*?[]!^,";
    size_t length = strlen(text);
    if (strspn(text, allowed) != length || length + 2 > sizeof token->patterns || text[0] == ',' ||
        text[length - 1] == ',' || strstr(text, ",,"))
        return spl_fail(
            err, SPL_E_USAGE,
            "%s, line %zu: the third field is patterns of dataset ids, joined by commas, such as site-*,vault",
            at->path, at->line);
    for (size_t i = 0; i < length; i++)
        token->patterns[i] = text[i] == ',' ? '\0' : text[i];
    return 0;
}

/* `line` is a copy, ended by NUL, with something on it. */
static int parse_line(struct spl_tokens *tokens, char *line, const struct place *at, struct spl_error *err)
{
    char *fields[4] = {0};
    for (char *rest = line, *field; (field = strsep(&rest, " \t"));) {
        if (!*field)
            continue;
        size_t i = 0;
        while (fields[i])
            i++;
        fields[i] = field;
        if (i == 3)
            break;
    }
    if (!fields[1] || fields[3])
        return spl_fail(err, SPL_E_USAGE, "%s, line %zu: a line is TOKEN SCOPES [PATTERNS]", at->path, at->line);
    if (tokens->count == tokens_max)
        return spl_fail(err, SPL_E_USAGE, "%s, line %zu: more than %d tokens", at->path, at->line, (int)tokens_max);
    if (spl_array_reserve(tokens->items, tokens->capacity, tokens->count + 1, err))
        return SPL_E_NOMEM;
    const struct spl_token *items = tokens->items;
    struct spl_token *token = &tokens->items[tokens->count];
    *token = (struct spl_token){.line = at->line};
    int rc;
    if ((rc = parse_token(token, fields[0], at, err)) || (rc = parse_scopes(token, fields[1], at, err)) ||
        (rc = parse_patterns(token, fields[2] ? fields[2] : "*", at, err)))
        return rc;
    for (size_t i = 0; i < tokens->count; i++)
        if (!memcmp(items[i].digest, token->digest, sizeof token->digest))
            return spl_fail(err, SPL_E_USAGE, "%s, line %zu: the token of line %zu again", at->path, at->line,
                            items[i].line);
    tokens->count++;
    return 0;
}

int spl_tokens_parse(const char *text, size_t length, const char *path, struct spl_tokens **out, struct spl_error *err)
{
    struct place at = {.path = path};
    struct spl_tokens *tokens = *out = NULL;
    char line[line_max];
    int rc = 0;
    if (!(tokens = spl_alloc(1, sizeof *tokens, err)))
        return SPL_E_NOMEM;
    size_t mark = length >= 3 && !memcmp(text, "\xef\xbb\xbf", 3) ? 3 : 0; // what editors for Windows put first
    for (size_t begin = mark; !rc && begin < length;) {
        const char *end = memchr(text + begin, '\n', length - begin);
        size_t bytes = end ? (size_t)(end - text) - begin : length - begin, kept = bytes;
        at.line++;
        if (kept && text[begin + kept - 1] == '\r')
            kept--;
        if (kept >= sizeof line || memchr(text + begin, '\0', bytes)) {
            rc = spl_fail(err, SPL_E_USAGE, "%s, line %zu: longer than %zu bytes, or not text", path, at.line,
                          sizeof line - 1);
            break;
        }
        memcpy(line, text + begin, kept);
        line[kept] = '\0';
        if (line[strspn(line, " \t")] && line[0] != '#')
            rc = parse_line(tokens, line, &at, err);
        begin += bytes + 1;
    }
    spl_secret_wipe(line, sizeof line);
    if (!rc && !tokens->count)
        rc = spl_fail(err, SPL_E_USAGE,
                      "%s holds no token, so nobody could do anything; a line is TOKEN SCOPES [PATTERNS]", path);
    if (rc)
        spl_tokens_destroy(tokens);
    else
        *out = tokens;
    return rc;
}

int spl_tokens_read(const char *path, struct spl_tokens **out, struct spl_error *err)
{
    char *text = NULL;
    size_t length = 0;
    int rc = spl_secret_read(path, file_max, &text, &length, err);
    if (rc)
        return rc;
    rc = spl_tokens_parse(text, length, path, out, err);
    spl_secret_wipe(text, length);
    free(text);
    return rc;
}

void spl_tokens_destroy(struct spl_tokens *tokens)
{
    if (!tokens)
        return;
    free(tokens->items);
    free(tokens);
}

size_t spl_tokens_get_count(const struct spl_tokens *tokens)
{
    return tokens->count;
}

const struct spl_token *spl_tokens_find(const struct spl_tokens *tokens, const char *shown, size_t length)
{
    uint8_t digest[SPL_DIGEST_BYTES];
    const struct spl_token *found = NULL;
    if (spl_sha256(shown, length, digest, NULL))
        return NULL;
    for (size_t i = 0; i < tokens->count; i++)
        if (spl_secret_is_equal(tokens->items[i].digest, digest, sizeof digest))
            found = &tokens->items[i];
    return found;
}

bool spl_token_allows(const struct spl_token *token, enum spl_scope scope, const char *id)
{
    if (!(token->scopes & 1u << scope))
        return false;
    bool allowed = !*id;
    for (const char *pattern = token->patterns; *pattern && !allowed; pattern += strlen(pattern) + 1)
        allowed = !fnmatch(pattern, id, 0);
    return allowed;
}
