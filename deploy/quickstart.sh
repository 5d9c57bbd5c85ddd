#!/usr/bin/env bash
# From a fresh clone on Debian 12 to pictures over HTTP: installs packages, builds, makes a sample scan, packs it,
# serves it and fetches view.jpg and depth.png. Runs until Ctrl-C; a second run reuses what the first one made.
set -euo pipefail

usage() {
    cat <<TEXT
usage: deploy/quickstart.sh [--once] [--port N] [--dir DIR]

  --once      end once the pictures are there
  --port N    serve on 127.0.0.1:N (8080)
  --dir DIR   where build, scan, dataset and pictures go (quickstart/ in the checkout)
TEXT
}

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
dir=$top/quickstart port=8080 once=
while [ $# -gt 0 ]; do
    case $1 in
    --once) once=yes ;;
    --port) port=${2-}; shift ;;
    --dir) dir=${2-}; shift ;;
    -h | --help) usage; exit 0 ;;
    *) echo "quickstart: unknown argument '$1'" >&2; usage >&2; exit 2 ;;
    esac
    shift || { usage >&2; exit 2; }
done
[[ $port =~ ^[0-9]{1,5}$ ]] && [ "$port" -ge 1 ] && [ "$port" -le 65535 ] ||
    { echo "quickstart: --port takes a number from 1 to 65535, not '$port'" >&2; exit 2; }
[ -n "$dir" ] || { echo "quickstart: --dir takes a folder" >&2; exit 2; }

say() { echo "== $*"; }

if (exec 3<>"/dev/tcp/127.0.0.1/$port") 2>/dev/null; then
    echo "quickstart: port $port of 127.0.0.1 is in use; stop what listens there or take another: --port $((port % 65535 + 1))" >&2
    exit 1
fi

mkdir -p "$dir"
dir=$(cd "$dir" && pwd)
build=$dir/build splatd=$dir/build/src/splatd scan=$dir/scan dataset=$dir/courtyard.spld

say "packages"
"$top/deploy/install-packages.sh" build run quickstart

say "build"
[ -f "$build/build.ninja" ] || meson setup "$build" "$top" -Dtests=false >"$dir/setup.log" 2>&1 ||
    { cat "$dir/setup.log" >&2; rm -rf "$build"; exit 1; }
ninja -C "$build" --quiet

# A container of an older format, or one whose content does not hold, is made anew.
if ! "$splatd" info --json "$dataset" >/dev/null 2>&1; then
    say "sample scan: an analytic courtyard, 2 million points from several stations"
    "$splatd" synth courtyard --points 2000000 --seed 1 -o "$scan"
    say "pack"
    "$splatd" pack "$scan/courtyard.ptx" -o "$dataset"
fi

say "serve"
daemon=
stop() {
    trap - EXIT INT TERM
    if [ -n "$daemon" ]; then
        kill -TERM "$daemon" 2>/dev/null || true
        wait "$daemon" || true
    fi
}
trap stop EXIT
trap 'exit 130' INT
trap 'exit 143' TERM
"$splatd" serve --listen "127.0.0.1:$port" "$dataset" &
daemon=$!
url=http://127.0.0.1:$port/v1/datasets/courtyard/view
for ((i = 0; ; i++)); do
    curl -sf -o /dev/null --max-time 5 "http://127.0.0.1:$port/v1/datasets/courtyard" && break
    kill -0 "$daemon" 2>/dev/null || { echo "quickstart: the daemon ended before it was ready" >&2; exit 1; }
    [ "$i" -lt 300 ] || { echo "quickstart: the daemon was not ready within 60 s" >&2; exit 1; }
    sleep 0.2
done

fetch() { # URL FILE
    curl -sSf --max-time 60 -o "$2.part" "$1" && mv "$2.part" "$2" || { rm -f "$2.part"; exit 1; }
}
fetch "$url?width=1280&height=720" "$dir/view.jpg"
fetch "$url?width=1280&height=720&layer=depth&format=png" "$dir/depth.png"
say "colour           $dir/view.jpg"
say "depth in mm      $dir/depth.png"
say "look round       http://127.0.0.1:$port/"
[ -z "$once" ] || exit 0
say "Ctrl-C ends the daemon"
wait "$daemon"
