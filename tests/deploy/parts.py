"""deploy/pack: a survey in parts, by make for real; the task of a Slurm array as bash runs it, or, with --slurm, an array of
a slurmctld and a slurmd of this test's own; the fields of the Kubernetes job, and what it asks of splatd.

Parts are the bytes that `splatd pack` makes of the same tiles, whatever failed, was killed or ran twice on the way."""
import contextlib
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import jsonschema
import yaml

from facts import ROOT
from kubernetes_shapes import shape_of

SPLATD = os.environ["SPLATD_BINARY"]
PACK = ROOT / "deploy/pack"
TILES, A_PART, PARTS = 5, 2, 3


class Survey:
    """Five tiles, one with a blank in its name, in a folder beside an empty one for the parts."""

    def __init__(self, top):
        self.tiles, self.packed, self.bin = top / "ti les", top / "packed", top / "bin"
        for folder in self.tiles, self.packed, self.bin:
            folder.mkdir()
        for i in range(TILES):
            subprocess.run([SPLATD, "synth", "courtyard", "--points", "2000", "--seed", str(i + 1), "--format", "ply", "-o",
                            str(top / "scan")], check=True, stderr=subprocess.DEVNULL)
            (top / "scan/courtyard.ply").rename(self.tiles / f"tile {i}.ply")
        (self.bin / "splatd").symlink_to(SPLATD)
        for part in range(PARTS):  # what parts must be
            names = sorted(self.tiles.iterdir())[part * A_PART:(part + 1) * A_PART]
            subprocess.run([SPLATD, "pack", *map(str, names), "-o", str(top / f"part-{part}.spld")], check=True,
                           stderr=subprocess.DEVNULL)
        self.truth = [(top / f"part-{part}.spld").read_bytes() for part in range(PARTS)]

    def environment(self, **more):
        return {**os.environ, "PATH": f"{self.bin}:{os.environ['PATH']}", **more}

    def make(self, *words, splatd=SPLATD, a_part=A_PART, **more):
        return subprocess.run(["make", "-f", PACK / "Makefile", f"TILES={self.tiles}", f"PACKED={self.packed}",
                               f"TILES_A_PART={a_part}", f"SPLATD={splatd}", *words], text=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, env=self.environment(**more))

    def part(self, number):
        return self.packed / f"part-{number}.spld"

    def check(self):
        for part in range(PARTS):
            assert self.part(part).read_bytes() == self.truth[part], part
        assert not list(self.packed.glob("*.part*")), list(self.packed.iterdir())

    def forget(self):
        for part in range(PARTS):
            self.part(part).unlink(missing_ok=True)


def times(survey):
    return [survey.part(part).stat().st_mtime_ns for part in range(PARTS)]


def check_make(survey):
    made = survey.make("-j2")
    assert made.returncode == 0 and "3 parts: 0 to 2" in made.stdout, made.stdout
    survey.check()
    before = times(survey)
    made = survey.make()
    assert made.returncode == 0 and times(survey) == before, made.stdout
    time.sleep(0.02)
    (survey.tiles / "tile 2.ply").touch()
    made = survey.make()
    after = times(survey)
    assert made.returncode == 0 and [a > b for a, b in zip(after, before)] == [False, True, False], made.stdout
    survey.check()


def check_failures(survey):
    """Of one tile that is broken, and of a process that is killed, only its own part is missing, until the next run."""
    survey.forget()
    whole = (survey.tiles / "tile 4.ply").read_bytes()
    (survey.tiles / "tile 4.ply").write_bytes(whole[:-100])
    made = survey.make("-k")
    assert made.returncode and "tile 4.ply" in made.stdout, made.stdout
    assert not survey.part(2).exists() and survey.part(0).exists() and survey.part(1).exists(), made.stdout
    (survey.tiles / "tile 4.ply").write_bytes(whole)
    survey.part(0).unlink()
    killer = survey.bin / "killed"
    killer.write_text(f'#!/bin/sh\n"{SPLATD}" "$@" & sleep 0.02; kill -9 $!; exit 137\n')
    killer.chmod(0o755)
    made = survey.make("-k", splatd=killer)
    assert made.returncode, made.stdout  # whichever was done before it was killed is whole
    for part in range(PARTS):
        assert not survey.part(part).exists() or survey.part(part).read_bytes() == survey.truth[part], part
    made = survey.make()
    assert made.returncode == 0, made.stdout
    survey.check()


def check_refusals(survey):
    for words, said in ((["TILES=/nowhere"], "/nowhere is no folder"), (["PACKED="], "PACKED= is not one folder"),
                        (["TILES_A_PART=0"], "TILES_A_PART=0 is no number above 0"), (["TILES=" + str(survey.bin)], "has no scan"),
                        (["PACKED=" + str(survey.tiles)], "has no blank")):
        made = survey.make(*words)
        assert made.returncode and said in made.stdout, (words, made.stdout)
    made = survey.make("lists", a_part=3)  # two parts: the third is of no list any more
    assert made.returncode == 0 and "part-2.spld is of no list any more" in made.stdout, made.stdout
    assert not (survey.packed / "tiles/2.txt").exists()
    survey.part(2).unlink()
    assert survey.make().returncode == 0
    survey.check()


