#!/usr/bin/env bash
# deploy/install_packages.sh [build|run|test|try ...]   (default: build run)
# Installs what is missing of these sections of packages.txt; `package` is what makes and tests
# Debian packages of it. Touches nothing, asks for no rights and needs no network when all of it is there.
set -euo pipefail
list="$(dirname "$(readlink -f "$0")")/packages.txt"

die() { echo "install_packages: $*" >&2; exit 1; }

packages_of() {
    awk -v section="[$1]" '
        { sub(/#.*/, ""); gsub(/[ \t\r]/, "") }
        /^\[/ { inside = ($0 == section); next }
        inside && NF' "$list"
}

installed() { [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]; }

[ $# -gt 0 ] || set -- build run
missing=()
for section in "$@"; do
    packages=$(packages_of "$section")
    [ -n "$packages" ] || die "there is no section '$section' in $list"
    command -v dpkg-query >/dev/null ||
        die "this is not Debian; install by hand what $list names in [$section]"
    for package in $packages; do installed "$package" || missing+=("$package"); done
done
[ ${#missing[@]} -gt 0 ] || exit 0

echo "Installing: ${missing[*]}"
root=()
if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "run this as root: apt-get install ${missing[*]}"
    root=(sudo)
fi
log=$(mktemp)
policy=/usr/sbin/policy-rc.d
made_policy=no
clean_up() {
    rm -f "$log"
    if [ $made_policy = yes ]; then "${root[@]}" rm -f $policy; fi
}
trap clean_up EXIT

# Some packages bring a service along (prometheus, for promtool): none is started by us.
if [ ! -e $policy ]; then
    made_policy=yes
    printf '#!/bin/sh\nexit 101\n' | "${root[@]}" tee $policy >/dev/null
    "${root[@]}" chmod 755 $policy
fi
apt() {
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q "$@" >"$log" 2>&1 && return
    tail -n 20 "$log" >&2
    return 1
}
apt update || echo "install_packages: apt-get update failed, trying with what is known" >&2
apt install -y --no-install-recommends "${missing[@]}" ||
    die "apt-get could not install: ${missing[*]}"
