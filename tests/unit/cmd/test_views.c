/* --default-view and --view of pack and collect, as people give them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include <cmocka.h>

#include <splatd/dataset.h>

static char folder[] = "/tmp/splatd-views-XXXXXX";
static char said[16384];

/* Runs `splatd ARGUMENTS` in the folder; returns the exit code, what was printed in `said`. */
static int run(const char *arguments)
{
    char line[2048];
    snprintf(line, sizeof line, "cd '%s' && '%s' %s 2>&1", folder, getenv("SPLATD_BINARY"), arguments);
    FILE *pipe = popen(line, "r");
    said[fread(said, 1, sizeof said - 1, pipe)] = 0;
    return WEXITSTATUS(pclose(pipe));
}

static void expect(const char *arguments, int code, const char *says)
{
    int got = run(arguments);
    if (got != code || !strstr(said, says))
        fail_msg("%s: exit %d, '%s' is not in: %s", arguments, got, says, said);
}

static void check_views(const char *name)
{
    char path[96];
    struct spl_dataset *dataset;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), 0);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_true(info->default_eye[0] == 4 && info->default_eye[1] == 5 && info->default_eye[2] == 1.6);
    assert_true(info->default_target[2] == 1.2 && info->default_up[2] == 1 && info->default_fov == 50);
    assert_int_equal(info->view_count, 2);
    assert_string_equal(info->views[0].name, "door");
    assert_string_equal(info->views[1].name, "plan");
    assert_true(info->views[0].target[0] == 4 && info->views[1].up[1] == 1 && info->views[1].view_height == 30);
    spl_dataset_close(dataset);
}

#define VIEWS                                                                                                          \
    " --default-view eye=4,5,1.6,target=0,0,1.2,fov=50"                                                                \
    " --view plan=eye=0,0,50,target=0,0,0,up=0,1,0,view_height=30"                                                     \
    " --view door=eye=1,0,1.6,target=4,0,1.2"

static void test_pack_and_collect_take_the_same_views(void **state)
{
    (void)state;
    expect("pack courtyard.ply -o tile.spld" VIEWS, 0, "tile.spld");
    check_views("tile.spld");
    expect("collect tile.spld -o all.spld" VIEWS, 0, "a collection of 1 tile");
    check_views("all.spld");
    expect("collect --merge all.spld -o whole.spld", 0, "one file");
    check_views("whole.spld");
    expect("collect --merge all.spld -o whole.spld" VIEWS, 2, "keeps title, description and views");
    expect("collect tile.spld -o all.spld", 0, "a collection of 1 tile"); /* anew: nothing is kept of the old one */
    expect("info --json all.spld", 0, "\"id\":\"all\"");
    assert_null(strstr(said, "\"door\""));
}

/* Where up is not said, as in views that are asked for: up is +y. */
static void test_a_plan_needs_no_up(void **state)
{
    (void)state;
    static const char *const ways[] = {"pack courtyard.ply", "pack --parts 2 courtyard.ply", "collect tile.spld"};
    expect("pack courtyard.ply -o tile.spld", 0, "tile.spld");
    for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
        char line[300], path[96];
        struct spl_dataset *dataset;
        snprintf(line, sizeof line, "%s --view top=eye=0,0,50,target=0,0,1,view_height=30 -o top.spld", ways[w]);
        expect(line, 0, "top.spld");
        snprintf(path, sizeof path, "%s/top.spld", folder);
        assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), 0);
        const double *up = spl_dataset_get_info(dataset)->views[0].up;
        assert_true(up[0] == 0 && up[1] == 1 && up[2] == 0);
        spl_dataset_close(dataset);
    }
}

static void test_what_is_no_view_is_refused(void **state)
{
    (void)state;
    static const char *const wrong[][2] = {
        {"--default-view eye=1,2,3", "--default-view needs eye=X,Y,Z and target=X,Y,Z"},
        {"--default-view eye=1,2,3,target=1,2", "--default-view"},
        {"--default-view eye=1,2,3,target=0,0,0,view_height=4", "--default-view: it is a pinhole's"},
        {"--default-view eye=1,2,3,target=0,0,0,roll=4", "--default-view takes eye="},
        {"--default-view eye=0,0,50,target=0,0,1", "--default-view: from eye 0,0,50 to target 0,0,1 with up 0,0,1: "},
        {"--view door", "--view takes NAME=eye="},
        {"--view door=eye=1,2,3", "--view needs eye="},
        {"--view 'a b=eye=1,2,3,target=0,0,0'", "--view: 'a b' is no name"},
        {"--view a=eye=1,2,3,target=0,0,0 --view a=eye=1,2,4,target=0,0,0", "--view a is given twice"},
        {"--view a=eye=0,0,50,target=0,0,1", "--view a: from eye 0,0,50 to target 0,0,1 with up 0,0,1: "},
        {"--view a=eye=0,0,50,target=0,0,1,up=0,0,3,view_height=9",
         "--view a: from eye 0,0,50 to target 0,0,1 with up 0,0,3: "},
    };
    static const char *const ways[] = {"pack courtyard.ply -o none.spld", "pack --parts 2 courtyard.ply -o none.spld",
                                       "collect tile.spld -o none.spld", "pack --join job -o job/none.spld"};
    expect("pack courtyard.ply -o tile.spld", 0, "tile.spld");
    expect("pack --plan 2 courtyard.ply -o job", 0, "2 parts");
    expect("pack --part 0 job", 0, "");
    expect("pack --part 1 job", 0, "");
    for (size_t w = 0; w < sizeof ways / sizeof *ways; w++)
        for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
            char line[300];
            snprintf(line, sizeof line, "%s %s", ways[w], wrong[i][0]);
            expect(line, 2, wrong[i][1]);
            bool by_tiles = w >= 2 && strstr(said, "with up"); /* they say what is up */
            if (!by_tiles && (strstr(said, "reading") || strstr(said, "looking at")))
                fail_msg("%s: read first: %s", line, said);
        }
    expect("info none.spld", 2, "none.spld");
    expect("info job/none.spld", 2, "none.spld");
    expect("info none.spld.parts/part-0.spld", 2, "part-0.spld");
    /* along up is what up makes it */
    expect("pack courtyard.ply --up -y --default-view eye=0,9,0,target=0,0,0 -o none.spld", 2, "with up 0,-1,0: ");
    expect("pack courtyard.ply --up -y --default-view eye=0,0,50,target=0,0,1 -o other.spld", 0, "other.spld");
    expect("info other.spld", 0, "other");
}

static int set_up(void **state)
{
    (void)state;
    if (!mkdtemp(folder))
        return -1;
    return run("synth courtyard --points 3000 --format ply -o .");
}

static int tear_down(void **state)
{
    char command[100];
    (void)state;
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return system(command);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pack_and_collect_take_the_same_views),
        cmocka_unit_test(test_a_plan_needs_no_up),
        cmocka_unit_test(test_what_is_no_view_is_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
