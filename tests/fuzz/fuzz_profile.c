/* Profiles: whatever is accepted must plan, and be written as it was read. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "measure/planner.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct spl_profile profile, again;
    struct spl_error err = {0};
    int rc = spl_profile_parse((const char *)data, size, "file", &profile, &err);
    if (rc ? err.code != rc || !err.message[0] || profile.points : err.code != 0)
        abort();
    if (rc)
        return 0;
    json_t *json = spl_profile_to_json(&profile);
    char *text = json_dumps(json, JSON_REAL_PRECISION(17));
    struct spl_planner planner;
    struct spl_choice choice;
    struct spl_demand demand = {.budget_ms = 50, .psnr = NAN, .width = 1280, .height = 720};
    if (!text || spl_profile_parse(text, strlen(text), "copy", &again, NULL) || again.count != profile.count ||
        spl_planner_init(&planner, &profile, NULL, NULL) || spl_planner_choose(&planner, &demand, &choice, NULL) ||
        !(choice.ms > 0) || !isfinite(choice.ms))
        abort();
    spl_planner_finish(&planner);
    spl_profile_finish(&again);
    spl_profile_finish(&profile);
    json_decref(json);
    free(text);
    return 0;
}
