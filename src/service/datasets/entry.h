/* One version of one dataset, opened for serving. Immutable but for the fields that say who owns them; references are
 * counted, so that a version that was replaced or dropped lives until the last request about it is answered.
 *
 * Life: open() on any thread → add to the fleet, whose devices make it resident → ready, references come and go → the
 * last unref() sends it back through the gpu threads, which let its pages go → destroyed. */
#ifndef SPL_SERVICE_ENTRY_H
#define SPL_SERVICE_ENTRY_H

#include <stdatomic.h>
#include <sys/queue.h>

#include <splatd/dataset.h>

#include "base/error.h"
#include "dataset/dataset.h"
#include "geom/camera_json.h"
#include "service/datasets/saved.h"
#include "service/place/places.h"
#include "service/view/plan.h"

enum spl_entry_state {
    SPL_ENTRY_OPENED,
    SPL_ENTRY_LOADING,  /* on its way to the device */
    SPL_ENTRY_RESIDENT, /* can be rendered */
    SPL_ENTRY_REFUSED,  /* the device has no room for it: see err */
    SPL_ENTRY_ASIDE,    /* it is drawn no more, since it costs the device: see err */
    SPL_ENTRY_LEAVING,  /* nobody refers to it any more */
    SPL_ENTRY_GONE,     /* the device has let go of it */
};

enum { SPL_DEVICES_MAX = 16 }; /* that serve at a time */

/* An entry on one device. */
struct spl_replica {
    struct spl_catalog_entry *entry;
    _Atomic uint64_t resident_bytes; /* on the device */
    bool there;                      // owned by: loop, until the last unref; it is resident, or was put aside

    /* Owned by whoever it was passed to last: the loop, or the gpu thread between add or release and the change. */
    STAILQ_ENTRY(spl_replica) link;
    enum spl_entry_state state;
    struct spl_error err;
    TAILQ_ENTRY(spl_replica) resident; // owned by: gpu
    uint32_t pages_wanted;             // owned by: gpu; first page that is not there yet
    bool loading;                      // owned by: gpu
    bool aside;                        // owned by: gpu; no frame of it is begun any more
    uint64_t lost_ns;                  // owned by: gpu; when the device was last lost in a frame of it, 0 = never
};

struct spl_catalog_entry {
    struct spl_dataset *dataset;
    const struct spl_dataset_info *info;
    struct spl_places *places;
    struct spl_places_hook at_once;      // owned by: loop; what `defaults` knows other coordinates by
    struct spl_camera_defaults defaults; /* for the loop: whoever may wait has a hook of its own */
    char uri[512]; /* "/v1/datasets/{id}", percent-encoded */
    struct spl_plan *plan;
    struct spl_saved *saved; /* its views by name */
    bool saving;             // owned by: loop; one of them is being written

    atomic_uint references;
    void (*release)(struct spl_catalog_entry *entry, void *context); // by the last unref; NULL: it is destroyed
    void *release_context;
    _Atomic uint32_t maps_at_once;   /* maps of stations that the memory limit has room for at a time */
    _Atomic uint64_t limit_bytes;    /* about the memory limit that holds all of it; 0 = not known, or it has no maps */

    struct spl_replica replicas[SPL_DEVICES_MAX];
    unsigned replicas_left;     // owned by: loop, until the last unref; that are to be loaded, or to be let go of
    unsigned home;              // owned by: loop; the device that draws its first piece where none has less to do
    enum spl_entry_state state; // owned by: loop
    struct spl_error err;       // owned by: loop
};

/* Bytes of its pages on all devices. */
uint64_t spl_catalog_entry_get_resident_bytes(const struct spl_catalog_entry *entry);

/* Maps and checks the dataset at `path`, which lies at `place` or will: its profile is looked for there. Ends with
 * SPL_E_CANCELLED soon after *how->cancelled (borrowed for the entry's life; may be NULL) is set. Blocks on disk, any
 * thread. The caller owns the one reference to *out. */
int spl_catalog_entry_open(const char *path, const char *place, const struct spl_dataset_opening *how,
                           struct spl_catalog_entry **out, struct spl_error *err);

/* Only somebody who holds a reference may take another. Any thread. Returns `entry`. */
struct spl_catalog_entry *spl_catalog_entry_ref(struct spl_catalog_entry *entry);
/* The same for who only knows that it was not destroyed; NULL where nobody holds one any more. */
struct spl_catalog_entry *spl_catalog_entry_try_ref(struct spl_catalog_entry *entry);
void spl_catalog_entry_unref(struct spl_catalog_entry *entry); /* NULL-safe; any thread */

/* Whatever its references say; for its last owner. NULL-safe. Unmaps, which may take a while. */
void spl_catalog_entry_destroy(struct spl_catalog_entry *entry);

#define SPL_CATALOG_ID_RULE "127 letters a-z and A-Z, digits, '.', '_' and '-', the first of them not a '.'"

_Static_assert(sizeof((struct spl_dataset_info *)0)->id == 128, "the rule names its length");

/* May `id` (of `length` bytes) be a dataset's id, by that rule? */
bool spl_catalog_id_is_valid(const char *id, size_t length);

#endif
