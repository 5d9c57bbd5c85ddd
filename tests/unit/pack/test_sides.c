/* Which way what is level shows where nobody says so: ground upwards, whatever stands on it; ceilings into their room.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "base/memory.h"
#include "clouds.h"
#include "pack/order.h"
#include "pack/orient_join.h"

enum { points_most = 120000 };
static const double step = 0.05, noise = 0.003;

/* A cloud in the making, upright; `up` says which axis becomes its z. */
struct scene {
    double (*position)[3];
    size_t count;
    uint64_t random;
    int up;
    double solid[2][2][3]; /* nothing is seen of others where these stand */
    int solids;
};

static struct scene begin(int up)
{
    struct scene s = {.position = spl_alloc(points_most, sizeof(double[3]), NULL), .random = 7, .up = up};
    assert_non_null(s.position);
    return s;
}

static void add(struct scene *s, double x, double y, double z)
{
    const double at[3] = {x, y, z};
    assert_true(s->count < points_most);
    for (int i = 0; i < s->solids; i++) {
        bool inside = true;
        for (int c = 0; c < 3; c++)
            inside &= at[c] > s->solid[i][0][c] - 1e-9 && at[c] < s->solid[i][1][c] + 1e-9;
        if (inside)
            return;
    }
    for (int c = 0; c < 3; c++)
        s->position[s->count][(c + s->up + 1) % 3] = at[c] + noise * (2 * uniform(&s->random) - 1);
    s->count++;
}

/* The rectangle from `low` to `high`, which are the same in one coordinate. */
static void add_sheet(struct scene *s, const double low[3], const double high[3])
{
    int flat = low[0] == high[0] ? 0 : low[1] == high[1] ? 1 : 2, u = (flat + 1) % 3, v = (flat + 2) % 3;
    for (double a = low[u]; a <= high[u]; a += step)
        for (double b = low[v]; b <= high[v]; b += step) {
            double at[3];
            at[flat] = low[flat];
            at[u] = a + 0.4 * step * uniform(&s->random);
            at[v] = b + 0.4 * step * uniform(&s->random);
            add(s, at[0], at[1], at[2]);
        }
}

/* Normals of the scene, of which nothing is left; the caller finishes the points. */
static struct spl_points finish(struct scene *s, int threads)
{
    struct spl_points p = cloud_of((const double(*)[3])s->position, s->count);
    struct spl_stage stage = quiet_stage((unsigned)threads);
    for (int c = 0; c < 3; c++)
        p.up[c] = c == s->up;
    free(s->position);
    assert_int_equal(spl_points_order(&p, &stage, NULL), 0);
    assert_int_equal(spl_surface(&p, 12, true, &stage, NULL), 0);
    return p;
}

/* Of the points below `height`, how many of those that are level show downwards. */
static size_t count_down(const struct spl_points *p, int up, double height, size_t *level)
{
    size_t down = 0;
    *level = 0;
    for (size_t i = 0; i < p->count; i++)
        if (p->axis[up][i] < height && fabsf(p->normal[i][up]) > 0.9f) {
            ++*level;
            down += p->normal[i][up] < 0;
        }
    return down;
}

static void check_ground(struct scene *s, int threads)
{
    int up = s->up;
    size_t level;
    struct spl_points p = finish(s, threads);
    size_t down = count_down(&p, up, 0.05, &level);
    assert_true(level > 10000);
    if (down > level / 100)
        fail_msg("axis %d: %zu of the ground's %zu points show downwards", up, down, level);
    spl_points_finish(&p);
}

/* Ground beside a wall at x = 0, from 0.3 on; it reaches the wall in one place, flat or bending upwards. */
static void add_yard(struct scene *s, int side, bool bends)
{
    double near = side * step, away = side * 0.3, far = side * 4;
    add_sheet(s, (double[3]){fmin(away, far), 0, 0}, (double[3]){fmax(away, far), 4, 0});
    if (!bends)
        add_sheet(s, (double[3]){fmin(near, away), 1.5, 0}, (double[3]){fmax(near, away), 2.5, 0});
    for (double angle = 0; bends && angle < M_PI / 2; angle += step / 0.3)
        for (double y = 1.9; y <= 2.1; y += step)
            add(s, away * (1 - sin(angle)), y + 0.4 * step * uniform(&s->random), 0.3 * (1 - cos(angle)));
}

