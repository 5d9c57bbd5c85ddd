/* Where a result goes: a file as a whole, or what takes bytes as they come. Owned by the command's thread. */
#include "cmd/output.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <splatd/image.h>

#include "base/file.h"
#include "base/text.h"

int spl_cmd_write_output(const char *path, const void *bytes, size_t length, struct spl_error *err)
{
    if (!strcmp(path, "-"))
        return spl_write_all(STDOUT_FILENO, bytes, length) ? spl_fail_errno(err, errno, "cannot write 'stdout'")
                                                           : SPL_OK;
    struct stat status;
    if (stat(path, &status) || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode)) {
        spl_file_sweep_beside(path);
        return spl_file_replace(path, bytes, length, err);
    }
    int fd = open(path, O_WRONLY | O_CLOEXEC);
    if (fd < 0)
        return spl_fail_errno(err, errno, "cannot write '%s'", path);
    int rc = spl_write_all(fd, bytes, length) ? spl_fail_errno(err, errno, "cannot write '%s'", path) : SPL_OK;
    close(fd);
    return rc;
}

void spl_cmd_put_text(FILE *out, const char *text, int width)
{
    size_t length;
    bool printable;
    for (; (length = spl_text_next(text, &printable)); text += length, width--)
        fprintf(out, "%.*s", printable ? (int)length : 1, printable ? text : "?");
    for (; width > 0; width--)
        fputc(' ', out);
}

void spl_cmd_put_row(const char *label, const char *text)
{
    printf("  %-14s", label);
    spl_cmd_put_text(stdout, text, 0);
    putchar('\n');
}

const char *spl_cmd_group(uint64_t value, char text[32])
{
    char digits[24];
    int length = snprintf(digits, sizeof digits, "%" PRIu64, value), used = 0;
    for (int i = 0; i < length; i++) {
        if (i && (length - i) % 3 == 0)
            text[used++] = ',';
        text[used++] = digits[i];
    }
    text[used] = 0;
    return text;
}

const char *spl_cmd_ending(const char *path)
{
    const char *slash = strrchr(path, '/'), *name = slash ? slash + 1 : path, *dot = strrchr(name, '.');
    return dot && dot > name && strcmp(name, "..") ? dot + 1 : "";
}

int spl_cmd_format_of(const char *path)
{
    char name[8];
    size_t n = 0;
    for (const char *p = spl_cmd_ending(path); *p && n + 1 < sizeof name; p++)
        name[n++] = (char)tolower((unsigned char)*p);
    name[n] = 0;
    return spl_format_from_name(name);
}

int spl_cmd_check_png(const char *option, const char *path, struct spl_error *err)
{
    struct stat status;
    if (!strcasecmp(spl_cmd_ending(path), "png") || !strcmp(path, "-") ||
        (!stat(path, &status) && !S_ISREG(status.st_mode) && !S_ISDIR(status.st_mode)))
        return SPL_OK;
    return spl_fail(err, SPL_E_USAGE, "%s writes a .png file, so its name ends like one: %s NAME.png, not '%s'", option,
                    option, path);
}

int spl_cmd_check_dataset(const char *command, const char *path, struct spl_error *err)
{
    struct stat status;
    if (!path)
        return spl_fail(err, SPL_E_USAGE, "%s needs a dataset to write: -o NAME.spld", command);
    if (strcmp(spl_cmd_ending(path), "spld"))
        return spl_fail(err, SPL_E_USAGE, "%s writes a dataset, whose name ends in .spld: -o NAME.spld, not '%.300s'",
                        command, path);
    if (!stat(path, &status) && !S_ISREG(status.st_mode))
        return spl_fail(err, SPL_E_USAGE, "%s writes a dataset: %.300s exists and is no file", command, path);
    return SPL_OK;
}

/* Of a format: "avi", "mp4", "7z"; not the "5" of "lod-1.5". */
static bool is_of_a_file(const char *ending)
{
    size_t letters = 0, length = strlen(ending);
    for (size_t i = 0; i < length; i++) {
        if (!isalnum((unsigned char)ending[i]))
            return false;
        letters += isalpha((unsigned char)ending[i]) != 0;
    }
    return letters && length <= 5;
}

int spl_cmd_check_folder(const char *path, const char *takes, struct spl_error *err)
{
    struct stat status;
    if (!*path || !strcmp(path, "-"))
        return spl_fail(err, SPL_E_USAGE, "-o takes %s, not '%s'", takes, path);
    if (!stat(path, &status))
        return S_ISDIR(status.st_mode)
                   ? SPL_OK
                   : spl_fail(err, SPL_E_USAGE, "-o takes %s, and '%s' is a file", takes, path);
    if (is_of_a_file(spl_cmd_ending(path)))
        return spl_fail(err, SPL_E_USAGE, "-o takes %s: give '%s' without .%s, or a slash behind it if it is a folder",
                        takes, path, spl_cmd_ending(path));
    return SPL_OK;
}
