#!/usr/bin/env bash
# deploy/package.sh [amd64|arm64|armhf] [--test]   (default: what this machine is)
# Builds build/packages/panelgate_VERSION_ARCH.deb for Debian 12, whatever this machine is: clang with
# a folder of that architecture's libraries, kept in ${XDG_CACHE_HOME:-~/.cache}/panelgate. The same
# sources of the same time (SOURCE_DATE_EPOCH, else the last commit's) make the same package.
# --test runs the unit tests of the pure modules and the demo as well, by qemu where it has to.
# Wants what deploy/install_packages.sh build package brings, and the network for the folder; from
# PANELGATE_MIRROR ("deb http://MIRROR/debian bookworm main"), else from where apt has its packages.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

usage() { sed -n '2,8s/^# //p' "$0" >&2; exit 64; }
die() { echo "package: $*" >&2; exit 1; }
say() { echo "== $*"; }

architecture=$(dpkg --print-architecture)
test=no
for word in "$@"; do
    case "$word" in
        amd64 | arm64 | armhf) architecture=$word ;;
        --test) test=yes ;;
        *) usage ;;
    esac
done

flags=
case $architecture in
    amd64) triple=x86_64-linux-gnu machine=x86_64 ;;
    arm64) triple=aarch64-linux-gnu machine=aarch64 ;;
    # What Debian's armhf is built for
    armhf) triple=arm-linux-gnueabihf machine=arm flags="-march=armv7-a -mfpu=vfpv3-d16 -mfloat-abi=hard" ;;
    *) die "there is no package for $architecture; amd64, arm64, armhf" ;;
esac
emulator=
run=()
[ "$architecture" = "$(dpkg --print-architecture)" ] || emulator=qemu-$machine-static
pure=(base modbus yaml profile arbiter tap doctor plan scan)

