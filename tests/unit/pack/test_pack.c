/* Whole packs of small clouds: what went in is in the dataset, within the stated errors, whatever the cloud and the
 * threads; what cannot be packed leaves nothing behind. */
#include <dirent.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include <splatd/pack.h>

#include "base/memory.h"
#include "clouds.h"
#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "support/sanitised.h"

static char folder[] = "/tmp/splatd-pack-XXXXXX";

static const char *path_of(const char *name)
{
    static char paths[4][512];
    static int next;
    char *path = paths[next++ % 4];
    snprintf(path, 512, "%s/%s", folder, name);
    return path;
}

/* A binary PLY of doubles; the colour is the point's number. */
static void write_ply(const char *path, const double (*position)[3], size_t count)
{
    FILE *f = fopen(path, "wb");
    assert_non_null(f);
    fprintf(f,
            "ply\nformat binary_little_endian 1.0\nelement vertex %zu\nproperty double x\nproperty double y\n"
            "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
            count);
    for (size_t i = 0; i < count; i++) {
        uint8_t color[3] = {(uint8_t)i, (uint8_t)(i >> 8), (uint8_t)(i >> 16)};
        fwrite(position[i], sizeof(double), 3, f);
        fwrite(color, 1, 3, f);
    }
    assert_int_equal(fclose(f), 0);
}

static int pack_file(const char *input, const char *output, unsigned threads, struct spl_pack_report *report,
                     struct spl_error *err)
{
    struct spl_pack_options options = {
        .size = sizeof options, .inputs = &input, .input_count = 1, .output = output, .threads = threads};
    return spl_pack(&options, report, err);
}

static int files_in_folder(void)
{
    int count = 0;
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));)
        count += e->d_name[0] != '.';
    closedir(d);
    return count;
}

/* Walks the whole dataset: each leaf splat is an input point, within `bound` radii; every point once; children and
 * boxes nest. Returns the mean position error in radii. */
static double check_dataset(const char *path, const double (*position)[3], size_t count, bool distinct)
{
    struct spl_dataset *dataset;
    struct spl_error err = {0};
    if (spl_dataset_open(path, true, &dataset, &err))
        fail_msg("%s", err.message);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    uint64_t node_count, chunk_count, next_id = 0;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    uint8_t *seen = calloc(count, 1);
    uint64_t leaf_splats = 0;
    double error = 0;
    for (uint32_t n = 0; n < node_count; n++) {
        const struct spl_node *node = &nodes[n];
        size_t page_bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, node->page, &page_bytes);
        assert_true(node->chunk_count > 0);
        for (uint32_t c = 0; c < node->child_count; c++) {
            const struct spl_node *child = &nodes[node->first_child + c];
            assert_int_equal(child->depth, node->depth + 1);
            for (int a = 0; a < 3; a++) {
                double shift = child->origin[a] - node->origin[a];
                assert_true(shift >= -1e-6 * node->size && shift + child->size <= node->size * (1 + 1e-6));
                assert_true(shift + child->box_min[a] >= node->box_min[a] &&
                            shift + child->box_max[a] <= node->box_max[a]);
            }
        }
        for (uint32_t c = 0; c < node->chunk_count; c++) {
            const struct spl_chunk *chunk = &chunks[node->first_chunk + c];
            assert_int_equal(chunk->first_id, next_id);
            next_id += chunk->count;
            for (uint32_t i = 0; i < chunk->count; i++) {
                struct spl_splat s;
                spl_chunk_decode(chunk, page, i, &s);
                assert_true(s.radius > 0);
                for (int a = 0; a < 3; a++) {
                    assert_true(s.position[a] - s.radius >= node->box_min[a]);
                    assert_true(s.position[a] + s.radius <= node->box_max[a]);
                }
                if (node->child_count || spl_chunk_kind(chunk) != SPL_CHUNK_DISCS)
                    continue;
                size_t who = s.color[0] | (size_t)s.color[1] << 8 | (size_t)s.color[2] << 16;
                double d = 0;
                assert_true(who < count && !seen[who]);
                seen[who] = 1;
                leaf_splats++;
                for (int a = 0; a < 3; a++) {
                    double e = node->origin[a] + s.position[a] - position[who][a];
                    d += e * e;
                }
                assert_true(sqrt(d) < 0.9 * chunk->step + 1e-6 * node->size);
                error += sqrt(d) / s.radius;
            }
        }
    }
    assert_int_equal(leaf_splats, info->leaf_splats);
    assert_int_equal(info->points, count);
    if (distinct)
        assert_int_equal(leaf_splats, count);
    assert_int_equal(next_id, info->ids);
    free(seen);
    spl_dataset_close(dataset);
    return error / (double)leaf_splats;
}

