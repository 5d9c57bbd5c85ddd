/* Canonical forms.
 *
 * Invariant: what changes a byte of the body or a header that describes it goes in; what does not stays out, and each
 * number goes in one way only (-0 as 0, the default margin as its value), so that a request written differently has the
 * same key. Fields have fixed places, a missing one is 0, so no two forms run into each other. */
#include "service/view/key.h"

#include <stdio.h>
#include <string.h>

#include <xxhash.h>

#include "geom/ray_list.h"
#include "render/method.h"

static uint64_t hash_program(void)
{
    unsigned char block[1 << 16];
    XXH3_state_t *state = XXH3_createState();
    FILE *file = fopen("/proc/self/exe", "rb");
    uint64_t hash = 0;
    if (state && XXH3_64bits_reset(state) == XXH_OK && file) {
        for (size_t n; (n = fread(block, 1, sizeof block, file)) > 0;)
            XXH3_64bits_update(state, block, n);
        hash = XXH3_64bits_digest(state);
    }
    if (file)
        fclose(file);
    XXH3_freeState(state);
    return hash;
}

uint64_t spl_renderer_hash(const struct spl_device_info *device)
{
    char text[2 * SPL_DEVICE_NAME_MAX + 96];
    int length = snprintf(text, sizeof text, "%s\n%s\n%s\n%s\n%016llx", SPLATD_VERSION, device->backend, device->name,
                          device->driver, (unsigned long long)hash_program());
    return XXH3_64bits(text, (size_t)length);
}

struct form {
    uint64_t words[128];
    size_t count;
};

static void add(struct form *form, uint64_t word)
{
    spl_assert(form->count < sizeof form->words / sizeof *form->words);
    form->words[form->count++] = word;
}

static uint64_t bits_of(double number)
{
    uint64_t word;
    number += 0.0; // -0 becomes 0
    memcpy(&word, &number, sizeof word);
    return word;
}

static void add_number(struct form *form, double number)
{
    add(form, bits_of(number));
}

static void add_camera(struct form *form, const struct spl_camera *camera)
{
    for (int i = 0; i < 3; i++)
        add_number(form, camera->eye[i]);
    for (int i = 0; i < 9; i++)
        add_number(form, camera->rotation[i]);
    add_number(form, camera->fx);
    add_number(form, camera->fy);
    add_number(form, camera->cx);
    add_number(form, camera->cy);
    add_number(form, camera->near);
    add_number(form, camera->far);
    add(form, (uint64_t)camera->width << 32 | camera->height);
    add(form, (uint64_t)camera->projection << 32 | (uint64_t)camera->lens.kind);
    for (int i = 0; camera->lens.kind && i < 9; i++)
        add_number(form, i < 6 ? camera->lens.k[i] : i < 8 ? camera->lens.p[i - 6] : camera->lens.reach);
}

/* What is soft, or drawn; another order of terms is another key. Not their text: a batch has 256 views, whose numbers
 * take longer to print than the loop has. */
static void add_terms(struct form *form, const struct spl_terms *terms)
{
    enum { name_words = (SPL_TERM_NAME_MAX + 7) / 8, term_words = 12 + name_words };
    uint64_t words[SPL_TERMS_MAX * term_words + 2 * SPL_TERMS_CORNERS_MAX] = {0}, *word = words;
    XXH128_hash_t hash = {0};
    for (uint32_t i = 0; i < terms->count; i++, word += term_words) {
        const struct spl_term *term = &terms->terms[i];
        word[0] = (uint64_t)term->measure | (uint64_t)term->corners << 8 | (uint64_t)(i ? term->joint : 0) << 32 |
                  (uint64_t)term->with_least << 40 | (uint64_t)term->with_most << 41 | (uint64_t)term->outside << 42;
        word[1] = bits_of(term->least);
        word[2] = bits_of(term->most);
        for (int k = 0; k < 9; k++)
            word[3 + k] = bits_of(term->shape[k]);
        memcpy(word + 12, term->name, strnlen(term->name, sizeof term->name));
    }
    for (uint32_t i = 0; i < 2 * terms->corner_count; i++)
        *word++ = bits_of(terms->corners[i / 2][i % 2]);
    if (terms->count)
        hash = XXH3_128bits(words, (size_t)((char *)word - (char *)words));
    add(form, hash.high64);
    add(form, hash.low64);
}

/* What it comes to, so that what is so by itself and what is asked for have one key. */
static void add_shade(struct form *form, const struct spl_shade_params *shade, uint32_t kinds)
{
    add(form, kinds);
    add_number(form, kinds & SPL_SHADE_SUN ? shade->sun[0] : 0);
    add_number(form, kinds & SPL_SHADE_SUN ? shade->sun[1] : 0);
}

