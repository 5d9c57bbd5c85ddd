#!/bin/sh
# usage: kernels.sh CODES OUTPUT
# CODES with a checksum of the files that it includes behind it: an assembler names those to nobody, so that a compiler's
# cache, which asks for what an object was made of, would give back that of other kernels.
set -eu
sum=$(sed -n 's/.*"\(.*\.spv\)".*/\1/p' "$1" | while IFS= read -r code; do cat "$code"; done | sha256sum)
{ cat "$1"; echo "/* ${sum%% *} */"; } >"$2"