static void test_every_point_is_there(void **state)
{
    (void)state;
    for (int shape = 0; shape < SHAPES; shape++) {
        size_t count = TEST_SIZE(60000, 15000);
        if (TEST_LOOKS_FOR_RACES && shape != SHAPE_CLUSTERS)
            continue;
        double(*position)[3] = shape_points((enum shape)shape, count, 31);
        struct spl_pack_report report;
        struct spl_error err = {0};
        write_ply(path_of("in.ply"), (const double(*)[3])position, count);
        assert_int_equal(pack_file(path_of("in.ply"), path_of("out.spld"), 2, &report, &err), 0);
        double error = check_dataset(path_of("out.spld"), (const double(*)[3])position, count, report.duplicates == 0);
        assert_true(report.normal_error <= 1);
        if (shape != SHAPE_CLUSTERS) { /* chunks of a thousand to one outrun 24 bits */
            assert_true(error <= 0.0165);
            assert_true(report.position_error <= 0.016);
        }
        assert_true((double)report.splats <= 1.4 * (double)report.leaf_splats);
        free(position);
    }
}

/* Strays aside, the default view shows the cloud, and not as a dot. */
static void test_default_view(void **state)
{
    (void)state;
    skip_under_tsan();
    static const enum shape shapes[] = {SHAPE_CUBE, SHAPE_SPHERE, SHAPE_PLANE, SHAPE_GRID, SHAPE_UTM};
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        size_t count = 5000, inside = 0;
        double(*position)[3] = shape_points(shapes[s], count, 71), low = INFINITY, high = -INFINITY;
        position[0][2] += 1e4;
        struct spl_error err = {0};
        struct spl_dataset *dataset;
        struct spl_camera camera;
        write_ply(path_of("in.ply"), (const double(*)[3])position, count);
        assert_int_equal(pack_file(path_of("in.ply"), path_of("out.spld"), 2, NULL, &err), 0);
        assert_int_equal(spl_dataset_open(path_of("out.spld"), false, &dataset, &err), 0);
        assert_int_equal(spl_dataset_get_default_camera(dataset, 1280, 720, &camera, &err), 0);
        for (size_t i = 1; i < count; i++) {
            double pixel[2], depth;
            if (!spl_camera_project(&camera, position[i], pixel, &depth))
                continue;
            inside += pixel[0] >= 0 && pixel[0] < 1280 && pixel[1] >= 0 && pixel[1] < 720;
            low = fmin(low, pixel[0]);
            high = fmax(high, pixel[0]);
        }
        assert_true(inside > 0.95 * (double)count);
        assert_true(high - low > 300);
        spl_dataset_close(dataset);
        free(position);
    }
    unlink(path_of("out.spld"));
}

static void expect_same_files(const char *a, const char *b)
{
    struct stat sa, sb;
    assert_int_equal(stat(a, &sa), 0);
    assert_int_equal(stat(b, &sb), 0);
    assert_int_equal(sa.st_size, sb.st_size);
    char *x = malloc((size_t)sa.st_size), *y = malloc((size_t)sb.st_size);
    FILE *f = fopen(a, "rb"), *g = fopen(b, "rb");
    assert_int_equal(fread(x, 1, (size_t)sa.st_size, f), (size_t)sa.st_size);
    assert_int_equal(fread(y, 1, (size_t)sb.st_size, g), (size_t)sb.st_size);
    assert_memory_equal(x, y, (size_t)sa.st_size);
    fclose(f);
    fclose(g);
    free(x);
    free(y);
}

