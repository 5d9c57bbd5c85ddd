"""deploy/prometheus and deploy/grafana against the daemon's own /metrics: every metric, label and value that an
expression names is there; every alert has a test that fires, one that does not, and its row in operating.md; the
dashboard is sound. promtool runs the tests of the rules, a Prometheus asks every expression of real data."""
import json
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request

import yaml

from facts import ROOT, run
from promql import named

sys.path.insert(0, str(ROOT / "tests/http"))
from harness import REAL, VIEW, Daemon, eventually, fresh  # noqa: E402

RULES, TESTS, SCRAPE, DASHBOARD, GUIDE = (
    "deploy/prometheus/rules.yml",
    "deploy/prometheus/tests.yml",
    "deploy/prometheus/prometheus.yml",
    "deploy/grafana/splatd.json",
    "deploy/operating.md",
)
PROMTOOL, PROMETHEUS = shutil.which("promtool"), shutil.which("prometheus")
TARGET = {"job", "instance", "le"}  # labels that Prometheus adds, and that of histograms
VARIABLES = {"$__rate_interval": "5m", "$job": ".+", "$instance": ".+"}


def sample(text):
    """{metric: {label: {values}}} of /metrics; a histogram counts by its three names."""
    metrics = {}
    for name, labels in re.findall(r"^([a-z]\w*)(?:\{(.*)\})? \S+$", text, re.M):
        known = metrics.setdefault(name, {})
        for label, value in re.findall(r'(\w+)="((?:[^"\\]|\\.)*)"', labels):
            known.setdefault(label, set()).add(value)
    return metrics


def use(d):
    """A little of everything that is counted by route or state."""
    for path in (
        fresh(f"{VIEW}?width=16&height=16"),
        f"{VIEW}?width=16&height=16",
        f"{VIEW}?width=16&height=16",
        "/v1/status",
    ):
        assert d.ask(path).status == 200


def substituted(expression):
    for variable, value in VARIABLES.items():
        expression = expression.replace(variable, value)
    return expression


def panels_of(dashboard):
    for panel in dashboard["panels"]:
        yield panel
        yield from panel.get("panels", [])


def check_dashboard(dashboard, expect):
    panels = list(panels_of(dashboard))
    expect(
        dashboard["schemaVersion"] >= 36 and dashboard["uid"] and dashboard["title"],
        "dashboard: no uid, title or schema",
    )
    ids = [panel["id"] for panel in panels]
    expect(len(set(ids)) == len(ids), f"dashboard: ids {ids}")
    variables = {v["name"]: v for v in dashboard["templating"]["list"]}
    expect(
        variables["datasource"]["type"] == "datasource" and variables["datasource"]["query"] == "prometheus",
        "dashboard: no variable for the data source",
    )
    taken = {}
    for panel in panels:
        place, title = panel["gridPos"], panel.get("title")
        expect(
            place["x"] + place["w"] <= 24 and min(place.values()) >= 0 and place["w"] * place["h"] > 0,
            f"{title}: {place}",
        )
        for x in range(place["x"], place["x"] + place["w"]):
            for y in range(place["y"], place["y"] + place["h"]):
                other = taken.setdefault((x, y), title)
                expect(other == title, f"dashboard: '{title}' lies over '{other}'")
        if panel["type"] != "row":
            expect(
                title and panel.get("description") and panel["targets"],
                f"panel {panel['id']}: title, description, targets?",
            )
            references = [target["refId"] for target in panel["targets"]]
            expect(len(set(references)) == len(references), f"{title}: refIds {references}")
            for thing in [panel, *panel["targets"]]:
                expect(
                    thing["datasource"] == {"type": "prometheus", "uid": "${datasource}"},
                    f"{title}: another data source",
                )
    for name in set(re.findall(r"\$(\w+)", json.dumps([p.get("targets") for p in panels]))) - set(variables):
        expect(name.startswith("__"), f"dashboard: no variable ${name}")


def expressions(rules, dashboard):
    """[(where, expression)]"""
    found = [
        (rule.get("record") or rule["alert"], rule["expr"]) for group in rules["groups"] for rule in group["rules"]
    ]
    for panel in panels_of(dashboard):
        found += [(f"panel '{panel['title']}'", substituted(target["expr"])) for target in panel.get("targets", [])]
    for variable in dashboard["templating"]["list"]:
        if variable["type"] == "query":
            metric = re.fullmatch(r"label_values\((.*), (\w+)\)", variable["definition"])
            found.append((f"variable {variable['name']}", f"sum by ({metric[2]}) ({substituted(metric[1])})"))
    return found


