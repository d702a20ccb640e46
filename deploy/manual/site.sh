#!/usr/bin/env bash
# deploy/manual/site.sh OUT    the manual as a site of its own in OUT: any web server, or a browser and OUT/index.html
# By the generator that the program's own manual is made with, so that both are the same; it ends with 1 where a
# link, an anchor or a picture leads nowhere. Wants what deploy/install_packages.sh build brings.
set -euo pipefail
[ $# = 1 ] || { sed -n '2,4s/^# //p' "$0" >&2; exit 64; }
here=$(dirname "$(readlink -f "$0")")
version=$(sed -n 's/^project(panelgate VERSION \([0-9.]*\).*/\1/p' "$here/../../CMakeLists.txt")
/usr/bin/python3 -B "$here/site.py" "$1" "$version"
echo "$(find "$1" -name '*.html' | wc -l) pages, $(du -sh "$1" | cut -f1): $1/index.html"
