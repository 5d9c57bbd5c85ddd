/* What level selection draws, against a selector that looks at everything (support/naive_select.h) and against the
 * splats themselves; and what it says of nodes that are not there. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "cameras.h"
#include "dataset/chunk.h"
#include "render/select.h"
#include "support/make_dataset.h"
#include "support/naive_select.h"

enum { side = 40, splats = 20000, width = 320, height = 200 };

static uint64_t random_state;

static double uniform(void)
{
    random_state = random_state * 6364136223846793005u + 1442695040888963407u;
    return (double)(random_state >> 11) / 9007199254740992.0;
}

/* Grants as many nodes as are left. */
static enum spl_select_answer take_one(void *context, uint32_t page)
{
    int *left = context;
    (void)page;
    return (*left)-- > 0 ? SPL_SELECT_YES : SPL_SELECT_NO;
}

static void a_spacing_of_stand_ins_is_not_complete(void **state)
{
    (void)state;
    static struct make_splat wall[side * side];
    for (int i = 0; i < side * side; i++)
        wall[i] =
            (struct make_splat){.position = {i % side * 0.1, i / side * 0.1, 0}, .normal = {0, 0, 1}, .radius = 0.05f};
    struct spl_dataset *dataset = make_dataset_levels(wall, side * side, 2);
    struct spl_view view;
    spl_view_init(&view);
    view.camera.near = 0.1;
    view.camera.far = 100;
    const double eye[3] = {2, 2, 8}, target[3] = {2, 2, 0}, up[3] = {0, 1, 0};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 40, 256, 256, NULL), SPL_OK);
    int left = 1000;
    struct spl_select_params params = {
        .dataset = dataset, .camera = &view.camera, .lod = 1, .resident = take_one, .context = &left};
    double fine, coarse;
    bool complete = true;
    assert_int_equal(spl_select_spacing(&params, &fine, &complete, NULL), SPL_OK);
    assert_true(complete);
    left = 1; /* the root */
    assert_int_equal(spl_select_spacing(&params, &coarse, &complete, NULL), SPL_OK);
    assert_false(complete);
    assert_true(coarse > fine);
    left = 1000;
    assert_int_equal(spl_select_spacing(&params, &fine, &complete, NULL), SPL_OK);
    assert_false(complete); /* what another part of the frame said stands */
    spl_dataset_close(dataset);
}

/* Clumps of a chunk each over two decades of size, in a cube of 2 m; radii as alike as the packer leaves them, but for
 * one disc of each clump, which is `odd` times as large. Every third clump is of wires. */
static struct spl_dataset *make_clumps(double odd)
{
    struct make_splat *all = calloc(splats, sizeof *all);
    double middle[3] = {0}, size = 0;
    assert_non_null(all);
    for (size_t i = 0; i < splats; i++) {
        if (i % SPL_CHUNK_SPLATS == 0) {
            size = 0.005 * pow(100, uniform());
            for (int c = 0; c < 3; c++)
                middle[c] = (1 - size) * (2 * uniform() - 1);
        }
        for (int c = 0; c < 3; c++)
            all[i].position[c] = middle[c] + size * (2 * uniform() - 1);
        all[i].normal[2] = 1;
        all[i].linear = i / SPL_CHUNK_SPLATS % 3 == 0;
        all[i].radius = (float)(0.012 * (0.6 + 0.8 * uniform()) * (i % SPL_CHUNK_SPLATS == 8 ? odd : 1));
    }
    struct spl_dataset *dataset = make_dataset_levels(all, splats, 2);
    free(all);
    return dataset;
}

/* A disc as a ball in view space. */
struct ball {
    double at[3], radius;
};

static struct ball ball_of(const struct spl_dataset *dataset, const struct spl_camera *camera,
                           const struct naive_chunk *drawn, uint32_t index)
{
    uint64_t count;
    size_t bytes;
    const struct spl_node *node = &spl_dataset_get_nodes(dataset, &count)[drawn->node];
    struct spl_splat splat;
    spl_chunk_decode(&spl_dataset_get_chunks(dataset, &count)[drawn->chunk],
                     spl_dataset_get_page(dataset, node->page, &bytes), index, &splat);
    struct ball ball = {.radius = splat.radius * drawn->scale};
    for (int i = 0; i < 3; i++)
        for (int a = 0; a < 3; a++)
            ball.at[i] += camera->rotation[3 * i + a] * (node->origin[a] + splat.position[a] - camera->eye[a]);
    return ball;
}

