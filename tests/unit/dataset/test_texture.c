/* Textures in the container: packing of codes, chunks with other colours, files made of files, and what is refused. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "dataset/chunk.h"
#include "dataset/dataset.h"
#include "dataset/atoms.h"
#include "dataset/dictionary.h"
#include "dataset/rewrite.h"
#include "dataset/texture.h"
#include "geom/tangent.h"
#include "sparse/atom.h"
#include "support/make_dataset.h"
#include "support/make_textures.h"
#include "support/spoil.h"

static char folder[256], path[300];

static void same_code(const struct spl_chunk_code *a, const struct spl_chunk_code *b)
{
    assert_int_equal(a->splats, b->splats);
    assert_int_equal(a->planes, b->planes);
    for (uint32_t t = 0; t < a->planes; t++) {
        assert_true(a->plane[t].step == b->plane[t].step && a->plane[t].gap == b->plane[t].gap);
        assert_int_equal(a->plane[t].index_bits, b->plane[t].index_bits);
        assert_int_equal(a->plane[t].weight_bits, b->plane[t].weight_bits);
    }
    for (uint32_t i = 0; i < a->splats; i++) {
        assert_int_equal(a->splat[i].count, b->splat[i].count);
        for (uint32_t t = 0; t < a->splat[i].count; t++) {
            assert_int_equal(a->splat[i].atom[t], b->splat[i].atom[t]);
            assert_int_equal(a->splat[i].weight[t], b->splat[i].weight[t]);
        }
    }
}

/* Every kind of chunk comes back as it was, at the size that the coder reckons with; whatever a flipped bit or a cut
 * makes of it is refused, or decodes within its block and the dictionary. */
static void test_codes(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 2, 31, 32, 33, 64, 100, 127, 128}, atoms[] = {1, 2, 700, 65536};
    uint32_t random = 1;
    for (uint32_t round = 0; round < 900; round++) {
        struct spl_dictionary dictionary = {.count = atoms[round % 4], .size = 8};
        uint32_t splats = counts[round % 9];
        struct spl_chunk_code code, back;
        make_code(&dictionary, round % 10 % 9, 7, round, splats, &code);
        uint32_t words[SPL_TEXTURE_WORDS_MAX], used = spl_texture_encode(&code, words);
        assert_int_equal(used ? 32 * (uint64_t)used + 32 : 0, spl_chunk_code_bits(&code));
        if (!used)
            continue;
        assert_null(spl_texture_judge(words, used, code.planes, splats, dictionary.count));
        spl_texture_decode(words, code.planes, splats, &back);
        same_code(&code, &back);
        uint64_t histogram[SPL_ATOMS_MAX + 1] = {0}, wanted[SPL_ATOMS_MAX + 1] = {0};
        spl_texture_count(words, code.planes, splats, histogram);
        for (uint32_t i = 0; i < splats; i++)
            wanted[code.splat[i].count]++;
        assert_memory_equal(histogram, wanted, sizeof wanted);
        assert_non_null(spl_texture_judge(words, used - 1, code.planes, splats, dictionary.count));
        for (int flip = 0; flip < 40; flip++) {
            random = random * 1664525u + 1013904223u;
            uint32_t *damaged = malloc((used + SPL_TEXTURE_TAIL_WORDS) * sizeof *damaged);
            memset(damaged + used, 0, SPL_TEXTURE_TAIL_WORDS * sizeof *damaged);
            memcpy(damaged, words, used * sizeof *damaged);
            damaged[random % used] ^= 1u << (random >> 27);
            if (!spl_texture_judge(damaged, used, code.planes, splats, dictionary.count)) {
                spl_texture_decode(damaged, code.planes, splats, &back);
                for (uint32_t i = 0; i < splats; i++)
                    for (uint32_t t = 0; t < back.splat[i].count; t++)
                        assert_true(back.splat[i].atom[t] < dictionary.count);
            }
            free(damaged);
        }
    }
}