/* A wall of one sheet between two yards: as a surface it has one side, so it tells one of the yards to show downwards.
 * It was half of the ground that did. */
static void test_a_wall_turns_no_yard(void **state)
{
    (void)state;
    for (int up = 0; up < 3; up++)
        for (int bends = 0; bends < 2; bends++) {
            struct scene s = begin(up);
            add_yard(&s, -1, bends);
            add_yard(&s, 1, bends);
            add_sheet(&s, (double[3]){0, 0, bends ? 0.3 : -step}, (double[3]){0, 4, 2});
            check_ground(&s, 1 + up % 2);
        }
}

/* Two patches of a road, and bushes on the strip between them, of which most points have any normal. */
static void test_bushes_turn_no_road(void **state)
{
    (void)state;
    for (int seed = 0; seed < 8; seed++) {
        struct scene s = begin(2);
        s.random = 1000 + (uint64_t)seed;
        add_sheet(&s, (double[3]){-4, 0, 0}, (double[3]){-0.25, 4, 0});
        add_sheet(&s, (double[3]){0.25, 0, 0}, (double[3]){4, 4, 0});
        for (int i = 0; i < 3000; i++)
            add(&s, 0.35 * (2 * uniform(&s.random) - 1), 4 * uniform(&s.random), 0.06 + 0.5 * uniform(&s.random));
        check_ground(&s, 1);
    }
}

/* A room shows one of its sides all over, also where its ceiling is as large as its floor. */
static void test_ceilings_agree_with_their_room(void **state)
{
    (void)state;
    struct scene s = begin(2);
    size_t inwards = 0;
    for (int c = 0; c < 3; c++)
        for (int end = 0; end < 2; end++) {
            double low[3] = {0}, high[3] = {5, 4, 2.5};
            low[c] = high[c] = end ? high[c] : 0;
            add_sheet(&s, low, high);
        }
    struct spl_points p = finish(&s, 2);
    for (size_t i = 0; i < p.count; i++) {
        double dot = 0;
        for (int c = 0; c < 3; c++)
            dot += p.normal[i][c] * ((double[3]){2.5, 2, 1.25}[c] - p.axis[c][i]);
        inwards += dot > 0;
    }
    inwards = inwards < p.count / 2 ? p.count - inwards : inwards;
    if (inwards < p.count - p.count / 200)
        fail_msg("%zu of the room's %zu points agree", inwards, p.count);
    spl_points_finish(&p);
}

/* The six faces of a box, but for those whose bit is not in `faces`: 2 * axis, + 1 for the far one. */
static void add_box(struct scene *s, const double min[3], const double max[3], unsigned faces)
{
    for (int face = 0; face < 6; face++) {
        double low[3], high[3];
        memcpy(low, min, sizeof low);
        memcpy(high, max, sizeof high);
        low[face / 2] = high[face / 2] = face % 2 ? max[face / 2] : min[face / 2];
        if (faces >> face & 1)
            add_sheet(s, low, high);
    }
}

enum { all_faces = 63, bottom = 1 << 4, top = 1 << 5 };

/* A box that stands in what is added later. */
static void add_solid(struct scene *s, const double min[3], const double max[3], unsigned faces)
{
    int solids = s->solids;
    s->solids = 0;
    add_box(s, min, max, faces);
    s->solids = solids;
    memcpy(s->solid[solids][0], min, sizeof s->solid[solids][0]);
    memcpy(s->solid[s->solids++][1], max, sizeof s->solid[solids][1]);
}

/* A deck on two piers, seen from all sides: its underside shows down, whatever the ground below says, and where blocks
 * end. */
