#!/usr/bin/env bash
# tests/upgrade.sh [OLD.deb [NEW.deb]]   (default: 0.1.0 of its newest commit, and what deploy/package.sh has made)
# Upgrades an installed gateway as a plant has one: a configuration of its own, tokens, a panel model, a drop-in
# of the unit, disabled or not. In a Debian of its own, without a network; without systemd as the first process
# (tests/service.sh has that), so the unit's command is run by hand. Prints what `check` and `config get` of both
# say of the configuration. Needs root and what deploy/install_packages.sh build package brings; ends with 77
# where something is missing. The old package is built once and kept in build/upgrade.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."
. tests/support/debian.sh

before=0.1.0
fail() { echo "upgrade.sh: $*" >&2; [ ! -e "$log" ] || cat "$log" >&2; exit 1; }
log=/nonexistent

# The newest commit that had that version.
commit_of() {
    local changed
    git rev-parse -q --verify "refs/tags/v$1^{commit}" && return
    changed=$(git log -1 --format=%H -S"project(panelgate VERSION $1 " -- CMakeLists.txt 2>/dev/null)
    [ -n "$changed" ] || return 1
    if git show "$changed:CMakeLists.txt" | grep -q "^project(panelgate VERSION $1 "; then git rev-parse HEAD
    else git rev-parse "$changed^"; fi
}

build_old() {
    local folder=$PWD/build/upgrade/$before commit
    old=$folder/build/packages/panelgate_$before-1_$(dpkg --print-architecture).deb
    [ ! -e "$old" ] || return 0
    commit=$(commit_of "$before") || skip "the history has no $before here"
    say "panelgate $before of ${commit:0:8}"
    mkdir -p "$folder"
    git archive "$commit" | tar -x -C "$folder"
    SOURCE_DATE_EPOCH=$(git log -1 --format=%ct "$commit") "$folder/deploy/package.sh"
}

need_root_and mmdebstrap unshare setpriv curl python3 ip git
if [ -z "${UPGRADE_ROOT-}" ]; then
    old=${1-}
    [ -n "$old" ] || build_old
    old=$(readlink -f "$old")
    find_package "${@:2}"
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    make_debian "$old" "$work/root"
    UPGRADE_ROOT=$work/root unshare --mount --net "$0" "$old" "$package"
    exit
fi
old=$1 package=$2
root=$UPGRADE_ROOT
log=$root.log
gateway=
clean_up() { [ -z "$gateway" ] || kill "$gateway" 2>/dev/null || true; }
trap clean_up EXIT
url=http://127.0.0.1:8080

inside() { chroot "$root" "$@"; }
# As an upgrade at night does it: nobody is there to be asked about the configuration.
install() { inside env DEBIAN_FRONTEND=noninteractive dpkg -i "/$1" >"$log" 2>&1 </dev/null || fail "dpkg -i $1"; }
version() { inside panelgate --version | sed -n 's/^panelgate //p'; }
asked() { curl -sf -H "Authorization: Bearer the-token-of-the-shift-1" "$url$1"; }
value() { asked /api/v1/stations/press/points/temperature | grep -q '"quality":"good"'; }
kept() { (cd "$root" && find etc/panelgate etc/credstore etc/systemd/system -type f -exec sha256sum {} + | sort -k2); }

plant() {
    mkdir -p "$root/etc/credstore" "$root/etc/panelgate/profiles" "$root/etc/systemd/system/panelgate.service.d"
    (umask 077; echo the-token-of-the-shift-1 >"$root/etc/credstore/panelgate-operator")
    sed 's/^name: .*/name: mixer-of-ours/' config/profiles/generic.yaml >"$root/etc/panelgate/profiles/mixer-of-ours.yaml"
    printf '[Service]\nDeviceAllow=char-ttyMI rw\n' >"$root/etc/systemd/system/panelgate.service.d/plant.conf"
    cat >"$root/etc/panelgate/panelgate.yaml" <<'YAML'
# floor 1, since 2026
profiles_dir: /etc/panelgate/profiles
lines:
  - name: floor1
    device: sim
    serial: {baud: 38400, parity: none}
    timing: {response_timeout: 300ms}
    stations:
      - id: 31
        name: press
        profile: autonics-gplp-s
        max_age: 500ms
        poll: [{read: UW100, count: 4, every: 1s}]
        points: [{name: temperature, at: UW100, type: i16, scale: 0.1, unit: celsius, every: 200ms}]
      - {id: 20, name: oven, profile: panasonic-gt, access: read_only}
      - {id: 7, name: mixer, profile: mixer-of-ours}
relays:
  - {from: press/UW100, count: 2, to: mixer/400010, every: 1s}
modbus_tcp:
  - {listen: 127.0.0.1:1502, allow: [127.0.0.0/8], units: {101: floor1/31}}
http:
  listen: 127.0.0.1:8080
  anonymous: none
  tokens: [{name: shift, role: operator, file: /etc/credstore/panelgate-operator}]
YAML
    chmod 644 "$root/etc/panelgate/panelgate.yaml"
    # LoadCredential of systemd would hand it out.
    inside chown panelgate "/etc/credstore" "/etc/credstore/panelgate-operator"
}