static void test_judge(void **state)
{
    (void)state;
    struct spl_chunk_code code = {.splats = 40, .planes = 2};
    for (int t = 0; t < 2; t++)
        code.plane[t] = (struct spl_code_plane){.step_code = 50, .index_bits = 5, .weight_bits = 4};
    for (int i = 0; i < 40; i++)
        code.splat[i] = (struct spl_splat_code){.count = (uint8_t)(i % 3), .atom = {20, 20}};
    uint32_t good[SPL_TEXTURE_WORDS_MAX], words[SPL_TEXTURE_WORDS_MAX], used = spl_texture_encode(&code, good);
    static const struct {
        uint32_t word, flip;
        const char *part;
    } rows[] = {
        {0, 17 ^ 5, "of a width"},
        {1, 1u << 24, "that does not exist"}, /* splat 40 */
        {4, 1 << 15, "that does not exist"},  /* splat 127 */
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        memcpy(words, good, sizeof words);
        words[rows[i].word] ^= rows[i].flip;
        const char *what = spl_texture_judge(words, used, 2, 40, 32);
        if (!what || !strstr(what, rows[i].part))
            fail_msg("row %zu: expected '%s', got '%s'", i, rows[i].part, what);
    }
    assert_non_null(strstr(spl_texture_judge(good, used, 2, 40, 20), "names an atom"));
    assert_null(spl_texture_judge(good, used, 2, 40, 21));
    assert_non_null(strstr(spl_texture_judge(good, used - 1, 2, 40, 32), "beyond the end"));
    static const uint32_t planes[] = {0, 9, 15};
    for (int i = 0; i < 3; i++)
        assert_non_null(strstr(spl_texture_judge(good, used, planes[i], 40, 32), "has no planes"));
    assert_non_null(strstr(spl_texture_judge(good, 4, 2, 40, 32), "masks that reach"));
    memcpy(words, good, sizeof words);
    words[0] &= 0xffff; /* the first plane's mask: bits 16 to 144 */
    words[1] = words[2] = words[3] = words[4] = 0;
    assert_non_null(strstr(spl_texture_judge(words, used, 2, 40, 32), "a plane without atoms"));
}

/* A dictionary comes back as it was; atoms are what they were made of up to the step of their coefficients; no cut or
 * changed stream leads out of its bytes. */
static void test_atoms(void **state)
{
    (void)state;
    static const uint32_t sizes[] = {8, 16, 32};
    for (int i = 0; i < 3; i++) {
        struct spl_dictionary d = make_dictionary(40, sizes[i], 7), back;
        uint32_t n = spl_texture_values(sizes[i]), random = 1;
        d.coefficients[3] = INT16_MAX; /* of the coarsest waves, one after the other */
        d.coefficients[n + 4] = -INT16_MAX;
        d.coefficients[3 * n - 1] = -1; /* the finest of atom 2 */
        size_t bytes = spl_atoms_write(&d, NULL);
        uint8_t *stream = malloc(bytes), *damaged = malloc(bytes);
        assert_int_equal(spl_atoms_write(&d, stream), bytes);
        assert_true(bytes % 4 == 0 && bytes < 40 * (size_t)n);
        assert_int_equal(spl_dictionary_init(&back, 40, sizes[i], NULL), SPL_OK);
        assert_null(spl_atoms_read(stream, bytes, &back));
        assert_memory_equal(back.coefficients, d.coefficients, 40 * n * sizeof *d.coefficients);
        assert_memory_equal(back.texels + 3 * n, d.texels + 3 * n, 37 * n); /* the first were changed */
        assert_memory_equal(back.scale + 3, d.scale + 3, 37 * sizeof *d.scale);
        assert_string_equal(spl_atoms_read(stream, bytes - 4, &back), "ends before its atoms do");
        for (int flip = 0; flip < 200; flip++) {
            random = random * 1664525u + 1013904223u;
            memcpy(damaged, stream, bytes);
            damaged[random % bytes] ^= (uint8_t)(1 << (random >> 29));
            spl_atoms_read(damaged, bytes, &back);
        }
        memset(damaged, 0xff, bytes);
        assert_non_null(spl_atoms_read(damaged, bytes, &back));
        d.coefficients[2 * n + 1] = -1;
        assert_int_equal(spl_atoms_write(&d, NULL), bytes); /* a place of zeros so far: still one bit or two */
        spl_atoms_write(&d, stream);
        assert_string_equal(spl_atoms_read(stream, bytes, &back), "has an atom with a mean colour");
        free(stream);
        free(damaged);
        spl_dictionary_finish(&d);
        spl_dictionary_finish(&back);

        struct spl_waves waves;
        float atom[SPL_TEXTURE_VALUES_MAX], scale, off = 0, length = 0;
        int16_t coefficient[SPL_TEXTURE_VALUES_MAX];
        int8_t texels[SPL_TEXTURE_VALUES_MAX];
        spl_waves_init(&waves, sizes[i]);
        for (uint32_t k = 0; k < n; k++) { /* a colour's mean is 0 */
            atom[k] = (k & 1 ? -1.0f : 1.0f) * (float)(1 + k / 2 % 5);
            length += atom[k] * atom[k];
        }
        for (uint32_t k = 0; k < n; k++)
            atom[k] /= sqrtf(length);
        spl_waves_analyse(&waves, atom, 0.005f, coefficient);
        assert_true(spl_waves_synthesise(&waves, coefficient, texels, &scale));
        for (uint32_t k = 0; k < n; k++) {
            float d1 = scale * texels[k] - atom[k];
            off += d1 * d1;
        }
        assert_true(off < 2 * (float)n * 0.005f * 0.005f / 12 + 1e-4f);
        memset(coefficient, 0, sizeof coefficient);
        assert_false(spl_waves_synthesise(&waves, coefficient, texels, &scale));
    }
}

