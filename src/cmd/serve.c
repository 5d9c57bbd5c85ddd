/* splatd serve: the daemon. Flags come from the service's table of parameters (service/ops/params.def). */
#include "cmd/cmd.h"

#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "base/memory.h"
#include "base/near_name.h"
#include "cmd/options.h"
#include "service/service.h"

static void usage(FILE *out)
{
    fprintf(out,
            "usage: splatd serve [OPTION…] NAME.spld…|DIR|URL\n\n"
            "Answers HTTP requests for views of datasets. A dataset's id is its file's stem; a directory stands for\n"
            "the .spld files in it. A dataset may lie on a server, https://, http:// or s3://BUCKET/KEY.\n\n"
            "Serve one dataset, look at it, fetch a metric depth image:\n"
            "  splatd serve courtyard.spld\n"
            "  url=http://127.0.0.1:8080/v1/datasets/courtyard/view\n"
            "  curl -o view.jpg  $url\n"
            "  curl -o depth.png \"$url?layer=depth\"\n"
            "From somewhere else, wider, as a numpy array:\n"
            "  curl -o d.npy \"$url?eye=8,0,2&target=0,0,1&fov=70&layer=depth&format=npy\"\n"
            "With a camera of COLMAP (or OpenGL, OpenCV), as JSON:\n"
            "  curl -o view.jpg --json '{\"camera\":{\"q\":[1,0,0,0],\"t\":[0,0,5],\"fov\":60},\"width\":640}' $url\n"
            "Every dataset of a directory, on any address for those with a token, on a real GPU or not at all:\n"
            "  splatd serve --listen 0.0.0.0:8080 --tokens /etc/splatd/tokens --require-gpu /srv/scans\n"
            "A dataset on a server, read as views need it; what was read is kept on this disk:\n"
            "  splatd serve --page-cache /var/cache/splatd/pages https://scans.example/halls/hall.spld\n"
            "A free port for a test; stderr says which:\n"
            "  splatd serve --listen 127.0.0.1:0 courtyard.spld\n"
            "With parameters from a file, `name = value` a line; flags win over it:\n"
            "  splatd serve --config /etc/splatd.conf --queue 64\n\n");
    spl_parameters_print_help(out);
    fprintf(out,
            "  -l, -d, -q                  --listen, --device, --log-level warning\n"
            "  -c, --config FILE           parameters of this file, named as the flags; see --manual\n"
            "      --manual                the manual page splatd.conf(5), for man -l\n"
            "  -h, --help\n\n"
            "SIGTERM or SIGINT finishes what runs and exits 0; a second one exits at once.\n"
            "Exit code 1: the service could not go on (say, the device was lost too often); 2: bad input or usage.\n");
}

/* What getopt returns for a parameter: this, its index, and for `no` the other base. */
enum { first_parameter = 256, first_no = 4096, opt_manual = 255 };
_Static_assert((int)SPL_PARAMETERS < first_no - first_parameter, "indices and their negations do not meet");

struct flags {
    struct option *options; /* of getopt_long, closed by zeros */
    char (*negations)[64];  /* "no-verify" */
};

static int make_flags(struct flags *flags, struct spl_error *err)
{
    static const struct option own[] = {{"config", required_argument, NULL, 'c'},
                                        {"manual", no_argument, NULL, opt_manual},
                                        {"quiet", no_argument, NULL, 'q'},
                                        {"help", no_argument, NULL, 'h'}};
    size_t count = sizeof own / sizeof *own;
    flags->options = spl_alloc(2 * SPL_PARAMETERS + count + 1, sizeof *flags->options, err);
    flags->negations = spl_alloc(SPL_PARAMETERS, sizeof *flags->negations, err);
    if (!flags->options || !flags->negations)
        return SPL_E_NOMEM;
    memcpy(flags->options, own, sizeof own);
    for (int i = 0; i < SPL_PARAMETERS; i++) {
        const struct spl_parameter *p = &spl_parameters[i];
        bool flag = p->type == SPL_PARAMETER_FLAG;
        flags->options[count++] =
            (struct option){p->name, flag ? no_argument : required_argument, NULL, first_parameter + i};
        if (!flag)
            continue;
        snprintf(flags->negations[i], sizeof flags->negations[i], "no-%s", p->name);
        flags->options[count++] = (struct option){flags->negations[i], no_argument, NULL, first_no + i};
    }
    return 0;
}

static void free_flags(struct flags *flags)
{
    free(flags->options);
    free(flags->negations);
}

static int set(struct spl_service_options *o, size_t index, const char *text, struct spl_error *err)
{
    return spl_service_options_set(o, index, text, SPL_FROM_FLAG, "--", err);
}

