#!/usr/bin/env bash
# tests/model/run.sh [--large]: checks book.pml with spin (Debian's package, and clang), and that each rule is
# needed: without it spin finds a wrong value or a write that goes twice. About ten minutes; --large: an hour more,
# two stations and a further attempt, as far as the memory of hashed states goes.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")"
command -v spin >/dev/null || { echo "install spin: apt-get install spin" >&2; exit 69; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0

cp book.pml "$work"
cd "$work" # spin and its verifier write beside what they read

# check EXPECTED NAME SPIN_OPTIONS...
check() {
    local expected=$1 name=$2 errors states
    shift 2
    rm -f pan pan.txt
    spin -a "$@" book.pml >/dev/null && clang-19 -w -O2 -DSAFETY -DMEMLIM=12000 "$memory" -o pan pan.c &&
        ./pan -m5000 $hash >pan.txt 2>&1 || true
    [ -s pan.txt ] || echo "spin or the compiler failed" >pan.txt
    errors=$(sed -nE 's/.*errors: ([0-9]+).*/\1/p' pan.txt)
    states=$(sed -nE 's/ *([0-9.e+]+) states, stored.*/\1/p' pan.txt)
    [ "${errors:-?}" = "$expected" ] || failed=1
    printf '%-34s %s error(s), %s expected, %s states\n' "$name" "${errors:-?}" "$expected" "${states:-?}"
}

memory=-DCOLLAPSE
hash=
for rule in NO_FORM NO_FUNCTION NO_WINDOW NO_BOOK NO_OLDEST NO_AGAIN NO_ORDER FORGET_OLD RETRY_ALL; do
    check 1 "without: $rule" -D$rule
done
check 0 "3 requests, 4 attempts" -DATTEMPTS=4
if [ "${1-}" = --large ]; then
    memory=-DBITSTATE
    hash=-w34
    check 0 "2 stations, 5 attempts (hashed)" -DATTEMPTS=5 -DSTATIONS=2
fi
exit $failed
