"""Every scan of SPLATD_DATA/bad and SPLATD_DATA/formats through the command line: it is packed, or refused with exit code
2 and a message that names the file; a refusal leaves nothing behind."""
import concurrent.futures
import os
import pathlib
import subprocess
import sys
import tempfile

SPLATD = os.environ["SPLATD_BINARY"]
DATA = pathlib.Path(os.environ["SPLATD_DATA"])
if not (DATA / "bad").is_dir():
    print(f"no {DATA / 'bad'}")
    sys.exit(77)



def attempt(source):
    """(what is wrong, "packed" or the refusal) of one file."""
    name, wrong = source.relative_to(DATA), []
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.spld"
        done = subprocess.run([SPLATD, "pack", source, "-o", out], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              timeout=600)
        said = done.stderr.decode(errors="replace").strip()
        end = "packed"
        if done.returncode == 0:
            if subprocess.run([SPLATD, "info", out], stdout=subprocess.DEVNULL).returncode:
                wrong.append(f"{name}: packed, but the dataset does not open")
            out.unlink()
        elif done.returncode == 2:
            end = f"{name}: {said.splitlines()[-1] if said else ''}"
            if source.name not in said:
                wrong.append(f"{name}: refused, but the message does not name it: {end}")
        else:
            wrong.append(f"{name}: exit code {done.returncode}: {said[-500:]}")
        left = os.listdir(folder)
        if left:
            wrong.append(f"{name}: left behind {left}")
    return wrong, end


sources = sorted(p for kind in ("bad", "formats") for p in (DATA / kind).rglob("*")
                 if p.is_file() and not p.name.startswith("README"))
with concurrent.futures.ThreadPoolExecutor(2) as pool:  # most of a small pack is one thread's
    results = list(pool.map(attempt, sources))
wrong = [line for lines, _ in results for line in lines]
refusals = [end for _, end in results if end != "packed"]
print("\n".join(refusals))
print(f"{len(results) - len(refusals)} packed, {len(refusals)} refused")
print("\n".join(wrong))
sys.exit(1 if wrong or not results else 0)
