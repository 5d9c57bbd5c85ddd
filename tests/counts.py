"""What Meson's log of a run says, a line each suite; the last line is how many passed, failed and were skipped in all.
usage: counts.py BUILD testlog.json SUITE..."""
import json
import os
import sys

build, log, suites = sys.argv[1], sys.argv[2], sys.argv[3:]
counts = {suite: [0, 0, 0, 0.0] for suite in suites}
if os.path.exists(log):
    for line in open(log, encoding="utf-8"):
        test = json.loads(line)
        of = test["name"].split(" / ")[0].split(":")[-1].split("+")
        count = counts[next(s for s in suites if s in of)]
        result = test["result"]
        count[0 if result in ("OK", "EXPECTEDFAIL") else 2 if result == "SKIP" else 1] += 1
        count[3] += test.get("duration", 0)
for suite, count in counts.items():
    if not any(count[:3]):  # silence is a failure
        count[1] = 1
    print(f"{build:10} {suite:9} {count[0]} passed, {count[1]} failed, {count[2]} skipped, {count[3]:.0f} s of tests")
print(*(sum(count[i] for count in counts.values()) for i in range(3)))
