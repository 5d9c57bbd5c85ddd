/* Devices side by side, on fake renderers: versions of datasets come and go on all of them, each view goes to one, and
 * those that are lost leave the others serving. */
#include "dataset/dataset.h"
#include "fleets.h"
#include "service/view/device_list.h"
#include "support/make_dataset.h"

static struct spl_fleet *start(size_t queue)
{
    return start_fleet("fake", queue);
}

static struct spl_job *make_job(unsigned deadline_ms)
{
    return make_view("width=8&height=4&format=raw", deadline_ms);
}

/* A version of a dataset of one splat, or of two that lie apart; the caller owns its reference. */
static struct spl_catalog_entry *open_splats(size_t count)
{
    char path[256] = "";
    struct spl_catalog_entry *entry = NULL;
    const struct make_splat splats[2] = {{.normal = {1, 0, 0}, .radius = 1},
                                         {.normal = {1, 0, 0}, .radius = 1, .position = {2, 90, -5}}};
    make_folder(path);
    strcat(path, "/one.spld");
    make_dataset_file(path, splats, count, 1);
    assert_int_equal(spl_catalog_entry_open(path, path, &(struct spl_dataset_opening){.verify = true}, &entry, NULL),
                     0);
    unlink(path);
    *strrchr(path, '/') = '\0';
    rmdir(path);
    return entry;
}

static struct spl_catalog_entry *open_entry(void)
{
    return open_splats(1);
}

static struct spl_catalog_entry *take_change(struct spl_fleet *fleet)
{
    struct spl_catalog_entry *entry;
    while (!(entry = spl_fleet_take_change(fleet)))
        usleep(500);
    return entry;
}

static void wait_until_ready(struct spl_fleet *fleet, uint64_t losses)
{
    await_losses(losses);
    while (spl_fleet_get_state(fleet) != SPL_PIPELINE_READY)
        usleep(500);
}

/* A view of the entry, or of none. */
static int view_of(struct spl_fleet *fleet, struct spl_catalog_entry *entry)
{
    struct spl_job *job = make_job(600000);
    job->entry = entry ? spl_catalog_entry_ref(entry) : NULL;
    job->dataset = entry ? entry->dataset : NULL;
    assert_int_equal(spl_fleet_submit(fleet, job, NULL), 0);
    assert_ptr_equal(take_job(fleet), job);
    int code = job->err.code;
    spl_job_destroy(job);
    return code;
}

/* The second time, where there are others; its frames cost no device any more, and it goes like any other. */
static void what_costs_the_device_twice_is_put_aside(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "1x4");
    struct spl_fleet *fleet = start(8);
    struct spl_catalog_entry *entry = open_entry(), *other = open_entry();
    spl_fleet_add(fleet, entry);
    assert_ptr_equal(take_change(fleet), entry);
    uint64_t losses = 0;
    for (int i = 0; i < 3; i++) { // alone it stays, however often
        assert_int_equal(view_of(fleet, NULL), 0);
        assert_int_equal(view_of(fleet, entry), SPL_E_DEVICE_LOST);
        wait_until_ready(fleet, ++losses);
        assert_null(spl_fleet_take_change(fleet));
    }
    spl_fleet_add(fleet, other);
    assert_ptr_equal(take_change(fleet), other);
    assert_int_equal(view_of(fleet, other), 0);
    assert_int_equal(view_of(fleet, entry), SPL_E_DEVICE_LOST);
    assert_ptr_equal(take_change(fleet), entry);
    assert_int_equal(entry->state, SPL_ENTRY_ASIDE);
    assert_non_null(strstr(entry->err.message, "lost twice"));
    wait_until_ready(fleet, ++losses); // the fourth: it is no longer the device's
    assert_int_equal(view_of(fleet, other), 0);
    assert_int_equal(view_of(fleet, entry), SPL_E_DEVICE_LOST); // is refused
    assert_int_equal(counters.device_losses, losses);
    assert_int_equal(spl_fleet_get_state(fleet), SPL_PIPELINE_READY);
    spl_catalog_entry_unref(entry);
    assert_null(spl_fleet_take_change(fleet));
    spl_catalog_entry_unref(entry); // that of the change
    assert_ptr_equal(take_change(fleet), entry);
    assert_int_equal(entry->state, SPL_ENTRY_GONE);
    spl_catalog_entry_destroy(entry);
    spl_catalog_entry_unref(other);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_fleet_destroy(fleet);
}

