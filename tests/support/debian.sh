# For the scripts that want a Debian of its own for a package; sourced by them.

# make_debian PACKAGE FOLDER [MORE,PACKAGES]: a Debian 12 with what the package needs, without it.
make_debian() {
    local needed architecture mirror=()
    architecture=$(dpkg-deb -f "$1" Architecture)
    needed=$(dpkg-deb -f "$1" Depends Pre-Depends |
        sed 's/^[A-Za-z-]*://; s/([^)]*)//g; s/ //g' | paste -sd,)
    [ ! -e /etc/apt/sources.list.d/debian.sources ] || mirror=(/etc/apt/sources.list.d/debian.sources)
    echo "== a Debian 12 of $architecture"
    mmdebstrap --quiet --mode=root --variant=minbase --architectures="$architecture" \
        --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr --include="$needed${3+,$3}" bookworm "$2" "${mirror[@]}"
}

# next_version PACKAGE FILE [other]: the same as a later version; `other`: with another program.
next_version() {
    local folder
    folder=$(mktemp -d)
    dpkg-deb -R "$1" "$folder"
    sed -i 's/^Version: .*$/&+next/' "$folder/DEBIAN/control"
    [ -z "${3-}" ] || echo >>"$folder/usr/bin/panelgate"
    dpkg-deb --root-owner-group -b "$folder" "$2" >/dev/null
    rm -rf "$folder"
}
