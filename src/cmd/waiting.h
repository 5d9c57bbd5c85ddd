/* What is said while a server does not answer. */
#ifndef SPL_CMD_WAITING_H
#define SPL_CMD_WAITING_H

#include <pthread.h>
#include <stdbool.h>

struct spl_cmd_waiting {
    const char *path;
    bool begun, over; /* over: guarded by mutex */
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t ended;
};

/* Around the opening of `path`, which is borrowed: of a URL that is not open after two seconds a line on stderr says
 * what is waited for, and for how long, without its secrets. Of a file nothing is. */
void spl_cmd_waiting_begin(struct spl_cmd_waiting *waiting, const char *path);
void spl_cmd_waiting_end(struct spl_cmd_waiting *waiting);

#endif
