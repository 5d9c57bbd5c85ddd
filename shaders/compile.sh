#!/bin/sh
# usage: compile.sh SPIRV-OPT OUTPUT GLSLANG…: compiles a kernel, and takes out of it what every driver would otherwise do
# away with when a kernel is made, for each set of constants anew: functions, variables, what is computed twice. Software
# drivers make one in half the time then. Loops stay as they are written, and structs whole: unrolled, or member by member,
# frames took up to 14 % longer.
set -eu
spirv_opt=$1 output=$2
shift 2
"$@" -o "$output"
exec "$spirv_opt" --preserve-bindings --preserve-spec-constants --merge-return --inline-entry-points-exhaustive \
    --eliminate-dead-functions --private-to-local --eliminate-local-single-block --eliminate-local-single-store \
    --eliminate-local-multi-store --eliminate-dead-code-aggressive --merge-blocks --simplify-instructions \
    --redundancy-elimination --eliminate-dead-code-aggressive "$output" -o "$output"
