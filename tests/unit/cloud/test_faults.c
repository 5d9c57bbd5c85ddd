/* What may go wrong around a sound file: it is cut at any byte, or memory is refused at any allocation. Either way
 * there is an error or fewer points, never a crash or a leak (the sanitisers watch), and never a point that the whole
 * file lacks. */
#include "cloud_test.h"

#include "base/memory.h"
#include "las_bytes.h"
#include "support/e57_writer.h"

static void make_ply(struct bytes *b)
{
    put_text(b, "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int i\nelement vertex 3\nproperty float x\n"
                "property float y\nproperty float z\nproperty ushort red\nproperty ushort green\nproperty ushort blue\n"
                "end_header\n3 0 1 2\n10.5 20.5 30.5 1 2 3\n11.5 21.5 31.5 4 5 6\n12.5 22.5 32.5 7 8 9\n");
}

static void make_binary_ply(struct bytes *b)
{
    put_text(b, "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uchar short i\nelement vertex 3\n"
                "property short x\nproperty short y\nproperty short z\nproperty float intensity\nend_header\n");
    put(b, "\3\0\0\1\0\2\0", 7);
    for (int16_t i = 0; i < 3; i++) {
        float intensity = i;
        put(b, (int16_t[3]){(int16_t)(i + 10), (int16_t)(i + 20), (int16_t)(i + 30)}, 6);
        put(b, &intensity, 4);
    }
}

static void make_pcd(struct bytes *b)
{
    put_text(b, "# .PCD v0.7\nFIELDS rgb x y z\nWIDTH 3\nVIEWPOINT 1 2 3 1 0 0 0\nDATA ascii\n"
                "65535 1.25 2.25 3.25\n255 4.25 5.25 6.25\n16711680 7.25 8.25 9.5\n");
}

static void make_binary_pcd(struct bytes *b)
{
    put_text(b, "# .PCD v0.7\nFIELDS x y z intensity\nSIZE 2 2 2 2\nTYPE I I I U\nPOINTS 3\nDATA binary\n");
    for (int16_t i = 0; i < 3; i++)
        put(b, (int16_t[4]){(int16_t)(i + 10), (int16_t)(i + 20), (int16_t)(i + 30), i}, 8);
}

static void make_compressed_pcd(struct bytes *b)
{
    static const char literals[] = "\3\0\0\0\24\0\3\0\0\0\24\0\3\0\0\0\24\0\3\0\0\0\24\0";
    put_text(b, "# .PCD v0.7\nFIELDS x y z i\nSIZE 2 2 2 2\nTYPE I I I U\nPOINTS 3\nDATA binary_compressed\n");
    put(b, (uint32_t[2]){3 * 8 + 1, 3 * 8}, 8);
    put(b, (uint8_t[1]){3 * 8 - 1}, 1); /* so many bytes as they are */
    put(b, literals, 3 * 8);
}

static void make_las(struct bytes *b)
{
    struct las las = las_default(4, 7, 3, 3);
    las.vlr_user = "LASF_Projection";
    las_build(b, &las);
}

static void make_gray_las(struct bytes *b)
{
    struct las las = las_default(2, 0, 0, 3);
    las_build(b, &las);
}

static void make_ptx(struct bytes *b)
{
    for (int s = 0; s < 2; s++)
        put_text(b,
                 "1\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n%d00 0 0 1\n"
                 "1.25 2.25 3.25 0.5 10 20 30\n4.25 5.25 6.25 0.5 40 50 60\n",
                 s);
}

static void make_pts(struct bytes *b)
{
    put_text(b, "3\n1.25 2.25 3.25 -20 10 20 30\n4.25 5.25 6.25 30 40 50 60\n7.25 8.25 9.25 40 70 80 90\n");
}

static void make_csv(struct bytes *b)
{
    put_text(b, "X,Y,Z,Intensity\n1.25,2.25,3.25,20\n4.25,5.25,6.25,30\n7.25,8.25,9.25,40\n");
}

static void make_e57(struct bytes *b)
{
    static const int64_t raw[3] = {10, 20, 30};
    const struct e57_field fields[] = {{.name = "cartesianX", .type = E57_INTEGER, .most = 100, .raw = raw},
                                       {.name = "cartesianY", .type = E57_INTEGER, .most = 100, .raw = raw},
                                       {.name = "cartesianZ", .type = E57_INTEGER, .most = 100, .raw = raw},
                                       {.name = "intensity", .type = E57_INTEGER, .most = 100, .raw = raw}};
    struct e57_writer w;
    size_t length;
    e57_begin(&w);
    e57_add_scan(&w, &(struct e57_scan){"scan", e57_pose(1, 0, 0, 0, 0, 0, 0), fields, 4, 3, 0});
    uint8_t *file = e57_end(&w, NULL, &length);
    put(b, file, length);
    free(file);
}

