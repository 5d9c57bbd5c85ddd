/* Terms of soft transparency: what is read is in range, and prints as a text that reads as the same terms. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <splatd/soft.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char text[SPL_TERMS_TEXT_MAX + 2], printed[SPL_TERMS_TEXT_MAX + 1];
    struct spl_soft_params soft, again;
    struct spl_error err = {0};
    size = size < sizeof text ? size : sizeof text - 1;
    memcpy(text, data, size);
    text[size] = '\0';
    memset(&soft, 0, sizeof soft);
    memset(&again, 0, sizeof again);
    int rc = spl_soft_parse(text, &soft, &err);
    if (rc ? err.code != rc || !err.message[0] || strcmp(err.field, "soft") || soft.what.count
           : err.code || !soft.what.count)
        abort();
    struct spl_terms clip, same;
    struct spl_error why = {0};
    memset(&clip, 0, sizeof clip);
    memset(&same, 0, sizeof same);
    if (!spl_terms_parse(text, "clip", &clip, &why)) {
        int bytes = spl_terms_print(&clip, printed, sizeof printed);
        if (!clip.count || bytes <= 0 || bytes > SPL_TERMS_TEXT_MAX || spl_terms_parse(printed, "clip", &same, NULL) ||
            memcmp(&clip, &same, sizeof clip) != 0)
            abort();
    } else if (strcmp(why.field, "clip") || clip.count)
        abort();
    if (rc)
        return 0;
    int length = spl_soft_print(&soft, printed, sizeof printed);
    if (spl_soft_check(&soft, NULL) || length <= 0 || length > SPL_TERMS_TEXT_MAX ||
        spl_soft_parse(printed, &again, NULL) || memcmp(&soft, &again, sizeof soft) != 0)
        abort();
    return 0;
}
