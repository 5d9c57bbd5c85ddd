/* Vectors from NPY, whatever numbers and order it has, and what it is refused for; layers of rays as JSON, and as NPY
 * without a column. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "image/vectors.h"

static const double wanted[2][3] = {{1, 2.5, -3}, {0.25, 0, 7}};

/* A file with `header` as its dictionary; its length. */
static size_t make(unsigned char *out, const char *header, const void *numbers, size_t bytes)
{
    const size_t length = strlen(header);
    memcpy(out, "\x93NUMPY\x01\x00", 8);
    out[8] = (unsigned char)length;
    out[9] = (unsigned char)(length >> 8);
    memcpy(out + 10, header, length);
    memcpy(out + 10 + length, numbers, bytes);
    return 10 + length + bytes;
}

static int load(unsigned char *file, size_t length, double **out, size_t *count, struct spl_error *err)
{
    FILE *stream = fmemopen(file, length, "rb");
    assert_non_null(stream);
    int rc = spl_vectors_load_npy(stream, length, "list", 100, out, count, err);
    fclose(stream);
    return rc;
}

static void every_form_is_read(void **state)
{
    (void)state;
    float small[6], turned[6];
    for (int i = 0; i < 6; i++) {
        small[i] = (float)wanted[i / 3][i % 3];
        turned[i % 3 * 2 + i / 3] = small[i];
    }
    const struct {
        const char *header;
        const void *numbers;
        size_t bytes;
    } rows[] = {
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }", wanted, sizeof wanted},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", small, sizeof small},
        {"{'shape':(2,3),'fortran_order':True,'descr':'<f4'}", turned, sizeof turned},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        unsigned char file[512];
        double *out;
        size_t count;
        struct spl_error err = {0};
        size_t length = make(file, rows[i].header, rows[i].numbers, rows[i].bytes);
        if (load(file, length, &out, &count, &err))
            fail_msg("%s", err.message);
        assert_int_equal(count, 2);
        assert_memory_equal(out, wanted, sizeof wanted);
        free(out);
        for (size_t cut = 1; cut < length; cut++) { /* no part of it is one */
            struct spl_error why = {0};
            assert_int_equal(load(file, cut, &out, &count, &why), SPL_E_INPUT);
            assert_true(!out && why.message[0]);
        }
    }
}

static void others_are_refused(void **state)
{
    (void)state;
    static const char *const headers[][2] = {
        {"{'descr': '>f8', 'fortran_order': False, 'shape': (2, 3), }", "float32"},
        {"{'descr': '<i8', 'fortran_order': False, 'shape': (2, 3), }", "float32"},
        {"{'descr': '<f8', 'shape': (2, 3), }", "fortran_order"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (6,), }", "(count, 3)"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 2), }", "(count, 3)"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2, 3), }", "(count, 3)"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (0, 3), }", "0 rows"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (101, 3), }", "101 rows"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615, 3), }", "rows"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (99999999999999999999, 3), }", "(count, 3)"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (3, 3), }", "need"},
        {"{'descr': '<f8', 'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", "'descr' is there twice"},
        {"{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), 'fortran_order': True}",
         "'fortran_order' is there twice"},
        {"{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }", "need"},
    };
    for (size_t i = 0; i < sizeof headers / sizeof *headers; i++) {
        unsigned char file[512];
        double *out;
        size_t count, length = make(file, headers[i][0], wanted, sizeof wanted);
        struct spl_error err = {0};
        assert_int_equal(load(file, length, &out, &count, &err), SPL_E_INPUT);
        if (out || !strstr(err.message, headers[i][1]))
            fail_msg("row %zu: %s", i, err.message);
    }
}

static void layers_are_lists(void **state)
{
    (void)state;
    float ranges[3] = {0.1f, NAN, 16777216.0f}, normals[6] = {0, 0, 0, 0.5f, 0, -1};
    uint32_t ids[3] = {0, UINT32_MAX, 7};
    uint8_t colors[8] = {1, 2, 3, 255, 0, 0, 0, 0};
    const struct {
        struct spl_image image;
        const char *json, *shape;
    } rows[] = {
        {{SPL_LAYER_RANGE, SPL_PIXEL_F32, 1, 3, ranges, 0}, "[0.1,\nnull,\n16777216]\n", "(3,)"},
        {{SPL_LAYER_NORMAL, SPL_PIXEL_F32X3, 1, 2, normals, 0}, "[null,\n[0.5,0,-1]]\n", "(2, 3)"},
        {{SPL_LAYER_ID, SPL_PIXEL_U32, 1, 3, ids, 0}, "[0,\nnull,\n7]\n", "(3,)"},
        {{SPL_LAYER_COLOR, SPL_PIXEL_RGBA8, 1, 2, colors, 0}, "[[1,2,3,255],\n[0,0,0,0]]\n", "(2, 4)"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spl_encoded encoded;
        assert_int_equal(spl_image_list_json(&rows[i].image, &encoded, NULL), SPL_OK);
        assert_int_equal(encoded.length, strlen(rows[i].json));
        assert_memory_equal(encoded.bytes, rows[i].json, encoded.length);
        assert_string_equal(encoded.media_type, "application/json");
        spl_encoded_finish(&encoded);
        for (int list = 0; list < 2; list++) {
            char header[128];
            assert_int_equal(spl_image_encode(&rows[i].image,
                                              &SPL_SIZED(spl_encode_options, .format = SPL_FORMAT_NPY, .list = list),
                                              &encoded, NULL),
                             SPL_OK);
            memcpy(header, encoded.bytes, 127);
            for (int k = 0; k < 127; k++)
                header[k] = header[k] ? header[k] : ' ';
            header[127] = 0;
            assert_int_equal(strstr(header, rows[i].shape) != NULL, list);
            spl_encoded_finish(&encoded);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_form_is_read),
        cmocka_unit_test(others_are_refused),
        cmocka_unit_test(layers_are_lists),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
