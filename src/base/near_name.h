/* Which of the names that there are was probably meant by one that there is not: of options, parameters, attributes. */
#ifndef SPL_BASE_NEAR_NAME_H
#define SPL_BASE_NEAR_NAME_H

#include <stddef.h>

/* The nearest of the names that were offered so far: the one with the fewest letters to change, add, leave out or swap,
 * where these are at most a third of the word's and three, whatever their case. What begins as the word does, or the
 * word as it, by three letters or more, is as near as can be. Pure; nothing is owned. */
struct spl_near_name {
    const char *word;
    size_t length, off; /* of the word that count; letters that the nearest is off, which a nearer one is below */
    const char *found;  /* of those offered, NULL = none is near */
};

/* Dashes in front of `word`, which stays, and what stands behind '=' do not count. */
struct spl_near_name spl_near_name_of(const char *word);
void spl_near_name_offer(struct spl_near_name *near, const char *name);

/* `names` is closed by NULL; NULL: none is near. */
const char *spl_near_name_find(const char *word, const char *const *names);

/* For a message: "did you mean 'NAME'? ", or "" where none is near. Returns `out`. */
enum { SPL_NEAR_NAME_TEXT_MAX = 96 };
const char *spl_near_name_say(const struct spl_near_name *near, char out[SPL_NEAR_NAME_TEXT_MAX]);

#endif