/* The second time in its pages; the others are served, and the device is not given up. */
static void what_costs_the_device_while_it_is_loaded_is_refused(void **state)
{
    (void)state;
    struct spl_fleet *fleet = start(8);
    struct spl_catalog_entry *entry = open_entry(), *other = open_entry();
    spl_fleet_add(fleet, other);
    assert_ptr_equal(take_change(fleet), other);
    const uint64_t losses = counters.device_losses;
    fake_setenv("FAKE_LOSE_LOADING", "10");
    spl_fleet_add(fleet, entry);
    assert_ptr_equal(take_change(fleet), entry);
    assert_int_equal(entry->state, SPL_ENTRY_REFUSED);
    assert_non_null(strstr(entry->err.message, "lost twice"));
    wait_until_ready(fleet, losses + 2);
    assert_int_equal(view_of(fleet, other), 0);
    assert_int_equal(counters.device_losses - losses, 2);
    fake_unsetenv("FAKE_LOSE_LOADING");
    spl_catalog_entry_unref(entry);
    spl_catalog_entry_unref(other);
    spl_fleet_destroy(fleet);
}

static void versions_come_and_go_while_the_device_is_lost(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "1x3");
    struct spl_fleet *fleet = start(8);
    for (int i = 0; i < 20; i++) {
        struct spl_catalog_entry *entry = open_entry();
        spl_fleet_add(fleet, entry);
        struct spl_job *job = make_job(600000), *back;
        if (i % 4 == 0 && !spl_fleet_submit(fleet, job, NULL))
            job = NULL;
        assert_ptr_equal(take_change(fleet), entry);
        assert_int_equal(entry->state, SPL_ENTRY_RESIDENT);
        if (!job)
            spl_job_destroy(take_job(fleet));
        spl_job_destroy(job);
        job = make_job(600000);
        job->entry = spl_catalog_entry_ref(entry);
        job->dataset = entry->dataset;
        spl_catalog_entry_unref(entry); // the job's reference is the last
        assert_null(spl_fleet_take_change(fleet));
        if (!spl_fleet_submit(fleet, job, NULL)) {
            back = take_job(fleet);
            assert_ptr_equal(back, job);
        }
        spl_job_destroy(job);
        assert_ptr_equal(take_change(fleet), entry);
        assert_int_equal(entry->state, SPL_ENTRY_GONE);
        spl_catalog_entry_destroy(entry);
    }
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_fleet_destroy(fleet);
}

static void a_fleet_ends_with_versions_in_every_state(void **state)
{
    (void)state;
    for (int taken = 0; taken < 4; taken++) {
        struct spl_fleet *fleet = start(8);
        for (int i = 0; i < 4; i++)
            spl_fleet_add(fleet, open_entry());
        for (int i = 0; i < taken;) {
            struct spl_catalog_entry *entry = take_change(fleet);
            if (entry->state == SPL_ENTRY_GONE) { // one that was given back is, soon
                spl_catalog_entry_destroy(entry);
                continue;
            }
            spl_catalog_entry_unref(entry);
            i++;
        }
        spl_fleet_destroy(fleet); // leak checkers see what is left
    }
    struct spl_catalog_entry *entry = open_entry();
    fake_setenv("FAKE_OPEN_LIMIT", "0");
    struct spl_fleet *fleet = start(8);
    spl_fleet_add(fleet, entry); // nobody will ever take it up
    fake_unsetenv("FAKE_OPEN_LIMIT");
    spl_fleet_destroy(fleet);
}

static struct spl_job *make_job_of(struct spl_catalog_entry *entry)
{
    struct spl_job *job = make_job(600000);
    job->entry = spl_catalog_entry_ref(entry);
    job->dataset = entry->dataset;
    return job;
}

static struct spl_pipeline_status look(struct spl_fleet *fleet, size_t device)
{
    struct spl_pipeline_status status;
    spl_pipeline_get_status(spl_fleet_get(fleet, device), &status);
    return status;
}

static void finish_all(struct spl_fleet *fleet, int jobs)
{
    for (int i = 0; i < jobs; i++) {
        struct spl_job *job = take_job(fleet);
        assert_int_equal(job->err.code, 0);
        spl_job_destroy(job);
    }
}

