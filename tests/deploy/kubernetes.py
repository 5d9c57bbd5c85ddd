"""deploy/kubernetes as kubectl renders it, each overlay with and without the components: shapes of the objects, and
everything that must agree: ports, probes, selectors, volumes, user, configuration, times and memory, the metric that
scales, the variable that the ingress hashes by. The daemon is started with what the overlay cpu gives it."""
import functools
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import jsonschema
import yaml

from facts import ROOT, Tree, find, parse_config, run, seconds, size
from kubernetes_shapes import shape_of
from promql import named

sys.path.insert(0, str(ROOT / "tests/http"))
from harness import REAL, WALL, Daemon  # noqa: E402

FOLDER = ROOT / "deploy/kubernetes"
ANNOTATIONS = {"upstream-hash-by", "proxy-body-size", "proxy-read-timeout", "proxy-next-upstream"}
TOKEN = "0123456789abcdef0123456789abcdef"


def render(overlay, components):
    with tempfile.TemporaryDirectory() as top:
        home = pathlib.Path(top, "kubernetes")
        shutil.copytree(FOLDER, home)
        file = home / "overlays" / overlay / "kustomization.yaml"
        text = file.read_text()
        assert "\n# components: [" in text
        file.write_text(text.replace("\n# components: [", "\ncomponents: [") if components else text)
        return subprocess.run(
            ["kubectl", "kustomize", str(file.parent)], check=True, stdout=subprocess.PIPE, text=True
        ).stdout


class Rendered:
    """What is applied, with some text replaced; `plain` files are those of the checkout, too."""

    def __init__(self, path=None, old="", new=""):
        self.tree = Tree(path, old, new) if path not in TEXTS else Tree()
        self.texts = dict(TEXTS)
        if path in TEXTS:
            assert old in TEXTS[path], f"nothing to plant in {path}: {old}"
            self.texts[path] = TEXTS[path].replace(old, new)


def start(text):
    """METRICS and answers to probes of a daemon with the ConfigMap and the flags of a rendered overlay."""
    objects = list(yaml.safe_load_all(text))
    [config] = [o["data"]["splatd.conf"] for o in objects if o["kind"] == "ConfigMap"]
    [container] = [o["spec"]["template"]["spec"]["containers"][0] for o in objects if o["kind"] == "Deployment"]
    with tempfile.TemporaryDirectory() as top:
        shutil.copy(WALL, top)
        tokens = pathlib.Path(top, "tokens")
        tokens.write_text(f"{TOKEN} view\n")
        tokens.chmod(0o400)
        for old, new in (
            ("/srv/splatd", top),
            ("/etc/splatd/secret/tokens", str(tokens)),
            (":8080", ":0"),
            (":8081", ":0"),
            ("drain-delay = 10000", "drain-delay = 0"),
        ):
            assert config.count(f"{old}\n") == 1, old
            config = config.replace(f"{old}\n", f"{new}\n")
        file = pathlib.Path(top, "splatd.conf")
        file.write_text(config)
        command = container["args"]
        assert command[:3] == ["serve", "--config", "/etc/splatd/splatd.conf"], command
        with Daemon(REAL, "--config", str(file), *command[3:], datasets=()) as d:
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                assert d.ops(container[probe]["httpGet"]["path"]).status == 200, probe
            assert d.ask("/v1/datasets/wall").status == 401
            assert d.ask("/v1/datasets/wall", headers={"Authorization": f"Bearer {TOKEN}"}).status == 200
            return set(re.findall(r"^(splatd_\w+)", d.ops("/metrics").body.decode(), re.M))


@functools.cache
def parse(text):
    return tuple(yaml.safe_load_all(text))


