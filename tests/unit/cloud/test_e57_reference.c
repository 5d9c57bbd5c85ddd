/* Every E57 file with a reference gives what the reference says: count and valid points of each scan, their fields, box
 * and colours, and the images. Prints the table. Skips without the scans. */
#include "cloud_test.h"

#include <jansson.h>
#include <math.h>

#include "cloud/e57/points.h"

enum { ROWS = 1000 };

static const char *fields_of(const struct spl_e57_scan *scan, char text[64])
{
    static const struct {
        const char *name;
        enum spl_e57_role role;
    } known[] = {{"xyz ", SPL_E57_X}, {"sph ", SPL_E57_RANGE}};
    *text = 0;
    for (int i = 0; i < 2; i++)
        if (spl_e57_have3(scan, known[i].role))
            strcat(text, known[i].name);
    if (scan->field[SPL_E57_STATE] >= 0 || scan->field[SPL_E57_SPHERICAL_STATE] >= 0)
        strcat(text, "inv ");
    if (scan->field[SPL_E57_INTENSITY] >= 0)
        strcat(text, "int ");
    if (spl_e57_have3(scan, SPL_E57_RED))
        strcat(text, "rgb ");
    if (scan->field[SPL_E57_ROW] >= 0)
        strcat(text, "rc ");
    if (spl_e57_have3(scan, SPL_E57_NX))
        strcat(text, "nor ");
    return text;
}

/* Sums of the raw colours of all points of a scan, those that the reference counts. */
static int sum_colors(struct spl_e57_points *points, const struct spl_e57_scan *scan, double sum[3],
                      struct spl_error *err)
{
    static double value[3][ROWS], state[ROWS];
    enum spl_e57_role of = spl_e57_have3(scan, SPL_E57_X) ? SPL_E57_STATE : SPL_E57_SPHERICAL_STATE;
    int code = spl_e57_points_begin(points, scan, err);
    memset(state, 0, sizeof state);
    while (code == 0 && points->next < scan->points) {
        size_t count = scan->points - points->next < ROWS ? (size_t)(scan->points - points->next) : ROWS;
        for (unsigned k = 0; code == 0 && k < 3; k++)
            code = spl_e57_points_read(points, SPL_E57_RED + k, value[k], count, err);
        if (code == 0 && scan->field[of] >= 0)
            code = spl_e57_points_read(points, of, state, count, err);
        for (size_t i = 0; code == 0 && i < count; i++)
            for (int k = 0; k < 3 && state[i] == 0; k++)
                sum[k] += value[k][i];
        spl_e57_points_take(points, count);
    }
    return code;
}

struct found {
    uint64_t valid;
    double min[3], max[3];
};

/* The scans one after the other, as the reader of clouds gives them: the counts of the reference say where one ends. */
static bool check_scans(const char *path, const struct spl_e57_document *document, struct spl_e57_points *points,
                        const json_t *rows, char *why)
{
    static struct spl_point_batch batch;
    struct spl_cloud *cloud = NULL;
    struct spl_error err = {0};
    bool good = json_array_size(rows) == document->scan_count;
    if (!batch.capacity)
        assert_int_equal(spl_point_batch_init(&batch, 1, NULL), 0);
    if (!good || spl_cloud_open(path, NULL, &cloud, &err)) {
        sprintf(why, "%zu scans; %.200s", document->scan_count, err.message);
        return false;
    }
    for (size_t s = 0; good && s < document->scan_count; s++) {
        const struct spl_e57_scan *scan = &document->scans[s];
        const json_t *row = json_array_get(rows, s), *sums = json_object_get(row, "rgbsum");
        uint64_t valid = (uint64_t)json_integer_value(json_object_get(row, "valid"));
        struct found f = {.min = {INFINITY, INFINITY, INFINITY}, .max = {-INFINITY, -INFINITY, -INFINITY}};
        char fields[64];
        double sum[3] = {0};
        int code = 0;
        good = scan->points == (uint64_t)json_integer_value(json_object_get(row, "count")) &&
               !strcmp(fields_of(scan, fields), json_string_value(json_object_get(row, "fields")));
        for (; good && f.valid < valid && (code = spl_cloud_read(cloud, &batch, &err)) > 0; f.valid += batch.count)
            for (int k = 0; k < 3; k++) {
                f.min[k] = fmin(f.min[k], batch.position[0][k]);
                f.max[k] = fmax(f.max[k], batch.position[0][k]);
            }
        good = good && f.valid == valid;
        for (size_t k = 0; good && valid && k < 3; k++) {
            double least = json_number_value(json_array_get(json_object_get(row, "min"), k)),
                   most = json_number_value(json_array_get(json_object_get(row, "max"), k));
            good =
                fabs(least - f.min[k]) <= 1e-8 * (1 + fabs(least)) && fabs(most - f.max[k]) <= 1e-8 * (1 + fabs(most));
        }
        if (good && sums)
            good = sum_colors(points, scan, sum, &err) == 0;
        for (size_t k = 0; good && sums && k < 3; k++)
            good = sum[k] == json_number_value(json_array_get(sums, k));
        sprintf(why + strlen(why), "%s%llu of %llu %s", s ? "; " : "", (unsigned long long)f.valid,
                (unsigned long long)scan->points, fields);
    }
    if (good && spl_cloud_read(cloud, &batch, &err) != 0)
        good = false;
    spl_cloud_destroy(cloud);
    return good;
}

