/* Devices side by side: whom a view goes to, and entries that are on several of them. See fleet.h.
 *
 * Invariant: entry->replicas_left counts the replicas that take_change() has still to see before it gives the entry
 * back. A pipeline that has ended answers no order any more; then its orders are settled here. Owned by the loop's
 * thread, but for on_released(). */
#include "service/view/fleet.h"

#include <stdlib.h>

#include "base/log.h"
#include "base/memory.h"
#include "service/view/device_list.h"
#include "service/view/parts.h"

struct spl_fleet {
    struct spl_device_list devices;
    struct spl_pipeline *pipelines[SPL_DEVICES_MAX];
    bool given_up[SPL_DEVICES_MAX]; /* has failed while others go on, and was told */
    size_t count;
    bool started; /* all devices have begun */
    unsigned next_home;
    struct spl_error failure;
};

size_t spl_fleet_get_count(const struct spl_fleet *fleet)
{
    return fleet->count;
}

struct spl_pipeline *spl_fleet_get(struct spl_fleet *fleet, size_t device)
{
    spl_assert(device < fleet->count);
    return fleet->pipelines[device];
}

/* Nobody refers to it any more. Any thread; what the loop left in the entry is ours by its last reference. */
static void on_released(struct spl_catalog_entry *entry, void *context)
{
    struct spl_fleet *fleet = context;
    bool there[SPL_DEVICES_MAX];
    for (size_t i = 0; i < fleet->count; i++)
        entry->replicas_left += there[i] = entry->replicas[i].there;
    spl_assert(entry->replicas_left);
    for (size_t i = 0; i < fleet->count; i++) // after the last of which the entry may be gone
        if (there[i])
            spl_pipeline_drop(fleet->pipelines[i], entry);
}

static void take_in(struct spl_fleet *fleet, struct spl_catalog_entry *entry)
{
    entry->release = on_released;
    entry->release_context = fleet;
    entry->home = fleet->next_home++ % fleet->count;
}

void spl_fleet_add(struct spl_fleet *fleet, struct spl_catalog_entry *entry)
{
    take_in(fleet, entry);
    entry->replicas_left = (unsigned)fleet->count;
    for (size_t i = 0; i < fleet->count; i++)
        spl_pipeline_add(fleet->pipelines[i], entry);
}

/* Is there anything to say of the entry, after what happened to one of its replicas? */
static bool settle(struct spl_fleet *fleet, struct spl_replica *replica, enum spl_entry_state state)
{
    struct spl_catalog_entry *entry = replica->entry;
    bool was_waited_for = entry->replicas_left > 0, anywhere = false;
    if (state == SPL_ENTRY_ASIDE) {
        entry->state = state;
        entry->err = replica->err;
        return true;
    }
    entry->replicas_left -= was_waited_for;
    replica->there = state == SPL_ENTRY_RESIDENT;
    if (state == SPL_ENTRY_GONE) {
        entry->state = state;
        return !entry->replicas_left;
    }
    for (size_t i = 0; i < fleet->count; i++)
        anywhere |= entry->replicas[i].there;
    if (state == SPL_ENTRY_REFUSED) {
        entry->err = replica->err;
        if (anywhere || entry->replicas_left)
            spl_log_warn("dataset %s is not on device %zu of %zu: %s", entry->info->id,
                         (size_t)(replica - entry->replicas) + 1, fleet->count, replica->err.message);
    }
    if (entry->replicas_left || (anywhere && !was_waited_for))
        return false;
    entry->state = anywhere ? SPL_ENTRY_RESIDENT : SPL_ENTRY_REFUSED;
    if (anywhere)
        entry->err = (struct spl_error){0};
    else
        entry->release = NULL; // the last unref() need not come here
    return true;
}

struct spl_catalog_entry *spl_fleet_take_change(struct spl_fleet *fleet)
{
    for (size_t i = 0; i < fleet->count; i++) {
        struct spl_pipeline *pipeline = fleet->pipelines[i];
        struct spl_replica *replica;
        while ((replica = spl_pipeline_take_change(pipeline)))
            if (settle(fleet, replica, replica->state))
                return replica->entry;
        while (spl_pipeline_has_ended(pipeline) && (replica = spl_pipeline_take_order(pipeline))) {
            bool leaves = replica->state == SPL_ENTRY_LEAVING;
            if (!leaves)
                spl_fail(&replica->err, SPL_E_DEVICE_LOST, "the device is gone");
            if (settle(fleet, replica, leaves ? SPL_ENTRY_GONE : SPL_ENTRY_REFUSED))
                return replica->entry;
        }
    }
    return NULL;
}

