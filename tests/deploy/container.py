"""deploy/Dockerfile, packages.txt, container.conf, splatd.conf, splatd.service and .dockerignore against each other and
the daemon: sections of packages, libraries of the binary, user, ports, paths, probe and signal.

usage: container.py [BINARY]     with the binary, its libraries are looked up too"""
import fnmatch
import json
import pathlib
import re
import shutil
import subprocess
import sys

from facts import ROOT, find, packages, run

DOCKERFILE, CONF, UNIT, IGNORE = (
    "deploy/Dockerfile",
    "deploy/container.conf",
    "deploy/splatd.service",
    ".dockerignore",
)
DPKG = pathlib.Path("/var/lib/dpkg/info")
binary = sys.argv[1] if len(sys.argv) > 1 else None


def instructions(text):
    """[(NAME, rest)] of each stage of a Dockerfile."""
    text = re.sub(r"\\\n", " ", re.sub(r"^#.*\n", "", text, flags=re.M))
    stages = []
    for line in filter(None, map(str.strip, text.split("\n"))):
        name, rest = line.split(None, 1)
        if name == "FROM":
            stages.append([])
        stages[-1].append((name, rest))
    return stages


def is_ignored(path, patterns):
    """As docker build does for what .dockerignore holds: '*', '**/', '!', the last match wins."""
    ignored = False
    for pattern in patterns:
        keep, pattern = pattern.startswith("!"), pattern.lstrip("!")
        parts = path.split("/")
        heads = ["/".join(parts[: n + 1]) for n in range(len(parts))]
        hit = pattern == "*" or any(
            fnmatch.fnmatch(head, pattern)
            or pattern.startswith("**/")
            and fnmatch.fnmatch(head.rsplit("/", 1)[-1], pattern[3:])
            for head in heads
        )
        ignored = not keep if hit else ignored
    return ignored


def needed_libraries():
    """What the binary names itself, sanitisers' libraries aside."""
    dynamic = subprocess.run(["readelf", "-d", binary], capture_output=True, text=True, check=True).stdout
    return [name for name in re.findall(r"NEEDED.*\[(.*)\]", dynamic) if not re.match(r"lib((a|t|l|ub)san|gcc_s)\b", name)]


def libraries_of(package):
    """Names of the libraries that an installed package of Debian has; none when it is not installed."""
    lists = [path for pattern in (f"{package}.list", f"{package}:*.list") for path in DPKG.glob(pattern)]
    return {line.rsplit("/", 1)[-1] for path in lists for line in path.read_text().splitlines() if ".so" in line}


libraries = needed_libraries() if binary and shutil.which("readelf") and DPKG.is_dir() else []


