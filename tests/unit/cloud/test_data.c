/* The real scans beside the checkout: every file of bad/ and formats/ has a row here that says how it loads (counts and
 * means of the coordinates from an independent program) or where it is refused. Skips where there are none.
 *
 * Most of bad/ are meshes with something odd for a mesh viewer; where the vertices are sound they load. */
#include "cloud_test.h"

#include <ftw.h>
#include <math.h>

struct row {
    const char *path;
    const char *refused; /* a part of the message: the place and the field; NULL = it loads */
    uint64_t points, skipped;
    double mean[3];
};

static const struct row rows[] = {
    {"7scenes_4stations.ptx", NULL, 272894, 34306, {-0.83111143, -0.192184719, 2.27285531}},
    {"als/autzen_trim.las", NULL, 110000, 0, {636546.405, 849145.786, 430.337525}},
    {"als/autzen_trim_7.las", NULL, 110000, 0, {636546.405, 849145.786, 430.337525}},
    {"bad/assimp_PLY/Wuson.ply", .refused = "line 3"},
    {"bad/assimp_PLY/cube.ply", NULL, 8, 0, {0.5, 0.5, 0.5}},
    {"bad/assimp_PLY/cube_binary.ply", NULL, 8, 0, {0.5, 0.5, 0.5}},
    {"bad/assimp_PLY/cube_binary_header_with_RN_newline.ply", NULL, 8, 0, {0.5, 0.5, 0.5}},
    {"bad/assimp_PLY/cube_binary_starts_with_nl.ply", NULL, 8, 0, {6.46753407, 0.5, 0.5}},
    {"bad/assimp_PLY/cube_uv.ply", NULL, 24, 0, {-1.25e-07, -2.5e-07, 0}},
    {"bad/assimp_PLY/float-color.ply", NULL, 3, 0, {100, 66.6666667, 0}},
    {"bad/assimp_PLY/issue623.ply", .refused = "line 14"},
    {"bad/assimp_PLY/payload_JVN42386607", .refused = "line 2"},
    {"bad/assimp_PLY/points.ply", NULL, 4, 0, {0, 0.5, 0.5}},
    {"bad/assimp_PLY/pond.0.ply", NULL, 70051, 0, {0.634139638, 0.834475133, -0.928574415}},
    {"bad/assimp_invalid/crash-30d6d0f7c529b3b66b4131700b7a4580cd7082df.ply", .refused = "line 7"},
    {"bad/assimp_invalid/empty.ply", .refused = "empty"},
    {"bad/displaz_test/bad_mesh_indices.ply", NULL, 4, 0, {1, 0.75, 0}},
    {"bad/displaz_test/color_lines.ply", NULL, 20, 0, {-1.2246468e-17, 0.0499999999, 0}},
    {"bad/displaz_test/displaz_ply_points.ply", .refused = "element vertex"},
    {"bad/displaz_test/grid.ply", NULL, 343, 0, {4, 4, 4}},
    {"bad/displaz_test/polygon_2d.ply", .refused = "line 6: z"},
    {"bad/displaz_test/polygon_explicitly_closed.ply", NULL, 13, 0, {0.0576923077, 39.7692308, 0}},
    {"bad/displaz_test/polygon_holes.ply", NULL, 28, 0, {2.42857143, 5.76785714, 0}},
    {"bad/displaz_test/polygon_oriented_complex.ply", NULL, 132, 0, {101.30303, 117.174242, 133.045455}},
    {"bad/displaz_test/polygon_simple.ply", NULL, 4, 0, {1, 0.75, 0}},
    {"bad/displaz_test/single_point.ply", NULL, 1, 0, {1, 2, 3}},
    {"bad/displaz_test/standard_ply_points.ply", NULL, 20, 0, {-1.2246468e-17, 0.0499999999, 0}},
    {"bad/displaz_test/tetrahedra.ply", NULL, 8, 0, {0, 0, 0}},
    {"bad/displaz_test/textured.ply", NULL, 4, 0, {0, 0, 0}},
    {"bad/displaz_test/triangles.ply", NULL, 22, 0, {-2.77555756e-17, -2.01858732e-17, 0}},
    {"bad/garbage.laz", .refused = "offset 24: version"},
    {"formats/las/1.2-empty-geotiff-vlrs.las", NULL, 43, 0, {-2.27444186, 5.73285465, -10.6317151}},
    {"formats/las/1.2-with-color-clipped.las", .refused = "offset 107"},
    {"formats/las/1.2-with-color.las", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/las/1.2-with-color.las.wkt", .refused = "line 1: x"},
    {"formats/las/100-points.las", NULL, 100, 0, {637357.344, 851359.175, 433.4589}},
    {"formats/las/4_6_crop.las", NULL, 23875, 0, {1639694.3, 1454595.34, 7095.33964}},
    {"formats/las/bad-geotiff-keys.las", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/las/bad_vlr_count.las", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/las/epsg_4326.las", NULL, 5380, 0, {-94.6724649, 31.042769, 54.5909312}},
    {"formats/las/extrabytes.las", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/las/garbage_nVariableLength.las", .refused = "offset 107"},
    {"formats/las/gps-time-nan.las", NULL, 1, 0, {0, 0, 0}},
    {"formats/las/hextest.las", NULL, 8, 0, {1, 1.01875, 0}},
    {"formats/las/interesting.las", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/las/lots_of_vlr.las", NULL, 1, 0, {715001.346, 839349.171, 17.275}},
    {"formats/las/mvk-thin.las", NULL, 6280, 0, {2047388.9, 1270147.52, 121.714314}},
    {"formats/las/mvk-thin.las.wkt", .refused = "line 1: x"},
    {"formats/las/no-points.las", NULL, 0, 0, {0, 0, 0}},
    {"formats/las/noise-clean.las", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/las/noise-dirty.las", NULL, 1065, 0, {637296.735, 851249.538, 434.097831}},
    {"formats/las/permutations/1.0_0.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.0_1.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.1_0.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.1_1.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.2-no-points.las", .refused = "offset 107"},
    {"formats/las/permutations/1.2_0.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.2_1.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.2_2.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/permutations/1.2_3.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/prec3.las", NULL, 110, 0, {636551.417, 849147.516, 430.851545}},
    {"formats/las/sample_c.las", NULL, 14408, 0, {674567.046, 1206774.56, 651.085639}},
    {"formats/las/sample_c_thin.las", NULL, 2732, 0, {674568.449, 1206773.64, 650.948697}},
    {"formats/las/sample_nc.las", NULL, 14408, 0, {674567.046, 1206774.56, 651.085639}},
    {"formats/las/simple.las", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/las/spec_3.las", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/las/spurious.las", NULL, 1065, 0, {-123.069671, 44.0563589, 132.312995}},
    {"formats/las/synthetic_test.las", NULL, 1, 0, {1, 2, 3}},
    {"formats/las/test1_4.las", NULL, 1000, 0, {1694379.48, 1816495.47, 5597.52053}},
    {"formats/las/test_epsg_4047.las", NULL, 10, 0, {-83.42759, 39.0126, 170.679}},
    {"formats/las/test_epsg_4326.las", NULL, 10, 0, {-83.42759, 39.0126, 170.679}},
    {"formats/las/test_epsg_4326_axis.las", NULL, 10, 0, {39.0126, -83.42759, 170.679}},
    {"formats/las/test_epsg_4326x3.las", NULL, 30, 0, {-83.42759, 39.0126, 170.679}},
    {"formats/las/test_utm16.las", NULL, 10, 0, {809329.787, 4324250.61, 170.679}},
    {"formats/las/test_utm17.las", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/las/utm15.las", NULL, 1, 0, {470692.44, 4602888.9, 16}},
    {"formats/las/utm17.las", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/las/vlr-43.bin", .refused = "line 1: x"},
    {"formats/las/warsaw_small.las", NULL, 3000, 0, {639929.413, 485161.691, 88.66576}},
    {"formats/las/wontcompress3.las", NULL, 1000, 0, {768343.868, 2028745.18, 107.97411}},
    {"formats/ply/issue_2421.ply", NULL, 1, 0, {1.23457, 12345.6789, 1.23456789e+09}},
    {"formats/ply/mesh.ply", NULL, 4, 0, {1.5, 1.5, 0.5}},
    {"formats/ply/mesh_fixed.ply", NULL, 4, 0, {1.5, 1.5, 0.5}},
    {"formats/ply/no_vertex.ply", .refused = "element vertex"},
    {"formats/ply/simple_binary.ply", NULL, 3, 0, {0, 0.333333333, 0}},
    {"formats/ply/simple_text.ply", NULL, 3, 0, {0, 0.333333333, 0}},
    {"formats/ply/sized_dims.ply", .refused = "line 4: z"},
    {"formats/ply/text_extradim.ply", NULL, 1, 0, {-2.64944, -13.0955, 0.00640115}},
    {"formats/ply/unsized_dims.ply", .refused = "line 4: z"},
    {"formats/pts/autzen.pts", NULL, 10, 0, {636120.311, 849079.747, 444.818002}},
    {"formats/pts/bunny_8.pts", .refused = "line 10: count"},
    {"formats/pts/site_56_8.pts", NULL, 8, 0, {6700.78282, 28.6104795, 638.092041}},
    {"formats/pts/test.pts", NULL, 19, 0, {-18.5627466, -21.7096132, -1.19121279}},
    {"formats/ptx/1.2-with-color.ptx", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/ptx/complex-transform.ptx", NULL, 4, 8, {-3.03438358, -3.17146975, -1.82366236}},
    {"formats/ptx/multiple-and-transform.ptx", NULL, 8, 0, {636848.172, 849053.42, 432.5375}},
    {"formats/ptx/no-color.ptx", NULL, 15, 0, {636334.331, 849185.105, 428.594}},
    {"formats/text/badheader.txt", .refused = "line 1: z"},
    {"formats/text/crlf_test.txt", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/text/crlf_test2.txt", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/text/decimate_file_grid.txt", NULL, 81, 0, {1639625.5, 1454423.5, 1.55555556}},
    {"formats/text/duplicates-sorted.txt", NULL, 7, 0, {0, 0.857142857, 0.714285714}},
    {"formats/text/duplicates-unsorted.txt", NULL, 7, 0, {0, 0.857142857, 0.714285714}},
    {"formats/text/file1.txt", NULL, 9, 0, {14.8888889, 13.4444444, 2}},
    {"formats/text/file2.txt", NULL, 9, 0, {15, 14.2222222, 2}},
    {"formats/text/file3.txt", NULL, 9, 0, {13.8888889, 14.6666667, 2}},
    {"formats/text/largescan.txt", NULL, 6, 0, {431693.288, 776842.748, 40.0301667}},
    {"formats/text/missingheader.txt", NULL, 5, 0, {3, 3, 3}},
    {"formats/text/numeric_dim.txt", NULL, 5, 0, {3, 3, 3}},
    {"formats/text/quoted.txt", NULL, 9, 0, {14.8888889, 13.4444444, 2}},
    {"formats/text/quoted2.txt", NULL, 9, 0, {14.8888889, 13.4444444, 2}},
    {"formats/text/text.txt", .refused = "line 1: x"},
    {"formats/text/utm17_1.txt", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/text/utm17_2.txt", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"formats/text/utm17_3.txt", .refused = "line 5"},
    {"formats/text/with_edgeofflightline.txt", NULL, 10000, 0, {498.988866, 496.821997, 50.0072087}},
    {"sceaux/surfels.ply", NULL, 600000, 0, {-0.0970488895, -0.130263265, -0.27137707}},
    {"trees/pine.las", NULL, 73851, 0, {0.0310485396, -0.0412745927, 9.84377304}},
    {"trees/spruce.las", NULL, 83392, 0, {-0.0945700499, 0.00851659576, 8.13124533}},
    {"als/powerline.laz", NULL, 774412, 0, {228938.569, 578517.204, 1.1828575}},
    {"formats/laz/autzen_trim.laz", NULL, 110000, 0, {636546.405, 849145.786, 430.337525}},
    {"formats/laz/las_with_several_extra_byte_bloc.laz", NULL, 697721, 0, {484866.118, 6632856.27, 107.51675}},
    {"formats/laz/simple-laszip-compressor-version-1.2r0.laz", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"formats/laz/simple.laz", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"copc/1.2-with-color.copc.laz", NULL, 1065, 0, {637296.735, 851249.538, 434.09784}},
    {"copc/lion_takanawa.copc.laz", NULL, 341989, 0, {-2.60490957, 3.99850966, -1.5115028}},
    {"copc/lone-star.copc.laz", NULL, 518862, 0, {515392.121, 4918365.95, 2328.67444}},
    {"interchange/pcd/pcl-learn0.pcd", NULL, 182292, 124908, {-0.0517441395, 0.0956667473, 0.850873603}},
    {"interchange/pcd/pcl-milk.pcd", NULL, 12575, 0, {0.249620892, -0.0965768723, -0.696798666}},
    {"interchange/pcd/pcl-object_template_0.pcd", NULL, 1397, 0, {-0.106276255, 0.0947920007, 0.734193853}},
    {"interchange/pcd/pcl-samp41-utm.pcd", NULL, 11231, 0, {513325.865, 5403710.75, 309.911434}},
    {"interchange/pcd/pdal-autzen-utm.pcd", NULL, 1065, 0, {494494.664, 4878134.83, 132.312995}},
    {"interchange/pcd/pdal-missingheader.pcd", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"interchange/pcd/pdal-utm17_space.pcd", NULL, 10, 0, {289816.322, 4320979.6, 170.679}},
    {"interchange/pcd/simple-ascii.pcd", NULL, 213, 0, {0.00906073761, 0.15169854, 0}},
    {"trees/pine.laz", NULL, 73851, 0, {0.0310485396, -0.0412745927, 9.84377304}},
    {"trees/pine_plot.laz", NULL, 114024, 0, {5.42936256, 4.90536146, 55.0804419}},
    {"trees/spruce.laz", NULL, 83392, 0, {-0.0945700499, 0.00851659576, 8.13124533}},
};

static const char *folder;
static unsigned files;

static const struct row *find_row(const char *path)
{
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if (!strcmp(rows[i].path, path))
            return &rows[i];
    return NULL;
}

static void assert_mean(const char *path, const struct loaded *l, const double mean[3])
{
    for (int k = 0; k < 3; k++)
        if (fabs(l->sum[k] / (double)(l->points ? l->points : 1) - mean[k]) > 1e-8 * fabs(mean[k]) + 1e-8)
            fail_msg("%s: mean of coordinate %d is %.10g instead of %.10g", path, k, l->sum[k] / (double)l->points,
                     mean[k]);
}

static int check_file(const char *path, const struct stat *status, int type, struct FTW *position)
{
    const char *name = path + strlen(folder) + 1;
    struct loaded l;
    (void)status, (void)position;
    if (type != FTW_F || !strncmp(name, "formats/e57/", 12)) /* test_e57_reference.c has those */
        return 0;
    const struct row *row = find_row(name);
    if (!row)
        fail_msg("%s has no row in this test", name);
    load_path(path, NULL, 1000, &l);
    if (row->refused) {
        if (l.code != SPL_E_INPUT || !strstr(l.err.message, row->refused) ||
            !strstr(l.err.message, strrchr(path, '/') + 1))
            fail_msg("%s: %llu points, %d \"%s\", expected \"%s\"", name, (unsigned long long)l.points, l.code,
                     l.err.message, row->refused);
    } else {
        if (l.code || l.points != row->points || l.skipped != row->skipped)
            fail_msg("%s: %llu points and %llu skipped instead of %llu and %llu %s", name, (unsigned long long)l.points,
                     (unsigned long long)l.skipped, (unsigned long long)row->points, (unsigned long long)row->skipped,
                     l.err.message);
        assert_mean(name, &l, row->mean);
    }
    loaded_finish(&l);
    files++;
    return 0;
}

static void every_file_loads_right_or_is_refused(void **state)
{
    static const char *const folders[] = {
        "bad", "formats", "als", "trees", "copc", "interchange/pcd", "7scenes_4stations.ptx", "sceaux/surfels.ply"};
    char path[4096];
    (void)state;
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++) {
        snprintf(path, sizeof path, "%s/%s", folder, folders[i]);
        assert_int_equal(nftw(path, check_file, 16, FTW_PHYS), 0);
    }
    assert_true(files > 100);
}

/* The two large scans are stored compressed; they are looked at where somebody has unpacked them. */
static void large_scans(void **state)
{
    static const struct {
        const char *path;
        uint64_t points;
    } large[] = {{"grenoble.ply", 11605395}, {"street.las", 1460879}};
    const char *cache = getenv("XDG_CACHE_HOME"), *home = getenv("HOME");
    (void)state;
    for (size_t i = 0; i < sizeof large / sizeof *large; i++) {
        char path[4096];
        struct loaded l;
        snprintf(path, sizeof path, "%s%s/splatd-data/%s",
                 cache  ? cache
                 : home ? home
                        : "",
                 cache ? "" : "/.cache", large[i].path);
        if (access(path, R_OK))
            continue;
        load_path(path, NULL, 65536, &l);
        assert_int_equal(l.code, 0);
        assert_int_equal(l.points, large[i].points);
        assert_int_equal(l.expected, large[i].points);
        assert_true(l.attributes & SPL_CLOUD_COLOR);
        loaded_finish(&l);
    }
}

static void stations_of_7scenes(void **state)
{
    struct loaded l;
    char path[4096];
    (void)state;
    snprintf(path, sizeof path, "%s/7scenes_4stations.ptx", folder);
    load_path(path, NULL, 5000, &l);
    assert_int_equal(l.station_count, 4);
    /* the first lines of the file: position, then the rotation by rows of the transposed matrix */
    assert_true(l.station[0][3] == -0.34045634 && l.station[0][7] == 0.016469818 && l.station[0][11] == 0.29656917);
    assert_true(l.station[0][0] == 0.9093129 && l.station[0][1] == 0.27262229 && l.station[0][4] == -0.27248618);
    loaded_finish(&l);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_file_loads_right_or_is_refused),
        cmocka_unit_test(large_scans),
        cmocka_unit_test(stations_of_7scenes),
    };
    folder = getenv("SPLATD_DATA");
    if (!folder || access(folder, R_OK))
        return 77;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