static void test_threads_do_not_matter(void **state)
{
    (void)state;
    size_t count = TEST_SIZE(200000, 30000); /* several leaves a thread */
    double(*position)[3] = shape_points(SHAPE_SPHERE, count, 41);
    struct spl_error err = {0};
    write_ply(path_of("in.ply"), (const double(*)[3])position, count);
    assert_int_equal(pack_file(path_of("in.ply"), path_of("one.spld"), 1, NULL, &err), 0);
    assert_int_equal(pack_file(path_of("in.ply"), path_of("five.spld"), 5, NULL, &err), 0);
    expect_same_files(path_of("one.spld"), path_of("five.spld"));
    unlink(path_of("one.spld"));
    unlink(path_of("five.spld"));
    free(position);
}

/* From one point on, in every shape; all equal; a dense cluster in a wide cloud; 10^9 metres. */
static void test_degenerate_clouds(void **state)
{
    (void)state;
    skip_under_tsan();
    static const size_t counts[] = {1, 2, 3, 4, 13, 200};
    for (int shape = 0; shape < SHAPES; shape++)
        for (size_t c = 0; c < sizeof counts / sizeof *counts; c++) {
            double(*position)[3] = shape_points((enum shape)shape, counts[c], c);
            struct spl_error err = {0};
            write_ply(path_of("in.ply"), (const double(*)[3])position, counts[c]);
            assert_int_equal(pack_file(path_of("in.ply"), path_of("out.spld"), 2, NULL, &err), 0);
            check_dataset(path_of("out.spld"), (const double(*)[3])position, counts[c], false);
            free(position);
        }
    enum { many = 30000 };
    double(*position)[3] = calloc(many, sizeof *position);
    struct spl_pack_report report;
    struct spl_error err = {0};
    write_ply(path_of("in.ply"), (const double(*)[3])position, many);
    assert_int_equal(pack_file(path_of("in.ply"), path_of("out.spld"), 2, &report, &err), 0);
    assert_true(report.leaf_splats == 1 && report.splats == 1 && report.duplicates == many - 1);
    uint64_t random = 51;
    for (size_t i = 0; i < many; i++)
        for (int c = 0; c < 3; c++)
            position[i][c] = i % 1000 ? 1e-3 * uniform(&random) : 1e9 * (uniform(&random) - 0.5);
    write_ply(path_of("in.ply"), (const double(*)[3])position, many);
    assert_int_equal(pack_file(path_of("in.ply"), path_of("out.spld"), 2, &report, &err), 0);
    check_dataset(path_of("out.spld"), (const double(*)[3])position, many, true);
    for (double width = 1e-4; width > 1e-9; width /= 10) { // a node is narrower than its corner is rounded
        for (size_t i = 0; i < many; i++)
            for (int c = 0; c < 3; c++)
                position[i][c] = 1e7 + (c < 2 ? width * uniform(&random) : 0);
        write_ply(path_of("in.ply"), (const double(*)[3])position, many);
        assert_int_equal(pack_file(path_of("in.ply"), path_of("out.spld"), 2, NULL, &err), 0);
        struct spl_dataset *dataset;
        if (spl_dataset_open(path_of("out.spld"), true, &dataset, &err))
            fail_msg("%g wide: %s", width, err.message);
        spl_dataset_close(dataset);
    }
    free(position);
}

/* The wire at y = 7, z = 4 from x = 0 to 15: there whole in the leaves together, and in the root. */
static void check_wire(const struct spl_dataset *dataset)
{
    uint64_t node_count, chunk_count;
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    double leaves = 0, root = 0;
    for (uint32_t n = 0; n < node_count; n++) {
        const uint32_t *page = spl_dataset_get_page(dataset, nodes[n].page, &(size_t){0});
        for (uint32_t c = nodes[n].first_chunk; c < nodes[n].first_chunk + nodes[n].chunk_count; c++)
            for (uint32_t i = 0; spl_chunk_kind(&chunks[c]) == SPL_CHUNK_LINES && i + 1 < chunks[c].count; i++) {
                struct spl_splat from, to;
                spl_chunk_decode(&chunks[c], page, i, &from);
                spl_chunk_decode(&chunks[c], page, i + 1, &to);
                assert_true(fabs(from.position[1] + nodes[n].origin[1] - 7) < 0.02);
                assert_true(fabs(from.position[2] + nodes[n].origin[2] - 4) < 0.02);
                double length = from.linear ? fabsf(to.position[0] - from.position[0]) : 0;
                leaves += nodes[n].child_count ? 0 : length;
                root += n ? 0 : length;
            }
    }
    assert_true(fabs(leaves - 15) < 0.1 && fabs(root - 15) < 0.1);
}

