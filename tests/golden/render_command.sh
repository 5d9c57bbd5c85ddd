#!/usr/bin/env bash
# 'splatd render' as a user runs it: what it writes, what it refuses, what it leaves behind.
set -u
splatd=$SPLATD_BINARY
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1
failed=0

fail() {
    echo "FAILED: $*"
    failed=1
}

"$splatd" synth courtyard --points 20000 --format ptx -o . >/dev/null 2>&1 &&
    "$splatd" pack courtyard.ptx -o courtyard.spld >/dev/null 2>&1 || { echo "no dataset to render"; exit 1; }
if ! "$splatd" render courtyard.spld --size 16x16 -o probe.png 2>messages; then
    grep -q "device" messages && { cat messages; exit 77; }
    cat messages
    exit 1
fi
rm -f probe.png messages courtyard.ptx

# writes FILE MAGIC ARGUMENTS…: exit 0, the file starts with the magic (in hex), one line on stderr names the backend.
writes() {
    local file=$1 magic=$2
    shift 2
    "$splatd" render courtyard.spld --size 64x48 "$@" -o "$file" 2>messages || fail "$* -o $file: exit $?"
    [ "$(head -c $((${#magic} / 2)) "$file" | od -An -tx1 | tr -d ' \n')" = "$magic" ] || fail "$file is no such file"
    grep -Eq '(vulkan|egl) .*splats in .* ms' messages || fail "$file: no line about the device: $(cat messages)"
    rm -f "$file" messages
    [ "$(ls)" = courtyard.spld ] || fail "$file: left behind: $(ls)"
}
writes a.jpg ffd8ff
writes a.jpeg ffd8ff --layer depth
writes a.JPG ffd8ff
writes a.PNG 89504e47
writes a.Npy 934e554d5059 --layer depth
writes a.png 89504e47 --eye 0,-2,1.6 --target=-1,5,2 --fov 60 --background '#ff000080' --supersample 2
writes a.png 89504e47 --layer depth --depth-scale 5000 --fx 60 --fy 61 --cx 30 --cy 20.5
writes a.npy 934e554d5059 --layer normal --method points --lod 0
writes a.dat 89504e47 --format png --background White --margin 2 --near 0.5 --far 100 --no-verify

echo '[[0, 0, 1], [1, 0, 0]]' >directions.JSON
"$splatd" render courtyard.spld --rays directions.JSON -o ranges.JSON 2>messages && grep -q '^\[' ranges.JSON ||
    fail "--rays and -o of .JSON: $(cat messages)"
mkfifo pipe.json && { sleep 0.2; cat directions.JSON; } >pipe.json &
"$splatd" render courtyard.spld --rays pipe.json -o ranges.JSON 2>messages && grep -q '^\[' ranges.JSON ||
    fail "--rays of a pipe: $(cat messages)"
wait
rm -f pipe.json directions.JSON ranges.JSON messages

bytes=$("$splatd" render courtyard.spld --size 8x4 --layer id --format raw -o - 2>/dev/null | wc -c)
[ "$bytes" = 128 ] || fail "stdout got $bytes bytes instead of 128"
for size in 32 x18; do
    bytes=$("$splatd" render courtyard.spld --size $size --layer id --format raw -o - 2>/dev/null | wc -c)
    [ "$bytes" = $((32 * 18 * 4)) ] || fail "--size $size: $bytes bytes instead of those of 32x18"
done
"$splatd" render courtyard.spld --size 32 --format raw -o - 2>messages | wc -c >/dev/null
grep -q 'nothing is in view' messages && fail "the default view is not empty: $(cat messages)"
"$splatd" render courtyard.spld --size 32 --eye 0,0,900 --target 0,0,990 --up 0,1,0 --format raw -o - 2>messages >/dev/null
grep -Eq "nothing is in view; the dataset's bounds are -?[0-9.]+,-?[0-9.]+,-?[0-9.]+ to " messages ||
    fail "a view of nothing says: $(cat messages)"
"$splatd" render courtyard.spld --size 32 --projection orthographic --view-height 9 --eye 0,0,-900 --target 0,0,-990 --up 0,1,0 \
    --format raw -o - 2>messages >/dev/null
grep -q ', all of it behind the eye' messages || fail "a plan from below the ground says: $(cat messages)"

# What no splat passes is not the camera's fault: the classes that there are, and only what is known to be none.
"$splatd" synth courtyard --points 4000 --classes --format las -o . >/dev/null 2>&1 &&
    "$splatd" pack courtyard.las -o classes.spld >/dev/null 2>&1 || fail "no dataset with classes"
