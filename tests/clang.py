"""What Clang warns of in the sources of a build by GCC: each is read as that build compiled it, and no object is made.

usage: clang.py BUILD"""
import concurrent.futures
import json
import os
import pathlib
import shlex
import subprocess
import sys

build = pathlib.Path(sys.argv[1])


def warnings_of(entry):
    words = shlex.split(entry["command"])
    first = next(i for i, word in enumerate(words) if word.startswith("-"))  # behind the compiler and what runs it
    command = ["clang", *words[first : words.index("-MD")], "-fsyntax-only", "-Werror", "-Wno-unknown-warning-option", entry["file"]]
    done = subprocess.run(command, cwd=entry["directory"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.stdout or f"{entry['file']}: clang ended with {done.returncode}\n" if done.returncode else ""


entries = [e for e in json.loads((build / "compile_commands.json").read_text()) if e["file"].endswith(".c")]
with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
    said = list(pool.map(warnings_of, entries))
print("".join(said) or f"{len(entries)} sources")
sys.exit(1 if any(said) or not entries else 0)
