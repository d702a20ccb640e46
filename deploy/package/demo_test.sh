#!/usr/bin/env bash
# demo_test.sh PACKAGE [EMULATOR...]: the program of a package as its demo, asked once by REST and once
# by Modbus/TCP (mbpoll, where it is installed). Nothing is installed and no port is fixed.
set -euo pipefail
package=$1
shift
work=$(mktemp -d)
demo=
clean_up() {
    [ -z "$demo" ] || kill "$demo" 2>/dev/null || true
    rm -rf "$work"
}
trap clean_up EXIT
fail() { echo "demo_test: $*" >&2; cat "$work/log" >&2; exit 1; }

dpkg-deb -x "$package" "$work/root"
"$@" "$work/root/usr/bin/panelgate" demo --http 127.0.0.1:0 --modbus 127.0.0.1:0 \
    >"$work/out" 2>"$work/log" &
demo=$!

# The port that it says it listens on.
port() {
    local end=$((SECONDS + 60))
    until grep -q "listening $1=" "$work/log"; do
        kill -0 $demo 2>/dev/null || fail "it has ended"
        [ $SECONDS -lt $end ] || fail "it does not listen"
        read -rt 0.1 <> <(:) || true
    done
    sed -n "s/.*listening $1=[^ ]*:\([0-9]*\)$/\1/p" "$work/log"
}

http=$(port http)
modbus=$(port modbus_tcp)
curl -sfo /dev/null --retry 20 --retry-delay 1 --retry-all-errors "http://127.0.0.1:$http/readyz" ||
    fail "/readyz is not 200"
values=$(curl -sf "http://127.0.0.1:$http/api/v1/stations/press/devices/UW0?count=5") ||
    fail "REST reads nothing"
grep -q '"values":\[10,20,30,40,50\]' <<<"$values" || fail "REST reads $values"
if command -v mbpoll >/dev/null; then
    # Its values are those of the panel's manual.
    mbpoll -m tcp -p "$modbus" -a 31 -t 4 -r 1 -c 5 -1 127.0.0.1 >"$work/read" || fail "mbpoll reads nothing"
    [ "$(sed -n 's/^\[[0-9]*\]:[[:blank:]]*//p' "$work/read" | paste -sd' ')" = "10 20 30 40 50" ] ||
        fail "mbpoll reads $(cat "$work/read")"
fi
kill -TERM $demo
wait $demo || fail "it ended with $?"
demo=
echo "demo_test: ready, read by REST and Modbus/TCP, ended with 0"
