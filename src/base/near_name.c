/* The distance of Damerau and Levenshtein between neighbours, case folded. Words and names beyond `most` letters are
 * near to nothing but what they begin with, so that a request's long word costs nothing. */
#include "base/near_name.h"

#include <ctype.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

enum { most = 40, start_least = 3, off_most = 4 };

static int letter(char c)
{
    return tolower((unsigned char)c);
}

/* Letters to change, add, leave out, or swap with their neighbour, to make `b` of `a`[0..length). */
static size_t distance(const char *a, size_t length, const char *b)
{
    size_t rows[3][most + 1], *before = rows[0], *last = rows[1], *now = rows[2], width = strlen(b);
    if (length > most || width > most)
        return most;
    for (size_t j = 0; j <= width; j++)
        last[j] = j;
    for (size_t i = 1; i <= length; i++) {
        now[0] = i;
        for (size_t j = 1; j <= width; j++) {
            size_t cost = last[j - 1] + (letter(a[i - 1]) != letter(b[j - 1]));
            cost = last[j] + 1 < cost ? last[j] + 1 : cost;
            cost = now[j - 1] + 1 < cost ? now[j - 1] + 1 : cost;
            if (i > 1 && j > 1 && letter(a[i - 1]) == letter(b[j - 2]) && letter(a[i - 2]) == letter(b[j - 1]) &&
                before[j - 2] + 1 < cost)
                cost = before[j - 2] + 1;
            now[j] = cost;
        }
        size_t *oldest = before;
        before = last;
        last = now;
        now = oldest;
    }
    return last[width];
}

struct spl_near_name spl_near_name_of(const char *word)
{
    word += strspn(word, "-");
    size_t length = strcspn(word, "="), off = length < start_least ? 1 : 1 + length / 3; // as many: another word
    return (struct spl_near_name){word, length, off < off_most ? off : off_most, NULL};
}

void spl_near_name_offer(struct spl_near_name *near, const char *name)
{
    size_t width = strlen(name), shorter = near->length < width ? near->length : width;
    int begins = shorter >= start_least && !strncasecmp(near->word, name, shorter);
    size_t off = begins ? 0 : distance(near->word, near->length, name);
    if (off >= near->off)
        return;
    near->off = off;
    near->found = name;
}

const char *spl_near_name_find(const char *word, const char *const *names)
{
    struct spl_near_name near = spl_near_name_of(word);
    for (; *names; names++)
        spl_near_name_offer(&near, *names);
    return near.found;
}

const char *spl_near_name_say(const struct spl_near_name *near, char out[SPL_NEAR_NAME_TEXT_MAX])
{
    out[0] = '\0';
    if (near->found)
        snprintf(out, SPL_NEAR_NAME_TEXT_MAX, "did you mean '%.64s'? ", near->found);
    return out;
}
