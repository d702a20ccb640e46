#!/usr/bin/env bash
# tests/packages.sh [PACKAGE.deb]   (default: what deploy/package.sh has made for this machine)
# Takes a package through its life in a Debian of its own: installed, started as its unit says,
# reloaded, upgraded, given TLS, tokens and an audit, removed, installed again, purged. Without systemd as
# the first process (that is tests/service.sh), so the unit's command is run by hand: as the unit's user, on
# a read-only root, with the folders and credentials that the unit names. Cut off from all networks. Needs root and what deploy/install_packages.sh package brings; ends with 77 where something
# is missing. A package of another architecture runs by qemu, after deploy/package.sh ARCH --test has
# made what that needs.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."
. tests/support/debian.sh

fail() { echo "packages.sh: $*" >&2; [ ! -e "$log" ] || cat "$log" >&2; exit 1; }

here=$(dpkg --print-architecture)
find_package "$@"
architecture=$(dpkg-deb -f "$package" Architecture)
need_root_and mmdebstrap unshare setpriv curl python3 ip arch-test
arch-test "$architecture" >/dev/null 2>&1 ||
    skip "this machine runs no $architecture (qemu-user-static, and binfmt_misc mounted)"

termios=build/package-$architecture/old_termios.so
[ "$architecture" = "$here" ] || [ -e "$termios" ] || skip "there is no $termios: deploy/package.sh $architecture --test"

# Itself again with mounts and a network of its own; the Debian is made before, as that wants a mirror.
if [ -z "${PACKAGES_ROOT-}" ]; then
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    make_debian "$package" "$work/root"
    PACKAGES_ROOT=$work/root unshare --mount --net "$0" "$package"
    exit
fi

root=$PACKAGES_ROOT
log=$root.log
url=http://127.0.0.1:8080  # of the demonstration; the network is ours alone
ask=(curl -sf)
handed=/run/credentials/panelgate.service
gateway=
manager=
clean_up() { kill $gateway $manager 2>/dev/null || true; }
trap clean_up EXIT

inside() { chroot "$root" "$@"; }
# Nobody is there to be asked about a configuration.
install() { inside dpkg -i "/$1" >"$log" 2>&1 </dev/null || fail "dpkg -i $1"; }
state() { inside dpkg-query -W -f '${db:Status-Abbrev}' panelgate 2>/dev/null || true; }
is() { [ "$(state)" = "$1" ] || fail "it is '$(state)', not '$1'"; }
told() { grep -q "$1" "$root.told"; }
values() { "${ask[@]}" "$url/api/v1/stations/press/devices/UW0?count=5" | grep -q '"values":\[10,20,30,40,50\]'; }

prepare() {
    mount --make-rprivate /
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    ip link set lo up
    cp "$package" "$root/first.deb"
    next_version "$package" "$root/next.deb"
    preload=
    [ "$architecture" = "$here" ] || { cp "$termios" "$root/termios.so"; preload=/termios.so; }
}

is_in_place() {
    is "ii "
    must inside panelgate check -c /etc/panelgate/panelgate.yaml >"$log"
    must [ -L "$root/etc/systemd/system/multi-user.target.wants/panelgate.service" ]
    must_not [ -e "$root/etc/systemd/system/panelgate.service" ]
    inside id -nG panelgate | grep -qw dialout || fail "its user is not in dialout"
}

# What systemd would be told.
listen() {
    rm -f "$root/run/notify"
    python3 - "$root/run/notify" >"$root.told" <<'PYTHON' &
import os, socket, sys
manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
manager.bind(sys.argv[1])
os.chmod(sys.argv[1], 0o777)
told = ""
while "STOPPING=1" not in told:
    told = manager.recv(4096).decode()
    print(told, flush=True)
PYTHON
    manager=$!
    within [ -S "$root/run/notify" ]
}

unit() { sed -n "s/^$1=//p" "$root/lib/systemd/system/panelgate.service"; }

# The folders that the unit lets its user write, made as systemd makes them; their names.
make_folders() {
    local pair name
    for pair in StateDirectory:/var/lib LogsDirectory:/var/log; do
        name=$(unit "${pair%:*}")
        [ -n "$name" ] || continue
        inside install -d -o "$(unit User)" -g "$(unit Group)" "${pair#*:}/$name"
        echo "${pair#*:}/$name"
    done
}

# What LoadCredential hands out: copies that only the service can read, made at its start.
hand_over() {
    local name
    rm -rf "$root$handed"
    inside install -d -o "$(unit User)" -m 0500 "$handed"
    for name in $(unit LoadCredential); do
        [ ! -e "$root/etc/credstore/$name" ] ||
            inside install -o "$(unit User)" -m 0400 "/etc/credstore/$name" "$handed/$name"
    done
}

# The unit's command, as its user, on a root that is read-only but for the unit's folders.
start() {
    local command folders
    read -ra command < <(unit ExecStart)
    folders=$(make_folders)
    hand_over
    NOTIFY_SOCKET=/run/notify CREDENTIALS_DIRECTORY=$handed unshare --mount bash -c '
        root=$1 folders=$2
        mount --rbind "$root" "$root" && mount -o remount,bind,ro "$root" || exit 99
        for folder in $folders; do
            mount --bind "$root$folder" "$root$folder" && mount -o remount,bind,rw "$root$folder" || exit 99
        done
        exec chroot "$root" "${@:3}"' start "$root" "$folders" env ${preload:+LD_PRELOAD=$preload} \
        setpriv --reuid "$(unit User)" --regid "$(unit Group)" --init-groups \
        --no-new-privs --inh-caps -all --bounding-set -all "${command[@]}" >"$log" 2>&1 &
    gateway=$!
    within told READY=1
    must "${ask[@]}" -o /dev/null "$url/readyz"
    within values
}