static void test_a_bridge_shows_down_below(void **state)
{
    (void)state;
    for (int up = 1; up < 3; up++) {
        struct scene s = begin(up);
        size_t wrong = 0, level = 0, below = 0;
        for (int pier = 0; pier < 2; pier++)
            add_solid(&s, (double[3]){pier ? 9 : 2, 0.5, 0}, (double[3]){pier ? 10 : 3, 3.5, 3},
                      all_faces - bottom - top);
        add_sheet(&s, (double[3]){-1, -1, 0}, (double[3]){13, 5, 0});
        add_box(&s, (double[3]){0, 0, 3}, (double[3]){12, 4, 3.4}, all_faces);
        struct spl_points p = finish(&s, up);
        for (size_t i = 0; i < p.count; i++) {
            double z = p.axis[up][i];
            float n = p.normal[i][up];
            bool under = z > 2.95 && z < 3.05;
            if (fabsf(n) < 0.9f)
                continue;
            level++;
            below += under;
            wrong += under ? n > 0 : n < 0;
        }
        assert_true(below > 10000);
        if (wrong > level / 100)
            fail_msg("%zu of the bridge's %zu level points show to the wrong side", wrong, level);
        spl_points_finish(&p);
    }
}

/* The six faces of a room, its ceiling scanned `dense` times as densely, and a cupboard at a wall whose upper half
 * hangs over its lower one: more of what shows up is seen than of the ceiling. */
static void test_rooms_show_in(void **state)
{
    (void)state;
    for (int dense = 1; dense < 3; dense++) {
        struct scene s = begin(2);
        size_t inwards = 0, level = 0;
        add_solid(&s, (double[3]){0, 1, 0}, (double[3]){0.6, 3, 1}, all_faces - bottom - top - 1);
        add_solid(&s, (double[3]){0, 1, 1}, (double[3]){1.6, 3, 2}, all_faces - bottom - 1);
        add_box(&s, (double[3]){0}, (double[3]){5, 4, 2.5}, all_faces);
        for (int more = 1; more < dense * dense; more++)
            add_sheet(&s, (double[3]){0, 0, 2.5}, (double[3]){5, 4, 2.5});
        struct spl_points p = finish(&s, 2);
        for (size_t i = 0; i < p.count; i++) {
            bool is_ceiling = p.axis[2][i] > 2.4 && fabsf(p.normal[i][2]) > 0.9f;
            level += fabsf(p.normal[i][2]) > 0.9f;
            inwards += fabsf(p.normal[i][2]) > 0.9f && is_ceiling == (p.normal[i][2] < 0);
        }
        if (inwards < level - level / 100)
            fail_msg("%zu of the room's %zu level points show in", inwards, level);
        spl_points_finish(&p);
    }
}

/* How many of the points that lie on the box from `min` to `max` show into it. */
static size_t count_inwards(const struct spl_points *p, const double min[3], const double max[3], size_t *on)
{
    size_t inwards = 0;
    *on = 0;
    for (size_t i = 0; i < p->count; i++)
        for (int face = 0; face < 6; face++) {
            const double *end = face % 2 ? max : min;
            float n = p->normal[i][face / 2];
            if (fabs(p->axis[face / 2][i] - end[face / 2]) < 2 * noise && fabsf(n) > 0.9f) {
                ++*on;
                inwards += face % 2 ? n < 0 : n > 0;
            }
        }
    return inwards;
}

/* Up says nothing, or the wrong thing, of a room that nobody stands beside: with a door, through which some of the
 * floor before it is seen, and crates that hide a part of its own. */
static void test_rooms_are_no_things(void **state)
{
    (void)state;
    for (int crates = 0; crates < 3; crates++)
        for (uint64_t seed = 1; seed < 4; seed++) {
            struct scene s = begin(2);
            const double low[3] = {0}, high[3] = {5, 4, 2.5};
            size_t on;
            s.random = seed;
            for (int crate = 0; crate < crates; crate++)
                add_solid(&s, (double[3]){3 * crate + 0.5, 1.2, -step},
                          (double[3]){3 * crate + 1.4, 3, crate ? 0.8 : 1.2}, all_faces - bottom);
            add_box(&s, low, high, all_faces - 1);
            add_sheet(&s, low, (double[3]){0, 1, 2.5});
            add_sheet(&s, (double[3]){0, 2, 0}, (double[3]){0, 4, 2.5});
            add_sheet(&s, (double[3]){0, 1, 2}, (double[3]){0, 2, 2.5});
            add_sheet(&s, (double[3]){-1, 1, 0}, (double[3]){0, 2, 0});
            struct spl_points p = finish(&s, 2);
            size_t inwards = count_inwards(&p, low, high, &on);
            assert_true(on > 25000);
            if (inwards < on - on / 100)
                fail_msg("%d crates, %d: %zu of the room's %zu points show in", crates, (int)seed, inwards, on);
            spl_points_finish(&p);
        }
}

