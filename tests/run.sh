#!/usr/bin/env bash
# Everything a change must pass, on a bare Debian 12: packages, then one build a row below, each with its suites of
# tests. The last line is "N passed, N failed, N skipped" over all of them; a build that fails counts as a failed test.
#
# usage: tests/run.sh [--quick|--full]
#   --quick   the normal build alone
#   --full    also the long conditions of stability, every planted fault of tests/mutants, and each fuzzer for a minute
set -euo pipefail

cd "$(dirname "${BASH_SOURCE[0]}")/.."
mode=${1-}
case $mode in
'' | --quick | --full) ;;
-h | --help) sed -n '2,8s/^# \{0,1\}//p' "$0"; exit 0 ;;
*) echo "usage: tests/run.sh [--quick|--full]" >&2; exit 2 ;;
esac

out=$PWD/build-tests
mkdir -p "$out"
passed=0 failed=0 skipped=0
finish() { # what failed once more, where a log that is cut still has it
    cat "$out/why.txt"
    echo "$passed passed, $failed failed, $skipped skipped"
    [ "$failed" = 0 ]
}

strict=-Dwerror=true # not with sanitisers: their checks add paths that GCC then warns of

# name, compiler, meson options -> build-tests/NAME; what is said of it in NAME.said, whether it is there in NAME.built
build() {
    local name=$1 compiler=$2 log=$out/$1.log
    shift 2
    local begin=$SECONDS setup=(meson setup "$out/$name" "$@")
    [ ! -f "$out/$name/build.ninja" ] || setup+=(--reconfigure)
    # of an earlier run, before the normal build's kernels changed
    [ ! "$out/normal/shaders/kernels.S" -nt "$out/$name/shaders/kernels.S" ] || rm -f "$out/$name/shaders/kernels.S"
    if CC="ccache $compiler" "${setup[@]}" >"$log" 2>&1 && ninja -C "$out/$name" ${targets-} >>"$log" 2>&1; then
        printf '%-10s %-8s built in %d s\n' "$name" "" $((SECONDS - begin)) >"$out/$name.said"
        tell "$name" yes
    else
        { tail -60 "$log"; printf '%-10s %-8s DOES NOT BUILD (%s)\n' "$name" "" "$log"; } >"$out/$name.said"
        tell "$name" no
    fi
}

# Name, yes or no, for built(): a file that is there holds what is said in it.
tell() {
    echo "$2" >"$out/$1.built.new"
    mv "$out/$1.built.new" "$out/$1.built"
}

# Waits for a build; is it there?
is_built() {
    until [ -f "$out/$1.built" ]; do
        kill -0 "${others-}" 2>/dev/null || [ -f "$out/$1.built" ] || { echo "$1 was not built" >"$out/$1.said"; tell "$1" no; }
        sleep 1
    done
    [ "$(cat "$out/$1.built")" = yes ]
}

# The same, and shows what is said of it; a broken one is counted.
built() {
    is_built "$1" || { failed=$((failed + 1)); tail -20 "$out/$1.said" >>"$out/why.txt"; cat "$out/$1.said"; return 1; }
    cat "$out/$1.said"
}

# name, tests at once, suites…: runs them together, so that no processor waits for the longest of each; what failed is
# shown with its output, and every suite is counted. Tests have ten times their limit: machines are shared, and others
# build beside them. `only` names those that run, `but` suites whose tests do not.
suites() {
    local name=$1 at_once=$2 begin=$SECONDS log=$out/$1/meson-logs/$3 told p f s
    shift 2
    rm -f "$log".{json,txt}
    ${run_under-} meson test -C "$out/$name" --no-rebuild "${@/#/--suite=}" ${but+"${but[@]/#/--no-suite=}"} --print-errorlogs ${only-} \
        --logbase "$1" --num-processes "$at_once" --timeout-multiplier "${timeouts:-10}" >"$out/$name-$1.log" 2>&1 || true
    told=$(python3 tests/counts.py "$name" "$log.json" "$out/why.txt" "$@")
    echo "${told%$'\n'*}"
    read -r p f s <<<"${told##*$'\n'}"
    [ "$f" = 0 ] || cat "$out/$name-$1.log"
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
    printf '%-10s %-8s in %d s\n' "$name" "" $((SECONDS - begin))
}