# The unit's command, as the package's user.
start() {
    local command
    read -ra command < <(sed -n 's/^ExecStart=//p' "$root/lib/systemd/system/panelgate.service")
    chroot "$root" setpriv --reuid panelgate --regid panelgate --init-groups \
        --no-new-privs --inh-caps -all --bounding-set -all "${command[@]}" >"$log" 2>&1 &
    gateway=$!
    within curl -sfo /dev/null "$url/readyz"
    within value
}
stop() {
    kill -TERM "$gateway"
    wait "$gateway" || fail "it ended with $?"
    gateway=
}

# What both say of the plant's file: nothing an operator would not want to know.
compare() {
    inside panelgate config get lines >"$root.get-$1" && inside panelgate config get http >>"$root.get-$1" &&
        inside panelgate config get modbus_tcp >>"$root.get-$1" || fail "config get of $1"
    inside panelgate check >"$root.check-$1" 2>&1 || { cat "$root.check-$1"; fail "check of $1"; }
}

mount --make-rprivate /
mount -t proc proc "$root/proc"
mount --rbind /dev "$root/dev"
ip link set lo up
cp "$old" "$root/old.deb"
cp "$package" "$root/new.deb"
say "$before: installed, with a configuration, tokens and a panel model of the plant"
install old.deb
[ "$(version)" = "$before" ] || fail "that is $(version)"
plant
start
user=$(inside id panelgate)
here=$(kept)
compare old
write='{"values":[7]}'
must curl -sfo /dev/null -X PUT -H "Authorization: Bearer the-token-of-the-shift-1" -d "$write" "$url/api/v1/stations/mixer/holding-registers/20"

say "the new program is asked before it is installed, as docs/install/upgrade.md says"
mkdir "$root/new"
dpkg-deb -x "$package" "$root/new"
must inside /new/usr/bin/panelgate check -c /etc/panelgate/panelgate.yaml >"$root.told"

say "upgrade, while it runs"
install new.deb
now=$(version)
[ "$now" = "$(dpkg-deb -f "$package" Version | sed 's/-1$//')" ] || fail "that is $now"
[ "$(inside dpkg-query -W -f '${db:Status-Abbrev}' panelgate)" = "ii " ] || fail "it is not installed"
[ "$(kept)" = "$here" ] || fail "these files differ now: $(diff <(echo "$here") <(kept))"
[ -z "$(find "$root/etc/panelgate" -name '*.dpkg-*')" ] || fail "dpkg left files behind in /etc/panelgate"
[ "$(inside id panelgate)" = "$user" ] || fail "its user is another one: $(inside id panelgate)"
must [ -L "$root/etc/systemd/system/multi-user.target.wants/panelgate.service" ]
must value  # the old program goes on until the service is started anew
stop

say "$now reads all of it"
start
asked /api/v1/version | grep -q "\"$now\"" || fail "REST says another version: $(asked /api/v1/version)"
must curl -sfo /dev/null -H "Authorization: Bearer the-token-of-the-shift-1" "$url/api/v1/stations/mixer"
must_not curl -sfo /dev/null "$url/api/v1/stations"
compare new
stop
say "what is different for this configuration (config get, check):"
diff -U0 "$root.get-old" "$root.get-new" | grep '^[-+][^-+]' || echo "   no setting"
diff -U0 "$root.check-old" "$root.check-new" | grep '^[-+][^-+]' || echo "   no line of check"

say "back to $before, and forward again"
install old.deb
[ "$(kept)" = "$here" ] || fail "going back has changed: $(diff <(echo "$here") <(kept))"
start
stop
install new.deb

say "a service that somebody has disabled stays that"
rm "$root/etc/systemd/system/multi-user.target.wants/panelgate.service"  # as systemctl disable does
install old.deb
install new.deb
must_not [ -e "$root/etc/systemd/system/multi-user.target.wants/panelgate.service" ]
[ "$(kept)" = "$here" ] || fail "that has changed: $(diff <(echo "$here") <(kept))"

say "purge: what the plant has put there stays, the demo's place is empty"
must inside dpkg -P panelgate >"$log" 2>&1
must_not [ -e "$root/etc/panelgate/panelgate.yaml" ]
must [ -e "$root/etc/panelgate/profiles/mixer-of-ours.yaml" ]
must [ -e "$root/etc/credstore/panelgate-operator" ]
echo "upgrade.sh: from $before to $now as it should"