/* A field with a wire over it. */
enum { side = TEST_LOOKS_FOR_RACES ? 100 : 150, wire = 400, field_points = side * side + wire };

static double (*make_field(void))[3]
{
    double(*position)[3] = malloc(field_points * sizeof *position);
    uint64_t random = 71;
    for (size_t i = 0; i < field_points; i++) {
        bool on_wire = i >= side * side;
        position[i][0] =
            on_wire ? 15.0 * (double)(i - side * side) / wire : 0.1 * ((double)(i % side) + uniform(&random));
        position[i][1] = on_wire ? 7 : 0.1 * ((double)(i / side) + uniform(&random));
        position[i][2] = (on_wire ? 4 : 0) + 0.0005 * uniform(&random);
    }
    return position;
}

/* Of a file packed from points, colours being their numbers: how many of the first `count` of the leaves point down. */
static size_t count_downwards(const char *path, size_t count)
{
    struct spl_dataset *dataset;
    uint64_t node_count, chunk_count;
    size_t down = 0;
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
    const struct spl_node *nodes = spl_dataset_get_nodes(dataset, &node_count);
    const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
    for (uint64_t n = 0; n < node_count; n++) {
        size_t page_bytes;
        const uint32_t *page = spl_dataset_get_page(dataset, nodes[n].page, &page_bytes);
        for (uint64_t c = nodes[n].first_chunk; c < nodes[n].first_chunk + nodes[n].chunk_count; c++)
            for (uint32_t i = 0; i < chunks[c].count && !nodes[n].child_count; i++) {
                struct spl_splat s;
                spl_chunk_decode(&chunks[c], page, i, &s);
                size_t who = s.color[0] | (size_t)s.color[1] << 8 | (size_t)s.color[2] << 16;
                down += spl_chunk_kind(&chunks[c]) == SPL_CHUNK_DISCS && who < count && s.normal[2] < 0;
            }
    }
    spl_dataset_close(dataset);
    return down;
}

/* -1 to 1. */
static double spread(uint64_t *random)
{
    return 2 * uniform(random) - 1;
}

/* Nobody gave normals a side. A road as noisy as its points are close, in several blocks, and in two halves, on both of
 * which bushes stand: it points to one side all over. It was one point of five that did not, where one edge with
 * another point of the noise, or of a bush, was as good as a hundred with the road. */
static void test_noise_and_bushes_turn_no_road(void **state)
{
    (void)state;
    skip_sanitised();
    enum { edge = 320, bush = 12000 };
    struct spl_error err = {0};
    double(*position)[3] = spl_alloc(edge * edge + bush, sizeof *position, NULL);
    size_t count = 0, road;
    uint64_t random = 91;
    assert_non_null(position);
    for (int i = 0; i < edge; i++)
        for (int j = 0; j < edge; j++) {
            double at[3] = {0.01 * i + 0.003 * spread(&random), 0.01 * j + 0.003 * spread(&random), 0};
            for (int k = 0; k < 6; k++)
                at[2] += 0.0042 * spread(&random);
            if (fabs(0.01 * i - 1.6) >= 0.05)
                memcpy(position[count++], at, sizeof at);
        }
    road = count;
    for (int i = 0; i < bush; i++, count++) {
        double at[3] = {1.6 + 0.12 * spread(&random), (i % 2 ? 1 : 2) + 0.4 * spread(&random),
                        0.2 * fabs(spread(&random))};
        memcpy(position[count], at, sizeof at);
    }
    write_ply(path_of("road.ply"), (const double(*)[3])position, count);
    if (pack_file(path_of("road.ply"), path_of("road.spld"), 2, NULL, &err))
        fail_msg("%s", err.message);
    size_t down = count_downwards(path_of("road.spld"), road);
    if (down > road / 2)
        down = road - down;
    if (down > road / 50)
        fail_msg("%zu of the road's %zu points have another side than the rest", down, road);
    free(position);
    unlink(path_of("road.ply"));
    unlink(path_of("road.spld"));
}

