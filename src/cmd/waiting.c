/* A thread that sleeps until the wait is over, or long enough to be told of. It writes one line, and nothing once end()
 * has returned. Where there is no thread to be had nothing is said. */
#include "cmd/waiting.h"

#include <stdio.h>

#include "base/clock.h"
#include "base/condition.h"
#include "cmd/output.h"
#include "dataset/remote.h"
#include "dataset/remote_url.h"

static const uint64_t silent_ns = 2 * SPL_NS_PER_S;

static void *watch(void *context)
{
    struct spl_cmd_waiting *w = context;
    const uint64_t until_ns = spl_now_ns() + silent_ns;
    char shown[512];
    pthread_mutex_lock(&w->mutex);
    while (!w->over && spl_condition_wait(&w->ended, &w->mutex, until_ns))
        ;
    if (!w->over) {
        fputs("splatd: waiting for ", stderr);
        spl_cmd_put_text(stderr, spl_remote_show(w->path, shown, sizeof shown), 0);
        fprintf(stderr, ", which is given up when nothing comes for %d s\n", SPL_REMOTE_DEADLINE_MS / 1000);
    }
    pthread_mutex_unlock(&w->mutex);
    return NULL;
}

void spl_cmd_waiting_begin(struct spl_cmd_waiting *w, const char *path)
{
    *w = (struct spl_cmd_waiting){.path = path};
    if (!spl_remote_is_url(path))
        return;
    pthread_mutex_init(&w->mutex, NULL);
    spl_condition_init(&w->ended);
    w->begun = !pthread_create(&w->thread, NULL, watch, w);
    if (!w->begun) {
        pthread_cond_destroy(&w->ended);
        pthread_mutex_destroy(&w->mutex);
    }
}

void spl_cmd_waiting_end(struct spl_cmd_waiting *w)
{
    if (!w->begun)
        return;
    pthread_mutex_lock(&w->mutex);
    w->over = true;
    pthread_cond_signal(&w->ended);
    pthread_mutex_unlock(&w->mutex);
    pthread_join(w->thread, NULL);
    pthread_cond_destroy(&w->ended);
    pthread_mutex_destroy(&w->mutex);
    w->begun = false;
}