/* Does it reach into the image? Its middle lies where splats are drawn, and it on the inner side of each edge. */
static bool is_seen(const struct spl_camera *camera, const struct ball *ball)
{
    if (!(ball->at[2] >= camera->near && ball->at[2] <= camera->far))
        return false;
    const double edges[4][3] = {{camera->fx, 0, camera->cx},
                                {-camera->fx, 0, camera->width - camera->cx},
                                {0, camera->fy, camera->cy},
                                {0, -camera->fy, camera->height - camera->cy}};
    for (int e = 0; e < 4; e++) {
        double inside = 0, length = 0;
        for (int c = 0; c < 3; c++) {
            inside += edges[e][c] * ball->at[c];
            length += edges[e][c] * edges[e][c];
        }
        if (inside < -ball->radius * sqrt(length))
            return false;
    }
    return true;
}

/* What was listed of a chunk. */
struct listed {
    uint32_t times, count, last_window;
    float radius_min;
    double near;
};

static struct listed *index_list(const struct spl_draw_list *list, const struct spl_chunk *chunks, uint32_t chunk_count)
{
    struct listed *listed = calloc(chunk_count, sizeof *listed);
    assert_non_null(listed);
    for (size_t i = 0; i < list->chunk_count; i++) {
        const struct spl_draw_chunk *draw = &list->chunks[i];
        uint32_t at = 0, window = draw->count >> SPL_COUNT_BITS;
        while (at < chunk_count && chunks[at].first_id != draw->first_id)
            at++;
        assert_true(at < chunk_count);
        assert_true(!listed[at].times++ || window > listed[at].last_window); /* each window once */
        listed[at].last_window = window;
        listed[at].count = draw->count & ((1u << SPL_COUNT_BITS) - 1);
        listed[at].radius_min = draw->radius_min;
        listed[at].near = list->bounds[i].near;
    }
    return listed;
}

/* Splats whose balls lie over the middle of a pixel: at most as many discs can. */
static uint32_t count_over(const struct spl_camera *camera, const struct ball *balls, size_t count, double x, double y)
{
    double ray[3] = {(x - camera->cx) / camera->fx, (y - camera->cy) / camera->fy, 1}, square = 0;
    uint32_t over = 0;
    for (int c = 0; c < 3; c++)
        square += ray[c] * ray[c];
    for (size_t i = 0; i < count; i++) {
        double along = 0, away = 0;
        for (int c = 0; c < 3; c++)
            along += ray[c] * balls[i].at[c] / square;
        for (int c = 0; c < 3; c++)
            away += pow(along * ray[c] - balls[i].at[c], 2);
        over += away < balls[i].radius * balls[i].radius;
    }
    return over;
}

/* Whether the root was asked for. */
static bool check_view(const struct spl_dataset *dataset, const struct spl_camera *camera, double lod)
{
    uint64_t chunk_count;
    size_t count, seen_balls = 0;
    int left = 1 << 30;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    struct spl_select_params params = {.dataset = dataset,
                                       .camera = camera,
                                       .lod = lod,
                                       .low_pass = (double)SPL_LOW_PASS,
                                       .discs = true,
                                       .resident = take_one,
                                       .context = &left};
    struct spl_draw_list list = {0};
    assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
    struct listed *listed = index_list(&list, chunks, chunk_count);
    struct naive_chunk *naive =
        naive_select(&(struct naive_options){.dataset = dataset, .camera = camera, .lod = lod}, &count);
    struct ball *balls = calloc(splats + splats / 4, sizeof *balls);
    assert_non_null(balls);
    uint64_t drawn = 0;
    for (size_t i = 0; i < count; i++) {
        struct listed *is = &listed[naive[i].chunk];
        bool wanted = false;
        for (uint32_t k = 0; k < naive[i].count; k++) {
            struct ball ball = ball_of(dataset, camera, &naive[i], k);
            bool seen = is_seen(camera, &ball);
            wanted |= seen;
            if (seen)
                balls[seen_balls++] = ball;
            if (seen && is->times && is->near > 0) /* not hidden by what lies behind it; 0: never is */
                assert_true(is->near <= ball.at[2] - ball.radius);
        }
        if (wanted && !is->times)
            fail_msg("chunk %u of node %u is not drawn at lod %g", naive[i].chunk, naive[i].node, lod);
        if (!is->times)
            continue;
        drawn += is->count;
        assert_int_equal(is->count, naive[i].count);
        assert_float_equal(is->radius_min / (float)(chunks[naive[i].chunk].radius_min * naive[i].scale), 1, 1e-6);
        is->times = 0;
    }
    assert_int_equal(drawn, list.drawn[SPL_CHUNK_DISCS]);
    for (uint32_t c = 0; c < chunk_count; c++)
        assert_int_equal(listed[c].times, 0); /* nothing of another level */
    for (int y = 5; y < height; y += 40)
        for (int x = 5; x < width; x += 40)
            assert_true(count_over(camera, balls, seen_balls, x + 0.5, y + 0.5) <= list.sample_splats);
    double spacing;
    bool complete = true;
    assert_int_equal(spl_select_spacing(&params, &spacing, &complete, NULL), SPL_OK);
    assert_float_equal(spacing / naive_spacing(naive, count), 1, 1e-9);
    bool coarse = naive[0].node == 0;
    free(balls);
    free(naive);
    free(listed);
    spl_draw_list_finish(&list);
    return coarse;
}

