#!/usr/bin/env bash
# tests/kernel/run.sh [--install] [--record]
# Runs src/line against the kernel's 8250 driver in an emulated machine (README.md). Exit code 77:
# skipped, for something is missing. --install: apt-get installs it. --record: writes what the
# drivers answered to recorded/ instead of comparing.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
cd "$here/../.."
out=$PWD/build/kernel
install=no
record=no
for option; do
    case $option in
        --install) install=yes ;;
        --record) record=yes ;;
        *) echo "usage: tests/kernel/run.sh [--install] [--record]" >&2; exit 64 ;;
    esac
done

skip() { echo "skipped: $*"; exit 77; }

[ "$(uname -m)" = x86_64 ] || skip "the emulated machine and its guest program are for x86-64"
command -v apt-get >/dev/null || skip "this is not Debian, and the kernel is a Debian package"

missing=()
need() { command -v "$1" >/dev/null || missing+=("$2"); }
need qemu-system-x86_64 qemu-system-x86
need cpio cpio
need g++ g++
need python3 python3
if [ ${#missing[@]} -gt 0 ]; then
    [ $install = yes ] || skip "missing ${missing[*]}; tests/kernel/run.sh --install gets them"
    DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends "${missing[@]}" \
        >/dev/null
fi

# The kernel that linux-image-cloud-amd64 stands for today; downloaded once, never installed.
mkdir -p "$out/cache"
kernel=$(cd "$out/cache" && find . -name 'vmlinuz-*' | sort -V | tail -n 1)
if [ -z "$kernel" ]; then
    package=$(apt-cache depends --important linux-image-cloud-amd64 2>/dev/null |
        awk '/Depends: linux-image-/ { print $2; exit }')
    [ -n "$package" ] || skip "apt knows no linux-image-cloud-amd64 (apt-get update?)"
    (cd "$out/cache" && apt-get -q -o APT::Sandbox::User=root download "$package" >/dev/null) ||
        skip "$package cannot be downloaded"
    deb=$(find "$out/cache" -name "${package}_*.deb" | head -n 1)
    dpkg --fsys-tarfile "$deb" | tar -x -C "$out/cache" --wildcards './boot/vmlinuz-*'
    rm "$deb"
    kernel=$(cd "$out/cache" && find . -name 'vmlinuz-*' | sort -V | tail -n 1)
fi

sources=(tests/kernel/*.cpp src/base/serial_format.cpp
    src/line/{termios_setup,driver,rs485,port_ops,open_error}.cpp)
changed=$(find tests/kernel src/line src/base include/panelgate/{line,base} -name '*.[ch]pp' \
    -newer "$out/root/init" -print -quit 2>/dev/null || true)
mkdir -p "$out/root"
if [ ! -e "$out/root/init" ] || [ -n "$changed" ]; then
    # Static: the guest has no other file. ld would warn of getgrgid_r(), which is not called there.
    g++ -std=c++20 -O1 -static -Wall -Wextra -Werror -Wl,--no-warnings -Iinclude -Isrc/line \
        "${sources[@]}" -o "$out/root/init"
fi
(cd "$out/root" && echo init | cpio --quiet -o -H newc) >"$out/initramfs"

result=0
python3 -B "$here/host.py" "$out/cache/$kernel" "$out/initramfs" "$out" ||
    result=1
{
    echo "# A pseudo-terminal"
    "$out/root/init" record
} >"$out/pty.txt"

# The first line says where it was recorded: it may differ.
for table in 8250 absent gone pty; do
    if [ $record = yes ]; then
        cp "$out/$table.txt" "$here/recorded/$table.txt"
    elif ! diff <(tail -n +2 "$here/recorded/$table.txt") <(tail -n +2 "$out/$table.txt"); then
        echo "not ok recorded.$table: < tests/kernel/recorded/$table.txt, > this kernel"
        result=1
    else
        echo "ok recorded.$table"
    fi
done
exit $result
