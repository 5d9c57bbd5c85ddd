/* Who may do what: a file of bearer tokens. One a line:
 *
 *     TOKEN SCOPES [PATTERNS]
 *
 * TOKEN is the text itself, 16 to 256 letters, digits and "-._~+/=", or sha256: and 64 hex digits of it. SCOPES are
 * view, tour and admin, PATTERNS of dataset ids as fnmatch(3) takes them ("*" when left out); both are joined by
 * commas. Blank lines and lines that begin with '#' say nothing. */
#ifndef SPL_SERVICE_TOKENS_H
#define SPL_SERVICE_TOKENS_H

#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

enum spl_scope { SPL_SCOPE_NONE, SPL_SCOPE_VIEW, SPL_SCOPE_TOUR, SPL_SCOPE_ADMIN, SPL_SCOPES };
extern const char *const spl_scope_names[SPL_SCOPES];

struct spl_tokens;
struct spl_token;

/* `path` is for messages, which name it and the line but nothing of the line's first field. SPL_E_USAGE. The caller
 * owns *out. Any thread, as below. */
int spl_tokens_parse(const char *text, size_t length, const char *path, struct spl_tokens **out, struct spl_error *err);
int spl_tokens_read(const char *path, struct spl_tokens **out, struct spl_error *err); /* blocks on disk */
void spl_tokens_destroy(struct spl_tokens *tokens);                                    /* NULL-safe */
size_t spl_tokens_get_count(const struct spl_tokens *tokens);

/* The token that a client has shown, NULL when there is none; borrowed. Takes as long for every text of that length. */
const struct spl_token *spl_tokens_find(const struct spl_tokens *tokens, const char *shown, size_t length);

/* May it do `scope` with dataset `id`? "" asks whether it may do it at all. */
bool spl_token_allows(const struct spl_token *token, enum spl_scope scope, const char *id);

#endif