/* Shared out, so that what the operator allows is allowed once. */
static struct spl_pipeline_options get_share(const struct spl_fleet *fleet, const struct spl_fleet_options *options,
                                             size_t device)
{
    struct spl_pipeline_options share = options->pipeline;
    share.number = (unsigned)device;
    share.of = (unsigned)fleet->count;
    share.renderer.device = fleet->devices.names[device];
    share.renderer.sharers = fleet->devices.sharers[device];
    share.queue = (share.queue + fleet->count - 1) / fleet->count;
    share.encoders = (share.encoders + fleet->count - 1) / fleet->count;
    share.samples_max /= fleet->count;
    share.frame_bytes_max = (share.frame_bytes_max ? share.frame_bytes_max : SPL_FRAME_BYTES_MAX) / fleet->count;
    return share;
}

int spl_fleet_create(const struct spl_fleet_options *options, struct spl_fleet **out, struct spl_error *err)
{
    const struct spl_pipeline_options *all = &options->pipeline;
    struct spl_fleet *fleet = spl_alloc(1, sizeof *fleet, err);
    if (!fleet)
        return SPL_E_NOMEM;
    int rc = spl_device_list_init(&fleet->devices, options->devices, err);
    fleet->count = fleet->devices.count;
    for (size_t i = 0; !rc && i < all->entry_count; i++) {
        take_in(fleet, all->entries[i]);
        for (size_t device = 0; device < fleet->count; device++)
            all->entries[i]->replicas[device].there = true;
    }
    size_t device = 0;
    for (; !rc && device < fleet->count; device += !rc) {
        const struct spl_pipeline_options share = get_share(fleet, options, device);
        rc = spl_pipeline_create(&share, &fleet->pipelines[device], err);
    }
    if (!rc) {
        *out = fleet;
        return 0;
    }
    fleet->count = device;
    for (size_t i = 0; i < all->entry_count; i++)
        all->entries[i]->release = NULL;
    for (size_t i = 0; i < fleet->count; i++)
        spl_pipeline_destroy(fleet->pipelines[i]);
    spl_device_list_finish(&fleet->devices);
    free(fleet);
    return rc;
}

void spl_fleet_destroy(struct spl_fleet *fleet)
{
    if (!fleet)
        return;
    for (size_t i = 0; i < fleet->count; i++)
        spl_pipeline_stop(fleet->pipelines[i]);
    for (struct spl_catalog_entry *entry; (entry = spl_fleet_take_change(fleet));)
        if (entry->state == SPL_ENTRY_GONE)
            spl_catalog_entry_destroy(entry);
        else
            spl_catalog_entry_unref(entry);
    for (size_t i = 0; i < fleet->count; i++)
        spl_pipeline_destroy(fleet->pipelines[i]);
    spl_device_list_finish(&fleet->devices);
    free(fleet);
}

/* The device that a job goes to where all have as little to do: each holds the pages of the places that it is asked
 * for, so the dataset is cut along its longest side into as many pieces as there are devices, of which its home has the
 * first. */
static size_t find_home(const struct spl_fleet *fleet, const struct spl_job *job)
{
    if (!job->entry)
        return 0;
    const struct spl_dataset_info *info = job->entry->info;
    const double *low = info->bounds_min, *high = info->bounds_max;
    int longest = 0;
    for (int c = 1; c < 3; c++)
        if (high[c] - low[c] > high[longest] - low[longest])
            longest = c;
    double length = high[longest] - low[longest], from = job->request.view.camera.eye[longest] - low[longest];
    double piece = length > 0 && from > 0 ? from / length * (double)fleet->count : 0;
    return job->entry->home + (piece < (double)fleet->count ? (size_t)piece : fleet->count - 1);
}

static bool can_draw(struct spl_fleet *fleet, const struct spl_job *job, size_t device)
{
    return spl_pipeline_get_state(fleet->pipelines[device]) == SPL_PIPELINE_READY &&
           (!job->entry || job->entry->replicas[device].there);
}

