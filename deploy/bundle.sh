#!/usr/bin/env bash
# A folder that runs where nothing is installed but a driver: splatd with its libraries, on any Linux of this machine's
# kind with a C library as new as the one it was built with (Debian 12: 2.36). With --tests the programs and images
# that tests/bench/gpu.sh runs lie in it, too. Videos of tours are left out: their encoders are larger than all the rest.
set -euo pipefail

usage() {
    cat <<TEXT
usage: deploy/bundle.sh [--tests] [--build DIR] OUT

  OUT          the folder that is made; 'OUT/splatd devices' says what renders where it is copied to
  --tests      with what OUT/tests/bench/gpu.sh needs to test and measure a GPU
  --build DIR  where it is compiled (build-bundle/ in the checkout)

An archive of it:  deploy/bundle.sh splatd-bundle && tar -caf splatd.tar.zst splatd-bundle
TEXT
}

top=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$top/build-bundle tests=false out=
while [ $# -gt 0 ]; do
    case $1 in
    --tests) tests=true ;;
    --build) build=${2:?$(usage)}; shift ;;
    -h | --help) usage; exit 0 ;;
    -*) echo "bundle: unknown argument '$1'" >&2; usage >&2; exit 2 ;;
    *) out=$1 ;;
    esac
    shift
done
[ -n "$out" ] || { usage >&2; exit 2; }
[ ! -e "$out" ] || [ -x "$out/bin/splatd" ] || { echo "bundle: $out exists and is no bundle" >&2; exit 2; }

# An old RPATH, unlike RUNPATH, also holds for the libraries of libraries.
options=(-Dvideo=disabled -Dtests=$tests -Dbuildtype=release -Db_ndebug=false
    "-Dc_link_args=['-Wl,--disable-new-dtags,-rpath,\$ORIGIN/../lib']")
mkdir -p "$build"
if [ -f "$build/build.ninja" ]; then
    meson configure "$build" "${options[@]}"
else
    meson setup "$build" "$top" "${options[@]}"
fi >"$build/setup.log" 2>&1 || { cat "$build/setup.log" >&2; exit 1; }
ninja -C "$build" --quiet

rm -rf "$out"
mkdir -p "$out"/{bin,lib/fallback,share/proj}
programs=("$build/src/splatd")
if $tests; then
    programs+=("$build"/tests/gpu/test-gpu-* "$build/tests/golden/golden" "$build/tests/stability/stability")
    mkdir -p "$out"/tests/{golden,stability,bench}
    cp -r "$top/tests/golden/images" "$out/tests/golden/"
    cp "$top"/tests/stability/*.json "$out/tests/stability/"
    cp "$top/tests/bench/gpu.sh" "$out/tests/bench/"
fi
for program in "${programs[@]}"; do
    [ -f "$program" ] && [ -x "$program" ] && cp "$program" "$out/bin/"
done
if $tests; then # what loads the daemon
    cp "$(command -v wrk)" "$(command -v curl)" "$out/bin/"
fi
strip "$out"/bin/*

# All libraries but the C library's own, which belongs to the system. The C++ runtime is the system's too where it has
# one: a driver that is newer than ours would find ours too old.
copied=0
while read -r library; do
    case ${library##*/} in
    ld-linux* | libc.so* | libm.so* | libpthread* | libdl.so* | librt.so* | libresolv* | libutil*) continue ;;
    libstdc++* | libgcc_s*) cp -L "$library" "$out/lib/fallback/" ;;
    *) cp -L "$library" "$out/lib/"; copied=$((copied + 1)) ;;
    esac
done < <(ldd "$out"/bin/* | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' | sort -u)
[ "$copied" -gt 0 ] || { echo "bundle: no library of $build/src/splatd was found" >&2; exit 1; }
for proj in /usr/share/proj /usr/local/share/proj; do
    [ -f "$proj/proj.db" ] && cp "$proj/proj.db" "$out/share/proj/" && break
done

cat >"$out/splatd" <<'SH'
#!/bin/sh
# Runs bin/splatd; brings the C++ runtime where the system has none.
here=$(dirname "$(readlink -f "$0")")
ldconfig -p 2>/dev/null | grep -q 'libstdc++\.so\.6 ' || [ -e /usr/lib/libstdc++.so.6 ] || [ -e /usr/lib64/libstdc++.so.6 ] ||
    export LD_LIBRARY_PATH="$here/lib/fallback${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export PROJ_DATA="${PROJ_DATA:-$here/share/proj}"
exec "$here/bin/splatd" "$@"
SH
chmod +x "$out/splatd"
"$out/splatd" --version >/dev/null
du -sh "$out" | awk '{ print $2 ": " $1 }'
