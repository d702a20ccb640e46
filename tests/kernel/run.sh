#!/usr/bin/env bash
# tests/kernel/run.sh [--install] [--record] [--usb]
# Runs src/line against the kernel's 8250 driver in an emulated machine (README.md). Exit code 77:
# skipped, for something is missing. --install: apt-get installs it. --record: writes what the
# drivers answered to recorded/ instead of comparing. --usb: an FTDI adapter and ftdi_sio instead.
set -euo pipefail
here=$(dirname "$(readlink -f "$0")")
cd "$here/../.."
install=no
record=no
port=uart
for option; do
    case $option in
        --install) install=yes ;;
        --record) record=yes ;;
        --usb) port=usb ;;
        *) echo "usage: tests/kernel/run.sh [--install] [--record] [--usb]" >&2; exit 64 ;;
    esac
done
case $port in
    uart) meta=linux-image-cloud-amd64 modules=() tables=(8250 absent gone pty) ;;
    usb) # in the order in which they need each other
        meta=linux-image-amd64 tables=(ftdi)
        modules=(usb-common usbcore xhci-hcd xhci-pci usbserial ftdi_sio) ;;
esac
out=$PWD/build/kernel
cache=$out/cache-$port
root=$out/root-$port
mkdir -p "$cache"

skip() { echo "skipped: $*"; exit 77; }

get_tools() {
    local missing=() tool
    for tool in qemu-system-x86_64=qemu-system-x86 cpio=cpio g++=g++ python3=python3; do
        command -v "${tool%=*}" >/dev/null || missing+=("${tool#*=}")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    [ $install = yes ] || skip "missing ${missing[*]}; tests/kernel/run.sh --install gets them"
    DEBIAN_FRONTEND=noninteractive apt-get -q install -y --no-install-recommends "${missing[@]}" \
        >/dev/null
}

# The kernel that the package $meta stands for today: downloaded once, unpacked, never installed.
get_kernel() {
    local package folder=$cache/incoming
    [ ! -e "$cache/unpacked" ] || return 0
    package=$(apt-cache depends --important "$meta" 2>/dev/null |
        awk '/Depends: linux-image-/ { print $2; exit }')
    [ -n "$package" ] || skip "apt knows no $meta (apt-get update?)"
    rm -rf "$folder"
    mkdir "$folder"
    (cd "$folder" && apt-get -q -o APT::Sandbox::User=root download "$package" >/dev/null) ||
        skip "$package cannot be downloaded"
    dpkg -x "$folder"/*.deb "$folder"
    mv "$folder"/boot/vmlinuz-* "$cache/vmlinuz"
    local number=0 module
    for module in "${modules[@]}"; do
        find "$folder/lib/modules" -name "$module.ko" -exec cp {} "$cache/$number-$module.ko" \;
        number=$((number + 1))
    done
    rm -rf "$folder"
    touch "$cache/unpacked"
}

build_guest() {
    local changed
    changed=$(find tests/kernel src/line src/base include/panelgate/{line,base} \
        -name '*.[ch]pp' -newer "$out/guest" -print -quit 2>/dev/null || true)
    [ ! -e "$out/guest" ] || [ -n "$changed" ] || return 0
    # Static: it is alone there. ld would warn of getgrgid_r(), which is not called.
    g++ -std=c++20 -O1 -static -Wall -Wextra -Werror -Wl,--no-warnings -Iinclude -Isrc/line \
        tests/kernel/*.cpp src/line/{termios_setup,driver,rs485,port_ops,open_error}.cpp \
        src/base/serial_format.cpp -o "$out/guest"
}

build_initramfs() {
    rm -rf "$root"
    mkdir -p "$root"
    cp "$out/guest" "$root/init"
    if [ ${#modules[@]} -gt 0 ]; then
        mkdir "$root/modules"
        cp "$cache"/*.ko "$root/modules"
    fi
    (cd "$root" && find . | cpio --quiet -o -H newc) >"$root.cpio"
}

[ "$(uname -m)" = x86_64 ] || skip "the emulated machine and its guest program are for x86-64"
command -v apt-get >/dev/null || skip "this is not Debian, and the kernel is a Debian package"
get_tools
get_kernel
build_guest
build_initramfs
for table in "${tables[@]}"; do rm -f "$out/$table.txt"; done

result=0
usb=()
[ $port = uart ] || usb=(usb)
python3 -B "$here/host.py" "$cache/vmlinuz" "$root.cpio" "$out" "${usb[@]}" || result=1
[ $port = usb ] || { echo "# A pseudo-terminal"; "$out/guest" record; } >"$out/pty.txt"

# The first line says where it was recorded: it may differ.
for table in "${tables[@]}"; do
    if [ ! -e "$out/$table.txt" ]; then
        echo "not ok recorded.$table: nothing was recorded"
        result=1
    elif [ $record = yes ]; then
        cp "$out/$table.txt" "$here/recorded/$table.txt"
    elif ! diff <(tail -n +2 "$here/recorded/$table.txt") <(tail -n +2 "$out/$table.txt"); then
        echo "not ok recorded.$table: < tests/kernel/recorded/$table.txt, > this kernel"
        result=1
    else
        echo "ok recorded.$table"
    fi
done
exit $result
