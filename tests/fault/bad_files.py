"""Every scan of SPLATD_DATA/bad and SPLATD_DATA/formats through the command line: it is packed, or refused with exit code
2 and a message that names the file; a refusal leaves nothing behind."""
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

wrong, packed, refused = [], 0, 0
with tempfile.TemporaryDirectory() as folder:
    out = pathlib.Path(folder) / "out.spld"
    for source in sorted(p for kind in ("bad", "formats") for p in (DATA / kind).rglob("*") if p.is_file()):
        if source.name.startswith("README"):
            continue
        name = source.relative_to(DATA)
        done = subprocess.run([SPLATD, "pack", source, "-o", out], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              timeout=600)
        said = done.stderr.decode(errors="replace")
        if done.returncode == 0:
            packed += 1
            if subprocess.run([SPLATD, "info", out], stdout=subprocess.DEVNULL).returncode:
                wrong.append(f"{name}: packed, but the dataset does not open")
            out.unlink()
        elif done.returncode == 2:
            refused += 1
            last = said.strip().splitlines()[-1] if said.strip() else ""
            print(f"{name}: {last}")
            if source.name not in said:
                wrong.append(f"{name}: refused, but the message does not name it: {last}")
        else:
            wrong.append(f"{name}: exit code {done.returncode}: {said[-500:]}")
        left = os.listdir(folder)
        if left:
            wrong.append(f"{name}: left behind {left}")
            for file in left:
                os.unlink(os.path.join(folder, file))
print(f"{packed} packed, {refused} refused")
print("\n".join(wrong))
sys.exit(1 if wrong else 0)