clips() { # ARGUMENTS…: what a view says
    "$splatd" render classes.spld --size 32 "$@" --format raw -o - 2>messages >/dev/null || fail "$*: $(cat messages)"
}
for clip in '--class 99' '--class 99,200-250' '--clip class:99' '--clip z<1000 --class 99'; do
    clips $clip
    grep -Eq "no splat passes 'class:99[^']*': class in 'classes' is [0-9, ]+( or [0-9]+)?$" messages ||
        fail "$clip says: $(cat messages)"
    grep -q 'is in view' messages && fail "$clip blames the camera: $(cat messages)"
done
clips --clip 'z>1000'
grep -Eq "no splat passes 'z>1000': 'classes' lies beside it: its bounds are " messages || fail "z>1000 says: $(cat messages)"
clips --class 2
grep -Eq 'no splat passes|in view' messages && fail "class 2 says: $(cat messages)"
clips --clip 'class:99 or z<1000'
grep -Eq 'no splat passes|in view' messages && fail "one of two says: $(cat messages)"
clips --class 2 --eye 0,0,900 --target 0,0,990 --up 0,1,0
grep -q "nothing that the clip leaves is in view; the dataset's bounds are " messages || fail "away says: $(cat messages)"
rm -f messages courtyard.las classes.spld
"$splatd" render --help | grep -q 'A first look' || fail "no help"
"$splatd" render courtyard.spld --size 8x8 -o a.png 2>/dev/null
cp a.png before.png

# refuses CODE WORDS ARGUMENTS…: that exit code, a message with the words, no new file and the old one untouched.
refuses() {
    local code=$1 words=$2 got
    shift 2
    "$splatd" render "$@" >/dev/null 2>messages
    got=$?
    [ $got = "$code" ] || fail "$*: exit $got instead of $code"
    grep -q -- "$words" messages || fail "$*: '$words' is not in '$(cat messages)'"
    rm -f messages
    [ "$(ls | tr '\n' ' ')" = "a.png before.png courtyard.spld " ] || fail "$*: left behind: $(ls)"
    cmp -s a.png before.png || fail "$*: the old file has changed"
}
refuses 2 'one dataset'
refuses 2 'one dataset' courtyard.spld courtyard.spld -o a.png
refuses 2 'needs a file' courtyard.spld
refuses 2 'which format' courtyard.spld -o a.gif
refuses 2 'which format' courtyard.spld -o -
refuses 2 '--format' courtyard.spld --format gif -o a.png
refuses 2 '--help' courtyard.spld --colour red -o a.png
refuses 2 '--eye' courtyard.spld --eye 1,2 -o a.png
refuses 2 '--eye' courtyard.spld --eye 1,2,nan -o a.png
refuses 2 '--target' courtyard.spld --target 1,2,3,4 -o a.png
refuses 2 'target' courtyard.spld --eye 1,2,3 --target 1,2,3 -o a.png
refuses 2 'up' courtyard.spld --eye 1,2,3 --target 1,2,9 -o a.png
refuses 2 '--fov' courtyard.spld --fov 180 -o a.png
refuses 2 '--fov' courtyard.spld --fov 60deg -o a.png
refuses 2 '--fov and --fx' courtyard.spld --fov 60 --fx 500 -o a.png
refuses 2 '--fy' courtyard.spld --fy 500 -o a.png
refuses 2 '--size' courtyard.spld --size 0x0 -o a.png
refuses 2 '--size' courtyard.spld --size 640x -o a.png
refuses 2 'width' courtyard.spld --size 1000000x1000000 -o a.png
refuses 2 'far' courtyard.spld --near 5 --far 5 -o a.png
refuses 2 '--method' courtyard.spld --method mesh -o a.png
refuses 2 '--layer' courtyard.spld --layer Color -o a.png
refuses 2 '--lod' courtyard.spld --lod -1 -o a.png
refuses 2 'supersample' courtyard.spld --supersample 3 -o a.png
refuses 2 '--background' courtyard.spld --background '#ff00' -o a.png
refuses 2 '--background' courtyard.spld --background rad -o a.png
refuses 2 '--quality' courtyard.spld --quality 0 -o a.png
refuses 2 '--depth-scale' courtyard.spld --depth-scale 0 -o a.png
refuses 2 '--memory-limit' courtyard.spld --memory-limit 1X -o a.png
refuses 2 'nowhere.json: there is no such file' courtyard.spld --rays nowhere.json -o a.npy
echo '[[0, 0, 1], 2]' >.bad.json
refuses 2 '.bad.json: directions.1. must be' courtyard.spld --rays .bad.json -o a.npy
refuses 1 'no-such-device' courtyard.spld --device no-such-device -o a.png
refuses 1 'nowhere' courtyard.spld --size 8x8 -o nowhere/a.png
refuses 2 'a.png' a.png -o a.png
exit $failed
