/* The one place that decides what an answer is good for: whether it is of the file that was opened, whether it is asked
 * for again, and what is said where it is not.
 *
 * Invariant: put() is given bytes of the state that the origin is held to, in order, each once. A head that says
 * another state, length or range is refused before a byte of it is taken. */
#include "dataset/remote_run.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/work.h"
#include "dataset/remote_counts.h"
#include "dataset/remote_retry.h"

static const uint64_t connect_most_ms = 5000, stall_most_ms = 10000, per_mib_ns = 10 * SPL_NS_PER_S;
/* Of a server that was given up: many reads do not each wait for it. */
static const uint64_t rest_ms = 2000, rest_most_s = 60;

/* One answer, while it comes. */
struct taking {
    struct spl_remote_origin *origin;
    struct spl_remote_run *run;
    struct spl_remote_reply reply;
    uint64_t done; /* of the run, over all answers */
    const char *wrong; /* NULL, or why this answer is not taken */
    bool changed;
};

static bool is_same(const struct spl_remote_state *state, const struct spl_remote_reply *reply)
{
    if (state->size != reply->total)
        return false;
    if (*state->etag && *reply->etag)
        return !strcmp(state->etag, reply->etag);
    if (*state->modified && *reply->modified)
        return !strcmp(state->modified, reply->modified);
    return !*state->etag && !*state->modified; // nobody says; else this answer is of something else
}

static void take_state(struct taking *t)
{
    struct spl_remote_state *state = &t->origin->state;
    state->size = t->reply.total;
    snprintf(state->etag, sizeof state->etag, "%s", t->reply.etag);
    snprintf(state->modified, sizeof state->modified, "%s", t->reply.modified);
    if (t->run->bytes > state->size)
        t->run->bytes = (size_t)state->size;
}

/* Is the head of a 206 that of what was asked for? */
static bool begin(void *context)
{
    struct taking *t = context;
    const struct spl_remote_reply *reply = &t->reply;
    const struct spl_remote_run *run = t->run;
    bool opening = !t->origin->state.size;
    if (*reply->encoding && strcmp(reply->encoding, "identity"))
        t->wrong = "its server packs what it sends, so that no part of it can be read; switch that off for datasets";
    else if (!reply->ranged || reply->first != run->first + t->done || reply->last < reply->first ||
             reply->last >= reply->total || reply->last >= run->first + run->bytes)
        t->wrong = "its server answers other bytes than it was asked for; look at what stands between";
    else if (!opening && !is_same(&t->origin->state, reply))
        t->changed = true;
    if (t->wrong || t->changed)
        return false;
    if (opening)
        take_state(t);
    return true;
}

static void note_moved(struct spl_remote_origin *origin, uint64_t now_ns)
{
    atomic_store(&origin->moved_ns, now_ns);
    if (origin->also_moved_ns)
        atomic_store(origin->also_moved_ns, now_ns);
}

static bool take(void *context, const void *data, size_t bytes)
{
    struct taking *t = context;
    const uint64_t left = t->run->bytes - t->done;
    const size_t mine = bytes < left ? bytes : (size_t)left;
    t->run->put(t->run->context, data, mine);
    t->done += mine;
    note_moved(t->origin, spl_now_ns());
    spl_remote_count(bytes, mine);
    return mine == bytes;
}

static const char *name_of(const struct spl_remote_origin *origin)
{
    return origin->opened ? origin->name : origin->shown;
}

static int fail_changed(struct spl_remote_origin *origin, struct spl_error *err)
{
    if (!atomic_exchange(&origin->changed, true))
        spl_log_warn("%s has changed since it was opened: what is not here yet of it can no longer be read",
                     origin->shown);
    return spl_fail(err, SPL_E_CORRUPT, "%s changed while it was served; open it anew", name_of(origin));
}

/* Asking again would not help. */
static int refuse(const struct spl_remote_origin *origin, const struct spl_remote_reply *reply, struct spl_error *err)
{
    int code = origin->opened ? SPL_E_IO
               : reply->status == 404 || reply->status == 410 ? SPL_E_NOT_FOUND
               : reply->status == 200 || reply->status == 416 ? SPL_E_INPUT : SPL_E_IO;
    if (!reply->status)
        return spl_fail(err, code, "cannot read %s: %s", name_of(origin), reply->why);
    return spl_fail(err, code, "cannot read %s: its server answers %ld%s%s%s: %s", name_of(origin), reply->status,
                    *reply->code ? " (" : "", reply->code, *reply->code ? ")" : "",
                    spl_remote_get_advice(reply->status));
}

static uint64_t least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

static int give_up(struct spl_remote_origin *origin, const struct spl_remote_reply *reply, unsigned failures,
                   struct spl_error *err)
{
    char status[40];
    uint64_t rest_ns = least(rest_ms, origin->deadline_ms) * SPL_NS_PER_MS,
             wish_s = least(reply->retry_after_s, rest_most_s);
    atomic_store(&origin->rests_until_ns, spl_now_ns() + (wish_s ? wish_s * SPL_NS_PER_S : rest_ns));
    snprintf(status, sizeof status, "it answers %ld", reply->status);
    return spl_fail(err, SPL_E_TIMEOUT, "cannot read %s: given up after %u attempts, at the last %s", name_of(origin),
                    failures, *reply->why ? reply->why : status);
}

