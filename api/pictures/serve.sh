# For the scripts beside it: `serve ARGUMENT…` starts a daemon on a free port that ends with the script, and waits until it
# answers; $service is its address, $out/log what it says.
serve() {
    : >"$out/log" # before it is read: what another script has left there names a daemon that is gone
    splatd serve --listen 127.0.0.1:0 --ops-listen 127.0.0.1:0 "$@" 2>"$out/log" &
    daemon=$!
    trap 'kill $daemon' EXIT
    until service=$(sed -n 's|.*listening on \(http://[^ ]*[0-9]\)/.*|\1|p' "$out/log"); grep -q ready "$out/log" && [ -n "$service" ]; do
        kill -0 $daemon
        sleep 0.1
    done
}
