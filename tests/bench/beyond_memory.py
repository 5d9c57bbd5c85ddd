"""What a bound of memory costs a pack and a service: the same scan packed within each bound, with the memory that the process
took over its time; the dataset opened, and a random tour of it, one view after the other, with all of the
device's memory, with a part, and with such a part on each of two devices.

usage: beyond_memory.py SCAN FOLDER [--memory none,4G,1G] [--device-memory 512M] [--places 40]
                        [--threads N] [--keep]

SCAN is what `splatd pack` takes, FOLDER a folder on a disk with room for the dataset and what a bound leaves to it. `none` among
the bounds is the pack in memory. Prints tables in Markdown and writes FOLDER/memory.svg, memory in use over time; exit 1 where
two packs differ or a bound did not hold.

environment: as for measure.py"""
import argparse
import hashlib
import json
import os
import pathlib
import random
import re
import statistics
import subprocess
import sys
import threading
import time

from measure import SPLATD, free_port, get

COLOURS = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#8c564b"]


def parse_bytes(text):
    number, unit = re.fullmatch(r"(\d+)([KMGT]?)", text).groups()
    return int(number) << " KMGT".index(unit or " ") * 10


def resident(pid):
    try:
        return int(pathlib.Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, IndexError):
        return 0


def pack(scan, dataset, bound, threads):
    """(seconds, processor seconds, samples of (second, bytes))."""
    options = ([] if bound == "none" else ["--memory", bound]) + (["--threads", str(threads)] if threads else [])
    before, began = os.times(), time.monotonic()
    process = subprocess.Popen([SPLATD, "pack", scan, "-o", dataset, *options], stderr=subprocess.PIPE, stdout=subprocess.PIPE,
                               text=True)
    samples = []
    with open(f"{dataset}.log", "w") as log:
        told = threading.Thread(target=lambda: [log.write(line) for line in process.stderr])
        told.start()
        while process.poll() is None:
            samples.append((time.monotonic() - began, resident(process.pid)))
            time.sleep(0.25)
        told.join()
    took, after = time.monotonic() - began, os.times()
    out = process.stdout.read()
    if process.returncode:
        sys.exit(f"packing within {bound} failed:\n{pathlib.Path(f'{dataset}.log').read_text()[-2000:]}")
    used = after.children_user - before.children_user + after.children_system - before.children_system
    points = int(re.search(r"(\d+) points in", out + pathlib.Path(f"{dataset}.log").read_text())[1])
    return took, used, samples, points


def digest(path):
    whole = hashlib.blake2b()
    with open(path, "rb") as file:
        while block := file.read(1 << 24):
            whole.update(block)
    return whole.hexdigest()