uint64_t spl_remote_get_patience_ns(const struct spl_remote_origin *origin, uint64_t bytes)
{
    return origin->deadline_ms * SPL_NS_PER_MS + ((bytes + (1 << 20) - 1) >> 20) * per_mib_ns;
}

/* False where who waits does so no longer. */
static bool rest(const struct spl_remote_origin *origin, uint64_t until_ns)
{
    for (uint64_t left; (left = spl_remaining_ns(until_ns)) && !spl_is_cancelled(origin->cancelled);) {
        uint64_t nap_ns = left < 50 * SPL_NS_PER_MS ? left : 50 * SPL_NS_PER_MS;
        nanosleep(&(struct timespec){.tv_nsec = (long)nap_ns}, NULL);
    }
    return !spl_is_cancelled(origin->cancelled);
}

static void ask(struct taking *t, uint64_t deadline_ns)
{
    struct spl_remote_origin *origin = t->origin;
    const struct spl_remote_state *state = &origin->state;
    const bool strong = *state->etag && strncmp(state->etag, "W/", 2); // a weak one matches nothing
    const struct spl_remote_ask what = {.first = t->run->first + t->done,
                                        .bytes = t->run->bytes - t->done,
                                        .if_match = strong ? state->etag : "",
                                        .if_unmodified = strong ? "" : state->modified,
                                        .deadline_ns = deadline_ns,
                                        .connect_ms = least(connect_most_ms, origin->deadline_ms / 2),
                                        .stall_ms = least(stall_most_ms, origin->deadline_ms / 3),
                                        .cancelled = origin->cancelled,
                                        .begin = begin,
                                        .take = take,
                                        .context = t};
    t->reply = (struct spl_remote_reply){0};
    spl_remote_count(requests, 1);
    origin->link.ask(origin->link.context, &what, &t->reply);
}

/* What the answer was good for: 1 = ask again, 0 = all is there, or an error. */
static int judge(struct taking *t, struct spl_error *err)
{
    const struct spl_remote_reply *reply = &t->reply;
    const enum spl_remote_verdict verdict = reply->status ? spl_remote_judge(reply->status)
                                            : reply->may_pass ? SPL_REMOTE_AGAIN : SPL_REMOTE_REFUSE;
    const bool cut = t->origin->opened && reply->status == 416; // it was longer
    if (t->changed || cut || verdict == SPL_REMOTE_CHANGED)
        return fail_changed(t->origin, err);
    if (spl_is_cancelled(t->origin->cancelled))
        return spl_fail(err, SPL_E_CANCELLED, "%s: nobody waits for it any more", name_of(t->origin));
    if (t->wrong)
        return spl_fail(err, SPL_E_IO, "cannot read %s: %s", name_of(t->origin), t->wrong);
    if (verdict == SPL_REMOTE_REFUSE)
        return refuse(t->origin, reply, err);
    return verdict == SPL_REMOTE_AGAIN || t->done < t->run->bytes;
}

int spl_remote_run(struct spl_remote_origin *origin, struct spl_remote_run *run, struct spl_error *err)
{
    struct taking t = {.origin = origin, .run = run};
    uint64_t since_ns = spl_now_ns(), end_ns = since_ns + spl_remote_get_patience_ns(origin, run->bytes);
    unsigned failures = 0, attempts = 0;
    struct spl_error why = {0};
    int rc = atomic_load(&origin->changed) ? fail_changed(origin, &why) : 1;
    if (rc > 0 && spl_remaining_ns(atomic_load(&origin->rests_until_ns)))
        return spl_fail(err, SPL_E_TIMEOUT, "cannot read %s: its server was given up a moment ago; come back later",
                        name_of(origin));
    note_moved(origin, since_ns);
    while (rc > 0) {
        uint64_t done = t.done;
        ask(&t, end_ns);
        if ((rc = judge(&t, &why)) <= 0)
            break;
        attempts++;
        if (t.done > done) {
            since_ns = spl_now_ns();
            failures = 0;
        }
        uint64_t until_ns = spl_now_ns() + spl_remote_get_pause_ns(++failures, t.reply.retry_after_s, spl_now_ns());
        if (until_ns > since_ns + origin->deadline_ms * SPL_NS_PER_MS || until_ns > end_ns)
            rc = give_up(origin, &t.reply, attempts, &why);
        else if (!rest(origin, until_ns))
            rc = spl_fail(&why, SPL_E_CANCELLED, "%s: nobody waits for it any more", name_of(origin));
        else
            spl_remote_count(retries, 1);
    }
    if (rc && rc != SPL_E_CANCELLED) {
        spl_remote_count(failures, 1);
        if (origin->opened && rc != SPL_E_CORRUPT)
            spl_log_warn("%s, of %s", why.message, origin->shown);
    }
    return rc ? spl_fail(err, rc, "%s", why.message) : SPL_OK;
}
