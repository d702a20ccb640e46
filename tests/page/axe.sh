#!/usr/bin/env bash
# tests/page/axe.sh [PAGE ...]   PAGE is such as /docs/tasks/tokens.html or '/#/points'; default: all of them
# Looks with axe-core for what bars people from the dashboard and the manual: see README.md. PANELGATE is the program.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/../.."
[ -f "${AXE-}" ] || { echo "axe: no axe-core: npm install --prefix FOLDER axe-core; AXE=FOLDER/node_modules/axe-core/axe.min.js" >&2; exit 77; }
command -v chromium >/dev/null || { echo "axe: no chromium: deploy/install_packages.sh pictures" >&2; exit 77; }
exec /usr/bin/python3 -B tests/system/test_axe.py "$@"