/* Whole and as bare points: the same points are linear, at every level some; bare points have neither normals nor radii
 * to pay for. */
static void test_linear_and_bare_points(void **state)
{
    (void)state;
    double(*position)[3] = make_field();
    write_ply(path_of("in.ply"), (const double(*)[3])position, field_points);
    for (int run = 0; run < (TEST_LOOKS_FOR_RACES ? 1 : 4); run++) {
        const char *input = path_of("in.ply");
        struct spl_pack_options options = {.size = sizeof options,
                                           .inputs = &input,
                                           .input_count = 1,
                                           .output = path_of("out.spld"),
                                           .threads = 2,
                                           .points_only = run & 1,
                                           .no_linear = run & 2,
                                           .no_clip_lines = run & 2};
        struct spl_pack_report report;
        struct spl_error err = {0};
        struct spl_dataset *dataset;
        assert_int_equal(spl_pack(&options, &report, &err), 0);
        check_dataset(path_of("out.spld"), (const double(*)[3])position, field_points, true);
        assert_int_equal(report.linear, options.no_linear ? 0 : wire);
        assert_int_equal(spl_dataset_open(path_of("out.spld"), true, &dataset, &err), 0);
        const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
        uint64_t linear = 0;
        assert_int_equal(spl_dataset_count_linear(dataset, &linear, &err), 0);
        assert_int_equal(linear, report.linear);
        assert_true(info->has_linear == !options.no_linear && info->has_surface == !options.points_only);
        assert_true(!options.points_only == (info->attribute_bits[SPL_ATTRIBUTE_NORMAL] > 0));
        assert_true((run == 0) == (info->attribute_bits[SPL_ATTRIBUTE_CLIP] > 0)); // the field has borders
        if (options.points_only)
            assert_true(!info->has_uncertainty && info->attribute_bits[SPL_ATTRIBUTE_RADIUS] == 0 &&
                        info->stream_count == 0);
        assert_true(info->splat_radius > 0.05 && info->splat_radius < 0.2);
        uint64_t chunk_count;
        uint32_t inner = 0;
        const struct spl_chunk *chunks = spl_dataset_get_chunks(dataset, &chunk_count);
        for (uint32_t c = 0; c < spl_dataset_get_nodes(dataset, &(uint64_t){0})[0].chunk_count; c++)
            inner += chunks[c].geometry_bits >> SPL_GEOMETRY_LINEAR != 0 && !spl_chunk_kind(&chunks[c]);
        assert_true(options.no_linear == (inner == 0));
        assert_int_equal(report.pieces, info->pieces);
        assert_true(options.no_linear ? info->pieces == 0 : info->pieces > wire / 8);
        assert_memory_equal(report.attribute_bits, info->attribute_bits, sizeof report.attribute_bits);
        if (!options.no_linear)
            check_wire(dataset);
        spl_dataset_close(dataset);
    }
    free(position);
}

static void expect_refusal(const char *input, const char *output, int code, const char *part)
{
    struct spl_error err = {0};
    int files = files_in_folder();
    assert_int_equal(pack_file(input, output, 2, NULL, &err), code);
    if (!strstr(err.message, part))
        fail_msg("'%s' does not say '%s'", err.message, part);
    assert_int_equal(files_in_folder(), files);
}

