#!/usr/bin/env bash
# tests/packages.sh [PACKAGE.deb]   (default: what deploy/package.sh has made for this machine)
# Takes a package through its life in a Debian of its own: installed, started as its unit says,
# reloaded, upgraded, removed, installed again, purged. Without systemd as the first process (that is
# tests/service.sh), so the unit's command is run by hand, as the package's user. Cut off from all
# networks. Needs root and what deploy/install_packages.sh package brings; ends with 77 where something
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
values() { curl -sf "$url/api/v1/stations/press/devices/UW0?count=5" | grep -q '"values":\[10,20,30,40,50\]'; }

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

# The unit's command, as the package's user.
start() {
    local command
    read -ra command < <(sed -n 's/^ExecStart=//p' "$root/lib/systemd/system/panelgate.service")
    NOTIFY_SOCKET=/run/notify chroot "$root" env ${preload:+LD_PRELOAD=$preload} \
        setpriv --reuid panelgate --regid panelgate --init-groups \
        --no-new-privs --inh-caps -all --bounding-set -all "${command[@]}" >"$log" 2>&1 &
    gateway=$!
    within told READY=1
    must curl -sfo /dev/null "$url/readyz"
    within values
}

stop() {
    kill -TERM $gateway
    wait $gateway || fail "it ended with $?"
    gateway=
    within told STOPPING=1
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
must_not inside getent passwd panelgate
echo "packages.sh: $(basename "$package") lived as it should"