static void every_splat_that_is_seen_is_drawn_at_its_level(void **state)
{
    (void)state;
    static const double lods[] = {0, 0.3, 1, 4, 16};
    unsigned coarse = 0;
    random_state = 17;
    for (int odd = 1; odd < 30; odd += 14) {
        struct spl_dataset *dataset = make_clumps(odd);
        for (int view = 0; view < 200; view++) {
            struct spl_camera camera = random_camera(uniform, width, height);
            coarse += check_view(dataset, &camera, lods[view % 5]);
        }
        spl_dataset_close(dataset);
    }
    assert_in_range(coarse, 40, 560); /* both levels were asked for */
}

/* A wall of small discs 10 m away, beside the image, with one disc that is ten times as large and, pruned, twice as
 * large again; one of the small ones lies `behind` the others. From `away` beyond the image's edge: how many nodes and
 * chunks are drawn. */
static void draw_beside(double behind, double away, uint64_t *nodes, size_t *chunks)
{
    enum { wall = 4 * SPL_CHUNK_SPLATS };
    static struct make_splat all[wall];
    for (int i = 0; i < wall; i++)
        all[i] = (struct make_splat){.position = {0.01 * (i % 16), 0.01 * (i / 16), i + 1 < wall ? 10 : 10 + behind},
                                     .normal = {0, 0, 1},
                                     .radius = i ? 0.005f : 0.05f};
    struct spl_dataset *dataset = make_dataset(all, wall);
    struct spl_camera camera = {.eye = {-5 - away}, .width = 200, .height = 200, .fx = 200, .fy = 200,
                                .cx = 100, .cy = 100, .near = 0.1, .far = 100};
    camera.rotation[0] = camera.rotation[4] = camera.rotation[8] = 1;
    int left = 1 << 30;
    struct spl_select_params params = {
        .dataset = dataset, .camera = &camera, .lod = 8, .discs = true, .resident = take_one, .context = &left};
    struct spl_draw_list list = {0};
    assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
    *nodes = list.nodes;
    *chunks = list.chunk_count;
    spl_draw_list_finish(&list);
    spl_dataset_close(dataset);
}

static void one_large_disc_at_the_edge_is_drawn(void **state)
{
    (void)state;
    uint64_t nodes;
    size_t chunks;
    draw_beside(0, 0.12, &nodes, &chunks);
    assert_true(nodes == 1 && chunks == 1);
    draw_beside(0, 0.17, &nodes, &chunks);
    assert_true(nodes == 0 && chunks == 0);
    draw_beside(0.5, 0.42, &nodes, &chunks); /* of such a box a disc could be twice as large, but none is */
    assert_true(nodes == 0 && chunks == 0);
}

