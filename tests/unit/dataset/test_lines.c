/* Chunks of lines: what is written decodes within the bounds, pieces are counted and cost few bytes, a splat's id and a
 * vertex's are of one row, and what no chunk of lines has is refused. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "dataset/codec.h"
#include "dataset/dataset.h"
#include "support/make_dataset.h"

static const struct spl_chunk_options options = {.position_error = 0.016,
                                                 .normal_error = M_PI / 180,
                                                 .radius_error = 0.05,
                                                 .kind = SPL_CHUNK_LINES};

struct made {
    struct spl_splat vertices[SPL_CHUNK_SPLATS];
    double position[SPL_CHUNK_SPLATS][3];
    struct spl_chunk chunk;
    uint32_t words[SPL_CHUNK_WORDS_MAX + SPL_PAGE_TAIL_WORDS], used;
};

static double noise(uint32_t i)
{
    return (double)(i * 2654435761u % 1000) / 1000 - 0.5;
}

/* A wire that sags over `count` vertices 5 cm apart, cut every `length`. */
static void make(struct made *m, uint32_t count, uint32_t length)
{
    *m = (struct made){.used = 0};
    for (uint32_t i = 0; i < count; i++) {
        double x = 0.05 * i;
        struct spl_splat *v = &m->vertices[i];
        *v = (struct spl_splat){.normal = {0, (float)sin(0.3 * noise(i)), (float)cos(0.3 * noise(i))},
                                .radius = (float)(0.06 + 0.01 * noise(i)),
                                .color = {40, (uint8_t)(60 + 30 * noise(i)), 80},
                                .linear = i + 1 < count && i % length != length - 1};
        memcpy(m->position[i], (double[3]){x, 2 + 0.01 * noise(i), 0.01 * x * x}, sizeof m->position[i]);
    }
    m->used =
        spl_chunk_encode(m->vertices, (const double(*)[3])m->position, count, &options, &m->chunk, m->words, NULL);
}

static void vertices_come_back(void **state)
{
    (void)state;
    static struct made m;
    static const uint32_t counts[][2] = {{2, 2}, {33, 11}, {128, 128}, {128, 2}, {127, 50}};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
        uint32_t count = counts[k][0], joined = 0;
        double off = 0, angle = 0;
        make(&m, count, counts[k][1]);
        assert_int_equal(m.used, spl_chunk_words(&m.chunk));
        assert_null(spl_chunk_get_codec(SPL_CHUNK_LINES)->judge(&m.chunk));
        for (uint32_t i = 0; i < count; i++) {
            struct spl_splat out;
            double squared = 0, cosine = 0;
            spl_chunk_decode(&m.chunk, m.words, i, &out);
            for (int c = 0; c < 3; c++) {
                squared += (out.position[c] - m.position[i][c]) * (out.position[c] - m.position[i][c]);
                cosine += (double)out.normal[c] * m.vertices[i].normal[c];
            }
            off += sqrt(squared) / m.vertices[i].radius / count;
            angle += acos(fmin(cosine, 1)) / count;
            joined += out.linear;
            assert_int_equal(out.linear, m.vertices[i].linear);
            assert_memory_equal(out.color, m.vertices[i].color, 3);
            assert_true(fabsf(out.radius / m.vertices[i].radius - 1) < 0.051f);
        }
        assert_true(off <= options.position_error * 1.001 && angle <= options.normal_error * 1.01);
        assert_int_equal(spl_chunk_count_pieces(&m.chunk), joined);
    }
}

static void a_piece_costs_few_bytes(void **state)
{
    (void)state;
    static struct made m;
    uint64_t bits[SPL_ATTRIBUTE_COUNT] = {0};
    make(&m, 128, 128);
    spl_chunk_add_bits(&m.chunk, bits);
    assert_int_equal(bits[SPL_ATTRIBUTE_LINES], 32 * m.used + 8 * SPL_CHUNK_BYTES);
    assert_true((double)bits[SPL_ATTRIBUTE_LINES] / 8 / 127 <= 12);
    for (int a = 0; a < SPL_ATTRIBUTE_COUNT; a++)
        assert_true(a == SPL_ATTRIBUTE_LINES || bits[a] == 0);
}

/* Within a code's rounding, 1 + 16 log2(width / 0.25 mm); 0 is not known, and of discs nothing is. */
static void widths_come_back(void **state)
{
    (void)state;
    static struct made m;
    struct spl_chunk_options with_width = options;
    make(&m, 40, 20);
    assert_true(spl_chunk_line_width(&m.chunk) == 0);
    for (double width = 1e-6; width < 100; width *= 1.3) {
        with_width.width = width;
        spl_chunk_encode(m.vertices, (const double(*)[3])m.position, 40, &with_width, &m.chunk, m.words, NULL);
        assert_null(spl_chunk_get_codec(SPL_CHUNK_LINES)->judge(&m.chunk));
        double within = fmin(fmax(width, 0.25e-3), 0.25e-3 * exp2(254 / 16.0));
        assert_true(fabs(spl_chunk_line_width(&m.chunk) / within - 1) < 0.0221);
        assert_int_equal(spl_chunk_count_pieces(&m.chunk), 38);
        assert_int_equal(m.used, spl_chunk_words(&m.chunk));
    }
    assert_int_equal(spl_line_width_code(NAN), 0);
    assert_int_equal(spl_line_width_code(INFINITY), 255);
    m.chunk.extra_bits &= 0xffffff;
    assert_true(spl_chunk_line_width(&m.chunk) == 0);
}