build=$PWD/build/package-$architecture
packages=$PWD/build/packages
version=$(sed -n 's/^project(panelgate VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
[ -n "${SOURCE_DATE_EPOCH-}" ] || SOURCE_DATE_EPOCH=$(git log -1 --format=%ct 2>/dev/null) ||
    SOURCE_DATE_EPOCH=$(stat -c %Y CHANGELOG.md)
export SOURCE_DATE_EPOCH

need() {
    local tool
    for tool in clang++-19 cmake ninja mmdebstrap dpkg-shlibdeps fakeroot "$triple-strip" $emulator; do
        command -v "$tool" >/dev/null ||
            die "there is no $tool here: deploy/install_packages.sh build package"
    done
}

# What the build wants of the other architecture, by the one list of packages.
libraries() {
    awk '{ sub(/#.*/, ""); gsub(/[ \t]/, "") } /^\[/ { inside = ($0 == "[build]"); next } inside' \
        deploy/packages.txt | grep -E -- '-dev$|^libjs-'
    printf '%s\n' libstdc++-12-dev libc6-dev libgtest-dev libgmock-dev
}

# A changed list makes a new one.
make_sysroot() {
    local list mirror=()
    list=$(libraries | sort -u | paste -sd,)
    sysroot=${XDG_CACHE_HOME:-$HOME/.cache}/panelgate/$architecture-$(
        { echo "$list"; cat deploy/package/database.sh; } | sha256sum | cut -c1-12)
    [ -z "$emulator" ] || run=("$emulator" -L "$sysroot")
    [ ! -d "$sysroot" ] || return 0
    say "libraries of Debian 12 for $architecture"
    mkdir -p "$(dirname "$sysroot")"
    [ ! -e /etc/apt/sources.list.d/debian.sources ] || mirror=(/etc/apt/sources.list.d/debian.sources)
    [ -z "${PANELGATE_MIRROR-}" ] || mirror=("$PANELGATE_MIRROR")
    rm -rf "$sysroot.part"
    mmdebstrap --quiet --variant=extract --architectures="$architecture" --include="$list" \
        --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
        --extract-hook="deploy/package/database.sh \"\$1\"" bookworm "$sysroot.part" "${mirror[@]}"
    # qemu -L would look there first, and its /dev/ptmx belongs to no devpts.
    rm -rf "$sysroot.part/dev"
    mv "$sysroot.part" "$sysroot"
}

# What CMake has found in another folder of libraries it would go on with.
forget_other_libraries() {
    [ ! -e "$build/CMakeCache.txt" ] || grep -q "^PANELGATE_SYSROOT:[A-Z]*=$sysroot$" "$build/CMakeCache.txt" ||
        rm -rf "$build"
}

# What only another architecture warns of stops no package.
configure() {
    mkdir -p "$build"
    cmake -S . -B "$build" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/deploy/package/toolchain.cmake" \
        -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS_RELEASE=-O2 -DCMAKE_INSTALL_PREFIX=/usr -DCMAKE_SKIP_RPATH=ON \
        -DPANELGATE_TRIPLE="$triple" -DPANELGATE_SYSROOT="$sysroot" -DPANELGATE_EMULATOR="$emulator" \
        -DPANELGATE_MACHINE_FLAGS="$flags" -DPANELGATE_TESTS="$1" -DPANELGATE_PACKAGE=ON -DPANELGATE_UNITY=ON -DPANELGATE_WERROR=OFF \
        -DPANELGATE_ARCHITECTURE="$architecture" -DPANELGATE_DOCUMENTS="$build/documents" \
        -DPANELGATE_DEPENDS="${2-}" >"$build.log" 2>&1 || { tail -n 20 "$build.log" >&2; exit 1; }
}

make() { cmake --build "$build" --target "$@" -- -k 0 >"$build.log" 2>&1 || {
    grep -v '^\[' "$build.log" | tail -n 40 >&2; exit 1; }; }

# Which packages, since which version, the program's libraries are of; nothing runs for it. dpkg knows
# files by where they are installed, and these lie elsewhere, with /lib a link to /usr/lib.
depends() {
    local folder
    folder=$(mktemp -d)
    mkdir -p "$folder/debian/panelgate/DEBIAN"
    cp "$build/panelgate" "$folder/debian/panelgate/"
    echo "Source: panelgate" >"$folder/debian/control"
    cp -r "$sysroot/var/lib/dpkg" "$folder/dpkg"
    sed -i "s,^/lib/,/usr/lib/,; s,^,$sysroot," "$folder"/dpkg/info/*.list
    (cd "$folder" && DEB_HOST_ARCH=$architecture dpkg-shlibdeps --warnings=0 --admindir="$folder/dpkg" \
        -l"$sysroot/usr/lib/$triple" -O -edebian/panelgate/panelgate) >"$folder/needed" || return
    sed -n 's/^shlibs:Depends=//p' "$folder/needed"
    rm -r "$folder"
}

documents() {
    local day
    day=$(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH")
    mkdir -p "$build/documents"
    printf 'panelgate (%s-1) bookworm; urgency=medium\n\n  * See changelog.gz.\n\n -- %s  %s\n' \
        "$version" "The panelgate authors <panelgate@plant.example>" "$day" |
        gzip -9n >"$build/documents/changelog.Debian.gz"
    gzip -9nc CHANGELOG.md >"$build/documents/changelog.gz"
    # What its libraries come from, and what is compiled into it
    DPKG_ADMINDIR=$sysroot/var/lib/dpkg deploy/sbom.sh rows libboost1.81-dev libcli11-dev libjs-dygraphs libjs-codemirror \
        $(sed 's/([^)]*)//g; s/,/ /g' <<<"$needed") | LC_ALL=C sort -u |
        deploy/sbom.sh cyclonedx "$version" >"$build/documents/sbom.cdx.json"
    deploy/manual/manual.py "$build/documents" "${run[@]}" "$build/panelgate"
    gzip -9nf "$build"/documents/panelgate.{1,yaml.5}
}

pack() {
    umask 022
    mkdir -p "$packages"
    (cd "$build" && cpack -G DEB -B "$packages" >"$build.log" 2>&1) ||
        { tail -n 20 "$build.log" >&2; exit 1; }
    rm -rf "$packages/_CPack_Packages"
}

run_tests() {
    configure ON
    say "unit tests of the pure modules${emulator:+ by $emulator}"
    make "${pure[@]/#/unit_}"
    local module
    [ -z "$emulator" ] || export PANELGATE_SANITIZED=1  # a tenth of what is played at length
    for module in "${pure[@]}"; do "${run[@]}" "$build/unit_$module" --gtest_brief=1; done
    say "the demo${emulator:+ by $emulator}"
    local termios=()
    if [ -n "$emulator" ]; then
        # shellcheck disable=SC2086  # flags are words
        clang++-19 --target="$triple" --sysroot="$sysroot" $flags -std=c++20 -O1 -fno-strict-aliasing \
            -shared -fPIC -o "$build/old_termios.so" deploy/package/old_termios.cpp
        termios=(-E LD_PRELOAD="$build/old_termios.so")
    fi
    deploy/package/demo_test.sh "$packages/panelgate_$version-1_$architecture.deb" \
        "${run[@]}" "${termios[@]}"
}

need
make_sysroot
say "panelgate for $architecture"
forget_other_libraries
configure OFF
make panelgate
needed=$(depends) || die "the packages that the program needs are not known"
documents
configure OFF "$needed"
pack
say "build/packages/panelgate_$version-1_$architecture.deb ($(stat -c %s "$packages/panelgate_$version-1_$architecture.deb") bytes): $needed"
[ $test = no ] || run_tests
