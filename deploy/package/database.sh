#!/bin/sh
# database.sh ROOT: a hook of mmdebstrap. Nothing is installed in a folder whose packages were only
# unpacked; this writes what dpkg-shlibdeps asks dpkg: which package a library is of, and since which
# version it has what. Links that lead out of the folder are turned to lead into it.
set -eu
root=$1
info=$root/var/lib/dpkg/info
mkdir -p "$info"
echo 1 >"$info/format"
part=$(mktemp -d)
trap 'rm -rf "$part"' EXIT
for deb in "$root"/var/cache/apt/archives/*.deb; do
    name=$(dpkg-deb -f "$deb" Package)
    [ "$(dpkg-deb -f "$deb" Multi-Arch)" != same ] || name=$name:$(dpkg-deb -f "$deb" Architecture)
    dpkg-deb --fsys-tarfile "$deb" | tar -t | sed 's,^\.,,; s,/$,,; s,^$,/.,' >"$info/$name.list"
    dpkg-deb -e "$deb" "$part/$name"
    for file in symbols shlibs; do
        [ ! -e "$part/$name/$file" ] || cp "$part/$name/$file" "$info/$name.$file"
    done
    { echo "Status: install ok installed"; dpkg-deb -f "$deb"; echo; } >>"$root/var/lib/dpkg/status"
done
find "$root" -type l -lname '/*' | while read -r link; do
    ln -sfn "$(realpath -m --relative-to="$(dirname "$link")" "$root$(readlink "$link")")" "$link"
done