/* What a stream must hold though no atom needs it: nothing behind the last one. And as many atoms as a device can bind,
 * of one wave each, are few bytes. */
static void test_forged_atoms(void **state)
{
    enum { count = 24000, size = 32 };
    struct spl_dictionary d, back;
    uint32_t n = spl_texture_values(size);
    (void)state;
    assert_int_equal(spl_dictionary_init(&d, count, size, NULL), SPL_OK);
    assert_int_equal(spl_dictionary_init(&back, count, size, NULL), SPL_OK);
    memset(d.coefficients, 0, (size_t)count * n * sizeof *d.coefficients);
    for (uint32_t a = 0; a < count; a++)
        d.coefficients[(size_t)a * n + 3] = a % 2 ? 1 : -1;
    size_t bytes = spl_atoms_write(&d, NULL);
    uint8_t *stream = malloc(bytes);
    spl_atoms_write(&d, stream);
    assert_true(bytes < 60000);
    assert_null(spl_atoms_read(stream, bytes, &back));
    int most = 0;
    for (uint32_t i = 0; i < n; i++) {
        int a = back.texels[i], b = back.texels[n + i];
        assert_int_equal(a, -b);
        most = abs(a) > most ? abs(a) : most;
    }
    assert_int_equal(most, 127);
    assert_true(!(stream[bytes - 1] & 0x80));
    stream[bytes - 1] |= 0x80;
    assert_string_equal(spl_atoms_read(stream, bytes, &back), "has bits behind its last atom");
    free(stream);
    spl_dictionary_finish(&d);
    spl_dictionary_finish(&back);
}

static void test_expand(void **state)
{
    (void)state;
    assert_int_equal(spl_dictionary_atom_words(32), 1 + 1024 + 256 + 64 + 16);
    assert_int_equal(spl_dictionary_atom_words(8), 1 + 64 + 16);
    struct spl_dictionary d = make_dictionary(5, 16, 3);
    uint32_t each = spl_dictionary_atom_words(16), *words = malloc(5 * each * sizeof *words);
    assert_int_equal(spl_dictionary_expanded_bytes(5, 16), 5 * each * 4);
    d.texels[0] = -128;
    spl_dictionary_expand(&d, words);
    for (uint32_t a = 0; a < 5; a++) {
        const uint32_t *at = words + a * each;
        assert_memory_equal(at++, &d.scale[a], sizeof *at);
        for (uint32_t side = 16; side >= 4; side /= 2)
            for (uint32_t i = 0; i < side * side; i++, at++)
                for (uint32_t c = 0; c < 3; c++) {
                    double sum = 0;
                    uint32_t cell = 16 / side;
                    for (uint32_t k = 0; k < cell * cell; k++)
                        sum +=
                            d.texels[((a * 3 + c) * 16 + i / side * cell + k / cell) * 16 + i % side * cell + k % cell];
                    assert_int_equal((int)(*at >> (16 - 8 * c) & 255) - 128, (int)floor(sum / (cell * cell) + 0.5));
                }
    }
    free(words);
    spl_dictionary_finish(&d);
}

