/* Which devices serve: the operator's list, a name each, and who shares memory with whom. Any thread. */
#ifndef SPL_SERVICE_DEVICE_LIST_H
#define SPL_SERVICE_DEVICE_LIST_H

#include <stddef.h>

#include "service/datasets/entry.h"

struct spl_device_list {
    char *names[SPL_DEVICES_MAX]; // owned; each as spl_renderer_options.device
    unsigned sharers[SPL_DEVICES_MAX]; /* how many of the list take of the same memory, itself counted */
    size_t count;
};

/* `text`: such names joined by commas, the same one again for a device that is to be used twice; or "all", which is
 * every usable GPU of the backend that has most of them. SPL_E_USAGE and SPL_E_NO_DEVICE, field "device". On failure
 * nothing is held. */
int spl_device_list_init(struct spl_device_list *list, const char *text, struct spl_error *err);
void spl_device_list_finish(struct spl_device_list *list);

#endif