static void test_refusals(void **state)
{
    (void)state;
    const double far[2][3] = {{0, 0, 0}, {0, 2e12, 0}}, nan[2][3] = {{NAN, 0, 0}, {0, INFINITY, 0}};
    unlink(path_of("out.spld"));
    write_ply(path_of("far.ply"), far, 2);
    expect_refusal(path_of("far.ply"), path_of("out.spld"), SPL_E_INPUT, "far.ply");
    write_ply(path_of("nan.ply"), nan, 2);
    expect_refusal(path_of("nan.ply"), path_of("out.spld"), SPL_E_INPUT, "nan.ply");
    write_ply(path_of("none.ply"), far, 0);
    expect_refusal(path_of("none.ply"), path_of("out.spld"), SPL_E_INPUT, "none.ply");
    write_ply(path_of("one.ply"), far, 1);
    expect_refusal(path_of("one.ply"), path_of("one.ply"), SPL_E_USAGE, "input too");
    expect_refusal(path_of("one.ply"), folder, SPL_E_USAGE, "no file");
    struct stat before, after;
    assert_int_equal(stat(path_of("one.ply"), &before), 0);
    expect_refusal(path_of("one.ply"), path_of("no/such/out.spld"), SPL_E_IO, "no/such");
    assert_int_equal(stat(path_of("one.ply"), &after), 0);
    assert_int_equal(before.st_size, after.st_size);
    struct spl_error err = {0};
    const char *input = path_of("one.ply");
    struct spl_pack_options options = {
        .size = sizeof options, .inputs = &input, .input_count = 1, .output = path_of("out.spld")};
    struct spl_pack_options wrong = options;
    wrong.neighbours = 2;
    assert_int_equal(spl_pack(&wrong, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "neighbours");
    wrong = options;
    wrong.position_error = -1;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&wrong, NULL, &err), SPL_E_USAGE);
    wrong = options;
    wrong.points_only = true;
    wrong.photos = &SPL_SIZED(spl_photo_options, .cameras = "poses");
    err = (struct spl_error){0};
    assert_true(spl_pack(&wrong, NULL, &err) != 0);
    assert_string_equal(err.field, "points-only");
    wrong = options;
    wrong.normal_error = NAN;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&wrong, NULL, &err), SPL_E_USAGE);
}

/* Each of the first allocations in turn is refused, then every fifth: an error, no file, no leak (the sanitizers look).
 */
static void test_refused_memory(void **state)
{
    (void)state;
    skip_under_tsan();
    size_t count = 9000; /* enough for two levels */
    double(*position)[3] = shape_points(SHAPE_CLUSTERS, count, 61);
    write_ply(path_of("in.ply"), (const double(*)[3])position, count);
    free(position);
    unlink(path_of("out.spld"));
    int files = files_in_folder();
    for (long n = 1;; n += n < 64 ? 1 : TEST_SIZE(5, 17)) {
        struct spl_error err = {0};
        spl_memory_fail_after(n);
        int rc = pack_file(path_of("in.ply"), path_of("out.spld"), 1, NULL, &err);
        spl_memory_fail_after(0);
        if (rc == 0) {
            assert_true(n > 20);
            break;
        }
        assert_int_equal(rc, SPL_E_NOMEM);
        assert_int_equal(files_in_folder(), files);
    }
    unlink(path_of("out.spld"));
}

/* Cancels when a stage is first reported; then no other stage may begin. */
struct canceller {
    struct spl_cancel cancel;
    const char *at;     // NULL = never
    char names[16][64]; /* of stages, in their order */
    int count, begun_after;
};

static void watch_stages(void *context, const struct spl_progress *progress)
{
    struct canceller *c = context;
    if (!c->count || strcmp(c->names[c->count - 1], progress->stage)) {
        assert_in_range(c->count, 0, 15);
        snprintf(c->names[c->count++], sizeof c->names[0], "%s", progress->stage);
        c->begun_after += spl_cancel_is_set(&c->cancel);
    }
    if (c->at && !strcmp(c->at, progress->stage))
        spl_cancel_set(&c->cancel);
}

static void test_cancelled_in_any_stage(void **state)
{
    (void)state;
    double(*position)[3] = make_field();
    write_ply(path_of("in.ply"), (const double(*)[3])position, field_points);
    free(position);
    const char *input = path_of("in.ply");
    struct canceller whole = {0};
    struct spl_pack_options options = {.size = sizeof options,
                                       .inputs = &input,
                                       .input_count = 1,
                                       .output = path_of("out.spld"),
                                       .threads = 2,
                                       .progress = watch_stages,
                                       .progress_context = &whole,
                                       .cancel = &whole.cancel};
    assert_int_equal(spl_pack(&options, NULL, NULL), SPL_OK);
    unlink(path_of("out.spld"));
    int files = files_in_folder();
    assert_string_equal(whole.names[whole.count - 1], "writing");
    bool joins = false;
    for (int i = 0; i < whole.count - 1; i++) {
        joins |= !strcmp(whole.names[i], "joining wires");
        struct canceller now = {.at = whole.names[i]};
        struct spl_error err = {0};
        options.progress_context = &now;
        options.cancel = &now.cancel;
        assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_CANCELLED);
        if (now.begun_after)
            fail_msg("cancelled in '%s', '%s' was begun all the same", now.at, now.names[now.count - 1]);
        assert_int_equal(files_in_folder(), files);
    }
    assert_true(joins && whole.count > 8);
}