/* Things as high as a room, on ground that is not there: a cabinet of whose underside only the rim is seen, a tower
 * whose upper half juts out, and a statue that leans over its foot. */
static void add_high_thing(struct scene *s, int which)
{
    if (which == 0) {
        add_solid(s, (double[3]){0.1, 0.1, -0.1}, (double[3]){1.9, 1.4, 0.05}, 0);
        add_box(s, (double[3]){0}, (double[3]){2, 1.5, 2.5}, all_faces);
    }
    if (which == 1) {
        add_solid(s, (double[3]){0, -0.25, 0}, (double[3]){2, 1.75, 5}, all_faces - bottom - top);
        add_box(s, (double[3]){-0.4, -0.65, 5}, (double[3]){2.4, 2.15, 9}, all_faces);
    }
    for (int i = 0; which == 2 && i < 30000; i++) {
        double z = 3 * uniform(&s->random), turn = 2 * M_PI * uniform(&s->random);
        double r = 0.4 + 0.25 * sin(3 * z) + (z > 2.6 ? (sqrt(fmax(0.16 - (z - 2.6) * (z - 2.6), 0)) - 0.4) : 0);
        add(s, 1 + r * cos(turn) + 0.3 * z, 0.75 + r * sin(turn), z);
    }
}

static void test_high_things_show_out(void **state)
{
    (void)state;
    for (int which = 0; which < 3; which++)
        for (uint64_t seed = 1; seed < 4; seed++) {
            struct scene s = begin(2);
            size_t out = 0, wall = 0;
            s.random = seed;
            add_high_thing(&s, which);
            struct spl_points p = finish(&s, 1);
            for (size_t i = 0; i < p.count; i++) {
                double z = p.axis[2][i], x = p.axis[0][i] - (which == 2 ? 1 + 0.3 * z : 1), y = p.axis[1][i] - 0.75;
                bool is_wall = z > 0.1 && z < 2.4 && fabsf(p.normal[i][2]) < 0.7f;
                wall += is_wall;
                out += is_wall && x * (double)p.normal[i][0] + y * (double)p.normal[i][1] > 0;
            }
            assert_true(wall > 3000);
            if (out < wall - wall / 50)
                fail_msg("%d, %d: %zu of %zu points show out", which, (int)seed, out, wall);
            spl_points_finish(&p);
        }
}

/* A girder that nobody saw the middle of from below, nor what it lies on. */
static void test_a_girder_shows_out(void **state)
{
    (void)state;
    struct scene s = begin(2);
    size_t wrong = 0, level = 0;
    add_box(&s, (double[3]){0}, (double[3]){36, 2.5, 1.9}, all_faces - bottom);
    for (int end = 0; end < 2; end++)
        add_sheet(&s, (double[3]){27 * end, 0, 0}, (double[3]){27 * end + 9, 2.5, 0});
    struct spl_points p = finish(&s, 2);
    for (size_t i = 0; i < p.count; i++) {
        level += fabsf(p.normal[i][2]) > 0.9f;
        wrong += fabsf(p.normal[i][2]) > 0.9f && (p.axis[2][i] < 1) == (p.normal[i][2] > 0);
    }
    assert_true(level > 40000);
    if (wrong > level / 100)
        fail_msg("%zu of the girder's %zu level points show in", wrong, level);
    spl_points_finish(&p);
}

