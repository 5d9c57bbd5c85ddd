/* Frames that wait for pages; see hold.h.
 *
 * Invariant: page->holds counts the holds in residency->holds that list the page. Who holds slots has taken the room of
 * all of them, so it waits for reads only, never for another frame; who waits for room holds nothing. */
#include "render/hold.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/memory.h"

static const uint64_t patience_ns = 10 * SPL_NS_PER_S;
enum { fruitless_max = 8 };

static void begin_reads(struct spl_hold *hold)
{
    for (; hold->begun < hold->count; hold->begun++) {
        uint32_t slot = hold->slots[hold->begun];
        struct spl_resident_page *page = &hold->pages[slot];
        struct spl_io_rank rank = {.awaited = true};
        if (spl_resident_has_room(page) && !page->filled && !page->failed && !page->missed &&
            !spl_residency_begin_read(hold->residency, hold->dataset, page, slot, rank))
            return;
    }
}

static void start_wait(struct spl_hold *hold, struct spl_residency *residency, struct spl_resident_dataset *resident)
{
    if (!hold->residency)
        LIST_INSERT_HEAD(&residency->holds, hold, link);
    hold->residency = residency;
    hold->waits = true;
    hold->dataset = resident->dataset;
    hold->pages = resident->pages;
    hold->since_ns = spl_now_ns();
    hold->begun = hold->come = 0;
}

/* Others may ask again. */
static void leave_line(struct spl_residency *residency, const struct spl_hold *hold)
{
    if (residency->first_in_line != hold)
        return;
    residency->first_in_line = NULL;
    residency->releases++;
}

/* A walk asks in the same order for as long as what it asks for is there. */
static void note_progress(struct spl_hold *hold, const struct spl_residency *residency,
                          const struct spl_resident_dataset *resident)
{
    size_t ready = 0;
    while (ready < residency->asked_count && resident->pages[residency->asked[ready]].filled)
        ready++;
    hold->fruitless = ready + 1 > hold->ready ? 0 : hold->fruitless + 1;
    hold->ready = ready + 1 > hold->ready ? ready + 1 : hold->ready;
}

bool spl_hold_gives_up(const struct spl_hold *hold)
{
    return hold->fruitless >= fruitless_max;
}

int spl_hold_end_walk(struct spl_residency *residency, struct spl_resident_dataset *resident, struct spl_hold *hold,
                      uint64_t *awaited, struct spl_error *err)
{
    spl_assert(!hold->waits);
    hold->crowded = residency->crowded;
    hold->count = 0;
    hold->stalled = residency->stalled;
    if (residency->crowded) {
        if (hold->stalled)
            leave_line(residency, hold); // nobody stands behind a disk that hangs
        else if (!residency->first_in_line)
            residency->first_in_line = hold;
        hold->releases = residency->releases;
        hold->hanging = spl_io_count_hanging(residency->io);
        start_wait(hold, residency, resident);
        return SPL_SLOT_PENDING;
    }
    leave_line(residency, hold);
    if (!residency->pending) {
        hold->ready = hold->fruitless = 0;
        return SPL_OK;
    }
    note_progress(hold, residency, resident);
    uint32_t *slots = spl_realloc(hold->slots, residency->asked_count, sizeof *slots, err);
    if (!slots)
        return SPL_E_NOMEM;
    hold->slots = slots;
    hold->count = residency->asked_count;
    memcpy(slots, residency->asked, hold->count * sizeof *slots);
    start_wait(hold, residency, resident);
    for (size_t i = 0; i < hold->count; i++) {
        hold->pages[slots[i]].holds++;
        *awaited += !hold->pages[slots[i]].filled;
    }
    begin_reads(hold);
    return SPL_SLOT_PENDING;
}

/* Has every slot come, or will never? 1 = yes, or one was driven out; 0 = no. */
static int follow(struct spl_hold *hold, struct spl_error *err)
{
    for (; hold->come < hold->count; hold->come++) {
        const struct spl_resident_page *page = &hold->pages[hold->slots[hold->come]];
        if (page->missed)
            continue;
        if (page->failed)
            return spl_fail(err, page->read->err.code, "%s", page->read->err.message);
        if (!spl_resident_has_room(page))
            return 1;
        if (!page->filled) {
            if (!page->read && hold->begun > hold->come) /* it lost its room, and has another's: nobody reads it */
                hold->begun = hold->come;
            return 0;
        }
    }
    return 1;
}

int spl_hold_poll(struct spl_hold *hold, struct spl_error *err)
{
    if (!hold->waits)
        return SPL_OK;
    if (!hold->crowded) {
        int rc = follow(hold, err);
        if (rc)
            return rc < 0 ? rc : SPL_OK;
        begin_reads(hold);
    } else if (hold->stalled ? !spl_io_hangs(hold->residency->io, hold->dataset)
                             : hold->residency->releases != hold->releases ||
                                   spl_io_count_hanging(hold->residency->io) != hold->hanging) {
        return SPL_OK;
    }
    uint64_t moved_ns = spl_io_get_moved_ns(hold->residency->io, hold->dataset);
    if (spl_now_ns() - (moved_ns > hold->since_ns ? moved_ns : hold->since_ns) < patience_ns)
        return SPL_SLOT_PENDING;
    return spl_fail(err, SPL_E_TIMEOUT, "no page has come for %d s", (int)(patience_ns / SPL_NS_PER_S));
}

/* Ends a wait. Why reads failed is forgotten; where `all`, reads that nobody waits for any more are dropped. */
static void let_go(struct spl_hold *hold, bool all)
{
    if (!hold->waits)
        return;
    struct spl_residency *residency = hold->residency;
    for (size_t i = 0; i < hold->count; i++) {
        struct spl_resident_page *page = &hold->pages[hold->slots[i]];
        if (!--page->holds && (page->failed || page->missed || (all && spl_resident_has_room(page) && !page->filled)))
            spl_residency_drop_slot(residency, page);
    }
    residency->releases += hold->count > 0;
    hold->count = 0;
    hold->waits = false;
}

void spl_hold_release(struct spl_hold *hold)
{
    let_go(hold, false);
}

void spl_hold_finish(struct spl_hold *hold)
{
    if (hold->residency) {
        let_go(hold, true);
        leave_line(hold->residency, hold);
        LIST_REMOVE(hold, link);
    }
    free(hold->slots);
    *hold = (struct spl_hold){0};
}

void spl_hold_let_go_dataset(struct spl_residency *residency, const struct spl_resident_dataset *resident)
{
    struct spl_hold *hold;
    LIST_FOREACH(hold, &residency->holds, link)
    if (hold->pages == resident->pages)
        let_go(hold, true);
}

void spl_hold_let_go_all(struct spl_residency *residency)
{
    for (struct spl_hold *hold; (hold = LIST_FIRST(&residency->holds));) {
        let_go(hold, true);
        LIST_REMOVE(hold, link);
        hold->residency = NULL;
    }
    residency->first_in_line = NULL;
}
