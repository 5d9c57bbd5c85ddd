/* What tests leave to the builds without sanitisers. ThreadSanitizer takes ten times as long and looks only for what
 * threads share, AddressSanitizer three times, for what a small input does to memory as much as a large one. A test
 * that does less under AddressSanitizer is named in `shortened` of tests/meson.build. */
#ifndef TEST_SUPPORT_SANITISED_H
#define TEST_SUPPORT_SANITISED_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#ifdef __SANITIZE_THREAD__
enum { TEST_LOOKS_FOR_RACES = 1 };
#else
enum { TEST_LOOKS_FOR_RACES = 0 };
#endif

#if defined __SANITIZE_THREAD__ || defined __SANITIZE_ADDRESS__
enum { TEST_SANITISED = 1 };
#else
enum { TEST_SANITISED = 0 };
#endif

/* The size of an input. */
#define TEST_SIZE(whole, sanitised) (TEST_SANITISED ? (sanitised) : (whole))

/* At the head of a test in which threads share nothing that another test does not share too. */
static inline void skip_under_tsan(void)
{
    if (TEST_LOOKS_FOR_RACES)
        skip();
}

/* In main(), where the tests that share anything between threads have it in their names. */
static inline void only_threads_under_tsan(void)
{
    if (TEST_LOOKS_FOR_RACES)
        cmocka_set_test_filter("*threads*");
}

/* Of one that judges a figure, over code that others of its program run. */
static inline void skip_sanitised(void)
{
    if (TEST_SANITISED)
        skip();
}

#endif