/* Nodes come nearest first: what is drawn first hides the rest, and takes memory first. */
static void nodes_are_listed_front_to_back(void **state)
{
    (void)state;
    random_state = 23;
    struct spl_dataset *dataset = make_clumps(1);
    uint64_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    for (int view = 0; view < 20; view++) {
        struct spl_camera camera = random_camera(uniform, width, height);
        struct spl_draw_list list = {0};
        int left = 1 << 30;
        double last = -INFINITY;
        struct spl_select_params params = {
            .dataset = dataset, .camera = &camera, .resident = take_one, .context = &left};
        assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
        for (size_t i = 0; i < list.chunk_count; i++) {
            uint32_t n = 0, c = 0;
            while (chunks[c].first_id != list.chunks[i].first_id)
                c++;
            while (nodes[n].first_chunk > c || nodes[n].first_chunk + nodes[n].chunk_count <= c)
                n++;
            double depth = 0;
            for (int a = 0; a < 3; a++)
                depth += camera.rotation[6 + a] * (nodes[n].origin[a] - camera.eye[a] +
                                                   0.5 * ((double)nodes[n].box_min[a] + nodes[n].box_max[a]));
            assert_true(depth >= last - 1e-6);
            last = depth;
        }
        spl_draw_list_finish(&list);
    }
    spl_dataset_close(dataset);
}

/* What several cores list, node by node, is what one does. */
static void shared_among_cores_it_is_the_same(void **state)
{
    (void)state;
    random_state = 29;
    struct spl_dataset *dataset = make_clumps(3);
    size_t several = 0;
    for (int view = 0; view < 60; view++) {
        struct spl_camera camera = random_camera(uniform, width, height);
        struct spl_draw_list list[2] = {{0}, {0}};
        for (int shared = 0; shared < 2; shared++) {
            int left = view % 3 ? 1 << 30 : 3;
            struct spl_select_params params = {.dataset = dataset, .camera = &camera, .lod = view % 2, .discs = true,
                                               .resident = take_one, .context = &left,
                                               .share_from = shared ? 1 : UINT32_MAX};
            assert_int_equal(spl_select(&params, &list[shared], NULL), SPL_OK);
        }
        const struct spl_draw_list *a = &list[0], *b = &list[1];
        assert_true(a->chunk_count == b->chunk_count && a->entry_count == b->entry_count && a->nodes == b->nodes);
        assert_true(a->batch_count == b->batch_count && a->first_back_chunk == b->first_back_chunk);
        assert_true(a->listed_splats == b->listed_splats && a->sample_splats == b->sample_splats);
        assert_memory_equal(a->drawn, b->drawn, sizeof a->drawn);
        assert_int_equal(a->complete, b->complete);
        several += a->nodes > 1;
        if (a->chunk_count) {
            assert_memory_equal(a->chunks, b->chunks, a->chunk_count * sizeof *a->chunks);
            assert_memory_equal(a->bounds, b->bounds, a->chunk_count * sizeof *a->bounds);
            assert_memory_equal(a->entries, b->entries, a->entry_count * sizeof *a->entries);
        }
        spl_draw_list_finish(&list[0]);
        spl_draw_list_finish(&list[1]);
    }
    assert_true(several > 20);
    spl_dataset_close(dataset);
}

/* The root is there, the others later: all of them are asked for. */
static enum spl_select_answer take_later(void *context, uint32_t page)
{
    int *asked = context;
    (void)page;
    return (*asked)++ ? SPL_SELECT_LATER : SPL_SELECT_YES;
}

static void what_comes_later_is_asked_for_at_once(void **state)
{
    (void)state;
    static struct make_splat grid[side * side];
    for (int i = 0; i < side * side; i++)
        grid[i] =
            (struct make_splat){.position = {i % side * 0.1, i / side * 0.1, 0}, .normal = {0, 0, 1}, .radius = 0.05f};
    struct spl_dataset *dataset = make_dataset_levels(grid, side * side, 2);
    uint64_t nodes;
    spl_dataset_get_nodes(dataset, &nodes);
    struct spl_view view;
    spl_view_init(&view);
    view.camera.near = 0.1;
    view.camera.far = 100;
    const double eye[3] = {2, 2, 8}, target[3] = {2, 2, 0}, up[3] = {0, 1, 0};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 40, 256, 256, NULL), SPL_OK);
    int asked = 0;
    struct spl_select_params params = {
        .dataset = dataset, .camera = &view.camera, .lod = 0, .resident = take_later, .context = &asked};
    struct spl_draw_list list = {0};
    assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
    assert_int_equal(asked, nodes); // four children lie in view
    assert_int_equal(nodes, 5);
    assert_int_equal(list.nodes, 1);
    assert_false(list.complete);
    spl_draw_list_finish(&list);
    spl_dataset_close(dataset);
}