def check(tree):
    wrong = []

    def expect(condition, message):
        if not condition:
            wrong.append(message)

    rules, tests = yaml.safe_load(tree.read(RULES)), yaml.safe_load(tree.read(TESTS))
    dashboard, guide, scrape = json.loads(tree.read(DASHBOARD)), tree.read(GUIDE), yaml.safe_load(tree.read(SCRAPE))
    every = [rule for group in rules["groups"] for rule in group["rules"]]
    recorded = {rule["record"] for rule in every if "record" in rule}
    alerts = {rule["alert"]: rule for rule in every if "alert" in rule}
    values = {}
    for label, found in ((label, found) for known in METRICS.values() for label, found in known.items()):
        values.setdefault(label, set()).update(found)
    every_label = TARGET | set(values)

    # Every name that an expression holds.
    for where, expression in expressions(rules, dashboard):
        try:
            selectors, labels = named(expression)
        except ValueError as error:
            expect(False, f"{where}: {error}")
            continue
        expect(labels <= every_label, f"{where}: nobody has the labels {labels - every_label}")
        for metric, matchers in selectors:
            foreign = metric in recorded or metric == "up"
            expect(metric in METRICS or foreign, f"{where}: the daemon has no {metric}")
            for label, value in matchers.items():
                known = METRICS.get(metric, {}).get(label) or (values.get(label) if foreign else None)
                expect(known or label in TARGET, f"{where}: {metric} has no label {label}")
                if known and value is not None and label != "software":
                    expect(value in known, f'{where}: {metric} has no {label}="{value}", but {sorted(known)}')
        for text in re.findall(r'job="(\w+)"', expression):
            expect(text == scrape["scrape_configs"][0]["job_name"], f"{where}: job {text}")
    [target] = scrape["scrape_configs"][0]["static_configs"][0]["targets"]
    expect(target == tree.parameters()["ops-listen"], f"{SCRAPE}: asks {target}")

    # Every alert: severity, words, tests both ways, what to do.
    tried = [t for group in tests["tests"] for t in group.get("alert_rule_test", [])]
    fire = {t["alertname"] for t in tried if t.get("exp_alerts")}
    quiet = {t["alertname"] for t in tried if not t.get("exp_alerts")}
    checked = {
        metric
        for group in tests["tests"]
        for t in group.get("promql_expr_test", [])
        for metric, _ in named(t["expr"])[0]
    }
    expect(recorded <= checked, f"{TESTS}: nobody checks {recorded - checked}")
    runbook = set(re.findall(r"^\| `(Splatd\w+)` \| \S.* \| \S.* \|$", guide, re.M))
    for what, names in (
        ("a test that fires", fire),
        ("a test that stays quiet", quiet),
        ("a row in operating.md", runbook),
    ):
        expect(names == set(alerts), f"alerts and those with {what} differ: {names ^ set(alerts)}")
    for name, rule in alerts.items():
        expect(rule["labels"]["severity"] in ("warning", "critical"), f"{name}: severity {rule['labels']}")
        expect(set(rule["annotations"]) == {"summary", "description"}, f"{name}: {rule['annotations']}")
    check_dashboard(dashboard, expect)
    return wrong


def promtool():
    """What promtool says of the rules as they are, and that it notices a rule that changes."""
    folder = ROOT / "deploy/prometheus"
    wrong = []
    for words in (
        ["check", "rules", "rules.yml"],
        ["check", "config", "prometheus.yml"],
        ["test", "rules", "tests.yml"],
    ):
        done = subprocess.run([PROMTOOL, *words], cwd=folder, capture_output=True, text=True)
        if done.returncode:
            wrong.append(f"promtool {' '.join(words)}: {done.stdout}{done.stderr}")
    with tempfile.TemporaryDirectory() as top:
        shutil.copy(ROOT / TESTS, top)
        changed = (ROOT / RULES).read_text().replace("splatd_standstill_seconds > 10", "splatd_standstill_seconds > 20")
        pathlib.Path(top, "rules.yml").write_text(changed)
        if not subprocess.run([PROMTOOL, "test", "rules", "tests.yml"], cwd=top, capture_output=True).returncode:
            wrong.append("promtool finds nothing wrong with another threshold")
    return wrong


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


def stalled(d):
    """Turns of the daemon's loop that took longer than the alert of its stalls has it, on a machine that others use too."""
    text = d.ops("/metrics").body.decode()
    count, quick = (float(re.search(rf"^splatd_loop_turn_seconds_{name} (\S+)$", text, re.M)[1]) for name in ("count", r'bucket\{le="0\.25"\}'))
    return count - quick


