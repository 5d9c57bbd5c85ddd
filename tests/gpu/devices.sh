#!/bin/sh
# splatd devices: the table, the JSON that scripts read, exit codes, and a machine without any driver.
set -eu
splatd=$SPLATD_BINARY
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
expect() { # exit code, then the command
    want=$1
    shift
    got=0
    "$@" >"$out/stdout" 2>"$out/stderr" || got=$?
    [ "$got" = "$want" ] || { echo "$*: exit $got, not $want"; cat "$out/stdout" "$out/stderr"; exit 1; }
}
says() { grep -q "$1" "$out/$2" || { echo "$2 does not say '$1':"; cat "$out/$2"; exit 1; }; }

expect 0 "$splatd" devices --help
says 'splatd devices --json | jq' stdout
expect 2 "$splatd" devices --no-such-option
expect 2 "$splatd" devices extra
says "'extra'" stderr

# No driver at all: still a list with the reasons, and a failure that says what to install.
export VK_DRIVER_FILES=/nonexistent VK_ICD_FILENAMES=/nonexistent
export __EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent __EGL_VENDOR_LIBRARY_DIRS=/nonexistent
expect 1 "$splatd" devices --json
says 'mesa-vulkan-drivers' stderr
python3 -c 'import json, sys; assert not any(d["usable"] for d in json.load(open(sys.argv[1])))' "$out/stdout"
unset VK_DRIVER_FILES VK_ICD_FILENAMES __EGL_VENDOR_LIBRARY_FILENAMES __EGL_VENDOR_LIBRARY_DIRS

"$splatd" devices >"$out/table" 2>/dev/null || exit 77
expect 0 "$splatd" devices --json
python3 - "$out/stdout" "$out/table" <<'PY'
import json, sys
devices, table = json.load(open(sys.argv[1])), open(sys.argv[2]).read()
assert any(d["usable"] for d in devices)
for d in devices:
    assert set(d) == {"device", "backend", "index", "name", "driver", "uuid", "software", "usable", "reason"}, d
    assert d["device"] == f'{d["backend"]}:{d["index"]}' and d["usable"] == (not d["reason"])
    assert d["device"] in table and d["name"] in table
PY