def check(tree):
    wrong = []

    def expect(condition, message):
        if not condition:
            wrong.append(message)

    lists, stages = packages(tree.read("deploy/packages.txt")), instructions(tree.read(DOCKERFILE))
    conf, host, ignore = tree.config(CONF), tree.config("deploy/splatd.conf"), tree.read(IGNORE)
    unit = dict(re.findall(r"^(\w+)=(.*)$", tree.read(UNIT), re.M))
    patterns = [line for line in ignore.split("\n") if line and line[0] != "#"]
    build, image = stages
    final, runs = dict(image), [rest for name, rest in image if name == "RUN"]

    # Packages: one list, whose sections the three who read it know.
    for path in (DOCKERFILE, "deploy/quickstart.sh", "tests/run.sh"):
        asked = re.findall(r"install-packages\.sh\"?((?: [a-z]+)+)", tree.read(path))
        expect(asked and all(set(words.split()) <= set(lists) for words in asked), f"{path}: sections {asked}")
    installs = [
        re.findall(r"install-packages\.sh ([a-z ]+)", rest) for stage in stages for name, rest in stage if name == "RUN"
    ]
    expect(
        [words[0].split() for words in installs if words] == [["build"], ["run"]], f"{DOCKERFILE}: installs {installs}"
    )
    expect("apt-get install" not in tree.read(DOCKERFILE), f"{DOCKERFILE}: a package beside packages.txt")
    there = set().union(*(libraries_of(package) for package in lists["run"] | {"libc6"}))
    for library in libraries:
        expect(library in there, f"packages.txt, run: nothing has {library}")

    # What the context lets through.
    tops = set(re.findall(r"^subdir\('(\w+)'\)", tree.read("meson.build"), re.M)) - {"tests"}
    needed = [f"{top}/meson.build" for top in tops | {"tests"}] + ["meson.build", "meson_options.txt", "include/splatd"]
    needed += [
        source
        for stage in stages
        for name, rest in stage
        if name == "COPY" and "--from" not in rest
        for source in rest.split()[:-1]
        if source != "."
    ]
    for path in needed:
        expect((ROOT / path).exists(), f"{DOCKERFILE}: no {path}")
        expect(not is_ignored(path, patterns), f"{IGNORE} keeps {path} out of the image")
    for path in (
        ".git/config",
        "build/src/splatd",
        "quickstart/courtyard.spld",
        "tests/run.sh",
        "deploy/x.spld",
        "url.key",
    ):
        expect(is_ignored(path, patterns), f"{IGNORE} lets {path} into the image")

    # Who it runs as, where it listens, what it reads and writes.
    user = final["USER"]
    expect(re.fullmatch(r"[1-9]\d+:[1-9]\d+", user), f"{DOCKERFILE}: USER {user} is no number but 0")
    expect(f"useradd -u {user.split(':')[0]} " in " ".join(runs), f"{DOCKERFILE}: nobody has the number {user}")
    expect(set(conf) <= set(tree.parameters()), f"{CONF}: unknown {set(conf) - set(tree.parameters())}")
    loaded = set(re.findall(r"^#?LoadCredential=([^:]+):", tree.read(UNIT), re.M))
    named = set(re.findall(r"/run/credentials/splatd\.service/(\S+)$", tree.read("deploy/splatd.conf"), re.M))
    expect(loaded == named and named, f"{UNIT} brings {loaded}, and deploy/splatd.conf names {named}")
    expect(unit.get("RestartPreventExitStatus") == "2", f"{UNIT}: what would fail again is tried again")
    expect(set(host) <= set(tree.parameters()), f"deploy/splatd.conf: unknown {set(host) - set(tree.parameters())}")
    ports = [conf[name].rsplit(":", 1)[1] for name in ("listen", "ops-listen")]
    expect(
        ports
        == [host[name].rsplit(":", 1)[1] for name in ("listen", "ops-listen")]
        == [tree.parameters()[name].rsplit(":", 1)[1] for name in ("listen", "ops-listen")],
        f"{CONF}: ports {ports}",
    )
    expect(
        all(conf[name].startswith("0.0.0.0:") for name in ("listen", "ops-listen")), f"{CONF}: not reached from outside"
    )
    expect(not {"allow-anonymous", "tokens"} & set(conf), f"{CONF}: whom it lets in is the operator's word")
    expect(final["EXPOSE"].split() == ports, f"{DOCKERFILE}: EXPOSE {final['EXPOSE']}, not {ports}")
    expect(f"/dev/tcp/127.0.0.1/{ports[1]} " in final["HEALTHCHECK"], f"{DOCKERFILE}: HEALTHCHECK asks another port")
    path = re.search(r"GET (\S+) ", final["HEALTHCHECK"])[1]
    expect(path == "/healthz" and f'"{path}"' in tree.read(find("ops.c")), f"{DOCKERFILE}: HEALTHCHECK asks for {path}")
    json.loads(final["HEALTHCHECK"].split("CMD", 1)[1])
    data = conf["dataset"]
    expect(
        data == host["dataset"] == final["VOLUME"] == unit["ReadOnlyPaths"], f"datasets: {data}, {final['VOLUME']}, …"
    )
    command = json.loads(final["ENTRYPOINT"]) + json.loads(final["CMD"])
    expect(unit["ExecStart"].split() == command, f"{DOCKERFILE} runs {command}, {UNIT} {unit['ExecStart']}")
    expect(
        any(name == "COPY" and rest.split() == [CONF, command[-1]] for name, rest in image),
        f"{DOCKERFILE}: {CONF} is not {command[-1]}",
    )
    environment = dict(word.split("=", 1) for name, rest in image if name == "ENV" for word in rest.split())
    for folder in [data] + [value for value in environment.values() if value.startswith("/")]:
        expect(re.search(rf"install -d .* {folder}\b", " ".join(runs)), f"{DOCKERFILE}: nobody makes {folder}")
    expect(
        {f"{name}={value}" for name, value in environment.items() if "/" in value} == set(unit["Environment"].split()),
        f"{DOCKERFILE}, {UNIT}: {environment} against {unit['Environment']}",
    )
    expect(
        "graphics" in environment["NVIDIA_DRIVER_CAPABILITIES"].split(","),
        f"{DOCKERFILE}: no Vulkan from NVIDIA's toolkit",
    )
    expect(final["STOPSIGNAL"] == "SIGTERM", f"{DOCKERFILE}: STOPSIGNAL {final['STOPSIGNAL']} does not drain")
    expect(
        {rest.split()[0] for stage in stages for name, rest in stage if name == "FROM"} == {"debian:bookworm-slim"},
        f"{DOCKERFILE}: the packages are Debian 12's",
    )
    return wrong


PLANTED = [
    (DOCKERFILE, "install-packages.sh run", "install-packages.sh runtime"),
    (DOCKERFILE, "install-packages.sh run", "install-packages.sh build"),
    (DOCKERFILE, "USER 10001:10001", "USER root"),
    (DOCKERFILE, "USER 10001:10001", "USER 10002:10002"),
    (DOCKERFILE, "EXPOSE 8080 8081", "EXPOSE 8080"),
    (DOCKERFILE, "127.0.0.1/8081", "127.0.0.1/8080"),
    (DOCKERFILE, "GET /healthz", "GET /health"),
    (DOCKERFILE, "VOLUME /srv/splatd", "VOLUME /data"),
    (DOCKERFILE, "STOPSIGNAL SIGTERM", "STOPSIGNAL SIGKILL"),
    (DOCKERFILE, "COPY deploy/container.conf", "COPY deploy/splatd.conf"),
    (DOCKERFILE, "/var/lib/splatd /var/cache/splatd", "/var/lib/splatd"),
    (DOCKERFILE, "graphics,utility", "compute,utility"),
    (CONF, "dataset = ", "datasets = "),
    (CONF, "8081", "9090"),
    (CONF, "log-format = json", "allow-anonymous = true"),
    (UNIT, "--config /etc/splatd/splatd.conf", "--config /etc/splatd.conf"),
    (UNIT, "ReadOnlyPaths=/srv/splatd", "ReadOnlyPaths=/srv/scans"),
    (UNIT, "RestartPreventExitStatus=2", "RestartPreventExitStatus=1"),
    (UNIT, "LoadCredential=url.key:", "LoadCredential=key:"),
    ("deploy/quickstart.sh", "build run quickstart", "build runtime"),
    (IGNORE, "!shaders", "!shader"),
    (IGNORE, "*\n!LICENSE", "!LICENSE"),
    *([("deploy/packages.txt", "run   libuv1\n", "")] if libraries else []),
]
run(check, PLANTED)