/* Colours change, nothing else does. */
static void lines_are_recoloured(void **state)
{
    (void)state;
    static struct made m;
    static uint32_t words[SPL_CHUNK_WORDS_MAX + SPL_PAGE_TAIL_WORDS];
    uint8_t color[SPL_CHUNK_SPLATS][3];
    struct spl_chunk chunk;
    make(&m, 100, 30);
    for (int i = 0; i < 100; i++)
        memcpy(color[i], (uint8_t[3]){(uint8_t)(2 * i), 7, (uint8_t)(255 - i)}, 3);
    uint32_t used = spl_chunk_recolor(&m.chunk, m.words, (const uint8_t(*)[3])color, &chunk, words);
    assert_int_equal(used, spl_chunk_words(&chunk));
    assert_int_equal(spl_chunk_count_pieces(&chunk), spl_chunk_count_pieces(&m.chunk));
    for (uint32_t i = 0; i < 100; i++) {
        struct spl_splat before, after;
        spl_chunk_decode(&m.chunk, m.words, i, &before);
        spl_chunk_decode(&chunk, words, i, &after);
        assert_memory_equal(after.color, color[i], 3);
        assert_memory_equal(after.position, before.position, sizeof before.position);
        assert_int_equal(after.linear, before.linear);
    }
}

/* Splats first, then the vertices; both are found by their ids, only splats are counted as such. */
static void ids_go_on_over_both_kinds(void **state)
{
    (void)state;
    enum { splats = 200, vertices = 5 };
    struct make_splat all[splats + vertices];
    for (int i = 0; i < splats + vertices; i++)
        all[i] = (struct make_splat){.position = {0.1 * i, 0, 0},
                                     .normal = {0, 0, 1},
                                     .radius = 0.1f,
                                     .color = {(uint8_t)i, 1, 2},
                                     .vertex = i >= splats,
                                     .linear = i >= splats && i + 1 < splats + vertices};
    struct spl_dataset *dataset = make_dataset(all, splats + vertices);
    const struct spl_dataset_info *info = spl_dataset_get_info(dataset);
    assert_true(info->splats == splats && info->leaf_splats == splats && info->ids == splats + vertices);
    assert_true(info->pieces == vertices - 1 && !info->has_linear);
    uint64_t linear = 0;
    assert_int_equal(spl_dataset_count_linear(dataset, &linear, NULL), SPL_OK);
    assert_int_equal(linear, 0);
    for (uint32_t id = 0; id <= splats + vertices; id++) {
        struct spl_splat found;
        assert_int_equal(spl_dataset_find_splat(dataset, id, &found), id < splats + vertices);
        assert_true(id == splats + vertices || found.color[0] == id);
        assert_true(id == splats + vertices || found.linear == all[id].linear);
    }
    spl_dataset_close(dataset);
}

static void what_lines_do_not_have_is_refused(void **state)
{
    (void)state;
    static struct made m;
    make(&m, 40, 20);
    const char *(*judge)(const struct spl_chunk *) = spl_chunk_get_codec(SPL_CHUNK_LINES)->judge;
    assert_null(judge(&m.chunk));
    struct spl_chunk forged[] = {m.chunk, m.chunk, m.chunk, m.chunk, m.chunk, m.chunk, m.chunk, m.chunk};
    forged[0].extra_bits |= 3; /* bits that no chunk has */
    forged[1].geometry_bits |= 3 << SPL_GEOMETRY_AXIS;
    forged[2].extra_bits += 19 << SPL_EXTRA_LINES;                   /* 21 lines of 40 vertices */
    forged[3].extra_bits &= ~(255u << SPL_EXTRA_LINES);              /* none */
    forged[4].geometry_bits ^= 3u << SPL_GEOMETRY_LINEAR;            /* all are joined, to what? */
    forged[5].radius_step = 0;
    forged[6].step = 0;
    forged[7].count = 1;
    for (size_t i = 0; i < sizeof forged / sizeof *forged; i++)
        assert_non_null(judge(&forged[i]));
    assert_null(spl_chunk_get_codec(SPL_CHUNK_KINDS));
    assert_null(spl_chunk_get_codec(255));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vertices_come_back),
        cmocka_unit_test(a_piece_costs_few_bytes),
        cmocka_unit_test(widths_come_back),
        cmocka_unit_test(lines_are_recoloured),
        cmocka_unit_test(ids_go_on_over_both_kinds),
        cmocka_unit_test(what_lines_do_not_have_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