def chart(path, runs):
    wide, high, left, foot = 900, 420, 70, 50
    longest = max(samples[-1][0] for _, samples in runs)
    most = max(bytes for _, samples in runs for _, bytes in samples) * 1.05
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" font-family="sans-serif" font-size="13">',
           f'<rect width="{wide}" height="{high}" fill="white"/>',
           f'<text x="{left}" y="18">Resident memory of splatd pack, GB, over seconds</text>']

    def place(second, bytes):
        return (f"{left + second / longest * (wide - left - 20):.1f},"
                f"{high - foot - bytes / most * (high - foot - 30):.1f}")
    for i in range(5):
        x, y = place(longest * i / 4, most * i / 4).split(",")
        out.append(f'<text x="{x}" y="{high - foot + 18}" text-anchor="middle">{longest * i / 4:.0f}</text>')
        out.append(f'<text x="{left - 8}" y="{float(y) + 4:.1f}" text-anchor="end">{most * i / 4 / 1e9:.1f}</text>')
        out.append(f'<path d="M{left} {y}H{wide - 20}" stroke="#ddd"/>')
    for i, (bound, samples) in enumerate(runs):
        every = max(1, len(samples) // 600)
        line = " ".join(place(*sample) for sample in samples[::every])
        out.append(f'<polyline points="{line}" fill="none" stroke="{COLOURS[i % 5]}" stroke-width="1.5"/>')
        name = "in memory" if bound == "none" else f"--memory {bound}"
        out.append(f'<text x="{left + 20 + 160 * i}" y="{high - 8}" fill="{COLOURS[i % 5]}">{name}</text>')
    path.write_text("\n".join(out) + "\n</svg>\n")


class Service:
    def __init__(self, dataset, *options):
        self.port, self.name = free_port(), pathlib.Path(dataset).stem
        began = time.monotonic()
        self.process = subprocess.Popen([SPLATD, "serve", "--quiet", "--no-verify", "--listen", f"127.0.0.1:{self.port}",
                                         "--ops-listen", "", "--cache", "0", "--deadline", "60000", *options, dataset])
        while True:
            try:
                if get(self.port, f"/v1/datasets/{self.name}")[0] == 200:
                    break
            except OSError:
                if self.process.poll() is not None:
                    sys.exit("the daemon has ended")
                time.sleep(0.01)
        self.opened_s = time.monotonic() - began

    def view(self, eye, target):
        text = ",".join(f"{x:.4f}" for x in eye), ",".join(f"{x:.4f}" for x in target)
        status, _, body, ms = get(self.port, f"/v1/datasets/{self.name}/view?width=1280&height=720&fov=60&lod=1&"
                                             f"eye={text[0]}&target={text[1]}")
        if status != 200:
            sys.exit(f"a view failed with {status}: {body[:300]}")
        return ms, body

    def status(self):
        return json.loads(get(self.port, "/v1/status")[2])

    def end(self):
        self.process.terminate()
        self.process.wait(60)


def places(dataset, count):
    """Random ones a tenth of the width above what lies there, looking ahead and down."""
    info = json.loads(subprocess.run([SPLATD, "info", "--json", dataset], capture_output=True, text=True, check=True).stdout)
    low, high = info["bounds"]["min"], info["bounds"]["max"]
    chance, wide = random.Random(1), max(high[0] - low[0], high[1] - low[1])
    for _ in range(count):
        eye = [chance.uniform(low[c] + 0.2 * (high[c] - low[c]), high[c] - 0.2 * (high[c] - low[c])) for c in (0, 1)]
        ahead = [chance.uniform(-0.15, 0.15) * wide for _ in (0, 1)]
        yield [*eye, low[2] + 0.05 * wide], [eye[0] + ahead[0], eye[1] + ahead[1], low[2] + 0.01 * wide]


def tour(dataset, count, device_memory):
    print("\n| device memory | opened and listed, s | resident then, MB | median view, ms | 90 % of views, ms | views/s | pages that "
          "made room |\n|---|---|---|---|---|---|---|")
    pictures, rates = {}, {}
    two = f"{device_memory} on each of two devices"
    for limit, options in (("all", []), (device_memory, ["--memory-limit", device_memory]),
                           (two, ["--memory-limit", device_memory, "--device", "vulkan:0,vulkan:0"])):
        service = Service(dataset, *options)
        at_start = resident(service.process.pid)
        times, bodies = [], []
        for eye, target in places(dataset, count):
            ms, body = service.view(eye, target)
            times.append(ms)
            bodies.append(body)
        evicted = service.status()["counters"]["pages_evicted"]
        service.end()
        pictures[limit], rates[limit] = bodies, 1000 * count / sum(times)
        print(f"| {limit} | {service.opened_s:.2f} | {at_start / 1e6:.0f} | {statistics.median(times):.0f} | "
              f"{sorted(times)[int(0.9 * count)]:.0f} | {rates[limit]:.2f} | {evicted} |", flush=True)
    same = {limit: sum(a == b for a, b in zip(pictures["all"], bodies)) for limit, bodies in pictures.items()}
    print(f"\nWith {device_memory} {rates[device_memory] / rates['all']:.2f} of the rate, on each of two devices "
          f"{rates[two] / rates['all']:.2f}; of {count} pictures {same[device_memory]} and {same[two]} are the same, the others "
          "are coarser somewhere.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scan")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--memory", default="none,4G,1G")
    parser.add_argument("--device-memory", default="512M")
    parser.add_argument("--places", type=int, default=40)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--keep", action="store_true", help="the last dataset stays in FOLDER")
    a = parser.parse_args()
    a.folder.mkdir(parents=True, exist_ok=True)
    runs, wrong, first = [], [], None
    print("| bound | points/s | of the first row's | processor time a million points, s | most memory, MB |\n|---|---|---|---|---|")
    for bound in a.memory.split(","):
        dataset = str(a.folder / "packed.spld")
        took, used, samples, points = pack(a.scan, dataset, bound, a.threads)
        runs.append((bound, samples))
        most = max(bytes for _, bytes in samples)
        first = first or (took, digest(dataset))
        print(f"| {'in memory' if bound == 'none' else bound} | {points / took:,.0f} | {first[0] / took:.2f} | "
              f"{used / points * 1e6:.2f} | {most / 1e6:.0f} |", flush=True)
        if digest(dataset) != first[1]:
            wrong.append(f"the bytes within {bound} are others")
        if bound != "none" and most > parse_bytes(bound):
            wrong.append(f"{bound} did not hold: {most / 1e6:.0f} MB")
    chart(a.folder / "memory.svg", runs)
    tour(dataset, a.places, a.device_memory)
    if not a.keep:
        os.unlink(dataset)
    if wrong:
        sys.exit("; ".join(wrong))


if __name__ == "__main__":
    main()