/* The device with the least to do; of those alike, the home of the dataset, all of which is at one place here. */
static void views_go_where_the_least_waits(void **state)
{
    (void)state;
    fake_setenv("FAKE_FRAME_MS", "300");
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_catalog_entry *entries[2] = {open_entry(), open_entry()};
    for (int i = 0; i < 2; i++) {
        spl_fleet_add(fleet, entries[i]);
        assert_ptr_equal(take_change(fleet), entries[i]);
        assert_int_equal(entries[i]->state, SPL_ENTRY_RESIDENT);
        assert_int_equal(entries[i]->home, i);
        assert_int_equal(spl_catalog_entry_get_resident_bytes(entries[i]), 2 << 16);
    }
    for (int i = 1; i >= 0; i--) {
        assert_int_equal(spl_fleet_submit(fleet, make_job_of(entries[i]), NULL), 0);
        assert_true(look(fleet, (size_t)i).samples_inside > 0);
        assert_int_equal(look(fleet, (size_t)!i).samples_inside, 0);
        finish_all(fleet, 1);
    }
    for (int i = 0; i < 6; i++)
        assert_int_equal(spl_fleet_submit(fleet, make_job_of(entries[0]), NULL), 0);
    assert_int_equal(look(fleet, 0).samples_inside, look(fleet, 1).samples_inside);
    struct spl_pipeline_status all;
    spl_fleet_get_status(fleet, &all);
    assert_int_equal(all.samples_inside, 2 * look(fleet, 0).samples_inside);
    assert_int_equal(all.render_capacity, 8);
    finish_all(fleet, 6);
    assert_int_equal(counters.frames, 8);
    for (int i = 0; i < 2; i++)
        spl_catalog_entry_unref(entries[i]);
    fake_unsetenv("FAKE_FRAME_MS");
    spl_fleet_destroy(fleet);
}

/* Of an idle fleet: by where the eye is along the dataset's longest side, beyond whose ends it counts as at them. */
static void places_of_a_dataset_have_homes(void **state)
{
    (void)state;
    fake_setenv("FAKE_FRAME_MS", "50");
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1,fake:2", 9);
    struct spl_catalog_entry *before = open_entry(), *entry = open_splats(2);
    spl_fleet_add(fleet, before); // whose home is the first
    assert_ptr_equal(take_change(fleet), before);
    spl_fleet_add(fleet, entry);
    assert_ptr_equal(take_change(fleet), entry);
    static const struct {
        double y;
        size_t device;
    } places[] = {{-1e12, 1}, {0, 1}, {29, 1}, {31, 2}, {59, 2}, {61, 0}, {90, 0}, {1e12, 0}};
    for (size_t i = 0; i < sizeof places / sizeof *places; i++) {
        struct spl_job *job = make_job_of(entry);
        job->request.view.camera.eye[1] = places[i].y;
        assert_int_equal(spl_fleet_submit(fleet, job, NULL), 0);
        assert_true(look(fleet, places[i].device).samples_inside > 0);
        finish_all(fleet, 1);
    }
    spl_catalog_entry_unref(before);
    spl_catalog_entry_unref(entry);
    fake_unsetenv("FAKE_FRAME_MS");
    spl_fleet_destroy(fleet);
}

static void all_queues_are_full_before_a_view_is_refused(void **state)
{
    (void)state;
    struct spl_fleet *fleet = start_fleet("fake,fake,fake", 6);
    struct spl_job *job;
    struct spl_error err = {0};
    int accepted = 0, rc;
    hold_frames(true);
    while (!(rc = spl_fleet_submit(fleet, job = make_job(600000), &err)))
        accepted++;
    assert_int_equal(rc, SPL_E_BUSY);
    assert_in_range(accepted, 6, 9); // two in each queue, and one that is drawn
    assert_in_range(spl_fleet_get_retry_after(fleet, false), 1, 60);
    spl_job_destroy(job);
    hold_frames(false);
    spl_fleet_destroy(fleet);
    assert_int_equal(counters.frames, accepted);
}