def prometheus(d, tries=5):
    """Expressions that a real Prometheus refuses, or that find nothing in what it scraped from a real daemon."""
    with tempfile.TemporaryDirectory() as top:
        config = yaml.safe_load((ROOT / SCRAPE).read_text())
        config["global"] = {"evaluation_interval": "1s"}
        config["rule_files"] = [str(ROOT / RULES)]
        config["scrape_configs"][0].update(scrape_interval="2s", scrape_timeout="2s")
        config["scrape_configs"][0]["static_configs"][0]["targets"] = [f"127.0.0.1:{d.ops_port}"]
        pathlib.Path(top, "prometheus.yml").write_text(yaml.safe_dump(config))
        process = port = None

        def start():
            nonlocal process, port
            port = free_port()
            process = subprocess.Popen(
                [
                    PROMETHEUS,
                    f"--config.file={top}/prometheus.yml",
                    f"--storage.tsdb.path={top}/data",
                    f"--web.listen-address=127.0.0.1:{port}",
                    "--log.level=error",
                ]
            )

        def ask(expression):
            nonlocal tries
            if process.poll() is not None and tries:  # somebody may have taken the port meanwhile
                tries -= 1
                start()
            url = f"http://127.0.0.1:{port}/api/v1/query?" + urllib.parse.urlencode({"query": expression})
            try:
                with urllib.request.urlopen(url, timeout=120) as answer:
                    return json.load(answer)["data"]["result"]
            except urllib.error.HTTPError as error:
                return [] if error.code == 503 else error.read().decode()  # 503: it is not ready
            except OSError:
                return []

        start()
        try:
            eventually(lambda: isinstance(found := ask("splatd_ready == 1"), list) and found, 300)
            rules, dashboard = yaml.safe_load((ROOT / RULES).read_text()), json.loads((ROOT / DASHBOARD).read_text())
            alerts = {rule.get("alert") for group in rules["groups"] for rule in group["rules"]}
            wanted = [(where, e) for where, e in expressions(rules, dashboard) if where not in alerts]
            left, end = wanted, time.monotonic() + 300
            while left and time.monotonic() < end:
                use(d)
                answers = [(where, e, ask(e)) for where, e in left]
                left = [(where, e) for where, e, answer in answers if not answer or isinstance(answer, str)]
                if any(isinstance(answer, str) for *_, answer in answers):
                    break
                time.sleep(0.5)
            wrong = [f"{where}: a real Prometheus finds nothing: {e}: {ask(e)}" for where, e in left]
            for where, e in expressions(rules, dashboard):
                if where in alerts and isinstance(ask(e), str):
                    wrong.append(f"{where}: {ask(e)}")
            firing = [alert["metric"]["alertname"] for alert in ask('ALERTS{alertstate="firing"}')]
            firing = [name for name in firing if name != "SplatdLoopStalls" or stalled(d) < 3]
            return wrong + [f"{name} fires at a daemon that is well" for name in firing]
        finally:
            process.terminate()
            process.wait(60)


PLANTED = [
    (RULES, "splatd_standstill_seconds", "splatd_still_seconds"),
    (RULES, 'software="true"', 'soft="true"'),
    (RULES, 'state="failed"', 'state="broken"'),
    (RULES, "sum by (job, route, le)", "sum by (job, path, le)"),
    (RULES, 'up{job="splatd"}', 'up{job="splat"}'),
    (RULES, "/v1/datasets/{id}/view", "/v1/dataset/{id}/view"),
    (RULES, "increase(splatd_device_losses_total", "increased(splatd_device_losses_total"),
    (RULES, "alert: SplatdSlow", "alert: SplatdSluggish"),
    (RULES, "severity: critical", "severity: fatal"),
    (TESTS, "alertname: SplatdTourFailed", "alertname: SplatdTour"),
    (GUIDE, "| `SplatdEvicting` |", "| SplatdEvicting |"),
    (SCRAPE, "8081", "8080"),
    (DASHBOARD, "splatd_cache_hits_total", "splatd_cache_hit_total"),
    (DASHBOARD, "splatd_queue_length", "splatd_queue_len"),
    (DASHBOARD, "sum by (stage)", "sum by (phase)"),
    (DASHBOARD, '"id": 2,', '"id": 3,'),
    (DASHBOARD, '"x": 4,', '"x": 3,'),
    (DASHBOARD, '"w": 12,', '"w": 13,'),
    (DASHBOARD, '"name": "datasource"', '"name": "source"'),
    (DASHBOARD, "$instance", "$host"),
]
with tempfile.TemporaryDirectory() as top, Daemon(REAL, "--tours", top) as d:
    use(d)
    METRICS = sample(d.ops("/metrics").body.decode())
    found = promtool() if PROMTOOL else []
    found += prometheus(d) if PROMETHEUS else []
if not (PROMTOOL and PROMETHEUS):
    print("note: no promtool and Prometheus, rules are read but not run")
run(lambda tree: check(tree) + (found if not tree.planted else []), PLANTED)
