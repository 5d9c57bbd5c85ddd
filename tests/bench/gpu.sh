#!/usr/bin/env bash
# What a GPU does with splatd: the gpu and golden suites on Vulkan and on EGL, then frame times, accuracy beside stored
# images and frames over HTTP. It needs a driver and nothing else: copy there what `deploy/bundle.sh --tests` made and
# run tests/bench/gpu.sh inside it. Everything it says is also in OUT/report.md.
set -uo pipefail

usage() {
    cat <<TEXT
usage: tests/bench/gpu.sh [OPTION…] OUT

  OUT               a folder: report.md, logs/, datasets
  --only LIST       of tests,frames,large,paging,http,loss, joined by commas (default: all)
  --points N        of the courtyard that is drawn (20e6), and N,M: of the large one (200e6)
  --seconds N       of each load over HTTP (5)
  --jobs N          tests at a time (half of the cores)
TEXT
}

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
only=tests,frames,large,paging,http,loss points=20e6 large=200e6 seconds=5 out=
jobs=$((($(nproc) + 1) / 2))
while [ $# -gt 0 ]; do
    case $1 in
    --only) only=$2; shift ;;
    --points) points=${2%,*}; [ "$2" = "$points" ] || large=${2#*,}; shift ;;
    --seconds) seconds=$2; shift ;;
    --jobs) jobs=$2; shift ;;
    -h | --help) usage; exit 0 ;;
    -*) echo "gpu.sh: unknown argument '$1'" >&2; usage >&2; exit 2 ;;
    *) out=$1 ;;
    esac
    shift
done
[ -n "$out" ] || { usage >&2; exit 2; }
splatd=$root/splatd
[ -x "$splatd" ] || { echo "gpu.sh: no $splatd; make the folder with deploy/bundle.sh --tests" >&2; exit 2; }
mkdir -p "$out/logs"
out=$(cd "$out" && pwd)
export SPLATD_SOURCE_ROOT=$root SPLATD_BINARY=$splatd
export XDG_CACHE_HOME=${XDG_CACHE_HOME:-$out/cache}
devices=$("$splatd" devices 2>/dev/null | awk '$1 ~ /:0$/ { sub(/:0$/, "", $1); printf "%s ", $1 }')
[ -n "$devices" ] || { "$splatd" devices; exit 1; }
failed=0

say() { printf '%s\n' "$*" | tee -a "$out/report.md"; }
block() { say '```'; tee -a "$out/report.md"; say '```'; }
wanted() { case ,$only, in *,$1,*) return 0 ;; *) return 1 ;; esac }
since() { echo $(($(date +%s) - $1)); }

# name, device, command…: one test in the background; its verdict is a line of OUT/verdicts.
run_test() {
    local name=$1 device=$2 code=0 begin=$EPOCHREALTIME folder
    shift 2
    folder=$out/logs/$name-$device
    mkdir -p "$folder"
    (cd "$folder" && SPLATD_TEST_DEVICE=$device timeout 150 "$@") >"$folder.txt" 2>&1 || code=$?
    case $code in 0) code=passed ;; 77) code=skipped ;; 124) code="FAILED (150 s)" ;; *) code="FAILED ($code)" ;; esac
    awk -v b="$begin" -v e="$EPOCHREALTIME" -v n="$name $device" -v c="$code" \
        'BEGIN { printf "%-28s %6.1f s  %s\n", n, e - b, c }' >>"$out/verdicts"
}

tests() {
    local begin device program
    begin=$(date +%s)
    say "## Tests" ""
    : >"$out/verdicts"
    for program in golden stability "$root"/bin/test-gpu-*; do
        for device in $devices; do
            while [ "$(jobs -rp | wc -l)" -ge "$jobs" ]; do wait -n; done
            case $program in
            golden) run_test golden "$device" "$root/bin/golden" "$device" & ;;
            stability) run_test stability "$device" "$root/bin/stability" invariants "$device" sums layers soft & ;;
            *) run_test "$(basename "$program")" "$device" "$program" & ;;
            esac
        done
    done
    case $devices in *vulkan*egl* | *egl*vulkan*) run_test golden backends "$root/bin/golden" backends & ;; esac
    wait
    sort "$out/verdicts" | block
    failed=$((failed + $(grep -c FAILED "$out/verdicts")))
    say "$(grep -c passed "$out/verdicts") passed, $(grep -c FAILED "$out/verdicts") failed, $(grep -c skipped "$out/verdicts") skipped" \
        "in $(since "$begin") s"
    grep FAILED "$out/verdicts" | while read -r program device rest; do
        say "" "$program $device:"
        grep -E 'FAILED|\[  ERROR|Failure|error|differ' "$out/logs/$program-$device.txt" | head -12 | cut -c1-200 | block
    done
    say ""
}

# points, name: a scan of the courtyard, packed.
dataset() {
    local name=$2 begin
    [ -f "$out/$name.spld" ] && return
    begin=$(date +%s)
    "$splatd" synth courtyard --points "$1" --format ply -o "$out/$name" >"$out/logs/$name-synth.txt" 2>&1 &&
        say "$name: $1 points scanned in $(since "$begin") s" && begin=$(date +%s) &&
        "$splatd" pack "$out/$name/courtyard.ply" -o "$out/$name.spld" >"$out/logs/$name-pack.txt" 2>&1 &&
        say "$name: $(tail -1 "$out/logs/$name-pack.txt")" || { say "$name could not be made"; failed=$((failed + 1)); return 1; }
    rm -rf "${out:?}/$name"
}