# Does a program built with this sanitiser start here? Containers without ptrace cannot look for leaks, and kernels with
# much address space randomisation stop this TSan.
sanitiser_runs() {
    local sanitiser=$1
    shift
    printf 'int main(void) { return 0; }\n' >"$out/probe.c"
    gcc -fsanitize="$sanitiser" "$out/probe.c" -o "$out/probe" && "$@" "$out/probe" >/dev/null 2>&1
}

deploy/install-packages.sh build run quickstart test
[ "$mode" != --full ] || deploy/install-packages.sh full

rm -f "$out"/*.{built,counts}
: >"$out/why.txt"
sanitised=(-Ddebug=false -Dc_args=-g1 -Doptimization=1 -Db_lundef=false) # lines are all that their reports show
leaks=1
sanitiser_runs address env || leaks=0
[ $leaks = 1 ] || echo "note: no leak check, this container does not let LeakSanitizer work"
export ASAN_OPTIONS=detect_leaks=$leaks:abort_on_error=1:allocator_may_return_null=1:verify_asan_link_order=0
export LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
export TSAN_OPTIONS=suppressions=$PWD/tests/tsan.supp:halt_on_error=1:second_deadlock_stack=1

# Drivers stay loaded, so that leaks of theirs are still told by their library's name when the process ends.
printf 'int dlclose(void *handle) { (void)handle; return 0; }\n' >"$out/keep-loaded.c"
gcc -shared -fPIC "$out/keep-loaded.c" -o "$out/keep-loaded.so"

# Hundreds of programs are linked: gold, of binutils, takes a third of the time.
if command -v ld.gold >/dev/null; then export CC_LD=gold; fi
# Of what is built without a backend only its stub differs, and the choice of a device: the rest was compiled before.
export CCACHE_DIR=$out/ccache CCACHE_DEPEND=1
few="src/splatd tests/gpu/test-gpu-gpu tests/gpu/test-gpu-exact"
build_others() {
    local kernels=-Dkernels=$out/normal/shaders
    build asan gcc "${sanitised[@]}" "$kernels" -Db_sanitize=address,undefined
    build tsan gcc "${sanitised[@]}" "$kernels" -Db_sanitize=thread
    targets=$few build no-vulkan gcc $strict "$kernels" -Dvulkan=disabled
    targets=$few build no-egl gcc $strict "$kernels" -Degl=disabled -Dsystemd=disabled -Dvideo=disabled
}

build normal gcc $strict
if [ "$mode" != --quick ]; then
    # The other builds take what the tests of those before them leave of the processors.
    (
        chrt --idle --pid 0 $BASHPID 2>/dev/null || renice -n 19 $BASHPID >/dev/null
        build_others
    ) &
    others=$!
    trap 'kill $others ${lane-} 2>/dev/null || true' EXIT
fi
here=$(nproc)
# Units, fuzzers and what strangers send run where AddressSanitizer looks on; here those that it shortens, and last the
# sum over all that was asked over HTTP. --full runs everything in every build.
units=(whole) again=() but=(attack sum) attacks=attack crowds=crowd
[ "$mode" = "" ] || units=(unit fuzz) but=() attacks=http crowds=http
[ "$mode" != --full ] || units+=(gpu-again) again=(unit-again)
# One program as a test: what it is called, and its command.
program() {
    local name=$1 begin=$SECONDS verdict=passed
    shift
    if "$@" >"$out/$name.log" 2>&1; then
        passed=$((passed + 1))
    else
        tail -40 "$out/$name.log" | tee -a "$out/why.txt"
        failed=$((failed + 1)) verdict=FAILED
    fi
    printf '%-10s %-8s %s in %d s\n' "$name" "" "$verdict" $((SECONDS - begin))
}

# Two lanes, since tests over HTTP wait most of their time: what computes takes what they leave of the processors.
computing() {
    if built asan; then
        timeouts=15 run_under="env LD_PRELOAD=$out/keep-loaded.so"
        suites asan "$here" unit "${again[@]}" fuzz
        only="gpu-vulkan gpu-egl exact-vulkan residency-vulkan"
        [ "$mode" != --full ] || only=""
        suites asan "$here" gpu
        only="" timeouts="" run_under=""
    fi
    if built tsan && [ -n "$tsan_runs" ]; then
        timeouts=25 run_under=$tsan_runs
        suites tsan "$here" unit "${again[@]}"
        timeouts="" run_under=""
    fi
    if built no-vulkan; then
        only="gpu-egl exact-egl devices" suites no-vulkan "$here" gpu # units do not see the backend
    fi
    if built no-egl; then
        only="gpu-vulkan exact-vulkan devices" suites no-egl "$here" gpu # nor this one, nor what stands in for FFmpeg and systemd
    fi
    # For what it warns of alone: the sanitised builds see what code does that only one compiler bears.
    program clang python3 tests/clang.py "$out/normal"
}

waiting() {
    ! is_built normal || suites normal $((2 * here)) http deploy
    unset but
    if is_built asan; then
        timeouts=15 run_under="env LD_PRELOAD=$out/keep-loaded.so" suites asan $((2 * here)) "$attacks"
    fi
    if is_built tsan && [ -n "$tsan_runs" ]; then
        timeouts=25 run_under=$tsan_runs suites tsan $((2 * here)) "$crowds"
    fi
}

if sanitiser_runs thread env; then
    tsan_runs="env"
elif sanitiser_runs thread setarch -R; then
    tsan_runs="setarch -R"
else
    echo "note: no thread check, TSan does not start on this kernel"
    tsan_runs="" skipped=$((skipped + 1))
fi

! built normal || suites normal "$here" "${units[@]}" rules gpu golden library fault stability e2e
[ "$mode" != --quick ] || { ! is_built normal || suites normal $((2 * here)) http deploy; finish; exit; }
(
    renice -n 10 $BASHPID >/dev/null
    unset but
    passed=0 failed=0 skipped=0
    computing
    echo "$passed $failed $skipped" >"$out/computing.counts"
) &
lane=$!
waiting
wait $lane || true
if read -r p f s <"$out/computing.counts"; then
    passed=$((passed + p)) failed=$((failed + f)) skipped=$((skipped + s))
else
    echo "the lane of what computes has ended early" | tee -a "$out/why.txt"
    failed=$((failed + 1))
fi
if [ "$mode" = "" ] && is_built normal; then
    cp -p "$out"/asan/tests/http/exercised/* "$out/normal/tests/http/exercised/" || true # none has passed: the sum says so
    suites normal 1 sum
fi
[ "$mode" = --full ] || { finish; exit; }

whole=(stability-whole-{conditions,drivers,invariants-vulkan,invariants-egl})
program stability meson test -C "$out/normal" --no-rebuild --benchmark "${whole[@]}"
program slurm meson test -C "$out/normal" --no-rebuild --benchmark parts-slurm
program mutants python3 tests/mutants/mutants.py --keep "$out/mutants"
build fuzz clang "${sanitised[@]}" -Db_sanitize=address,undefined -Dfuzz=true
if built fuzz; then
    for fuzzer in "$out"/fuzz/tests/fuzz/fuzzer-*; do
        [ -x "$fuzzer" ] && [ -f "$fuzzer" ] || continue
        target=${fuzzer##*/fuzzer-} found=$out/fuzz/found-${fuzzer##*/fuzzer-}
        mkdir -p "$found"
        if "$fuzzer" -max_total_time=60 -artifact_prefix="$found/crash-" "$found" "tests/fuzz/corpus/$target" \
            >"$out/fuzz-$target.log" 2>&1; then
            passed=$((passed + 1)) verdict=passed
        else
            tail -40 "$out/fuzz-$target.log"
            failed=$((failed + 1)) verdict="FAILED, input in $found"
        fi
        printf '%-10s %-8s %s\n' fuzz "$target" "$verdict"
    done
fi
finish
