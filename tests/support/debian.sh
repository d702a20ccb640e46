# For the scripts that want a Debian of its own for a package; sourced by them. They have a fail().

script=${0##*/}
patience=60  # seconds: a limit for what should happen soon

skip() { echo "$script: skipped, $*"; exit 77; }
say() { echo "== $*"; }
must() { "$@" || fail "failed: $*"; }
must_not() { ! "$@" || fail "should have failed: $*"; }
within() {
    local end=$((SECONDS + patience))
    until "$@"; do [ $SECONDS -lt $end ] || fail "not within $patience s: $*"; done
}

# find_package [PACKAGE.deb]: its path in $package; by default what was made for this machine.
find_package() {
    package=${1-$(find build/packages -name "panelgate_*_$(dpkg --print-architecture).deb" 2>/dev/null |
        sort -V | tail -n 1)}
    [ -n "$package" ] || skip "there is no package: deploy/package.sh"
    [ -e "$package" ] || { echo "$script: there is no $package" >&2; exit 66; }
    package=$(readlink -f "$package")
}

need_root_and() {
    local tool
    [ "$(id -u)" = 0 ] || skip "it needs root"
    for tool; do command -v "$tool" >/dev/null || skip "there is no $tool here"; done
}

# make_debian PACKAGE FOLDER [MORE,PACKAGES]: a Debian 12 with what the package needs, without it.
make_debian() {
    local needed architecture mirror=()
    architecture=$(dpkg-deb -f "$1" Architecture)
    needed=$(dpkg-deb -f "$1" Depends Pre-Depends |
        sed 's/^[A-Za-z-]*://; s/([^)]*)//g; s/ //g' | paste -sd,)
    [ ! -e /etc/apt/sources.list.d/debian.sources ] || mirror=(/etc/apt/sources.list.d/debian.sources)
    say "a Debian 12 of $architecture"
    mmdebstrap --quiet --mode=root --variant=minbase --architectures="$architecture" \
        --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr --include="$needed${3+,$3}" bookworm "$2" "${mirror[@]}"
}

# next_version PACKAGE FILE [other]: the same as a later version, with a later demonstration; `other`: with another
# program, too.
next_version() {
    local folder
    folder=$(mktemp -d)
    dpkg-deb -R "$1" "$folder"
    sed -i 's/^Version: .*$/&+next/' "$folder/DEBIAN/control"
    find "$folder/etc/panelgate/panelgate.yaml" "$folder/usr/share/panelgate/demo.yaml" -type f \
        -exec sh -c 'echo "# later" >>"$0"' {} \; 2>/dev/null || true
    [ -z "${3-}" ] || echo >>"$folder/usr/bin/panelgate"
    dpkg-deb --root-owner-group -b "$folder" "$2" >/dev/null
    rm -rf "$folder"
}
