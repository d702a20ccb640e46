#!/usr/bin/env bash
# From a fresh Debian 12 to a running gateway with five simulated panels, in one command.
# Arguments go to `panelgate demo`: --http ADDR:PORT, --modbus ADDR:PORT.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

say() { printf '\n== %s\n' "$*"; }

say "1/3 packages"
deploy/install_packages.sh build run try
say "2/3 building (the first time takes some minutes)"
log=build/demo-build.log
mkdir -p build
if ! { cmake --preset release -DPANELGATE_UNITY=ON && cmake --build --preset release --target panelgate; } >$log 2>&1; then
    tail -n 30 $log >&2
    echo "demo: the build failed, all of it is in $PWD/$log" >&2
    exit 1
fi
say "3/3 build/release/panelgate demo $*"
exec build/release/panelgate demo "$@"
