#!/usr/bin/env bash
# Installs what is missing of the named sections of deploy/packages.txt. Needs no root when nothing is missing.
# usage: deploy/install-packages.sh SECTION…      (build, run, quickstart, test, full)
set -euo pipefail

list=$(dirname "${BASH_SOURCE[0]}")/packages.txt
[ $# -gt 0 ] || { echo "usage: $0 SECTION… (build, run, quickstart, test, full)" >&2; exit 2; }

wanted=()
for section in "$@"; do
    mapfile -t -O "${#wanted[@]}" wanted < <(awk -v s="$section" '$1 == s {print $2}' "$list")
    awk -v s="$section" '$1 == s {n++} END {exit !n}' "$list" || { echo "$0: no section '$section' in $list" >&2; exit 2; }
done

missing=()
for package in "${wanted[@]}"; do
    status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    [ "$status" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

if ! command -v apt-get >/dev/null; then
    echo "missing, and there is no apt-get to install them with: ${missing[*]}" >&2
    exit 1
fi
as_root=()
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || { echo "run this as root first: apt-get install ${missing[*]}" >&2; exit 1; }
    as_root=(sudo)
fi
echo "installing: ${missing[*]}" >&2
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
    -o Dpkg::Use-Pty=0 "${missing[@]}" >&2