/* While one is reopened, however long that takes, the other serves; and the fleet is ready. */
static void a_lost_device_leaves_the_others(void **state)
{
    (void)state;
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_catalog_entry *entry = open_entry();
    spl_fleet_add(fleet, entry);
    assert_ptr_equal(take_change(fleet), entry);
    spl_catalog_entry_ref(entry);
    spl_catalog_entry_unref(entry);
    atomic_store(&fake_frames.closed, true);
    fake_setenv("FAKE_LOSE_FRAME", "1");
    assert_int_equal(view_of(fleet, entry), SPL_E_DEVICE_LOST);
    fake_unsetenv("FAKE_LOSE_FRAME");
    await_losses(1); // the view came back before
    for (int i = 0; i < 4; i++) {
        assert_int_equal(spl_fleet_get_state(fleet), SPL_PIPELINE_READY);
        assert_int_equal(view_of(fleet, entry), 0);
    }
    assert_int_equal(spl_pipeline_get_state(spl_fleet_get(fleet, 0)), SPL_PIPELINE_REBUILDING);
    atomic_store(&fake_frames.closed, false);
    while (spl_pipeline_get_state(spl_fleet_get(fleet, 0)) != SPL_PIPELINE_READY)
        usleep(1000);
    assert_int_equal(view_of(fleet, entry), 0);
    spl_catalog_entry_unref(entry);
    spl_fleet_destroy(fleet);
}

/* For good: datasets come and go on those that are left, and with the last the fleet has failed. */
static void a_device_that_is_gone_is_given_up(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "10x100"); // the second after twenty
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_catalog_entry *entry = open_entry(), *later = open_entry();
    spl_fleet_add(fleet, entry);
    assert_ptr_equal(take_change(fleet), entry);
    fake_setenv("FAKE_OPEN_LIMIT", "0");
    while (view_of(fleet, entry) != SPL_E_DEVICE_LOST)
        ;
    while (spl_pipeline_get_state(spl_fleet_get(fleet, 0)) != SPL_PIPELINE_FAILED)
        usleep(500);
    assert_int_equal(spl_fleet_get_state(fleet), SPL_PIPELINE_READY);
    spl_fleet_add(fleet, later);
    assert_ptr_equal(take_change(fleet), later);
    assert_int_equal(later->state, SPL_ENTRY_RESIDENT);
    assert_false(later->replicas[0].there);
    assert_int_equal(view_of(fleet, later), 0);
    spl_catalog_entry_unref(entry); // also on the device that is gone
    assert_ptr_equal(take_change(fleet), entry);
    assert_int_equal(entry->state, SPL_ENTRY_GONE);
    spl_catalog_entry_destroy(entry);
    for (struct spl_job *job; spl_fleet_get_state(fleet) != SPL_PIPELINE_FAILED; spl_job_destroy(job)) {
        job = make_job_of(later);
        if (!spl_fleet_submit(fleet, job, NULL))
            assert_ptr_equal(take_job(fleet), job);
    }
    assert_int_equal(spl_fleet_get_failure(fleet)->code, SPL_E_DEVICE_LOST);
    spl_catalog_entry_unref(later);
    fake_unsetenv("FAKE_OPEN_LIMIT");
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_fleet_destroy(fleet);
}

/* It is drawn where it is; what no device has room for is refused. */
static void a_dataset_has_room_on_some_devices(void **state)
{
    (void)state;
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1", 8);
    struct spl_catalog_entry *entry = open_entry(), *large = open_entry();
    fake_setenv("FAKE_REFUSE", "1");
    spl_fleet_add(fleet, entry);
    assert_ptr_equal(take_change(fleet), entry);
    assert_int_equal(entry->state, SPL_ENTRY_RESIDENT);
    assert_int_equal(entry->replicas[0].there + entry->replicas[1].there, 1);
    assert_int_equal(entry->err.code, 0);
    for (int i = 0; i < 4; i++)
        assert_int_equal(view_of(fleet, entry), 0);
    fake_setenv("FAKE_REFUSE", "3");
    spl_fleet_add(fleet, large);
    assert_ptr_equal(take_change(fleet), large);
    assert_int_equal(large->state, SPL_ENTRY_REFUSED);
    assert_int_equal(large->err.code, SPL_E_LIMIT);
    fake_unsetenv("FAKE_REFUSE");
    spl_catalog_entry_unref(large);
    spl_catalog_entry_unref(entry);
    assert_ptr_equal(take_change(fleet), entry); // of the one device that had it
    assert_int_equal(entry->state, SPL_ENTRY_GONE);
    spl_catalog_entry_destroy(entry);
    spl_fleet_destroy(fleet);
}

