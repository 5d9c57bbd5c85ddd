"""deploy/pack: a survey in parts, by make for real; the task of a Slurm array as bash runs it, or, with --slurm, an array of
a slurmctld and a slurmd of this test's own; the fields of the Kubernetes job, and what it asks of splatd.

Parts are the bytes that they are when packed one after the other in a job of the same scans elsewhere, whatever failed, was
killed or ran twice on the way, and so is what they are joined to. One process that makes all parts writes the file that they are
merged to."""
import contextlib
import json
import os
import pathlib
import shutil
import signal
import struct
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
SCANS, PARTS = 3, 4


class Survey:
    """Scans that overlap, one with a blank in its name, a job of them, and the same job elsewhere with its parts as they must be."""

    def __init__(self, top):
        self.scans, self.job, self.bin, self.truth = top / "sc ans", top / "the job", top / "bin", top / "truth"
        for folder in self.scans, self.bin:
            folder.mkdir()
        for i in range(SCANS):
            subprocess.run([SPLATD, "synth", "courtyard", "--points", "3000", "--seed", str(i + 1), "--format", "ply", "-o",
                            str(top / "scan")], check=True, stderr=subprocess.DEVNULL)
            (top / "scan/courtyard.ply").rename(self.scans / f"scan {i}.ply")
        (self.bin / "splatd").symlink_to(SPLATD)
        for job in self.job, self.truth:
            said = self.run("--plan", PARTS, self.scans, "-o", job)
            assert said.returncode == 0 and f"{PARTS} parts of" in said.stdout, said.stdout
            assert f"--array=0-{PARTS - 1} deploy/pack/slurm.sbatch {job}" in said.stdout, said.stdout
        for part in range(PARTS):
            assert self.run("--part", part, self.truth).returncode == 0
        assert self.run("--join", self.truth).returncode == 0

    def environment(self, **more):
        return {**os.environ, "PATH": f"{self.bin}:{os.environ['PATH']}", **more}

    def run(self, *words, **more):
        return subprocess.run([SPLATD, "pack", *map(str, words)], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              env=self.environment(**more))

    def make(self, *words, splatd=SPLATD, **more):
        return subprocess.run(["make", "-f", PACK / "Makefile", f"JOB={self.job}", f"SPLATD={splatd}", *words], text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=self.environment(**more))

    def part(self, number):
        return self.job / f"part-{number}.spld"

    def check(self, joined=False):
        names = [f"part-{part}.spld" for part in range(PARTS)] + ["all.spld"] * joined
        for name in names:
            assert (self.job / name).read_bytes() == (self.truth / name).read_bytes(), name
        assert sorted(p.name for p in self.job.iterdir()) == sorted(names + ["job.json"]), list(self.job.iterdir())

    def forget(self):
        for file in self.job.glob("*.spld"):
            file.unlink()


def check_make(survey):
    made = survey.make("-j2", LC_ALL="de_DE.UTF-8")
    assert made.returncode == 0 and f"a collection of {PARTS} tiles" in made.stdout, made.stdout
    survey.check(joined=True)
    before = [survey.part(part).stat().st_ino for part in range(PARTS)]
    made = survey.make()
    assert made.returncode == 0 and "part-1.spld: part 1 is there, whole and of this plan" in made.stdout, made.stdout
    assert [survey.part(part).stat().st_ino for part in range(PARTS)] == before
    survey.check(joined=True)
    (survey.job / "all.spld").unlink()
    survey.part(1).unlink()
    made = survey.make("join")
    assert made.returncode and f"1 of {PARTS} parts are missing: 1;" in made.stdout, made.stdout


def check_at_once(survey):
    """Each part twice, all at the same time."""
    survey.forget()
    running = [subprocess.Popen([SPLATD, "pack", "--part", str(part), survey.job, "--threads", "1"], stderr=subprocess.DEVNULL)
               for part in list(range(PARTS)) * 2]
    for process in running:
        assert process.wait(600) == 0
    survey.check()


