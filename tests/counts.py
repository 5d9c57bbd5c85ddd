"""What Meson's log of a run says, a line each suite; the last line is how many passed, failed and were skipped in all.
What the tests that failed say of it is added to the file WHY.
usage: counts.py BUILD testlog.json WHY SUITE..."""
import json
import os
import re
import sys

LINES = 40  # of a failure
build, log, why, suites = sys.argv[1], sys.argv[2], sys.argv[3], sys.argv[4:]


def reasons(test):
    """What begins with FAIL in the output of a test in Python, without the log of its daemon behind it; else the end."""
    text = test.get("stdout", "") + test.get("stderr", "")
    found = re.findall(r"^FAIL \w.*?(?=^ok   |^skip |^FAIL \w|^\d{4}-\d\d-\d\dT|\Z)", text, re.DOTALL | re.MULTILINE)
    for lines in map(str.splitlines, found or [text]):
        yield from lines[:1] if found else []
        yield from lines[1 if found else 0:][-LINES:]


counts = {suite: [0, 0, 0, 0.0] for suite in suites}
if os.path.exists(log):
    for line in open(log, encoding="utf-8"):
        test = json.loads(line)
        of = test["name"].split(" / ")[0].split(":")[-1].split("+")
        count = counts[next(s for s in suites if s in of)]
        result = test["result"]
        count[0 if result in ("OK", "EXPECTEDFAIL") else 2 if result == "SKIP" else 1] += 1
        count[3] += test.get("duration", 0)
        if result not in ("OK", "EXPECTEDFAIL", "SKIP"):
            with open(why, "a", encoding="utf-8") as out:
                print(f"{build} {test['name']}: {result}", *reasons(test), sep="\n", file=out)
for suite, count in counts.items():
    if not any(count[:3]):  # silence is a failure
        count[1] = 1
    print(f"{build:10} {suite:9} {count[0]} passed, {count[1]} failed, {count[2]} skipped, {count[3]:.0f} s of tests")
print(*(sum(count[i] for count in counts.values()) for i in range(3)))
