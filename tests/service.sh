#!/usr/bin/env bash
# tests/service.sh [PACKAGE.deb]   (default: what deploy/package.sh has made for this machine)
# Takes the service through its life under a real systemd, booted in a container that has a network of
# its own: what `apt install` starts under all its limits (a kernel that refuses calls, no devices but
# serial ones, no user's rights), reloads, restarts, upgrades, lets go. About three minutes, as it waits
# for the watchdog. Needs root and what deploy/install_packages.sh package brings; ends with 77 where
# something is missing.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."
. tests/support/debian.sh

fail() { echo "service.sh: $*" >&2; inside journalctl --no-pager -n 40 >&2 || true; exit 1; }
# A watchdog of 30 s and a machine that has much to do
patience=120

find_package "$@"
need_root_and mmdebstrap systemd-nspawn nsenter

work=$(mktemp -d)
container=
leader=
clean_up() {
    [ -z "$leader" ] || kill -RTMIN+4 "$leader" 2>/dev/null || true  # poweroff.target
    [ -z "$container" ] || wait "$container" || true
    rm -rf "$work"
}
trap clean_up EXIT

make_debian "$package" "$work/root" systemd-sysv,dbus,curl,procps
cp "$package" "$work/root/first.deb"
next_version "$package" "$work/root/next.deb"
next_version "$work/root/next.deb" "$work/root/other.deb" other

say "boot"
systemd-nspawn --directory "$work/root" --boot --private-network --register=no --keep-unit \
    --console=pipe --machine="panelgate$$" </dev/null >"$work/console" 2>&1 &
container=$!
has_leader() {
    kill -0 $container 2>/dev/null || { cat "$work/console"; skip "this machine boots no container"; }
    leader=$(pgrep -P $container -f systemd$)
}
within has_leader
inside() { nsenter -t "$leader" -m -u -i -n -p -C -r -w "$@"; }
booted() { [[ $(inside systemctl is-system-running 2>/dev/null) =~ ^(running|degraded)$ ]]; }
within booted

url=http://127.0.0.1:8080
show() { inside systemctl show panelgate --value -p "$1"; }
is() { [ "$(show "$1")" = "$2" ]; }
ready() { inside curl -sfo /dev/null $url/readyz; }
values() { inside curl -sf "$url/api/v1/stations/press/devices/UW0?count=5" | grep -q '"values":\[10,20,30,40,50\]'; }
told() { inside journalctl -u panelgate --no-pager -o cat | grep -q "$1"; }
field() { inside journalctl -u panelgate --no-pager -o cat --output-fields="$1" | grep -q "$2"; }
lives() {
    within is ActiveState active
    within values
}
file=$work/root/etc/panelgate/panelgate.yaml

say "install: it is started, under all its limits, and answers"
must inside dpkg -i /first.deb >"$work/console" 2>&1
lives
must is NRestarts 0
must test "$(show StatusText | grep -c '1 of 1 line up')" = 1
must inside sh -c '[ "$(ps -o user= -C panelgate)" = panelgate ]'
must field PANELGATE_EVENT listening
first=$(show MainPID)

say "reload: a new file, a bad one, and the good one again"
sed -i 's/name: press$/name: presse/' "$file"
must inside systemctl reload panelgate
within inside curl -sfo /dev/null $url/api/v1/stations/presse
cp "$file" "$work/good"
echo "nonsense: 1" >>"$file"
inside systemctl reload panelgate || true
within told "nonsense"
must ready
must is MainPID "$first"
sed 's/name: presse$/name: press/' "$work/good" >"$file"
must inside systemctl reload panelgate
within values
must is MainPID "$first"

say "killed: it comes back"
must inside kill -KILL "$first"
within is NRestarts 1
lives

say "hangs: the watchdog ends it, and it comes back"
must inside kill -STOP "$(show MainPID)"
within is NRestarts 2
lives

say "a bad file at its start: it is not tried again"
cp "$file" "$work/good"
echo "nonsense: 1" >>"$file"
must_not inside systemctl restart panelgate 2>/dev/null
within is ActiveState failed
must is ExecMainStatus 78
cp "$work/good" "$file"

say "port 502 and a token, without a user's rights"
inside mkdir -p /etc/credstore
echo a-token-of-the-service | inside sh -c 'umask 077; cat >/etc/credstore/panelgate-operator'
sed -e 's/127\.0\.0\.1:1502/127.0.0.1:502/' \
    -e 's|anonymous: admin.*|anonymous: none\n  tokens: [{name: ops, role: admin, file: "${CREDENTIALS_DIRECTORY:-/etc/credstore}/panelgate-operator"}]|' \
    "$work/good" >"$file"
must inside panelgate check -c /etc/panelgate/panelgate.yaml >"$work/console"
must inside systemctl restart panelgate
within ready
must_not values 2>/dev/null
must inside curl -sfo /dev/null -H "Authorization: Bearer a-token-of-the-service" $url/api/v1/lines
must inside bash -c 'exec 3<>/dev/tcp/127.0.0.1/502'
cp "$work/good" "$file"
must inside systemctl restart panelgate
lives

say "an audit without which nothing is written, in the folder that the unit makes"
echo 'audit: {file: /var/log/panelgate/audit.jsonl, on_failure: refuse_writes}' >>"$file"
must inside systemctl reload panelgate
within inside curl -sfo /dev/null -X PUT -d '{"value":21.5}' $url/api/v1/stations/press/points/setpoint
within inside sh -c 'panelgate audit show --kind write | grep -q confirmed'
must inside sh -c '[ "$(stat -c %U /var/log/panelgate/audit.jsonl)" = panelgate ]'
must inside panelgate audit verify >"$work/console"
cp "$work/good" "$file"
must inside systemctl reload panelgate

say "upgrade: the same program reloads, another one is started"
echo "# ours" >>"$file"
first=$(show MainPID)
must inside dpkg -i /next.deb >"$work/console" 2>&1
lives
must is MainPID "$first"
must inside dpkg -i /other.deb >"$work/console" 2>&1
lives
must_not is MainPID "$first"
must grep -q "^# ours" "$file"

say "remove and purge"
must inside dpkg -r panelgate >"$work/console" 2>&1
must_not is ActiveState active
must_not ready
must inside dpkg -P panelgate >"$work/console" 2>&1
echo "service.sh: $(basename "$package") lived under systemd as it should"
