#!/usr/bin/env bash
# Client of splatd: curl and awk, one file.
#
#   splatd.sh datasets
#   splatd.sh info hall
#   splatd.sh view hall view.jpg eye=4,5,6 target=0,0,1 fov=50
#   splatd.sh view hall depth.png eye=4,5,6 target=0,0,1 layer=depth
#   splatd.sh pick hall 640 360 eye=4,5,6 target=0,0,1
#   splatd.sh ring hall views 36 6 3 target=0,0,1 fov=50   # 36 views from 6 m round the target, 3 m above: views/00.jpg …
#
# SPLATD_URL names the service (http://127.0.0.1:8080), SPLATD_TOKEN a token. A busy service is asked again when it
# says.
set -euo pipefail

base=${SPLATD_URL:-http://127.0.0.1:8080} base=${base%/}
examples() { sed -n '4,9s/^# \{0,3\}//p' "$0"; }

# WHAT IS WRONG
usage() {
    echo "splatd.sh: $1; as in" >&2
    examples >&2
    exit 2
}

# NAMES ARGUMENT…: every one of NAMES must have an argument, and what follows them is NAME=VALUE.
needs() {
    local -a names
    local pair
    read -ra names <<<"$1"
    shift
    [ $# -ge ${#names[@]} ] || usage "$command needs ${names[*]}, and ${names[$#]} is missing"
    for pair in "${@:${#names[@]} + 1}"; do
        [[ $pair == ?*=* ]] || usage "$command: '$pair' is not NAME=VALUE"
    done
}

# NAME ARGUMENT
number() { [[ $2 =~ ^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)$ ]] || usage "$command: $1 '$2' is no number"; }

# URL…: prints the reply; a refusal is told on stderr.
ask() {
    local body status secret=${SPLATD_TOKEN:+header = \"Authorization: Bearer $SPLATD_TOKEN\"}
    body=$(mktemp)
    # The token goes past the command line, which every user can see.
    status=$(curl -sS --retry 5 --max-time 120 -K <(printf '%s' "$secret") -o "$body" -w '%{http_code}' "$1") ||
        { rm -f "$body"; return 1; }
    if [ "$status" != 200 ]; then
        echo "splatd.sh: $status: $(sed -n 's/.*"detail": "\(.*\)",\{0,1\}$/\1/p' "$body")" >&2
        rm -f "$body"
        return 1
    fi
    cat "$body"
    rm -f "$body"
}

# NAME=VALUE…: a query
query() { local IFS='&'; echo "$*" | sed 's/%/%25/g; s/ /%20/g; s/#/%23/g; s/+/%2B/g'; }

# FILE NAME=VALUE…: `said` is what FILE's ending adds to the query; a FILE that would hold something else is refused.
say_format() {
    local file=$1 ending='' named='' given='' several='' container='' pair
    [[ ${file##*/} == ?*.* ]] && ending=${file##*.}
    shift
    for pair in "$@"; do
        case $pair in
        format=*) given=${pair#*=} ;;
        container=*) several=$pair container=${pair#*=} ;;
        layers=*) several=$pair ;;
        esac
    done
    case $ending in
    jpg | jpeg) named=jpeg ;;
    tif | tiff) named=tiff ;;
    png | webp | npy | raw | zip) named=$ending ;;
    esac
    given=${given/%jpg/jpeg} given=${given/%tif/tiff}
    said=()
    if [ "$named" = zip ]; then
        [ -n "$container" ] || said=(container=zip)
        [ "${container:-zip}" = zip ] || usage "$command: '$file' is no name of 'container=$container': give one without .zip"
    elif [ -n "$several" ]; then
        [ -z "$named" ] || usage "$command: '$several' is several images: give FILE.zip in the place of '$file'"
    elif [ -z "$named$given" ]; then
        usage "$command: '$file' does not say which format: end it in .jpg, .png or .npy, or add format="
    elif [ -z "$given" ]; then
        said=("format=$named")
    elif [ -n "$named" ] && [ "$named" != "$given" ]; then
        usage "$command: '$file' is no name of a $given: give one that ends in .$given, or another format="
    fi
}

# DATASET FILE NAME=VALUE…
view() {
    local id=$1 file=$2 said
    shift 2
    say_format "$file" "$@"
    ask "$base/v1/datasets/$id/view?$(query "$@" ${said[@]+"${said[@]}"})" >"$file.part" && mv "$file.part" "$file" ||
        { rm -f "$file.part"; return 1; }
}

# DATASET DIR COUNT RADIUS HEIGHT target=X,Y,Z NAME=VALUE…
ring() {
    local id=$1 dir=$2 count=$3 radius=$4 height=$5 target=${6#target=} i=0 eye
    [[ $count =~ ^[0-9]*[1-9][0-9]*$ ]] || usage "ring: COUNT '$count' is no whole number from 1 on"
    number RADIUS "$radius"
    number HEIGHT "$height"
    [ "target=$target" = "$6" ] || usage "ring needs target=X,Y,Z in the place of '$6'"
    shift 6
    mkdir -p "$dir"
    awk -v n="$count" -v r="$radius" -v h="$height" -v t="$target" 'BEGIN {
        split(t, c, ",")
        for (i = 0; i < n; i++) {
            a = 8 * atan2(1, 1) * i / n
            printf "%.9g,%.9g,%.9g\n", c[1] + r * cos(a), c[2] + r * sin(a), c[3] + h
        }
    }' | while read -r eye; do
        view "$id" "$(printf '%s/%02d.jpg' "$dir" "$i")" "eye=$eye" "target=$target" format=jpeg "$@"
        i=$((i + 1))
    done
}

command=${1-}
[ $# -gt 0 ] && shift
case $command in
--help | -h | help) examples ;;
datasets) [ $# = 0 ] || usage "datasets takes nothing, not '$1'"; ask "$base/v1/datasets" | sed -n 's/^ *"id": "\(.*\)",$/\1/p' ;;
info) needs DATASET "$@"; [ $# = 1 ] || usage "info takes one DATASET, not '$2' as well"; ask "$base/v1/datasets/$1"; echo ;;
view) needs "DATASET FILE" "$@"; view "$@" ;;
pick)
    needs "DATASET X Y" "$@"
    id=$1 x=$2 y=$3
    shift 3
    ask "$base/v1/datasets/$id/pick?$(query "x=$x" "y=$y" "$@")"
    echo
    ;;
ring) needs "DATASET DIR COUNT RADIUS HEIGHT target=X,Y,Z" "$@"; ring "$@" ;;
"") usage "a command is missing" ;;
*) usage "there is no command '$command'" ;;
esac