/* Where a job goes, of those that were not `tried`; NULL: none can draw it. */
static struct spl_pipeline *choose(struct spl_fleet *fleet, const struct spl_job *job, uint32_t tried)
{
    struct spl_pipeline *best = NULL;
    uint64_t least = UINT64_MAX;
    const size_t home = find_home(fleet, job);
    for (size_t i = 0; i < fleet->count; i++) {
        size_t device = (i + home) % fleet->count;
        struct spl_pipeline *pipeline = fleet->pipelines[device];
        struct spl_pipeline_status status;
        if (tried >> device & 1 || !can_draw(fleet, job, device))
            continue;
        spl_pipeline_get_status(pipeline, &status);
        uint64_t work = job->behind ? status.behind_length : status.samples_inside;
        if (work < least) {
            least = work;
            best = pipeline;
        }
    }
    return best;
}

/* Gives a large view to all devices that have nothing to do, where there are several. Each has the same stretch of the
 * image whatever others do, so that it comes back to the same pages. */
static bool submit_parts(struct spl_fleet *fleet, struct spl_job *job)
{
    struct spl_pipeline *idle[SPL_DEVICES_MAX];
    struct spl_pipeline_status status;
    unsigned count = 0;
    for (size_t i = 0; i < fleet->count; i++) {
        spl_pipeline_get_status(fleet->pipelines[i], &status);
        if (!status.samples_inside && can_draw(fleet, job, i))
            idle[count++] = fleet->pipelines[i];
    }
    if (count < 2 || spl_parts_begin(job, count, NULL))
        return false;
    for (unsigned i = 0; i < count; i++)
        spl_parts_submit(job, i, idle[i]); // the others draw what one has no room for
    if (!job->spread.away)
        spl_parts_undo(job);
    return job->spread.away;
}

int spl_fleet_submit(struct spl_fleet *fleet, struct spl_job *job, struct spl_error *err)
{
    struct spl_pipeline *pipeline;
    struct spl_error why = {0};
    uint32_t tried = 0;
    int rc = SPL_E_BUSY;
    if (fleet->count == 1) // its own words for whatever state it is in
        return spl_pipeline_submit(fleet->pipelines[0], job, err);
    if (spl_parts_can(job) && submit_parts(fleet, job))
        return SPL_OK;
    spl_fail(&why, rc, "no device is ready; come back later");
    while ((pipeline = choose(fleet, job, tried))) {
        why = (struct spl_error){0};
        if ((rc = spl_pipeline_submit(pipeline, job, &why)) != SPL_E_BUSY)
            break;
        for (size_t i = 0; i < fleet->count; i++)
            tried |= (uint32_t)(fleet->pipelines[i] == pipeline) << i;
    }
    return rc ? spl_fail_field(err, rc, why.field, "%s", why.message) : SPL_OK;
}

/* A part has come back: the whole that comes with it, or NULL. What a lost device has left another draws, once: a view
 * that costs every device shall not go round. */
static struct spl_job *take_part(struct spl_fleet *fleet, struct spl_job *part, size_t device)
{
    struct spl_job *whole;
    unsigned number;
    enum spl_parts_state state = spl_parts_take(part, &whole, &number);
    whole->spread.lost |= part->err.code == SPL_E_DEVICE_LOST ? 1u << device : 0;
    if (state == SPL_PARTS_LEFT) {
        struct spl_pipeline *pipeline = whole->spread.again ? NULL : choose(fleet, whole, whole->spread.lost);
        whole->spread.again = true;
        if (pipeline && spl_parts_submit(whole, number, pipeline))
            state = SPL_PARTS_INSIDE;
        else
            spl_parts_give_back(whole);
    }
    spl_job_destroy(part);
    return state == SPL_PARTS_INSIDE ? NULL : whole;
}

struct spl_job *spl_fleet_take(struct spl_fleet *fleet)
{
    for (size_t i = 0; i < fleet->count; i++)
        for (struct spl_job *job; (job = spl_pipeline_take(fleet->pipelines[i]));)
            if (!job->part.whole || (job = take_part(fleet, job, i)))
                return job;
    return NULL;
}

/* Devices of several kinds draw pictures that differ in a level here and there: no bytes of one would be those of
 * another. */
static int check_kind(struct spl_fleet *fleet, struct spl_error *err)
{
    struct spl_pipeline_status first, other;
    spl_pipeline_get_status(fleet->pipelines[0], &first);
    for (size_t i = 1; i < fleet->count; i++) {
        if (spl_pipeline_get_renderer(fleet->pipelines[i]) == spl_pipeline_get_renderer(fleet->pipelines[0]))
            continue;
        spl_pipeline_get_status(fleet->pipelines[i], &other);
        return spl_fail_field(err, SPL_E_USAGE, "device",
                              "%s (%.100s, %.100s) and %s (%.100s, %.100s) are of two kinds, whose pictures differ in "
                              "places; name devices of one kind, and run a daemon for each kind",
                              first.device.backend, first.device.name, first.device.driver, other.device.backend,
                              other.device.name, other.device.driver);
    }
    return SPL_OK;
}

