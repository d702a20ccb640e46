#!/usr/bin/env bash
# From a fresh Debian 12 to a running gateway with five simulated panels, in one command.
# Arguments go to `panelgate demo`: --http ADDR:PORT, --modbus ADDR:PORT.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

say() { printf '\n== %s\n' "$*"; }

say "1/3 packages"
deploy/install_packages.sh build run try
say "2/3 building (the first time takes two minutes)"
# A first look needs no optimized program; who has built one already keeps it.
tree=demo
[ ! -f build/release/build.ninja ] || tree=release
log=build/demo-build.log
mkdir -p build
if ! { cmake --preset $tree -DPANELGATE_UNITY=ON && cmake --build --preset $tree --target panelgate; } >$log 2>&1; then
    tail -n 30 $log >&2
    echo "demo: the build failed, all of it is in $PWD/$log" >&2
    exit 1
fi
ln -sfn $tree/panelgate build/panelgate
say "3/3 build/panelgate demo $*"
exec build/panelgate demo "$@"