/* What getopt does not take; `text` of the command line. */
static int refuse(int why, const char *text, struct spl_error *err)
{
    const char *names[SPL_PARAMETERS + 3], *near = NULL;
    size_t count = 0;
    for (int i = 0; i < SPL_PARAMETERS; i++)
        names[count++] = spl_parameters[i].name;
    names[count++] = "config";
    names[count++] = "manual";
    names[count] = NULL;
    bool unknown = why == '?' && (!optopt || optopt < opt_manual);
    if (unknown && !optopt)
        near = spl_near_name_find(text, names);
    return spl_fail(err, SPL_E_USAGE, "'%.80s' %s; %s%s%s'splatd serve --help' shows how", text,
                    why == ':' ? "needs a value" : unknown ? "is no option of serve" : "takes no value",
                    near ? "did you mean --" : "", near ? near : "", near ? "? " : "");
}

/* One flag of the command line, `text` of it. */
static int apply(struct spl_service_options *o, int option, const char *text, struct spl_error *err)
{
    char letter[] = {'-', (char)optopt, '\0'};
    switch (option) {
    case 'l':
        return set(o, SPL_PARAMETER_listen, optarg, err);
    case 'd':
        return set(o, SPL_PARAMETER_device, optarg, err);
    case 'q':
        return set(o, SPL_PARAMETER_log_level, "warning", err);
    case 'c':
        return spl_service_options_read(o, optarg, err);
    case ':':
    case '?': // optopt: the letter, or what a known name stands for
        if (optopt && optopt < opt_manual)
            text = letter;
        return refuse(option, text, err);
    default:
        return option >= first_no ? set(o, (size_t)(option - first_no), "false", err)
                                  : set(o, (size_t)(option - first_parameter), optarg ? optarg : "true", err);
    }
}

/* 1 when there is nothing more to do, 0 to serve, or an error. */
static int parse(struct spl_service_options *o, int argc, char **argv, const struct option *options,
                 struct spl_error *err)
{
    opterr = 0; // said by apply(), in the log's format
    for (int c; (c = getopt_long(argc, argv, ":l:d:c:qh", options, NULL)) >= 0;) {
        if (c == 'h') {
            usage(stdout);
            return 1;
        }
        if (c == opt_manual) {
            spl_parameters_print_manual(stdout);
            return 1;
        }
        int rc = apply(o, c, argv[optind - 1], err);
        if (rc)
            return rc;
    }
    for (; optind < argc; optind++) {
        int rc = set(o, SPL_PARAMETER_datasets, argv[optind], err);
        if (rc)
            return rc;
    }
    return o->datasets.count ? 0
                             : spl_fail(err, SPL_E_USAGE,
                                      "serve needs at least one NAME.spld or a directory of them: splatd serve "
                                      "hall.spld; 'splatd serve --help' shows more");
}

/* Puts before an error's message where the parameter at fault was set, unless it says so itself. */
static void locate(const struct spl_service_options *o, struct spl_error *err)
{
    struct spl_error bare = *err;
    char where[300];
    spl_service_options_locate(o, bare.field, where, sizeof where);
    if (!*where || !strncmp(bare.message, where, strlen(where)))
        return;
    bool named = strstr(bare.message, bare.field);
    *err = (struct spl_error){0};
    spl_fail_field(err, bare.code, bare.field, "%s%s%s%s", where, named ? "" : bare.field, named ? "" : ": ",
                   bare.message);
}

int spl_cmd_serve(int argc, char **argv)
{
    struct spl_service_options o;
    struct flags flags = {0};
    struct spl_error err = {0};
    signal(SIGHUP, SIG_IGN); // until it is heeded: whoever sends one so early wants read what is not read yet
    int rc = spl_service_options_init(&o, &err);
    if (!rc)
        rc = make_flags(&flags, &err);
    if (!rc)
        rc = parse(&o, argc, argv, flags.options, &err);
    spl_log_set_level((enum spl_log_level)o.log_level);
    spl_log_set_format((enum spl_log_format)o.log_format); // also for what parse() has found wrong after it
    if (!rc && (rc = spl_service_run(&o, &err)) < 0)
        locate(&o, &err); // what parse() refuses says itself whether a line or a flag is at fault
    int code = rc < 0 ? spl_cmd_fail(&err) : 0;
    for (size_t i = 0; i < o.mistakes; i++)
        spl_cmd_fail(&o.mistake[i]);
    free_flags(&flags);
    spl_service_options_finish(&o);
    return code;
}