/* Two houses on the ground, with eaves whose undersides are seen, as from a car and from the air. */
static void test_houses_stand_on_ground(void **state)
{
    (void)state;
    for (int air = 0; air < 2; air++) {
        struct scene s = begin(2);
        size_t wrong = 0, level = 0;
        add_solid(&s, (double[3]){1, 1, 0}, (double[3]){4, 4, 3}, air ? 0 : all_faces - bottom - top);
        add_solid(&s, (double[3]){6, 1, 0}, (double[3]){9, 4, 3}, air ? 0 : all_faces - bottom - top);
        add_sheet(&s, (double[3]){0}, (double[3]){10, 6, 0});
        for (int house = 0; house < 2; house++)
            add_box(&s, (double[3]){5 * house + 0.5, 0.5, 3}, (double[3]){5 * house + 4.5, 4.5, 3.4},
                    air ? top : all_faces);
        struct spl_points p = finish(&s, 1);
        for (size_t i = 0; i < p.count; i++) {
            double z = p.axis[2][i];
            bool under = z > 2.95 && z < 3.05;
            level += fabsf(p.normal[i][2]) > 0.9f;
            wrong += fabsf(p.normal[i][2]) > 0.9f && under == (p.normal[i][2] > 0);
        }
        assert_true(level > 20000);
        if (wrong > level / 100)
            fail_msg("%s: %zu of %zu level points show to the wrong side", air ? "air" : "car", wrong, level);
        spl_points_finish(&p);
    }
}

/* What was seen from all sides, and lies on nothing: a ball, or a brick; from below `below` times as densely. */
static void add_thing(struct scene *s, bool ball, int below, double scale)
{
    const int count = 20000;
    const double half[3] = {1, 0.7, 0.6};
    for (int i = 0; i < count; i++) {
        double at[3], turn = 2 * M_PI * uniform(&s->random), z = 2 * uniform(&s->random) - 1, r = sqrt(1 - z * z);
        int face = (int)(3 * uniform(&s->random));
        for (int c = 0; c < 3; c++)
            at[c] = half[c] * (c != face ? 2 * uniform(&s->random) - 1 : z < 0 ? -1 : 1);
        if (ball)
            memcpy(at, (double[3]){r * cos(turn), r * sin(turn), z}, sizeof at);
        if (at[2] < 0 || uniform(&s->random) * below < 1)
            add(s, scale * at[0], scale * at[1], scale * at[2]);
    }
}

/* Up says nothing of them: half of them showed in. Balls are as large as a room, too, and bricks in millimetres. */
static void test_things_show_out(void **state)
{
    (void)state;
    for (int ball = 0; ball < 2; ball++)
        for (int below = 1; below < 4; below += 2)
            for (uint64_t seed = 1; seed < 7; seed++) {
                struct scene s = begin(2);
                size_t out = 0;
                s.random = seed;
                add_thing(&s, ball, below, seed < 4 ? 1 : ball ? 3 : 300);
                struct spl_points p = finish(&s, 1);
                for (size_t i = 0; i < p.count; i++) {
                    double sum = 0;
                    for (int c = 0; c < 3; c++)
                        sum += (double)p.normal[i][c] * p.axis[c][i];
                    out += sum > 0;
                }
                if (out < p.count - p.count / 100)
                    fail_msg("%s, %d times as dense below, %d: %zu of %zu points show out", ball ? "ball" : "brick",
                             below, (int)seed, out, p.count);
                spl_points_finish(&p);
            }
}

/* Decides over `count` components of a block each, between which are so many edges of which each end agrees wholly, or
 * not at all where there are less than none. */
static void decide(struct spl_component *components, size_t count, const int edges[][3], size_t edge_count)
{
    struct spl_orient_join join;
    assert_int_equal(spl_orient_join_init(&join, components, count, NULL, NULL), 0);
    for (size_t e = 0; e < edge_count; e++)
        for (int i = 0; i < abs(edges[e][2]); i++)
            assert_int_equal(spl_orient_join_add(&join, (uint32_t)edges[e][0], (uint32_t)edges[e][1],
                                                 edges[e][2] < 0 ? -1 : 1, false, NULL),
                             0);
    assert_int_equal(spl_orient_join_decide(&join, NULL), 0);
    spl_orient_join_finish(&join);
}