def task(survey, part, *options, **more):
    return subprocess.run(["bash", PACK / "slurm.sbatch", survey.packed, *options], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, env=survey.environment(SLURM_ARRAY_TASK_ID=str(part), **more))


def check_task(survey):
    survey.forget()
    for part in 2, 0, 1, 1:
        done = task(survey, part, SLURM_MEM_PER_NODE="512", SLURM_CPUS_PER_TASK="2")
        assert done.returncode == 0, done.stdout
    assert "is there" in done.stdout, done.stdout
    survey.check()
    missing = task(survey, 7)
    assert missing.returncode == 1 and "7.txt is not there" in missing.stdout, missing.stdout
    survey.part(0).unlink()
    assert task(survey, 0, "--points-only").returncode == 0  # options reach splatd
    assert survey.part(0).read_bytes() != survey.truth[0]
    survey.part(0).unlink()
    assert task(survey, 0).returncode == 0
    survey.check()


def check_job(survey):
    job = yaml.safe_load((PACK / "job.yaml").read_text())
    jsonschema.Draft202012Validator(shape_of(job)).validate(job)
    for field, wrong in (("completionMode", "Index"), ("backoffLimit", -1), ("completion", 3)):
        planted = {**job, "spec": {**job["spec"], field: wrong}}
        assert list(jsonschema.Draft202012Validator(shape_of(planted)).iter_errors(planted)), field
    [container] = job["spec"]["template"]["spec"]["containers"]
    [mount] = container["volumeMounts"]
    [env] = container["env"]
    args = [word.replace(mount["mountPath"] + "/packed", str(survey.packed)).replace(f"$({env['name']})", "1")
            for word in container["args"]]
    survey.part(1).unlink()
    subprocess.run([SPLATD, *args], check=True, stderr=subprocess.DEVNULL)
    survey.check()


CONFIG = """ClusterName=splatd
SlurmctldHost=localhost
SlurmUser=root
SlurmctldPort={0}
SlurmdPort={1}
AuthType=auth/munge
AuthInfo=socket={2}/munge.socket
CredType=cred/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
StateSaveLocation={2}/state
SlurmdSpoolDir={2}/spool
SlurmctldPidFile={2}/ctld.pid
SlurmdPidFile={2}/d.pid
SlurmctldLogFile={2}/ctld.log
SlurmdLogFile={2}/d.log
MpiDefault=none
ReturnToService=2
NodeName=localhost CPUs={3} RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=localhost Default=YES MaxTime=INFINITE State=UP
"""


@contextlib.contextmanager
def cluster(top):
    """Environment of Slurm's commands for a cluster of this machine, with a munge of its own."""
    for folder in "state", "spool", "etc":
        (top / folder).mkdir()
    key = top / "munge.key"
    key.write_bytes(os.urandom(1024))
    key.chmod(0o400)
    (top / "etc/slurm.conf").write_text(CONFIG.format(16817, 16818, top, os.cpu_count()))
    environment = {**os.environ, "SLURM_CONF": str(top / "etc/slurm.conf")}
    commands = (["munged", "--foreground", "--force", f"--socket={top}/munge.socket", f"--key-file={key}",
                 f"--pid-file={top}/munge.pid", f"--log-file={top}/munge.log", f"--seed-file={top}/munge.seed"],
                ["slurmctld", "-D", "-i"], ["slurmd", "-D", "-N", "localhost"])
    running = []
    try:
        for command in commands:
            running.append(subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
            time.sleep(2)
            assert running[-1].poll() is None, (command, *(p.read_text()[-2000:] for p in top.glob("*.log")))
        yield environment
    finally:
        for process in reversed(running):
            process.send_signal(signal.SIGTERM)
        for process in running:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(10)
            process.kill()


def check_slurm(survey, top):
    """An array of a real cluster; a task that is killed while it packs, and the array submitted again."""
    survey.forget()
    with cluster(top) as environment:
        environment = {**environment, "PATH": survey.environment()["PATH"]}
        for turn in range(2):
            subprocess.run(["sbatch", "--wait", f"--array=0-{PARTS - 1}", "--cpus-per-task=1", "--mem=512", f"--output={top}/%a.log",
                            PACK / "slurm.sbatch", survey.packed], env=environment, check=True, timeout=120)
            for part in range(PARTS):
                print(f"task {part}:", (top / f"{part}.log").read_text().strip().split("\n")[-1])
            survey.check()
            survey.part(turn).unlink()  # as if it had been killed
    survey.make()
    survey.check()


if "--slurm" in sys.argv and not (shutil.which("slurmctld") and shutil.which("munged") and os.geteuid() == 0):
    print("skipped: needs slurmctld, slurmd and munged, and root")
    sys.exit(77)
with tempfile.TemporaryDirectory() as folder:
    survey = Survey(pathlib.Path(folder))
    check_make(survey)
    if "--slurm" in sys.argv:
        with tempfile.TemporaryDirectory() as place:
            check_slurm(survey, pathlib.Path(place))
    else:
        check_failures(survey)
        check_refusals(survey)
        check_task(survey)
        check_job(survey)
print("parts are whole")