static void (*const makers[])(struct bytes *) = {
    make_ply, make_binary_ply, make_pcd, make_binary_pcd, make_compressed_pcd, make_las, make_gray_las,
    make_ptx, make_pts,        make_csv, make_e57};
enum { MAKERS = sizeof makers / sizeof *makers };

static void cut_at_every_byte(void **state)
{
    static struct bytes b;
    (void)state;
    for (size_t m = 0; m < MAKERS; m++) {
        struct loaded whole, cut;
        b.length = 0;
        makers[m](&b);
        size_t length = b.length, errors = 0;
        load_bytes(&b, NULL, 2, &whole);
        if (whole.code < 0)
            fail_msg("%zu: %s", m, whole.err.message);
        for (size_t keep = 0; keep < length; keep++) {
            b.length = keep;
            load_bytes(&b, NULL, 2, &cut);
            errors += cut.code < 0;
            if (cut.points > whole.points)
                fail_msg("%zu: cut at %zu has %llu points", m, keep, (unsigned long long)cut.points);
            /* a number in text may lose digits where the cut falls: only the last point can differ by that */
            for (size_t i = 0; i + 1 < cut.points; i++)
                assert_memory_equal(cut.first.position[i], whole.first.position[i], sizeof cut.first.position[i]);
            if (cut.code == 0 && makers[m] != make_csv && cut.points == whole.points && keep + 3 < length)
                fail_msg("%zu: nobody saw that %zu of %zu bytes are there", m, keep, length);
            loaded_finish(&cut);
        }
        assert_true(errors > length / 4); /* headers, at least, do not pass in pieces */
        loaded_finish(&whole);
    }
}

static void memory_refused_at_any_allocation(void **state)
{
    static struct bytes b;
    (void)state;
    for (size_t m = 0; m < MAKERS; m++) {
        b.length = 0;
        makers[m](&b);
        write_scratch(b.data, b.length);
        for (long n = 1;; n++) {
            struct spl_cloud *cloud = NULL;
            struct spl_error err = {0};
            struct spl_point_batch batch;
            spl_memory_fail_after(n);
            int code = spl_point_batch_init(&batch, 2, &err);
            if (code == 0)
                code = spl_cloud_open(scratch_path(), NULL, &cloud, &err);
            while (code == 0 && (code = spl_cloud_read(cloud, &batch, &err)) > 0)
                code = 0;
            spl_memory_fail_after(0);
            spl_cloud_destroy(cloud);
            spl_point_batch_finish(&batch);
            assert_in_range(n, 1, 50);
            if (err.code == 0) {
                assert_in_range(n, 9, 50); /* 5 of the batch, then cloud, path and window at least */
                break;
            }
            assert_int_equal(err.code, SPL_E_NOMEM);
        }
    }
}

/* The file shrinks while it is read: the readers see its end, not a signal. */
static void file_truncated_under_the_reader(void **state)
{
    static struct bytes b;
    (void)state;
    for (int las = 0; las < 2; las++) {
        struct spl_cloud *cloud;
        struct spl_error err = {0};
        struct spl_point_batch batch;
        size_t head;
        FILE *f = fopen(scratch_path(), "wb");
        assert_non_null(f);
        b.length = 0;
        if (las) {
            struct las header = las_default(2, 0, 0, 1);
            las_build(&b, &header);
            las_set(&b, 107, 200000, 4);
            head = b.length - 20;
        } else {
            put_text(&b, "ply\nformat binary_little_endian 1.0\nelement vertex 200000\nproperty double x\n"
                         "property double y\nproperty int z\nend_header\n");
            head = b.length;
        }
        fwrite(b.data, 1, head, f);
        for (int i = 0; i < 200000; i++)
            fwrite("\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 1, 20, f);
        fclose(f);
        assert_int_equal(spl_point_batch_init(&batch, 1000, NULL), 0);
        assert_int_equal(spl_cloud_open(scratch_path(), NULL, &cloud, &err), 0);
        assert_int_equal(spl_cloud_read(cloud, &batch, &err), 1);
        assert_int_equal(truncate(scratch_path(), 3000000), 0);
        int code;
        while ((code = spl_cloud_read(cloud, &batch, &err)) > 0)
            ;
        assert_int_equal(code, SPL_E_INPUT);
        assert_non_null(strstr(err.message, "shorter"));
        spl_cloud_destroy(cloud);
        spl_point_batch_finish(&batch);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cut_at_every_byte),
        cmocka_unit_test(memory_refused_at_any_allocation),
        cmocka_unit_test(file_truncated_under_the_reader),
    };
    return cmocka_run_group_tests(tests, NULL, remove_scratch);
}