/* Of two pieces of ground as large as each other, the second of which shows downwards. */
static bool turns_second(int votes, bool anchored)
{
    struct spl_component pieces[2] = {{.outward = 10000, .level = 10000, .anchored = anchored},
                                      {.outward = -9999, .level = -9999}};
    decide(pieces, 2, (const int[1][3]){{0, 1, votes}}, 1);
    assert_false(pieces[0].flip);
    return pieces[1].flip;
}

/* Up has votes of its own, which strong ones outdo; it has none beside what was given a side. */
static void test_strong_votes_outdo_up(void **state)
{
    (void)state;
    assert_true(turns_second(-50, false));
    assert_true(turns_second(50, false));
    assert_false(turns_second(50, true));
    assert_true(turns_second(-50, true));
    assert_false(turns_second(400, false));
}

/* Two halves of a roof in two blocks, each too small for a say, and a gutter that tells both to show down. */
static bool turns_roof(int seam, int odd)
{
    enum { ground, halves, gutter = halves + 2, pieces };
    struct spl_component street[pieces] = {
        {.outward = 10000, .level = 10000}, {.outward = 600, .own = 600}, {.outward = 600, .own = 600}, {.outward = 1}};
    struct spl_orient_join join;
    assert_int_equal(spl_orient_join_init(&join, street, pieces, NULL, NULL), 0);
    for (int i = 0; i < seam; i++) /* the first ones disagree: noise */
        assert_int_equal(spl_orient_join_add(&join, halves, halves + 1, i < odd ? -1 : 1, true, NULL), 0);
    for (int i = 0; i < 15; i++)
        for (uint32_t half = halves; half < gutter; half++)
            assert_int_equal(spl_orient_join_add(&join, half, gutter, 1, false, NULL), 0);
    for (int i = 0; i < 25; i++)
        assert_int_equal(spl_orient_join_add(&join, ground, gutter, -1, false, NULL), 0);
    assert_int_equal(spl_orient_join_decide(&join, NULL), 0);
    spl_orient_join_finish(&join);
    assert_false(street[ground].flip);
    assert_int_equal(street[halves].flip, street[halves + 1].flip);
    return street[halves].flip;
}

/* A roof has its say for up by all of its points, wherever blocks end. */
static void test_blocks_cut_no_roof(void **state)
{
    (void)state;
    assert_true(turns_roof(0, 0));
    assert_false(turns_roof(12, 0));
    assert_false(turns_roof(12, 3));
}

/* No wall alone outdoes up, all four do: a ceiling waits for those that hang together with its floor. */
static void test_a_ceiling_hears_all_its_walls(void **state)
{
    (void)state;
    enum { ground, ceiling, walls, pieces = walls + 4 };
    struct spl_component room[pieces] = {{.outward = 10001, .level = 10001}, {.outward = 10000, .level = 10000}};
    int edges[8][3];
    for (int w = 0; w < 4; w++) {
        memcpy(edges[w], (int[3]){ground, walls + w, 200 - w}, sizeof edges[w]);
        memcpy(edges[4 + w], (int[3]){ceiling, walls + w, w - 90}, sizeof edges[w]);
    }
    decide(room, pieces, (const int(*)[3])edges, 8);
    assert_int_not_equal(room[ceiling].flip, room[ground].flip);
    for (int w = walls; w < pieces; w++)
        assert_int_equal(room[w].flip, room[ground].flip);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_wall_turns_no_yard),
        cmocka_unit_test(test_bushes_turn_no_road),
        cmocka_unit_test(test_ceilings_agree_with_their_room),
        cmocka_unit_test(test_strong_votes_outdo_up),
        cmocka_unit_test(test_a_bridge_shows_down_below),
        cmocka_unit_test(test_rooms_show_in),
        cmocka_unit_test(test_rooms_are_no_things),
        cmocka_unit_test(test_high_things_show_out),
        cmocka_unit_test(test_a_girder_shows_out),
        cmocka_unit_test(test_houses_stand_on_ground),
        cmocka_unit_test(test_things_show_out),
        cmocka_unit_test(test_a_ceiling_hears_all_its_walls),
        cmocka_unit_test(test_blocks_cut_no_roof),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