static bool check_images(const struct spl_e57_document *document, const json_t *rows)
{
    bool good = json_array_size(rows) == document->image_count;
    for (size_t i = 0; good && i < document->image_count; i++) {
        const struct spl_e57_image *image = &document->images[i];
        const json_t *row = json_array_get(rows, i);
        const long long is[5] = {image->kind, image->coding, (long long)image->width, (long long)image->height,
                                 (long long)image->bytes};
        static const char *const names[5] = {"proj", "type", "w", "h", "bytes"};
        for (int k = 0; k < 5; k++)
            good = good && json_integer_value(json_object_get(row, names[k])) == is[k];
        good = good && json_is_true(json_object_get(row, "assoc")) == (image->scan_guid[0] != 0);
    }
    return good;
}

static bool check_row(const char *data, const json_t *row)
{
    const char *file = json_string_value(json_object_get(row, "file"));
    const char *error = json_string_value(json_object_get(row, "error"));
    char path[1024], why[4096] = "";
    struct spl_source source;
    struct spl_e57_pages pages = {0};
    struct spl_e57_document document = {0};
    struct spl_e57_points points = {0};
    struct spl_error err = {0};
    bool good;
    snprintf(path, sizeof path, "%s/%s", data, file);
    if (!strncmp(file, "shared/data/", 12))
        snprintf(path, sizeof path, "%s/%s", data, file + 12);
    else
        snprintf(path, sizeof path, "%s/interchange/%s", data, file);
    int code = spl_source_open(&source, path, &err);
    if (!code)
        code = spl_e57_pages_init(&pages, &source, &err);
    if (!code)
        code = spl_e57_document_read(&document, &pages, &err);
    if (!code)
        code = spl_e57_points_init(&points, &pages, &document, &err);
    if (code || error) {
        struct loaded l;
        load_path(path, NULL, 100, &l);
        good = error && l.code == SPL_E_INPUT && strstr(l.err.message, strrchr(path, '/') + 1);
        snprintf(why, sizeof why, "refused: %.180s", strrchr(l.err.message, '/') ? strrchr(l.err.message, '/') : "");
        loaded_finish(&l);
    } else {
        good = check_scans(path, &document, &points, json_object_get(row, "scans"), why) &&
               check_images(&document, json_object_get(row, "images"));
        sprintf(why + strlen(why), "; %zu images", document.image_count);
    }
    printf("%-5s %-58s %s\n", good ? "same" : "WRONG", file, why);
    spl_e57_points_finish(&points);
    spl_e57_document_finish(&document);
    spl_e57_pages_finish(&pages);
    spl_source_close(&source);
    return good;
}

static void every_reference(void **state)
{
    const char *data = getenv("SPLATD_DATA");
    char path[1024], line[8192];
    unsigned rows = 0, wrong = 0;
    (void)state;
    snprintf(path, sizeof path, "%s/interchange/e57-reference.jsonl", data ? data : "");
    FILE *list = fopen(path, "r");
    if (!list)
        exit(77);
    for (; fgets(line, sizeof line, list); rows++) {
        json_t *row = json_loads(line, 0, NULL);
        wrong += !check_row(data, row);
        json_decref(row);
    }
    fclose(list);
    assert_true(rows > 30);
    assert_int_equal(wrong, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(every_reference)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
