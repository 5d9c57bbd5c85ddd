/* Every LAZ and COPC file with a reference decodes to its records, bit for bit: SHA-256 of all of them as LAS stores
 * them, their count, the box of their integers. Prints the table. Skips without the scans. */
#include "laz_file.h"

#include <jansson.h>
#include <openssl/evp.h>

struct found {
    uint64_t points;
    int64_t min[3], max[3];
    char hash[65];
};

static int read_all(const char *path, unsigned threads, struct found *found, struct spl_error *err)
{
    struct laz_file f;
    unsigned char digest[EVP_MAX_MD_SIZE];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    *found = (struct found){.min = {INT64_MAX, INT64_MAX, INT64_MAX}, .max = {INT64_MIN, INT64_MIN, INT64_MIN}};
    EVP_DigestInit_ex(hash, EVP_sha256(), NULL);
    int code = laz_file_open(&f, path, threads, err);
    while (code == 0) {
        const uint8_t *records;
        size_t count, bytes = f.format.record_bytes;
        code = spl_laz_stream_read(f.stream, SPL_LAZ_WANT_ALL, &records, 1000, &count, err);
        if (code < 0 || count == 0)
            break;
        EVP_DigestUpdate(hash, records, count * bytes);
        found->points += count;
        for (size_t i = 0; i < count; i++)
            for (unsigned k = 0; k < 3; k++) {
                int64_t v = (int32_t)spl_le_get32(records + i * bytes + 4 * k);
                found->min[k] = v < found->min[k] ? v : found->min[k];
                found->max[k] = v > found->max[k] ? v : found->max[k];
            }
    }
    EVP_DigestFinal_ex(hash, digest, NULL);
    for (int i = 0; i < 32; i++)
        snprintf(found->hash + 2 * i, 3, "%02x", digest[i]);
    EVP_MD_CTX_free(hash);
    laz_file_close(&f);
    return code;
}

static bool agrees(const json_t *row, const struct found *found)
{
    bool same = (uint64_t)json_integer_value(json_object_get(row, "points")) == found->points;
    for (size_t k = 0; found->points && k < 3; k++) {
        same = same && json_integer_value(json_array_get(json_object_get(row, "min_int"), k)) == found->min[k];
        same = same && json_integer_value(json_array_get(json_object_get(row, "max_int"), k)) == found->max[k];
    }
    return same && strcmp(json_string_value(json_object_get(row, "sha256_records")), found->hash) == 0;
}

static void every_reference(void **state)
{
    const char *data = getenv("SPLATD_DATA");
    char path[1024], line[8192];
    unsigned rows = 0, wrong = 0;
    (void)state;
    snprintf(path, sizeof path, "%s/interchange/laz-reference.jsonl", data ? data : "");
    FILE *list = fopen(path, "r");
    if (!list)
        skip();
    while (fgets(line, sizeof line, list)) {
        json_t *row = json_loads(line, 0, NULL);
        assert_non_null(row);
        const char *name = json_string_value(json_object_get(row, "file"));
        bool shared = strncmp(name, "shared/data/", 12) == 0;
        snprintf(path, sizeof path, "%s/%s%s", data, shared ? "" : "interchange/", shared ? name + 12 : name);
        for (unsigned threads = 1; threads <= 3; threads += 2) {
            struct spl_error err = {0};
            struct found found;
            int code = read_all(path, threads, &found, &err);
            bool same = code == 0 && agrees(row, &found);
            if (threads == 1 || !same)
                printf("%-62s %2d %8llu %.12s %s %s\n", name, (int)json_integer_value(json_object_get(row, "pdrf")),
                       (unsigned long long)found.points, found.hash, same ? "equal" : "DIFFERS", err.message);
            wrong += !same;
        }
        rows++;
        json_decref(row);
    }
    fclose(list);
    printf("%u files, %u differ\n", rows, wrong);
    assert_true(rows > 50);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_reference)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