static void test_tangent(void **state)
{
    (void)state;
    for (int i = 0; i < 2000; i++) {
        double z = i % 40 / 19.5 - 1, angle = i * 0.7;
        if (i % 3 == 0) /* nearly level, where the frame follows x */
            z = copysign(sqrt(1 - pow(0.24 * (i % 40) / 40, 2)), z);
        double level = sqrt(fmax(1 - z * z, 0));
        float n[3] = {(float)(level * cos(angle)), (float)(level * sin(angle)), (float)z}, u[3], v[3];
        spl_tangent_frame(n, u, v);
        double uu = 0, vv = 0, uv = 0, un = 0, vn = 0;
        for (int a = 0; a < 3; a++) {
            uu += u[a] * u[a];
            vv += v[a] * v[a];
            uv += u[a] * v[a];
            un += u[a] * n[a];
            vn += v[a] * n[a];
        }
        assert_true(fabs(uu - 1) < 1e-5 && fabs(vv - 1) < 1e-5 && fabs(uv) < 1e-5 && fabs(un) < 1e-5 &&
                    fabs(vn) < 1e-5);
        assert_true(fabs(u[0] * v[1] - u[1] * v[0] - n[2]) < 1e-5); // right-handed
        if (level > 0.26)
            assert_true(u[2] == 0 && v[2] > 0); // rows are level and rise
        else
            assert_true(u[0] > 0.96);
    }
}

/* A dataset of two levels of everything. */
static struct spl_dataset *some_dataset(void)
{
    enum { count = 3000 };
    struct make_splat *splats = malloc(count * sizeof *splats);
    for (int i = 0; i < count; i++)
        splats[i] = (struct make_splat){.position = {i % 60 + 0.3 * sin(i), i / 60, 2 * sin(i * 0.01)},
                                        .normal = {0, 0.6f, 0.8f},
                                        .radius = 1 + 0.2f * (float)(i % 5),
                                        .uncertainty = 0.01f * (float)(i % 9),
                                        .color = {(uint8_t)i, (uint8_t)(i / 3), (uint8_t)(i * 7)},
                                        .classification = (uint8_t)(i % 4)};
    struct spl_dataset *dataset = make_dataset_levels(splats, count, 2);
    free(splats);
    return dataset;
}

static void paint(uint32_t id, uint8_t color[3])
{
    color[0] = (uint8_t)(id * 31);
    color[1] = (uint8_t)(id / 5);
    color[2] = id % 3 ? 0 : 255;
}

/* All of `b`'s splats are `a`'s, but for colours, which follow `paint` where `painted`. */
static void same_splats(const struct spl_dataset *a, const struct spl_dataset *b, bool painted)
{
    uint64_t splats = spl_dataset_get_info(a)->splats;
    assert_int_equal(splats, spl_dataset_get_info(b)->splats);
    static const char *const names[] = {"class", "uncertainty"};
    for (uint32_t id = 0; id < splats; id++) {
        struct spl_splat x = {0}, y = {0};
        assert_true(spl_dataset_find_splat(a, id, &x) && spl_dataset_find_splat(b, id, &y));
        if (painted)
            paint(id, x.color);
        assert_memory_equal(x.position, y.position, sizeof x.position);
        assert_memory_equal(x.normal, y.normal, sizeof x.normal);
        assert_memory_equal(x.color, y.color, sizeof x.color);
        assert_true(x.radius == y.radius);
        for (int i = 0; i < 2; i++) {
            double p = -1, q = -2;
            assert_true(spl_dataset_find_value(a, spl_dataset_find_stream(a, names[i]), id, &p));
            assert_true(spl_dataset_find_value(b, spl_dataset_find_stream(b, names[i]), id, &q));
            assert_true(p == q);
        }
    }
}

