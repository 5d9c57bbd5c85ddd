/* Token files and signed queries: the first byte chooses. Whatever file is accepted answers lookups; no query is taken
 * for signed but by the key. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "service/access/sign.h"
#include "service/access/tokens.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void try_tokens(const char *text, size_t size)
{
    struct spl_tokens *tokens = NULL;
    struct spl_error err = {0};
    int rc = spl_tokens_parse(text, size, "file", &tokens, &err);
    if (rc ? err.code != rc || !err.message[0] || tokens : !spl_tokens_get_count(tokens))
        abort();
    if (rc)
        return;
    const struct spl_token *token = spl_tokens_find(tokens, text, strcspn(text, " \t\r\n"));
    for (int scope = SPL_SCOPE_VIEW; token && scope < SPL_SCOPES; scope++)
        if (spl_token_allows(token, (enum spl_scope)scope, "wall") &&
            !spl_token_allows(token, (enum spl_scope)scope, ""))
            abort();
    spl_tokens_destroy(tokens);
}

/* Of a template of tiles' URLs one that is asked for. */
static void fill_holes(char *path)
{
    static const char *const holes[][2] = {{"{z}", "111"}, {"{x}", "222"}, {"{y}", "333"}, {"{r}", "@2x"}};
    const char *query = path + strcspn(path, "?#");
    char *tiles = strstr(path, "/tiles/{z}");
    for (size_t i = 0; tiles && i < sizeof holes / sizeof *holes; i++) {
        char *at = strstr(tiles, holes[i][0]);
        if (at && at < query)
            memcpy(at, holes[i][1], 3);
    }
}

static void try_query(const char *query)
{
    static char bytes[] = "0123456789abcdef0123456789abcdef";
    const struct spl_sign_key key = {bytes, 32};
    struct spl_error err = {0};
    struct spl_signed found = {0};
    int rc = spl_sign_check(&key, "/v1/datasets/wall/view", query, 0, &found, &err);
    if (rc ? err.code != rc || !err.field[0] : found.kept > strlen(query) || !spl_sign_is_signed(query))
        abort();
    char *url = NULL;
    if (!spl_sign_url(&key, query, 1, &url, NULL)) {
        char *path = url + (spl_sign_path_of(url) - url);
        fill_holes(path);
        char *mark = strchr(path, '?');
        *mark = '\0';
        mark[1 + strcspn(mark + 1, "#")] = '\0';
        if (spl_sign_check(&key, path, mark + 1, 1, &found, NULL) ||
            !spl_sign_check(&key, path, mark + 1, 2, &found, NULL))
            abort();
    }
    free(url);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *text = calloc(size + 1, 1);
    if (!text || !size) {
        free(text);
        return 0;
    }
    memcpy(text, data + 1, size - 1);
    if (data[0] == '?')
        try_query(text);
    else
        try_tokens(text, size - 1);
    free(text);
    return 0;
}