def check_overlay(tree, name, text, expect):
    objects = parse(text)
    by = {}
    for o in objects:
        for error in jsonschema.Draft202012Validator(shape_of(o)).iter_errors(o):
            expect(False, f"{name}: {o['kind']} {o['metadata'].get('name')}: {error.json_path}: {error.message}")
        by[o["kind"], o["metadata"]["name"]] = o
        expect(
            o["metadata"].get("labels", {}).get("app.kubernetes.io/name") == "splatd" or o["kind"] == "ServiceMonitor",
            f"{name}: {o['kind']} {o['metadata']['name']} has no label",
        )
    expect(len(by) == len(objects), f"{name}: an object twice")
    deployment = by["Deployment", "splatd"]["spec"]
    labels, pod = deployment["template"]["metadata"]["labels"], deployment["template"]["spec"]
    [container] = pod["containers"]
    parameters, docker = tree.parameters(), tree.read("deploy/Dockerfile")
    [config_map] = [o for o in objects if o["kind"] == "ConfigMap"]
    config = parse_config(config_map["data"]["splatd.conf"])
    flags = dict(arg.lstrip("-").partition("=")[::2] for arg in container["args"][3:])
    expect(
        set(config) | set(flags) <= set(parameters), f"{name}: unknown {(set(config) | set(flags)) - set(parameters)}"
    )
    value = {**parameters, **config, **flags}

    # Who is selected.
    expect(
        deployment["selector"]["matchLabels"].items() <= labels.items(),
        f"{name}: the deployment selects none of its pods",
    )
    for o in objects:
        spec = o.get("spec", {})
        if o["kind"] == "Service":
            expect(
                spec["selector"].items() <= labels.items(), f"{name}: Service {o['metadata']['name']} selects no pod"
            )
        if o["kind"] in ("PodDisruptionBudget", "NetworkPolicy"):
            selector = spec.get("selector", spec.get("podSelector"))["matchLabels"]
            expect(selector.items() <= labels.items(), f"{name}: {o['kind']} selects no pod")
    for rule in pod["topologySpreadConstraints"]:
        expect(rule["labelSelector"]["matchLabels"].items() <= labels.items(), f"{name}: spreads no pod")

    # Ports by name, from the configuration to the ingress.
    ports = {port["name"]: port["containerPort"] for port in container["ports"]}
    expect(
        ports == {"http": int(config["listen"].rsplit(":", 1)[1]), "ops": int(config["ops-listen"].rsplit(":", 1)[1])},
        f"{name}: ports {ports}",
    )
    services = {o["metadata"]["name"]: o for o in objects if o["kind"] == "Service"}
    for service in services.values():
        for port in service["spec"]["ports"]:
            expect(port["targetPort"] in ports and port["name"] == port["targetPort"], f"{name}: no port {port}")
    expect(
        [p["name"] for p in services["splatd"]["spec"]["ports"]] == ["http"], f"{name}: clients reach more than http"
    )
    for rule in by["NetworkPolicy", "splatd"]["spec"]["ingress"]:
        expect(all(port["port"] in ports for port in rule["ports"]), f"{name}: NetworkPolicy: {rule['ports']}")
    ops = tree.read(find("ops.c"))
    for probe, path in (("startupProbe", "/readyz"), ("readinessProbe", "/readyz"), ("livenessProbe", "/healthz")):
        asked = container[probe]["httpGet"]
        expect(asked == {"path": path, "port": "ops"} and f'"{path}"' in ops, f"{name}: {probe} asks {asked}")

    # Files: the image's paths, the configuration's, the volumes.
    mounts = {mount["name"]: mount for mount in container["volumeMounts"]}
    volumes = {volume["name"]: volume for volume in pod["volumes"]}
    expect(set(mounts) == set(volumes), f"{name}: volumes {set(mounts) ^ set(volumes)}")
    expect(
        volumes["config"]["configMap"]["name"] == config_map["metadata"]["name"]
        and mounts["config"]["subPath"] in config_map["data"]
        and mounts["config"]["mountPath"] == container["args"][2],
        f"{name}: the configuration is not where it is read",
    )
    expect(os.path.dirname(config["tokens"]) == mounts["tokens"]["mountPath"], f"{name}: tokens lie elsewhere")
    expect(mounts["datasets"]["mountPath"] == config["dataset"] and mounts["datasets"]["readOnly"], f"{name}: datasets")
    expect(f"XDG_CACHE_HOME={mounts['cache']['mountPath']} " in docker, f"{name}: the cache is another folder's")
    claim = volumes["datasets"].get("persistentVolumeClaim", {}).get("claimName")
    expect(
        ("PersistentVolumeClaim", claim) in by
        if claim
        else volumes["datasets"]["hostPath"]["path"] == config["dataset"],
        f"{name}: nobody claims {claim}",
    )
    expect(
        bool(claim) == any(o["kind"] == "PersistentVolumeClaim" for o in objects), f"{name}: a claim that nobody mounts"
    )
    expect(
        tree.read("deploy/operating.md").count(f"secret generic {volumes['tokens']['secret']['secretName']} "),
        f"{name}: nobody says how the Secret is made",
    )

    # Rights.
    user = pod["securityContext"]["runAsUser"]
    expect(f"USER {user}:{pod['securityContext']['runAsGroup']}\n" in docker, f"{name}: user {user} is not the image's")
    expect(
        pod["securityContext"]["runAsNonRoot"] is True
        and pod["automountServiceAccountToken"] is False
        and container["securityContext"]
        == {"allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]}},
        f"{name}: rights",
    )

    # Times and sizes.
    unit = dict(re.findall(r"^(\w+)=(.*)$", tree.read("deploy/splatd.service"), re.M))
    longest = (int(value["drain-delay"]) + int(value["deadline"])) / 1000 + 5
    expect(int(value["drain-delay"]) >= 5000, f"{name}: the drain is over before endpoints forget the pod")
    expect(pod["terminationGracePeriodSeconds"] >= longest + 5, f"{name}: killed {longest} s into its drain")
    startup = container["startupProbe"]
    expect(
        startup["periodSeconds"] * startup["failureThreshold"] == seconds(unit["TimeoutStartSec"]), f"{name}: {startup}"
    )
    limits = container["resources"]["limits"]
    if name.startswith("cpu"):
        fixed = size(value["memory-limit"]) + size(value["cache"]) + 2 * size("1G")  # replies and frames: built in
        expect(0 < size(flags["memory-limit"]) and fixed <= size(limits["memory"]), f"{name}: {fixed} bytes do not fit")
    else:
        expect("require-gpu" in flags and limits["nvidia.com/gpu"] == "1", f"{name}: no GPU")
        expect(any(t["key"] == "nvidia.com/gpu" for t in pod["tolerations"]), f"{name}: GPU nodes turn it away")

    # The autoscaler's metric, from /metrics through the adapter.
    scaler = by["HorizontalPodAutoscaler", "splatd"]["spec"]
    target = scaler["scaleTargetRef"]
    expect((target["kind"], target["name"]) in by and target["apiVersion"] == "apps/v1", f"{name}: scales {target}")
    [wanted] = scaler["metrics"]
    [rule] = yaml.safe_load(tree.read("deploy/kubernetes/prometheus-adapter.yaml"))["rules"]["custom"]
    series = rule["seriesQuery"].split("{")[0]
    expect(
        wanted["pods"]["metric"]["name"]
        == re.sub(rule["name"]["matches"], rule["name"]["as"].replace("$1", r"\1"), series),
        f"{name}: the adapter has no {wanted['pods']['metric']['name']}",
    )
    expect(series in METRICS, f"{name}: the daemon has no {series}")
    query = rule["metricsQuery"].replace("<<.Series>>", series).replace("<<.LabelMatchers>>", 'namespace="a",pod=~"b"')
    expect(
        named(query.replace("<<.GroupBy>>", "pod"))[0][0][0] == series
        and "<<" not in query.replace("<<.GroupBy>>", ""),
        f"{name}: the adapter asks {query}",
    )
    expect(set(rule["resources"]["overrides"]) == {"namespace", "pod"}, f"{name}: {rule['resources']}")
    expect(
        0 < int(wanted["pods"]["target"]["averageValue"]) < int(value["queue"]) / 2,
        f"{name}: scales when it is too late",
    )
    expect(1 < scaler["minReplicas"] < scaler["maxReplicas"], f"{name}: replicas")

    # The ingress.
    ingress = by["Ingress", "splatd"]
    annotations = {
        key.removeprefix("nginx.ingress.kubernetes.io/"): text
        for key, text in ingress["metadata"]["annotations"].items()
    }
    expect(set(annotations) == ANNOTATIONS, f"{name}: annotations {set(annotations) ^ ANNOTATIONS}")
    snippet = yaml.safe_load(tree.read("deploy/kubernetes/ingress-nginx.yaml"))["data"]["http-snippet"]
    expect(
        re.search(rf"^map \$request_uri {re.escape(annotations['upstream-hash-by'])} {{$", snippet, re.M),
        f"{name}: nobody sets {annotations['upstream-hash-by']}",
    )
    expect(
        int(annotations["proxy-read-timeout"]) * 1000 > int(value["deadline"]), f"{name}: the ingress gives up first"
    )
    for path in ingress["spec"]["rules"][0]["http"]["paths"]:
        backend = path["backend"]["service"]
        expect(
            backend["port"]["name"] in [p["name"] for p in services[backend["name"]]["spec"]["ports"]],
            f"{name}: {backend}",
        )

    # Who is scraped, and by which name.
    for (kind, _), o in by.items():
        if kind == "ServiceMonitor":
            selector = o["spec"]["selector"]["matchLabels"]
            chosen = [s for s in services.values() if selector.items() <= s["metadata"]["labels"].items()]
            expect([s["metadata"]["name"] for s in chosen] == ["splatd-ops"], f"{name}: scrapes {chosen}")
            [end] = o["spec"]["endpoints"]
            expect(end["port"] == "ops" and end["path"] == "/metrics" and '"/metrics"' in ops, f"{name}: scrapes {end}")
            job = yaml.safe_load(tree.read("deploy/prometheus/prometheus.yml"))["scrape_configs"][0]["job_name"]
            expect(
                chosen and chosen[0]["metadata"]["labels"].get(o["spec"]["jobLabel"]) == job,
                f"{name}: another job than {job}",
            )
    expect(name.endswith("+") == any(kind == "ServiceMonitor" for kind, _ in by), f"{name}: the operator's objects")


def check(rendered):
    wrong = []

    def expect(condition, message):
        if not condition:
            wrong.append(message)

    for name, text in rendered.texts.items():
        check_overlay(rendered.tree, name, text, expect)
    for path in ("README.md", "deploy/operating.md"):
        text = rendered.tree.read(path)
        named_paths = re.findall(r"deploy/kubernetes[\w./-]*\w", text)
        expect(named_paths, f"{path} does not say how to apply them")
        for named_path in named_paths:
            expect((ROOT / named_path).exists(), f"{path}: no {named_path}")
    return wrong


CPU, GPU, MORE = "cpu", "gpu", "cpu+"
PLANTED = [
    (CPU, "readinessProbe:", "readynessProbe:"),
    (CPU, "terminationGracePeriodSeconds: 45", "terminationGracePeriodSeconds: 20"),
    (CPU, "path: /healthz", "path: /health"),
    (CPU, "name: ops\n", "name: metrics\n"),
    (CPU, "containerPort: 8081", "containerPort: 8082"),
    (CPU, "targetPort: http", "targetPort: web"),
    (CPU, "readOnlyRootFilesystem: true", "readOnlyRootFilesystem: false"),
    (CPU, "runAsUser: 10001", "runAsUser: 1000"),
    (CPU, "mountPath: /srv/splatd", "mountPath: /data"),
    (CPU, "mountPath: /etc/splatd/secret", "mountPath: /etc/splatd/secrets"),
    (CPU, "claimName: splatd-datasets", "claimName: datasets"),
    (CPU, "memory: 8Gi", "memory: 6Gi"),
    (CPU, "--memory-limit=4G", "--memory=4G"),
    (CPU, "drain-delay = 10000", "drain_delay = 10000"),
    (CPU, "drain-delay = 10000", "drain-delay = 30000"),
    (CPU, "matchLabels:\n      app.kubernetes.io/name: splatd", "matchLabels:\n      app.kubernetes.io/name: splat"),
    (CPU, "autoscaling/v2", "autoscaling/v2beta2"),
    (CPU, "name: splatd_queue_length", "name: splatd_queue"),
    (CPU, 'averageValue: "4"', 'averageValue: "40"'),
    (CPU, "upstream-hash-by: $splatd_dataset", "upstream-hash-by: $dataset"),
    (CPU, "upstream-hash-by:", "upstream-hash:"),
    (CPU, 'proxy-read-timeout: "60"', 'proxy-read-timeout: "5"'),
    (GPU, "--require-gpu", "--require-gpus"),
    (GPU, 'nvidia.com/gpu: "1"', 'nvidia.com/gpus: "1"'),
    (MORE, "path: /metrics", "path: /metric"),
    (MORE, "jobLabel: app.kubernetes.io/name", "jobLabel: app"),
    (
        MORE,
        "matchLabels:\n      app.kubernetes.io/component: ops",
        "matchLabels:\n      app.kubernetes.io/component: op",
    ),
    ("deploy/kubernetes/prometheus-adapter.yaml", "splatd_queue_length", "splatd_queue_size"),
    ("deploy/kubernetes/prometheus-adapter.yaml", "<<.Series>>", "<<.Serie>>"),
    ("deploy/kubernetes/ingress-nginx.yaml", "$splatd_dataset", "$dataset"),
    ("deploy/Dockerfile", "USER 10001:10001", "USER 1000:1000"),
    ("README.md", "deploy/kubernetes/overlays/cpu", "deploy/kubernetes/overlays/cpus"),
]
version = (
    shutil.which("kubectl")
    and subprocess.run(["kubectl", "version", "--client"], capture_output=True, text=True).stdout
)
if not version or not re.search(r"Kustomize Version: v([5-9]|\d\d)", version):
    print("skipped: no kubectl with Kustomize 5 or later")
    sys.exit(77)
TEXTS = {
    overlay + ("+" if components else ""): render(overlay, components)
    for overlay in (CPU, GPU)
    for components in (False, True)
}
METRICS = start(TEXTS[CPU])
run(check, PLANTED, Rendered)