stop() {
    kill -TERM $gateway
    wait $gateway || fail "it ended with $?"
    gateway=
    within told STOPPING=1
}

token() { sed -n '/shown only now/{n;n;s/ //g;p}' "$root.token"; }
new_token() { inside panelgate token new --name scada --role operator -o /etc/panelgate/scada.hash >"$root.token"; }
with() { ask=(curl -sf --cacert "$root/etc/panelgate/tls/ca.crt" -H "Authorization: Bearer $1"); }
write() { "${ask[@]}" -X PUT -d '{"value":21.5}' "$url/api/v1/stations/press/points/setpoint" >/dev/null; }
refused() { ! write; }
recorded() { [ "$(inside panelgate audit show --kind write --json | grep -c '"outcome":"confirmed"')" = "$1" ]; }
doubted() { inside panelgate check 2>&1 >/dev/null | grep -F "$1" >/dev/null; }

# TLS, a token as a hash, a token by systemd, and an audit without which nothing may be written, set up as
# docs/operate/tls.md, docs/tasks/tokens.md and docs/operate/audit.md say.
secure() {
    inside panelgate cert new-ca --dir /etc/panelgate/tls >/dev/null
    inside panelgate cert new-server localhost 127.0.0.1 --dir /etc/panelgate/tls >/dev/null
    new_token
    mkdir -m 700 "$root/etc/credstore"
    (umask 077; echo the-token-of-the-shift-1 >"$root/etc/credstore/panelgate-operator")
    sed -i '/^http:/,$d' "$root/etc/panelgate/panelgate.yaml"
    cat >>"$root/etc/panelgate/panelgate.yaml" <<'YAML'
http:
  listen: 127.0.0.1:8080
  anonymous: none
  tokens:
    - {name: scada, role: operator, file: /etc/panelgate/scada.hash}
    - {name: ops, role: operator, file: "${CREDENTIALS_DIRECTORY:-/etc/credstore}/panelgate-operator"}
  tls: {certificate: /etc/panelgate/tls/localhost.crt, key: /etc/panelgate/tls/localhost.key}
audit: {file: /var/log/panelgate/audit.jsonl, on_failure: refuse_writes}
YAML
}

prepare
say "install"
install first.deb
is_in_place
say "start"
listen
start
[ "$(stat -c %u "/proc/$gateway")" = "$(inside id -u panelgate)" ] || fail "it runs as another user"
say "reload"
kill -HUP $gateway
must values
say "upgrade, with a configuration that somebody has changed"
echo "# ours" >>"$root/etc/panelgate/panelgate.yaml"
install next.deb
is_in_place
must values  # without systemd nobody starts it again: the old program runs on
must grep -q "^# ours" "$root/etc/panelgate/panelgate.yaml"
stop
say "TLS, tokens, and an audit without which nothing is written"
cp "$root/etc/panelgate/panelgate.yaml" "$root.demo"
mkdir -p "$root/etc/panelgate/tls"
secure
must doubted "the service's user panelgate cannot read /etc/panelgate/tls/localhost.key: chgrp panelgate"
inside chgrp panelgate /etc/panelgate/tls/localhost.key
inside chmod 640 /etc/panelgate/tls/localhost.key
make_folders >/dev/null  # the first start has made them
must_not doubted warning
url=https://127.0.0.1:8080
with "$(token)"
listen
start
must write
within recorded 1
must inside panelgate audit verify >"$root.verified"
must [ "$(stat -c %u "$root/var/log/panelgate/audit.jsonl")" = "$(inside id -u panelgate)" ]
say "a token that is a file is renewed by a reload, a credential by a restart"
rm "$root/etc/panelgate/scada.hash"
new_token
kill -HUP $gateway
within refused
with "$(token)"
within write
echo the-token-of-the-shift-2 >"$root/etc/credstore/panelgate-operator"
stop
with the-token-of-the-shift-2
listen
start
must write
stop
cp "$root.demo" "$root/etc/panelgate/panelgate.yaml"
rm -r "$root/etc/panelgate/tls" "$root/etc/panelgate/scada.hash" "$root/etc/credstore" "$root$handed"
say "remove"
must inside dpkg -r panelgate >"$log" 2>&1
is "rc "
must_not [ -e "$root/usr/bin/panelgate" ]
must grep -q "^# ours" "$root/etc/panelgate/panelgate.yaml"
say "install again"
install first.deb
is_in_place
say "purge"
must inside dpkg -P panelgate >"$log" 2>&1
is ""
left=$(find "$root" -xdev -name '*panelgate*' ! -path '*/var/log/*')
[ -z "$left" ] || fail "left behind: $left"
must_not [ -e "$root/var/log/panelgate" ]
must_not inside getent passwd panelgate
echo "packages.sh: $(basename "$package") lived as it should"
