/* splatd serve: the daemon. */
#include "cmd/cmd.h"

#include <getopt.h>
#include <stdio.h>

#include "base/log.h"
#include "cmd/options.h"
#include "service/service.h"

static void usage(FILE *out)
{
    fprintf(out,
            "usage: splatd serve [OPTION…] NAME.spld…|DIR\n\n"
            "Answers HTTP requests for views of datasets. A dataset's id is its file's stem; a directory stands for\n"
            "the .spld files in it.\n\n"
            "Serve one dataset, look at it, fetch a metric depth image:\n"
            "  splatd serve courtyard.spld\n"
            "  url=http://127.0.0.1:8080/v1/datasets/courtyard/view\n"
            "  curl -o view.jpg  $url\n"
            "  curl -o depth.png \"$url?layer=depth\"\n"
            "From somewhere else, wider, as a numpy array:\n"
            "  curl -o d.npy \"$url?eye=8,0,2&target=0,0,1&fov=70&layer=depth&format=npy\"\n"
            "With a camera of COLMAP (or OpenGL, OpenCV), as JSON:\n"
            "  curl -o view.jpg --json '{\"camera\":{\"q\":[1,0,0,0],\"t\":[0,0,5],\"fov\":60},\"width\":640}' $url\n"
            "Every dataset of a directory, on any address, on a real GPU or not at all:\n"
            "  splatd serve --listen 0.0.0.0:8080 --require-gpu /srv/scans\n"
            "A free port for a test; stderr says which:\n"
            "  splatd serve --listen 127.0.0.1:0 courtyard.spld\n\n");
    fprintf(out,
            "  -l, --listen ADDR:PORT    default 127.0.0.1:8080; IPv6 as [::1]:8080; port 0 takes a free one\n"
            "  -d, --device D            auto, vulkan, egl, vulkan:1, a UUID or part of a name: see 'splatd devices'\n"
            "      --require-gpu         refuse software drivers\n"
            "      --memory-limit BYTES  of device memory (default: 3/4 of what the device reports)\n"
            "      --queue N             views that may wait, 1 to 4096 (default 32); beyond: 503 and Retry-After\n"
            "      --deadline MS         for a view to be ready, 1 to 600000 (default 10000); beyond: 503\n"
            "      --encoders N          threads that encode images, 1 to 16 (default 2)\n"
            "      --max-pixels N        of an image (default 67108864); sides go to %d\n"
            "      --no-verify           trust the datasets' checksums: faster start\n"
            "  -q, --quiet               only warnings and errors on stderr\n\n"
            "SIGTERM or SIGINT finishes what runs and exits 0; a second one exits at once.\n"
            "Exit code 1: the service could not go on (say, the device was lost too often); 2: bad input or usage.\n",
            SPL_SERVICE_SIDE_MAX);
}

enum { opt_require_gpu = 256, opt_memory, opt_queue, opt_deadline, opt_encoders, opt_pixels, opt_no_verify };

static const struct option options[] = {
    {"listen", required_argument, NULL, 'l'},
    {"device", required_argument, NULL, 'd'},
    {"require-gpu", no_argument, NULL, opt_require_gpu},
    {"memory-limit", required_argument, NULL, opt_memory},
    {"queue", required_argument, NULL, opt_queue},
    {"deadline", required_argument, NULL, opt_deadline},
    {"encoders", required_argument, NULL, opt_encoders},
    {"max-pixels", required_argument, NULL, opt_pixels},
    {"no-verify", no_argument, NULL, opt_no_verify},
    {"quiet", no_argument, NULL, 'q'},
    {"help", no_argument, NULL, 'h'},
    {0},
};

static int apply(struct spl_service_options *o, int option, struct spl_error *err)
{
    uint64_t count = 0;
    int rc = 0;
    switch (option) {
    case 'l':
        o->listen = optarg;
        return 0;
    case 'd':
        o->renderer.device = optarg;
        return 0;
    case opt_require_gpu:
        o->renderer.require_gpu = true;
        return 0;
    case opt_memory:
        return spl_cmd_parse_count("--memory-limit", optarg, 1 << 20, UINT64_MAX, &o->renderer.memory_limit, err);
    case opt_queue:
        rc = spl_cmd_parse_count("--queue", optarg, 1, 4096, &count, err);
        o->queue = count;
        return rc;
    case opt_deadline:
        rc = spl_cmd_parse_count("--deadline", optarg, 1, 600000, &count, err);
        o->deadline_ms = (unsigned)count;
        return rc;
    case opt_encoders:
        rc = spl_cmd_parse_count("--encoders", optarg, 1, 16, &count, err);
        o->encoders = (unsigned)count;
        return rc;
    case opt_pixels:
        return spl_cmd_parse_count("--max-pixels", optarg, 1, (uint64_t)SPL_SERVICE_SIDE_MAX * SPL_SERVICE_SIDE_MAX,
                                   &o->pixels_max, err);
    case opt_no_verify:
        o->verify = false;
        return 0;
    case 'q':
        spl_log_set_level(SPL_LOG_WARN);
        return 0;
    default:
        return SPL_E_USAGE; // getopt has said why
    }
}

int spl_cmd_serve(int argc, char **argv)
{
    struct spl_service_options o;
    struct spl_error err = {0};
    spl_service_options_init(&o);
    for (int c; (c = getopt_long(argc, argv, "l:d:qh", options, NULL)) >= 0;) {
        if (c == 'h') {
            usage(stdout);
            return 0;
        }
        if (!apply(&o, c, &err))
            continue;
        if (err.code)
            return spl_cmd_fail(&err);
        fprintf(stderr, "'splatd serve --help' shows how\n");
        return 2;
    }
    if (optind == argc) {
        fprintf(stderr, "splatd: serve needs at least one NAME.spld or a directory of them\n");
        return 2;
    }
    o.paths = argv + optind;
    o.path_count = (size_t)(argc - optind);
    int rc = spl_service_run(&o, &err);
    return rc ? spl_cmd_fail(&err) : 0;
}