def check_failures(survey):
    """Of a scan that changed, only parts that read it are missing; of a process that is killed its own, until the next run."""
    survey.forget()
    scan = survey.scans / f"scan {SCANS - 1}.ply"
    whole = scan.read_bytes()
    scan.write_bytes(whole[:-100])
    made = survey.make("-k")
    assert made.returncode and f"scan {SCANS - 1}.ply: has {len(whole) - 100} bytes, and {len(whole)} when" in made.stdout, made.stdout
    scan.write_bytes(whole)
    killer = survey.bin / "killed"
    for delay in "0.01", "0.03", "0.06", "0.1":
        killer.write_text(f'#!/bin/sh\n"{SPLATD}" "$@" & sleep {delay}; kill -9 $!; wait $!; exit 137\n')
        killer.chmod(0o755)
        made = survey.make("-k", "parts", splatd=killer)
        assert made.returncode, made.stdout  # whichever was done before it was killed is whole
        for part in range(PARTS):
            name = f"part-{part}.spld"
            assert not survey.part(part).exists() or survey.part(part).read_bytes() == (survey.truth / name).read_bytes(), part
    made = survey.make()
    assert made.returncode == 0, made.stdout
    survey.check(joined=True)


def check_headers(survey, top):
    """Of many LAS scans headers alone are read. One whose box is a lie, too small or with a stray, costs no point."""
    folder, job = top / "las", top / "las job"
    folder.mkdir()
    for i in range(9):
        subprocess.run([SPLATD, "synth", "courtyard", "--points", "2000", "--seed", str(i + 1), "--format", "las", "-o",
                        str(top / "scan")], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        (top / "scan/courtyard.las").rename(folder / f"{i}.las")
    for name, place, value in ("0.las", 179, None), ("1.las", 195, 1e9):  # the most of x is nearly its least; of y far away
        las = bytearray((folder / name).read_bytes())
        least = struct.unpack_from("<d", las, place + 8)[0]
        struct.pack_into("<d", las, place, least + 0.5 if value is None else value)
        (folder / name).write_bytes(las)
    planned = survey.run("--plan", 2, folder, "-o", job)
    assert planned.returncode == 0 and "counting" not in planned.stdout, planned.stdout
    counted = survey.run("--plan", 3, folder, "-o", top / "counted")
    assert counted.returncode == 0 and "counting" in counted.stdout, counted.stdout
    assert survey.run("--part", 1, job).returncode == 0 and survey.run("--part", 0, job).returncode == 0
    assert survey.run("--join", job).returncode == 0
    assert survey.run(folder, "-o", top / "whole.spld").returncode == 0
    whole, joined = (json.loads(subprocess.run([SPLATD, "info", "--json", path], check=True, stdout=subprocess.PIPE).stdout)
                     for path in (top / "whole.spld", job / "all.spld"))
    for field in "points", "leaf_splats", "bounds", "unit":
        assert whole[field] == joined[field], (field, whole[field], joined[field])
    assert {s["name"] for s in whole["streams"]} <= {s["name"] for s in joined["streams"]}, joined["streams"]


def in_part(command, number, whole, how):
    """The process of the command, stopped or killed by the signal `how` after it has begun the part of that number, and before
    it has replaced the file `whole`. One that was done before the signal came begins once more, where the file was as it is now."""
    def version():
        return whole.stat().st_ino if whole.exists() else None
    end = time.monotonic() + 120
    while time.monotonic() < end:
        before = version()
        running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        for line in running.stderr:
            if line.startswith(f"part {number} of"):
                break
        os.kill(running.pid, how)
        came = os.waitid(os.P_PID, running.pid, os.WEXITED | os.WSTOPPED | os.WNOWAIT).si_code
        if came != os.CLD_EXITED and version() == before:
            return running
        running.send_signal(signal.SIGCONT)
        said = running.communicate()[1]
        assert running.returncode in (0, -signal.SIGKILL), (running.returncode, said)
        if before is None:
            whole.unlink(missing_ok=True)
    raise AssertionError(f"part {number}: the process was done each time before the signal came")


def check_leftovers(survey, command, whole, parts):
    """Of another number of parts nothing stays; what is a user's does; two at once are told; scans written meanwhile are read."""
    first = whole.read_bytes()
    others = [*command[:3], "2", *command[4:]]
    parts.mkdir()
    for name in "part-3.spld", "part-7.empty", f"part-3.spld.splatd-{2**22 + 1}", f".job.json.{2**22 + 1}-0":
        (parts / name).write_text("of a plan before")
    (parts / "job.json").write_text('{"format": "splatd-job"}')
    assert subprocess.run(others, stderr=subprocess.DEVNULL).returncode == 0 and not parts.exists(), list(parts.iterdir())
    with in_part(command, 2, whole, signal.SIGSTOP) as running:
        second = subprocess.run(command, stderr=subprocess.PIPE, text=True)
        assert second.returncode == 2 and "another splatd packs these parts" in second.stderr, second.stderr
        running.kill()
    (parts / "notes.txt").write_text("mine")
    os.utime(survey.scans / "scan 0.ply", (time.time() + 60,) * 2)  # however coarse the disk's clock is
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0 and "it is packed anew" in done.stderr and "it is left" in done.stderr, done.stderr
    assert sorted(p.name for p in parts.iterdir()) == ["job.json", "notes.txt"] and whole.read_bytes() == first
    (parts / "notes.txt").unlink()
    assert subprocess.run(command, stderr=subprocess.DEVNULL).returncode == 0 and not parts.exists()


def check_one_file(survey, top):
    """Parts merged, from any folder, and the same file by one process, which is killed in each of its parts and goes on."""
    merged, whole, parts = top / "merged.spld", top / "whole.spld", top / "whole.spld.parts"
    said = survey.run("--join", survey.truth, "--merge", "-o", merged, "--title", "Parts")
    assert said.returncode == 0 and "points in one file" in said.stdout, said.stdout
    assert survey.run("--join", survey.truth).returncode == 0  # without the title again, for all others
    command = [SPLATD, "pack", "--parts", str(PARTS), survey.scans, "-o", whole, "--title", "Parts"]
    for part in range(PARTS):
        with in_part(command, part + 1, whole, signal.SIGKILL):
            pass
        assert not whole.exists() and parts.is_dir(), part
        assert (parts / f"part-{part - 1}.spld").exists() or not part, part
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 0 and done.stderr.count("it is there already") >= PARTS - 1, done.stderr
    assert whole.read_bytes() == merged.read_bytes()
    assert not parts.exists(), list(parts.iterdir())
    info = json.loads(subprocess.run([SPLATD, "info", "--json", whole], check=True, stdout=subprocess.PIPE).stdout)
    assert info["sources"] == [f"scan {i}.ply" for i in range(SCANS)] and not info.get("tiles"), info
    joined = json.loads(subprocess.run([SPLATD, "info", "--json", survey.truth / "all.spld"], check=True,
                                       stdout=subprocess.PIPE).stdout)
    for field in "points", "leaf_splats", "bounds", "unit", "levels":
        assert info[field] == joined[field], (field, info[field], joined[field])
    assert sorted(p.name for p in survey.truth.iterdir()) == sorted(
        [f"part-{part}.spld" for part in range(PARTS)] + ["all.spld", "job.json"])  # merging writes nothing there
    check_leftovers(survey, command, whole, parts)
    shutil.copy(survey.scans / "scan 0.ply", top / "copy.spld")
    (top / "folder.spld").mkdir()
    assert survey.run("--plan", 2, top / "copy.spld", "-o", top / "of copy").returncode == 0
    assert survey.run("--part", 0, top / "of copy").returncode == survey.run("--part", 1, top / "of copy").returncode == 0
    (top / "link.spld.parts").symlink_to(top / "nowhere")
    said = survey.run("--parts", 3, survey.scans, "-o", top / "link.spld")
    assert said.returncode == 2 and "link.spld.parts: this is a link" in said.stdout, said.stdout
    for words, says in ((("--merge", survey.scans, "-o", whole), "--merge is of parts that are joined"),
                        (("--join", survey.truth, "--merge"), "--merge needs a dataset to write"),
                        (("--join", survey.truth, "--merge", "-o", survey.truth / "part-0.spld"), "is a tile of"),
                        (("--parts", 3, top / "copy.spld", "-o", top / "copy.spld"), "is an input too"),
                        (("--join", top / "of copy", "--merge", "-o", top / "copy.spld"), "is an input too"),
                        (("--parts", 3, survey.scans, "-o", top / "folder.spld"), "exists and is no file"),
                        (("--join", top / "nowhere", "--merge", "-o", top / "folder.spld"), "exists and is no file"),
                        (("--parts", 3, "--part", 1, survey.truth), "name one way"),
                        (("--parts", 3, "--prune", 9, survey.scans, "-o", merged), "cannot be split into parts"),
                        (("--parts", 3, survey.scans, "-o", survey.truth), "writes a dataset")):
        said = survey.run(*words)
        assert said.returncode == 2 and says in said.stdout, (words, said.stdout)
    for name in "merged", "copy", "folder":
        assert not (top / f"{name}.spld.parts").exists(), name


def check_refusals(survey):
    for words, said in ((["JOB=/nowhere"], "JOB=/nowhere is no job"), (["JOB="], "JOB= is no job"),
                        (["JOB=" + str(survey.scans)], "is no job: splatd pack --plan N SCANS -o JOB makes one")):
        made = survey.make(*words)
        assert made.returncode and said in made.stdout, (words, made.stdout)
    for words, said in ((("--plan", 2, survey.scans), "--plan needs a folder for the job"),
                        (("--plan", 2, "-o", "job"), "--plan needs at least one scan"),
                        (("--plan", 2, survey.scans, "-o", survey.scans), "holds something else than a job"),
                        (("--plan", 2, "--prune", 3, survey.scans, "-o", survey.bin / "j"), "--prune cannot be split"),
                        (("--plan", 2, "--part", 3, survey.scans, "-o", survey.bin / "j"), "are three steps"),
                        (("--part", 0, survey.job, "--keep", "none"), "--keep is decided by the plan"),
                        (("--part", 0, survey.job, "-o", "a.spld"), "leave out -o"),
                        (("--part", 0), "--part takes one folder"), (("--join", survey.job, survey.job), "--join takes one folder"),
                        (("--join", survey.job, "--memory", 99), "--memory is decided by the plan"),
                        (("--join", survey.scans), "a job is a folder that"), (("--part", PARTS, survey.job), "and none of number"),
                        (("--join", survey.job, "-o", survey.bin / "a.spld"), "lies in another folder than"),
                        (("--halo", 1, survey.scans, "-o", survey.bin / "a.spld"), "--halo is of parts")):
        said_of = survey.run(*words)
        assert said_of.returncode == 2 or said_of.returncode == 1, (words, said_of.stdout)
        assert said in said_of.stdout, (words, said_of.stdout)
    assert list(survey.bin.iterdir()) == [survey.bin / "splatd"] or not (survey.bin / "j").exists()


def task(survey, part, *options, **more):
    return subprocess.run(["bash", PACK / "slurm.sbatch", survey.job, *options], text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, env=survey.environment(SLURM_ARRAY_TASK_ID=str(part), **more))


def check_task(survey):
    survey.forget()
    for part in 2, 0, 1, 3, 1:
        done = task(survey, part, SLURM_MEM_PER_NODE="512", SLURM_CPUS_PER_TASK="2")
        assert done.returncode == 0, done.stdout
    assert "part 1 is there" in done.stdout, done.stdout
    survey.check()
    missing = task(survey, 7)
    assert missing.returncode == 2 and "and none of number 7" in missing.stdout, missing.stdout
    survey.part(0).unlink()
    assert task(survey, 0, "--memory", "64").returncode == 0  # options reach splatd
    assert task(survey, 0, "--points-only").returncode == 2
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
    args = [word.replace(mount["mountPath"] + "/job", str(survey.job)).replace(f"$({env['name']})", "1")
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
                            PACK / "slurm.sbatch", survey.job], env=environment, check=True, timeout=120)
            for part in range(PARTS):
                print(f"task {part}:", (top / f"{part}.log").read_text().strip().split("\n")[-1])
            survey.check()
            survey.part(turn).unlink()  # as if it had been killed
    survey.make()
    survey.check(joined=True)


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
        check_at_once(survey)
        check_failures(survey)
        check_one_file(survey, pathlib.Path(folder))
        check_refusals(survey)
        check_headers(survey, pathlib.Path(folder))
        check_task(survey)
        check_job(survey)
print("parts are whole")