/* A floor around the eye reaches its plane, so its chunks have no bounds on the image; windows above the horizon see
 * none of it all the same, and do not list it. Those that see any of its discs do. */
static void windows_list_what_they_may_see(void **state)
{
    (void)state;
    enum { columns = (width + SPL_WINDOW - 1) / SPL_WINDOW, rows = (height + SPL_WINDOW - 1) / SPL_WINDOW, most = 64 };
    static struct make_splat discs[side * side];
    for (int i = 0; i < side * side; i++)
        discs[i] = (struct make_splat){.position = {(i % side - side / 2) * 0.02, (i / side - side / 2) * 0.02, 0},
                                       .normal = {0, 0, 1},
                                       .radius = 0.05f};
    struct spl_dataset *dataset = make_dataset_levels(discs, side * side, 1);
    struct spl_view view;
    spl_view_init(&view);
    view.camera.near = 0.1;
    view.camera.far = 100;
    const double eye[3] = {0, 0, 0.2}, target[3] = {0, 1, 0.2}, up[3] = {0, 0, 1};
    assert_int_equal(spl_camera_look_at(&view.camera, eye, target, up, NULL), SPL_OK);
    assert_int_equal(spl_camera_set_fov(&view.camera, 60, width, height, NULL), SPL_OK);
    int left = 1 << 30;
    struct spl_select_params params = {.dataset = dataset,
                                       .camera = &view.camera,
                                       .low_pass = (double)SPL_LOW_PASS,
                                       .discs = true,
                                       .resident = take_one,
                                       .context = &left};
    struct spl_draw_list list = {0};
    assert_int_equal(spl_select(&params, &list, NULL), SPL_OK);
    uint64_t chunk_count;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    static bool listed[most][rows][columns];
    assert_true(chunk_count <= most);
    size_t windows = 0, seen = 0, naive_count;
    for (size_t i = 0; i < list.chunk_count; i++) {
        const uint32_t window = list.chunks[i].count >> SPL_COUNT_BITS;
        const uint32_t column = window & ((1u << SPL_WINDOW_BITS) - 1), row = window >> SPL_WINDOW_BITS;
        uint32_t at = 0;
        while (at < chunk_count && chunks[at].first_id != list.chunks[i].first_id)
            at++;
        assert_true(at < chunk_count);
        for (uint32_t w = 0; w < rows * columns; w++)
            if (!window || w == row * columns + column - 1)
                listed[at][w / columns][w % columns] = true;
        windows += window > 0;
        assert_true(!window || row > 0); /* those of the first row end above the horizon */
    }
    assert_true(windows > 0);
    struct naive_chunk *naive =
        naive_select(&(struct naive_options){.dataset = dataset, .camera = &view.camera}, &naive_count);
    for (size_t i = 0; i < naive_count; i++)
        for (uint32_t k = 0; k < naive[i].count; k++) {
            const struct ball ball = ball_of(dataset, &view.camera, &naive[i], k);
            for (uint32_t w = 0; w < rows * columns; w++) {
                struct spl_camera camera = view.camera;
                camera.cx -= w % columns * SPL_WINDOW;
                camera.cy -= w / columns * SPL_WINDOW;
                camera.width = camera.height = SPL_WINDOW;
                if (!is_seen(&camera, &ball))
                    continue;
                seen++;
                assert_true(listed[naive[i].chunk][w / columns][w % columns]);
            }
        }
    assert_true(seen > side * side / 4);
    free(naive);
    spl_draw_list_finish(&list);
    spl_dataset_close(dataset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_spacing_of_stand_ins_is_not_complete),
        cmocka_unit_test(every_splat_that_is_seen_is_drawn_at_its_level),
        cmocka_unit_test(one_large_disc_at_the_edge_is_drawn),
        cmocka_unit_test(windows_list_what_they_may_see),
        cmocka_unit_test(nodes_are_listed_front_to_back),
        cmocka_unit_test(shared_among_cores_it_is_the_same),
        cmocka_unit_test(what_comes_later_is_asked_for_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
