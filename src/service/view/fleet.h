/* The devices that serve: a pipeline each, side by side, and in front of them one of everything that the loop asks.
 *
 * A view goes to the device that has the least to do, and of those alike to the home of its dataset and place, so that
 * devices hold different pages and have room for more of them together. A large one is drawn by all that have nothing
 * to do (parts.h). They are of one kind, so the bytes are those of any of them. A dataset is resident on each that has
 * room for it; a device that is lost, or gone for good, leaves the others serving. All calls are the loop thread's
 * unless they say otherwise, and none of them blocks but destroy(). */
#ifndef SPL_SERVICE_FLEET_H
#define SPL_SERVICE_FLEET_H

#include "service/view/pipeline.h"

struct spl_fleet;

struct spl_fleet_options {
    /* Of all devices together: `queue`, `encoders`, samples and bytes are shared out; `number`, `of`, the renderer's
     * device and sharers are set here. */
    struct spl_pipeline_options pipeline;
    const char *devices; /* as spl_renderer_options.device, several joined by commas; or "all" */
};

/* Starts a pipeline for each device. Entries of the options: the caller's references. SPL_E_NO_DEVICE, field "device",
 * where the list is none; what is wrong with a device makes the fleet fail. */
int spl_fleet_create(const struct spl_fleet_options *options, struct spl_fleet **out, struct spl_error *err);

/* Finishes what is inside, destroys jobs that were not taken and entries that nobody refers to. References that others
 * hold must be gone before. NULL-safe. */
void spl_fleet_destroy(struct spl_fleet *fleet);

/* As of a pipeline; SPL_E_BUSY where no device takes it. */
int spl_fleet_submit(struct spl_fleet *fleet, struct spl_job *job, struct spl_error *err);
struct spl_job *spl_fleet_take(struct spl_fleet *fleet);

/* Makes `entry` resident on every device that has room. Takes the caller's reference; take_change() gives it back with
 * the entry, which then is SPL_ENTRY_RESIDENT on one at least, or SPL_ENTRY_REFUSED with entry->err; later, with a
 * reference of its own, maybe as SPL_ENTRY_ASIDE. From now on the last unref() of the entry, on any thread, sends it
 * here, and take_change() gives it back as SPL_ENTRY_GONE, for the caller to destroy. */
void spl_fleet_add(struct spl_fleet *fleet, struct spl_catalog_entry *entry);
struct spl_catalog_entry *spl_fleet_take_change(struct spl_fleet *fleet);

/* Starting until all devices have begun, then ready while one of them is; failed when all are, when one did not start,
 * or when they are not of one kind. */
enum spl_pipeline_state spl_fleet_get_state(struct spl_fleet *fleet);
const struct spl_error *spl_fleet_get_failure(const struct spl_fleet *fleet); /* once it is failed */

uint64_t spl_fleet_get_renderer(struct spl_fleet *fleet); /* as of a pipeline */

/* Of all devices together; `device` and `frame_ms` are the first's that is ready. */
void spl_fleet_get_status(struct spl_fleet *fleet, struct spl_pipeline_status *status);

size_t spl_fleet_get_count(const struct spl_fleet *fleet);
struct spl_pipeline *spl_fleet_get(struct spl_fleet *fleet, size_t device); /* below count: for its state and status */

uint64_t spl_fleet_get_still_ns(struct spl_fleet *fleet); /* of the device that has stood still for longest */
unsigned spl_fleet_get_retry_after(struct spl_fleet *fleet, bool large);

#endif
