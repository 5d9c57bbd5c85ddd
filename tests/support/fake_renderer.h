/* What a test tells the fake renderers of its own process while they draw, so that no outcome depends on who is faster.
 * A daemon's are told by their environment alone (fake_renderer.c). Any thread. */
#ifndef TEST_SUPPORT_FAKE_RENDERER_H
#define TEST_SUPPORT_FAKE_RENDERER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

extern struct fake_frames {
    atomic_bool held;            /* no step ends but by its deadline, or as its frame is cancelled */
    atomic_bool hang;            /* the first step of each renderer does not end at all */
    atomic_bool closed;          /* renderers do not open */
    _Atomic uint64_t endless_px; /* frames of as many samples come no further, step by step; 0: all come to their end */
    atomic_int drawing, hanging; /* steps that are inside, or hang, just now */
} fake_frames;

/* As setenv() and unsetenv(), which must not meet the getenv() of another thread. */
void fake_setenv(const char *name, const char *value);
void fake_unsetenv(const char *name);

#endif