static void devices_are_of_one_kind(void **state)
{
    (void)state;
    struct spl_fleet *fleet = start_fleet("fake,other", 8);
    assert_int_equal(spl_fleet_get_state(fleet), SPL_PIPELINE_FAILED);
    assert_non_null(strstr(spl_fleet_get_failure(fleet)->message, "two kinds"));
    assert_string_equal(spl_fleet_get_failure(fleet)->field, "device");
    spl_fleet_destroy(fleet);
}

static void lists_of_devices_are_checked(void **state)
{
    (void)state;
    static const struct {
        const char *text, *message;
        int code;
    } bad[] = {{"vulkan,", "empty", SPL_E_USAGE},
               {",", "empty", SPL_E_USAGE},
               {"vulkan:0, ,vulkan:1", "empty", SPL_E_USAGE},
               {"a,b,c,d,e,f,g,h,i,j,k,l,m,n,o,p,q", "more than 16", SPL_E_USAGE}};
    struct spl_device_list list;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct spl_error err = {0};
        assert_int_equal(spl_device_list_init(&list, bad[i].text, &err), bad[i].code);
        assert_string_equal(err.field, "device");
        assert_non_null(strstr(err.message, bad[i].message));
        assert_int_equal(list.count, 0);
    }
    assert_int_equal(spl_device_list_init(&list, "fake:0, fake:1,fake:0", NULL), 0);
    assert_int_equal(list.count, 3);
    assert_string_equal(list.names[1], "fake:1");
    assert_int_equal(list.sharers[0], 2); // unknown ones, by their names
    assert_int_equal(list.sharers[1], 1);
    spl_device_list_finish(&list);
    assert_int_equal(spl_device_list_init(&list, "", NULL), 0);
    assert_string_equal(list.names[0], "auto");
    assert_int_equal(list.sharers[0], 1);
    spl_device_list_finish(&list);
}

/* Both together: views while versions come and go and devices are lost. Whoever sees races runs it (suite crowd). */
static void devices_are_lost_while_all_goes_on(void **state)
{
    (void)state;
    fake_setenv("SPLATD_INJECT_LOSS_AFTER", "7x2");
    struct spl_fleet *fleet = start_fleet("fake:0,fake:1,fake:2", 32);
    int back = 0, sent = 0;
    for (int i = 0; i < 12; i++) {
        struct spl_catalog_entry *entry = open_entry();
        spl_fleet_add(fleet, entry);
        assert_ptr_equal(take_change(fleet), entry);
        assert_int_equal(entry->state, SPL_ENTRY_RESIDENT);
        for (int v = 0; v < 6; v++) {
            struct spl_job *job = make_job_of(entry);
            if (spl_fleet_submit(fleet, job, NULL))
                spl_job_destroy(job);
            else
                sent++;
        }
        spl_catalog_entry_unref(entry);
        struct spl_catalog_entry *changed = NULL;
        while (!changed || changed->state != SPL_ENTRY_GONE) {
            for (struct spl_job *job; (job = spl_fleet_take(fleet)); back++)
                spl_job_destroy(job);
            if ((changed = spl_fleet_take_change(fleet)) && changed->state == SPL_ENTRY_ASIDE)
                spl_catalog_entry_unref(changed);
            usleep(200);
        }
        assert_ptr_equal(changed, entry);
        spl_catalog_entry_destroy(entry);
    }
    assert_int_equal(back, sent);
    fake_unsetenv("SPLATD_INJECT_LOSS_AFTER");
    spl_fleet_destroy(fleet);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_costs_the_device_twice_is_put_aside),
        cmocka_unit_test(what_costs_the_device_while_it_is_loaded_is_refused),
        cmocka_unit_test(versions_come_and_go_while_the_device_is_lost),
        cmocka_unit_test(a_fleet_ends_with_versions_in_every_state),
        cmocka_unit_test(views_go_where_the_least_waits),
        cmocka_unit_test(places_of_a_dataset_have_homes),
        cmocka_unit_test(all_queues_are_full_before_a_view_is_refused),
        cmocka_unit_test(a_lost_device_leaves_the_others),
        cmocka_unit_test(a_device_that_is_gone_is_given_up),
        cmocka_unit_test(a_dataset_has_room_on_some_devices),
        cmocka_unit_test(devices_are_of_one_kind),
        cmocka_unit_test(lists_of_devices_are_checked),
        cmocka_unit_test(devices_are_lost_while_all_goes_on),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