static int setup(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    DIR *d = opendir(folder);
    for (struct dirent *e; (e = readdir(d));)
        unlink(path_of(e->d_name));
    closedir(d);
    return rmdir(folder);
}

/* A folder, made once work has begun, where a file was to be. */
static void take_the_place(void *context, const struct spl_progress *progress)
{
    (void)progress;
    mkdir(context, 0700);
}

static void count_guesses(void *context, const char *text)
{
    *(int *)context += !!strstr(text, "which side of a plane is its front is guessed");
}

/* Planes are written beside the dataset; a place or a kind that cannot be is known before work begins. */
static void test_primitives_are_exported(void **state)
{
    (void)state;
    size_t count = 20000, faces = 0;
    double(*position)[3] = shape_points(SHAPE_PLANE, count, 3);
    char *input = strdup(path_of("flat.ply")), *output = strdup(path_of("flat.spld"));
    const char *const inputs[] = {input};
    struct spl_pack_options options = {.size = sizeof options, .inputs = inputs, .input_count = 1, .output = output,
                                       .primitives = SPL_PRIMITIVES_ALL};
    struct spl_error err = {0};
    char row[4096];
    write_ply(input, (const double(*)[3])position, count);
    free(position);
    int before = files_in_folder();
    options.export_primitives = path_of("flat.stl");
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_USAGE);
    assert_string_equal(err.field, "export-primitives");
    options.export_primitives = input;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_USAGE);
    assert_non_null(strstr(err.message, "is a scan"));
    options.export_primitives = path_of("no/folder/flat.obj");
    err = (struct spl_error){0};
    assert_int_not_equal(spl_pack(&options, NULL, &err), 0);
    assert_int_equal(files_in_folder(), before);
    options.export_primitives = path_of("flat.obj");
    options.primitives = SPL_PRIMITIVES_OFF;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_USAGE);
    assert_int_equal(files_in_folder(), before);
    options.primitives = SPL_PRIMITIVES_ALL;
    struct canceller late = {.at = "panels"}; /* there is no drawing where there is no dataset */
    options.progress = watch_stages;
    options.progress_context = &late;
    options.cancel = &late.cancel;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_CANCELLED);
    assert_int_equal(files_in_folder(), before);
    options.progress = NULL;
    options.cancel = NULL;
    int guesses = 0; /* a PLY without normals says nothing of sides */
    options.warn = count_guesses;
    options.progress_context = &guesses;
    assert_int_equal(spl_pack(&options, NULL, &err), 0);
    assert_int_equal(guesses, 1);
    options.warn = NULL;
    assert_int_equal(files_in_folder(), before + 2);
    FILE *in = fopen(options.export_primitives, "r");
    assert_non_null(in);
    while (fgets(row, sizeof row, in))
        faces += row[0] == 'f';
    fclose(in);
    assert_int_equal(faces, 1);
    unlink(options.export_primitives);
    options.progress = take_the_place; /* the drawing comes last, and says that the dataset stands */
    options.progress_context = (void *)options.export_primitives;
    err = (struct spl_error){0};
    assert_int_equal(spl_pack(&options, NULL, &err), SPL_E_IO);
    assert_string_equal(err.field, "export-primitives");
    assert_non_null(strstr(err.message, "flat.spld' is written"));
    rmdir(options.export_primitives);
    assert_int_equal(files_in_folder(), before + 1);
    unlink(input);
    unlink(output);
    free(input);
    free(output);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_point_is_there),
        cmocka_unit_test(test_default_view),
        cmocka_unit_test(test_threads_do_not_matter),
        cmocka_unit_test(test_degenerate_clouds),
        cmocka_unit_test(test_noise_and_bushes_turn_no_road),
        cmocka_unit_test(test_linear_and_bare_points),
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_refused_memory),
        cmocka_unit_test(test_cancelled_in_any_stage),
        cmocka_unit_test(test_primitives_are_exported),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