/* What colours show, as text; the ramp is among the methods' parameters. */
static void add_color(struct form *form, const struct spl_color_params *color, bool painted)
{
    char text[SPL_COLOR_TEXT_MAX];
    XXH128_hash_t hash = {0};
    const bool ranged = painted && color->has_range;
    if (painted)
        hash = XXH3_128bits(text, (size_t)spl_color_print(color, text, sizeof text));
    add(form, hash.high64);
    add(form, hash.low64);
    add(form, ranged ? 4u | (uint64_t)color->shares[0] | (uint64_t)color->shares[1] << 1 : 0);
    add_number(form, ranged ? color->range[0] : 0);
    add_number(form, ranged ? color->range[1] : 0);
}

static void add_encoding(struct form *form, const struct spl_view_request *request, enum spl_layer layer)
{
    struct spl_encode_options options = spl_view_get_encoding(request, layer), *encode = &options;
    bool jpeg = encode->format == SPL_FORMAT_JPEG, webp = encode->format == SPL_FORMAT_WEBP;
    add(form, (uint64_t)layer << 32 | (uint64_t)encode->format);
    add(form, jpeg || webp ? (uint64_t)encode->quality : 0);
    add(form, jpeg ? (uint64_t)spl_encode_chroma(encode) : 0);
    bool distance = layer == SPL_LAYER_DEPTH || layer == SPL_LAYER_RANGE;
    add_number(form, encode->format == SPL_FORMAT_PNG && distance ? encode->depth_scale : 0);
}

struct spl_key spl_key_make(const struct spl_view_request *request, const struct spl_dataset_info *dataset,
                            uint64_t renderer)
{
    const struct spl_view *view = &request->view;
    const uint8_t *b = view->background;
    uint32_t background = (uint32_t)b[0] << 24 | (uint32_t)b[1] << 16 | (uint32_t)b[2] << 8 | b[3];
    struct form form = {0};
    add(&form, dataset->version);
    add(&form, renderer);
    add_camera(&form, &view->camera);
    add(&form, (uint64_t)view->method << 32 | view->layers);
    add_number(&form, view->lod);
    add_number(&form, view->supersample);
    bool colored = view->layers >> SPL_LAYER_COLOR & 1;
    const uint32_t shades = colored && !request->picks ? spl_shade_for(view, dataset) : 0;
    const bool painted = colored && !request->picks && view->color.by != SPL_COLOR_BY_RGB;
    uint32_t params = spl_method_get_params(view->method);
    for (int i = 0; i < SPL_PARAM_COUNT; i++) {
        const struct spl_method_param_info *param = spl_method_param_get(i);
        bool counts = params >> i & 1 && spl_method_param_counts(param, dataset) &&
                      (colored || param->changes != SPL_CHANGES_TEXTURES) &&
                      (shades & SPL_SHADE_EDL || param->changes != SPL_CHANGES_SHADE) &&
                      (painted || param->changes != SPL_CHANGES_COLORS) &&
                      (view->soft.what.count || param->changes != SPL_CHANGES_SOFT);
        add_number(&form, counts ? spl_view_get_param(view, i) : 0);
    }
    add_terms(&form, &view->soft.what);
    add_shade(&form, &view->shade, shades);
    add_color(&form, &view->color, painted);
    add(&form, colored ? background : 0);
    add(&form, (uint64_t)request->picks << 32 | (uint64_t)request->container);
    if (request->picks) {
        add_camera(&form, &request->pick.camera);
        add_number(&form, request->pick.x);
        add_number(&form, request->pick.y);
        add(&form, request->pick.crs);
    }
    for (unsigned layer = 0; layer < SPL_LAYER_COUNT && !request->picks; layer++)
        if (view->layers >> layer & 1)
            add_encoding(&form, request, (enum spl_layer)layer);
    if (view->rays) {
        add(&form, UINT64_MAX - 1 - request->listed);
        add(&form, view->rays->hash[0]);
        add(&form, view->rays->hash[1]);
    }
    if (view->clip.count) { // behind all else, so that keys without are those of before
        add(&form, UINT64_MAX);
        add_terms(&form, &view->clip);
    }
    if (view->surrounded)
        add(&form, UINT64_MAX - 1);
    XXH128_hash_t hash = XXH3_128bits(form.words, form.count * sizeof *form.words);
    return (struct spl_key){.words = {hash.high64, hash.low64}};
}

void spl_key_etag(const struct spl_key *key, char etag[SPL_ETAG_BYTES])
{
    snprintf(etag, SPL_ETAG_BYTES, "\"%016llx%016llx\"", (unsigned long long)key->words[0],
             (unsigned long long)key->words[1]);
}

bool spl_etag_matches(const char *list, const char *etag, bool strong)
{
    size_t length = strlen(etag);
    const char *p = list + strspn(list, " \t");
    if (*p == '*')
        return !p[1 + strspn(p + 1, " \t")];
    for (;;) {
        p += strspn(p, " \t,");
        const bool weak = !strncmp(p, "W/", 2);
        if (weak)
            p += 2;
        const char *end = *p == '"' ? strchr(p + 1, '"') : NULL;
        if (!end)
            return false;
        size_t found = (size_t)(end + 1 - p);
        p = end + 1;
        if (found == length && !(strong && weak) && !strncmp(p - found, etag, length))
            return true;
    }
}