struct coding {
    const struct spl_dataset *from;
    const struct spl_dictionary *dictionary;
    uint32_t next, fail_at;
};

static int code_chunk(void *context, uint64_t chunk, struct spl_chunk_code *code, struct spl_error *err)
{
    struct coding *c = context;
    uint64_t count;
    assert_int_equal(chunk, c->next++);
    if (chunk == c->fail_at)
        return spl_fail(err, SPL_E_CANCELLED, "enough");
    make_code(c->dictionary, 8, 5, chunk, spl_dataset_get_chunks(c->from, &count)[chunk].count, code);
    return SPL_OK;
}

static void test_rewrite(void **state)
{
    (void)state;
    struct spl_dataset *from = some_dataset(), *to, *plain;
    uint64_t splats = spl_dataset_get_info(from)->splats;
    uint8_t(*colors)[3] = malloc(splats * sizeof *colors);
    for (uint32_t id = 0; id < splats; id++)
        paint(id, colors[id]);
    struct spl_dictionary dictionary = make_dictionary(300, 16, 1);
    struct coding coding = {.from = from, .dictionary = &dictionary, .fail_at = 3};
    json_t *about = json_pack("{s:i}", "photographs", 3);
    struct spl_rewrite what = {.from = from,
                                 .colors = (const uint8_t(*)[3])colors,
                                 .dictionary = &dictionary,
                                 .code_chunk = code_chunk,
                                 .context = &coding,
                                 .textures = about};
    struct spl_error err = {0};
    assert_int_equal(spl_dataset_rewrite(&what, path, &err), SPL_E_CANCELLED);
    assert_string_equal(err.message, "enough");
    assert_int_equal(access(path, F_OK), -1);

    coding = (struct coding){.from = from, .dictionary = &dictionary, .fail_at = UINT32_MAX};
    assert_int_equal(spl_dataset_rewrite(&what, path, NULL), SPL_OK);
    const struct spl_dataset_info *info = spl_dataset_get_info(from);
    uint64_t chunk_count;
    const struct spl_chunk *chunks = spl_dataset_get_chunks(from, &chunk_count);
    assert_int_equal(coding.next, chunk_count);
    for (int verify = 0; verify < 2; verify++) {
        assert_int_equal(spl_dataset_open(path, verify, &to, NULL), SPL_OK);
        same_splats(from, to, true);
        info = spl_dataset_get_info(to);
        assert_true(info->atoms == 300 && info->texture_size == 16 && info->has_color && info->pages == 1);
        assert_int_equal(info->dictionary_bytes, spl_dictionary_expanded_bytes(300, 16));
        const struct spl_dictionary *read = spl_dataset_get_dictionary(to);
        assert_memory_equal(read->texels, dictionary.texels, 300 * spl_texture_values(16));
        assert_memory_equal(read->scale, dictionary.scale, 300 * sizeof(float));
        assert_int_equal(
            json_integer_value(json_object_get(json_object_get(spl_dataset_get_meta(to), "textures"), "photographs")),
            3);
        uint32_t *words = malloc(spl_dataset_get_texture_bytes(to, 0));
        assert_int_equal(spl_dataset_read_textures(to, 0, words, NULL), SPL_OK);
        uint64_t bits = 0, histogram[SPL_ATOMS_MAX + 1] = {0}, wanted[SPL_ATOMS_MAX + 1] = {0};
        for (uint32_t c = 0; c < chunk_count; c++) {
            struct spl_chunk_code code, back = {0};
            make_code(&dictionary, 8, 5, c, chunks[c].count, &code);
            uint32_t texture = spl_dataset_get_chunk_textures(to)[c];
            assert_int_equal(spl_texture_planes(texture), code.planes);
            spl_texture_decode(words + spl_texture_word(texture), code.planes, chunks[c].count, &back);
            same_code(&code, &back);
            bits += code.planes ? spl_chunk_code_bits(&code) : 32;
            for (uint32_t i = 0; i < code.splats; i++)
                wanted[code.splat[i].count]++;
        }
        assert_int_equal(spl_dataset_count_atoms(to, histogram, NULL), SPL_OK);
        assert_memory_equal(histogram, wanted, sizeof wanted);
        uint64_t counted = info->attribute_bits[SPL_ATTRIBUTE_TEXTURE];
        assert_true(counted >= bits && counted <= bits + 32 * (SPL_TEXTURE_TAIL_WORDS + 16));
        assert_int_equal(info->attribute_bits[SPL_ATTRIBUTE_DICTIONARY], 8 * (16 + spl_atoms_write(&dictionary, NULL)));
        free(words);
        if (!verify)
            spl_dataset_close(to);
    }
    /* What nobody says anew stays, to the byte; and back: textures dropped, colours kept. */
    assert_int_equal(spl_dataset_rewrite(&(struct spl_rewrite){.from = to}, path, NULL), SPL_OK);
    assert_int_equal(spl_dataset_open(path, true, &plain, NULL), SPL_OK);
    assert_true(spl_dataset_get_info(plain)->version == spl_dataset_get_info(to)->version);
    spl_dataset_close(plain);
    const struct spl_rewrite bare = {.from = to, .dictionary = &(struct spl_dictionary){.count = 0}};
    assert_int_equal(spl_dataset_rewrite(&bare, path, NULL), SPL_OK);
    assert_int_equal(spl_dataset_open(path, true, &plain, NULL), SPL_OK);
    same_splats(to, plain, false);
    info = spl_dataset_get_info(plain);
    assert_true(!info->atoms && !info->dictionary_bytes && !spl_dataset_get_texture_bytes(plain, 0) &&
                !spl_dataset_get_chunk_textures(plain) && !info->attribute_bits[SPL_ATTRIBUTE_TEXTURE]);
    uint64_t histogram[SPL_ATOMS_MAX + 1] = {0};
    assert_int_equal(spl_dataset_count_atoms(plain, histogram, NULL), SPL_OK);
    assert_int_equal(histogram[0], splats);
    assert_null(json_object_get(spl_dataset_get_meta(plain), "textures"));
    spl_dataset_close(plain);
    spl_dataset_close(to);
    spl_dataset_close(from);
    spl_dictionary_finish(&dictionary);
    json_decref(about);
    free(colors);
}

