#!/usr/bin/env bash
# Builds the container image and uses it as README and deploy/operating.md say: without a token it refuses to start;
# with a read-only root, no capability and a user without rights it serves a picture; its probe and its stop work. By
# hand: it needs a registry that has debian:bookworm-slim, and minutes.
#
# usage: tests/deploy/image.sh [docker|podman]      BUILD_OPTIONS and RUN_OPTIONS are passed on
set -euo pipefail

tool=${1-docker}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
command -v "$tool" >/dev/null || { echo "usage: $0 [docker|podman]; there is no $tool" >&2; exit 2; }
read -ra build_options <<<"${BUILD_OPTIONS-}"
read -ra run_options <<<"${RUN_OPTIONS--p 127.0.0.1:8080:8080 -p 127.0.0.1:8081:8081}"

home=$(mktemp -d) name=splatd-image-test-$$
trap '"$tool" rm -f "$name" >/dev/null 2>&1 || true; rm -rf "$home"' EXIT
run() { "$tool" run "${run_options[@]}" --read-only --cap-drop ALL --security-opt no-new-privileges "$@"; }
fail() { echo "FAILED: $*"; "$tool" logs "$name" 2>&1 | tail -20; exit 1; }

"$tool" build "${build_options[@]}" -f deploy/Dockerfile -t splatd .

# A scan made, packed and served by the image itself; what is written belongs to whoever runs this.
here() { "$tool" run --rm "${run_options[@]}" -u "$(id -u):$(id -g)" -v "$home:/data" splatd "$@"; }
here synth courtyard --points 100000 -o /data/scan
here pack /data/scan/courtyard.ptx -o /data/courtyard.spld
chmod 755 "$home" && chmod 644 "$home/courtyard.spld"

rc=0
run --rm -v "$home:/srv/splatd:ro" splatd || rc=$?
[ "$rc" = 2 ] || fail "without a word about who may come in it ended with $rc, not 2"

run -d --name "$name" -v "$home:/srv/splatd:ro" splatd serve --config /etc/splatd/splatd.conf --allow-anonymous
for ((i = 0; i < 120; i++)); do
    curl -sf http://127.0.0.1:8081/readyz >/dev/null && break
    sleep 0.5
done
curl -sSf -o "$home/view.jpg" 'http://127.0.0.1:8080/v1/datasets/courtyard/view?width=640&height=360' || fail "no picture"
[ "$(stat -c %s "$home/view.jpg")" -gt 10000 ] || fail "a picture of $(stat -c %s "$home/view.jpg") bytes"
[ "$("$tool" exec "$name" id -u)" = 10001 ] || fail "another user"
"$tool" exec "$name" sh -c 'echo x >/etc/x' 2>/dev/null && fail "the root can be written"
probe=$("$tool" inspect "$name" --format '{{index .Config.Healthcheck.Test 3}}')
"$tool" exec "$name" bash -c "$probe" || fail "the probe says no"
"$tool" exec "$name" bash -c "${probe/healthz/nowhere}" && fail "the probe says yes to anything"
"$tool" stop -t 30 "$name" >/dev/null
code=$("$tool" inspect "$name" --format '{{.State.ExitCode}}')
[ "$code" = 0 ] || fail "exit code $code after a stop"
echo "the image is built and works"
