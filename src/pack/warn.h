/* What a pack tells whoever listens. */
#ifndef SPL_PACK_WARN_H
#define SPL_PACK_WARN_H

/* Hands a text to `warn`, which may be NULL; of more than 1199 bytes the first. */
void spl_pack_warn(void (*warn)(void *context, const char *text), void *context, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

#endif
