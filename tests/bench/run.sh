#!/usr/bin/env bash
# tests/bench/run.sh [--quick] [--only NAME] ...: measures build/release/panelgate beside the ideal
# master and rivals; `--help` tells the rest. Leaves build/bench/table.md, results.json and plot.svg.
set -euo pipefail
python=/usr/bin/python3 # Debian's: pymodbus is Debian's package
[ -x $python ] || python=python3
exec $python -B "$(dirname "$(readlink -f "$0")")/driver.py" "$@"