/* Devices that are gone for good are told of once. */
static void tell_of_failure(struct spl_fleet *fleet, size_t device)
{
    if (!fleet->given_up[device])
        spl_log_error("device %zu of %zu is given up, the others go on: %s", device + 1, fleet->count,
                      spl_pipeline_get_failure(fleet->pipelines[device])->message);
    fleet->given_up[device] = true;
}

enum spl_pipeline_state spl_fleet_get_state(struct spl_fleet *fleet)
{
    size_t of[SPL_PIPELINE_FAILED + 1] = {0};
    enum spl_pipeline_state states[SPL_DEVICES_MAX];
    for (size_t i = 0; i < fleet->count; i++)
        of[states[i] = spl_pipeline_get_state(fleet->pipelines[i])]++;
    for (size_t i = 0; i < fleet->count && !fleet->failure.code; i++)
        if (states[i] == SPL_PIPELINE_FAILED && (!fleet->started || of[SPL_PIPELINE_FAILED] == fleet->count))
            fleet->failure = *spl_pipeline_get_failure(fleet->pipelines[i]);
        else if (states[i] == SPL_PIPELINE_FAILED)
            tell_of_failure(fleet, i);
    if (!fleet->failure.code && !fleet->started && !of[SPL_PIPELINE_STARTING]) {
        fleet->started = true;
        check_kind(fleet, &fleet->failure);
    }
    if (fleet->failure.code)
        return SPL_PIPELINE_FAILED;
    if (!fleet->started)
        return SPL_PIPELINE_STARTING;
    return of[SPL_PIPELINE_READY] ? SPL_PIPELINE_READY : SPL_PIPELINE_REBUILDING;
}

const struct spl_error *spl_fleet_get_failure(const struct spl_fleet *fleet)
{
    spl_assert(fleet->failure.code);
    return &fleet->failure;
}

uint64_t spl_fleet_get_renderer(struct spl_fleet *fleet)
{
    uint64_t renderer = 0;
    for (size_t i = 0; i < fleet->count && !renderer; i++)
        renderer = spl_pipeline_get_renderer(fleet->pipelines[i]);
    return renderer;
}

void spl_fleet_get_status(struct spl_fleet *fleet, struct spl_pipeline_status *status)
{
    struct spl_pipeline_status one;
    bool any = false;
    *status = (struct spl_pipeline_status){0};
    for (size_t i = 0; i < fleet->count; i++) {
        spl_pipeline_get_status(fleet->pipelines[i], &one);
        if (!i || (!any && spl_pipeline_get_state(fleet->pipelines[i]) == SPL_PIPELINE_READY)) {
            any = spl_pipeline_get_state(fleet->pipelines[i]) == SPL_PIPELINE_READY;
            status->device = one.device;
            status->frame_ms = one.frame_ms;
        }
        status->frames += one.frames;
        status->device_bytes += one.device_bytes;
        status->device_limit_bytes += one.device_limit_bytes;
        status->pages_pending += one.pages_pending;
        status->samples_inside += one.samples_inside;
        status->behind_length += one.behind_length;
        status->render_length += one.render_length;
        status->render_capacity += one.render_capacity;
        status->encode_length += one.encode_length;
        status->encode_capacity += one.encode_capacity;
        status->large_length += one.large_length;
        status->large_samples += one.large_samples;
        status->large_samples_max += one.large_samples_max;
        status->large_bytes += one.large_bytes;
    }
}

uint64_t spl_fleet_get_still_ns(struct spl_fleet *fleet)
{
    uint64_t longest = 0;
    for (size_t i = 0; i < fleet->count; i++) {
        uint64_t still = spl_pipeline_get_still_ns(fleet->pipelines[i]);
        longest = still > longest ? still : longest;
    }
    return longest;
}

unsigned spl_fleet_get_retry_after(struct spl_fleet *fleet, bool large)
{
    unsigned least = 0;
    for (size_t i = 0; i < fleet->count; i++) {
        unsigned seconds = spl_pipeline_get_retry_after(fleet->pipelines[i], large);
        least = !least || seconds < least ? seconds : least;
    }
    return least;
}
