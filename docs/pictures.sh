#!/usr/bin/env bash
# docs/pictures.sh [PROGRAM]   (default: build/release/panelgate)
# Takes the pictures docs/pictures/*.png anew: PROGRAM's demo in Chromium, light and dark. Look at them before
# they are committed. Wants what deploy/install_packages.sh pictures brings.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."
program=$(readlink -f "${1:-build/release/panelgate}")
[ -x "$program" ] || { echo "pictures: there is no $program: cmake --build build/release --target panelgate" >&2; exit 66; }
for tool in chromium pngquant optipng; do
    command -v "$tool" >/dev/null || { echo "pictures: there is no $tool: deploy/install_packages.sh pictures" >&2; exit 69; }
done
/usr/bin/python3 -B deploy/manual/pictures.py docs/pictures "$program"
for picture in docs/pictures/*.png; do
    colours=24
    case $picture in *scope*) colours=64 ;; esac  # with a key of colours
    pngquant --force --nofs --strip --speed 1 --output "$picture" $colours "$picture"
    optipng -quiet -o5 -strip all "$picture"
done
ls -l docs/pictures/*.png