static void test_bad_files(void **state)
{
    (void)state;
    struct spl_dataset *from = some_dataset(), *dataset;
    struct spl_dictionary dictionary = make_dictionary(100, 8, 2);
    make_textured_file(from, &dictionary, 4, 9, path);
    const struct spl_dataset_info info = *spl_dataset_get_info(from);
    spl_dataset_close(from);
    spl_dictionary_finish(&dictionary);
    struct spoil good = spoil_load(path);
    static const uint32_t types[] = {SPL_SECTION_ATOMS, SPL_SECTION_HEAD, SPL_SECTION_TEXTURES};
    static const char *const names[] = {"section ATOM fails its checksum", "section HEAD 0 fails its checksum",
                                        "section TEXP 0 fails its checksum"};
    for (int t = 0; t < 3; t++)
        for (uint32_t bit = 0; bit < 64; bit++) {
            struct spoil f = spoil_load(path);
            const struct spl_section *s = spoil_find(&f, types[t]);
            uint64_t at = s->bytes * 8 * bit / 64 + bit % 8;
            f.bytes[s->offset + at / 8] ^= (uint8_t)(1u << at % 8);
            spoil_store(&f, path, false);
            spoil_expect(path, names[t]);
            free(f.bytes);
            spoil_store(&good, path, false);
        }
    const uint32_t words_in_head = (uint32_t)(info.nodes * SPL_NODE_BYTES + info.chunks * SPL_CHUNK_BYTES) / 4;
    const struct {
        uint32_t type, word, value;
        const char *part;
    } rows[] = {
        {SPL_SECTION_ATOMS, 0, 0, "section ATOM has no atoms"},
        {SPL_SECTION_ATOMS, 0, 90, "section ATOM has a size that is not its atoms'"},
        {SPL_SECTION_ATOMS, 0, 101, "section ATOM ends before its atoms do"},
        {SPL_SECTION_ATOMS, 0, 0xffffffff, "section ATOM has no atoms, or more"},
        {SPL_SECTION_ATOMS, 1, 9, "section ATOM has a size of textures"},
        {SPL_SECTION_ATOMS, 1, 0, "section ATOM has a size of textures"},
        {SPL_SECTION_ATOMS, 2, 1, "section ATOM has a size of textures or a reserved"},
        {SPL_SECTION_ATOMS, 4, 0xffffffff, "section ATOM has an atom of more coefficients than texels"},
        {SPL_SECTION_ATOMS, 4, 0, "section ATOM has an atom of nothing"},
        {SPL_SECTION_HEAD, words_in_head, 0x1ffffffe, "section TEXP 0: chunk 0 starts beyond"},
        {SPL_SECTION_HEAD, words_in_head, 0x40000002, "section TEXP 0: chunk 0 "},
        {SPL_SECTION_HEAD, words_in_head, 0x90000000, "section TEXP 0: chunk 0 has no planes"},
        {SPL_SECTION_HEAD, words_in_head, 5, "section TEXP 0: chunk 0 has no planes"},
        {SPL_SECTION_TEXTURES, 0, 0xffffffff, "section TEXP 0: chunk 0 has indices"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct spoil f = spoil_load(path);
        memcpy(f.bytes + spoil_find(&f, rows[i].type)->offset + 4 * rows[i].word, &rows[i].value, 4);
        spoil_store(&f, path, true);
        spoil_expect(path, rows[i].part);
        free(f.bytes);
        spoil_store(&good, path, false);
    }
    for (int t = 0; t < 3; t += 2) { /* one kind missing: its type becomes one that readers skip */
        struct spoil f = spoil_load(path);
        spoil_find(&f, types[t])->type = SPL_FOURCC('N', 'O', 'N', 'E');
        spoil_store(&f, path, true);
        spoil_expect(path, "section table lists some of ATOM and a TEXP for each page, but not all");
        free(f.bytes);
        spoil_store(&good, path, false);
    }
    struct spoil f = spoil_load(path); /* both missing: heads then have words too many */
    spoil_find(&f, SPL_SECTION_ATOMS)->type = spoil_find(&f, SPL_SECTION_TEXTURES)->type =
        SPL_FOURCC('N', 'O', 'N', 'E');
    spoil_store(&f, path, true);
    spoil_expect(path, "section PDIR: page 0 has another number of nodes or chunks");
    spoil_store(&good, path, false);
    free(f.bytes);

    /* Opened without a look at the pages: a bad code is found when it is read. */
    f = spoil_load(path);
    f.bytes[spoil_find(&f, SPL_SECTION_TEXTURES)->offset] |= 31;
    spoil_store(&f, path, false);
    assert_int_equal(spl_dataset_open(path, false, &dataset, NULL), SPL_OK);
    uint32_t *words = malloc(spl_dataset_get_texture_bytes(dataset, 0));
    struct spl_error err = {0};
    assert_int_equal(spl_dataset_read_textures(dataset, 0, words, &err), SPL_E_CORRUPT);
    assert_non_null(strstr(err.message, "section TEXP 0: chunk 0 has indices"));
    spl_dataset_close(dataset);
    /* Overwritten in place after it was verified: found as well. */
    spoil_store(&good, path, false);
    assert_int_equal(spl_dataset_open(path, true, &dataset, NULL), SPL_OK);
    spoil_store(&f, path, false);
    err = (struct spl_error){0};
    assert_int_equal(spl_dataset_read_textures(dataset, 0, words, &err), SPL_E_CORRUPT);
    assert_non_null(strstr(err.message, "textures of page 0 was overwritten"));
    spl_dataset_close(dataset);
    free(words);
    free(f.bytes);
    free(good.bytes);
}

static int set_up(void **state)
{
    (void)state;
    make_folder(folder);
    snprintf(path, sizeof path, "%s/some.spld", folder);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_codes),        cmocka_unit_test(test_judge),     cmocka_unit_test(test_atoms),
        cmocka_unit_test(test_forged_atoms), cmocka_unit_test(test_expand),    cmocka_unit_test(test_tangent),
        cmocka_unit_test(test_rewrite),    cmocka_unit_test(test_bad_files),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