bench() { # the rows of `splatd bench`, and where its text goes
    "$splatd" bench "$@" 2>&1 | block
}

frames() {
    say "## Frames" ""
    dataset "$points" courtyard || return
    "$splatd" render "$out/courtyard.spld" --size 1280x720 -o "$out/view.jpg" >/dev/null 2>&1
    local list size
    list=$(echo $devices | tr ' ' ,)
    bench "$out/courtyard.spld" --device "$list" --method splat,nearest,points,fill --lod 0.5,1,2,4
    for size in 1920x1080 3840x2160; do
        bench "$out/courtyard.spld" --size $size --method splat,nearest,points,fill --lod 1,2
    done
    bench "$out/courtyard.spld" --soft 'plane:0,0,1.2,0,0,1>0' --soft-model express,layer,concentric,base --frames 8
}

large() {
    say "## Large" ""
    dataset "$large" large || return
    bench "$out/large.spld" --size 1920x1080 --method splat,nearest,points,fill --lod 0.5,1,2
}

paging() {
    say "## Paging: a quarter of the memory" ""
    local file=$out/large.spld
    [ -f "$file" ] || file=$out/courtyard.spld
    [ -f "$file" ] || return
    bench "$file" --method splat --lod 1 --frames 10
    bench "$file" --method splat --lod 1 --frames 10 --memory-limit $(($(stat -c %s "$file") / 4 / 1048576 + 256))
}

curl() { LD_LIBRARY_PATH=$root/lib "$root/bin/curl" "$@"; }

# clients, query…: views a second, each a little other than all before, so that no cache has it. Those that were refused
# are no views.
loads=0
load() {
    local clients=$1
    shift
    loads=$((loads + 1))
    cat >"$out/load.lua" <<LUA
local thread, views = 0, 0
function setup(t) thread = thread + 1; t:set("own", thread) end
function request()
    views = views + 1
    return wrk.format("GET", string.format("/v1/datasets/courtyard/view?$*&fov=60.%08d", ($loads * 10 + own) * 100000 + views))
end
LUA
    LD_LIBRARY_PATH=$root/lib "$root/bin/wrk" -t "$((clients < 8 ? clients : 8))" -c "$clients" -d "${seconds}s" --latency \
        -s "$out/load.lua" "http://127.0.0.1:$port" 2>&1 |
        awk -v c="$clients" -v q="$*" '$1 == "50%" { half = $2 } $1 == "99%" { most = $2 } $2 == "requests" && $3 == "in" { all = $1 }
            $1 == "Requests/sec:" { rate = $2 } /Non-2xx/ { refused = $NF }
            END {
                views = all ? rate * (all - refused) / all : 0
                printf "%3d clients  %8.1f views/s  median %9s  99 %% %9s  %s%s\n", c, views, half, most, q,
                    refused ? ", and " refused " refused" : ""
            }'
}

http() {
    say "## Over HTTP" ""
    [ -f "$out/courtyard.spld" ] || dataset "$points" courtyard || return
    port=18080
    "$splatd" serve --listen 127.0.0.1:$port --quiet "$out/courtyard.spld" >"$out/logs/serve.txt" 2>&1 &
    local daemon=$! clients
    for ((i = 0; i < 300; i++)); do curl -s -o /dev/null "http://127.0.0.1:$port/v1/status" && break; sleep 0.1; done
    {
        for clients in 1 4 16 64; do load $clients "width=1280&height=720"; done
        load 16 "width=1280&height=720&method=points&lod=2"
        load 16 "width=1920&height=1080"
        curl -s -D - -o /dev/null "http://127.0.0.1:$port/v1/datasets/courtyard/view?width=1280&height=720&margin=1.5" |
            grep -i '^server-timing'
    } | block
    kill $daemon
    wait $daemon
}

loss() {
    say "## A device that is lost, three times" ""
    [ -f "$out/courtyard.spld" ] || dataset "$points" courtyard || return
    port=18081
    SPLATD_INJECT_LOSS_AFTER=5x3 "$splatd" serve --listen 127.0.0.1:$port --quiet "$out/courtyard.spld" \
        >"$out/logs/loss.txt" 2>&1 &
    local daemon=$!
    for ((i = 0; i < 300; i++)); do curl -s -o /dev/null "http://127.0.0.1:$port/v1/status" && break; sleep 0.1; done
    for ((i = 0; i < 40; i++)); do
        curl -s -o /dev/null -w '%{http_code} ' "http://127.0.0.1:$port/v1/datasets/courtyard/view?width=640&height=360&margin=1.$((i + 1))"
    done | block
    kill $daemon
    wait $daemon
}

: >"$out/report.md"
say "# $(date -u +%F)" ""
{
    "$splatd" --version
    "$splatd" devices
    nvidia-smi --query-gpu=name,driver_version,memory.total --format=csv,noheader 2>/dev/null
    echo "$(nproc) cores, $(awk '/MemTotal/ { printf "%d", $2 / 1048576 }' /proc/meminfo) GiB, $(uname -srm)"
} 2>&1 | block
for part in tests frames large paging http loss; do
    wanted $part && $part
done
say "" "$failed failed"
[ "$failed" = 0 ]
