#!/usr/bin/env bash
# tests/run.sh [--quick | --nightly]: installs what is missing, builds, tests, says what was seen.
# Two builds: what users get runs the system tests, the scenarios and the explorer; the one with
# AddressSanitizer and UndefinedBehaviorSanitizer the unit tests, shorter scenarios, the fuzzers' replays and
# a system test of each face. --quick: the first build alone, with the unit tests. --nightly: all of it in
# both, and what needs real time to prove what the scenarios prove in virtual time.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

mode=usual
case "${1-}" in
    "") ;;
    --quick | --nightly) mode=${1#--} ;;
    *) echo "usage: tests/run.sh [--quick | --nightly]" >&2; exit 64 ;;
esac

logs=$PWD/build/test-logs
mkdir -p "$logs"
# The tests wait more than they compute.
jobs=$(($(nproc) + 1))
summary=()
failed_logs=()
failed=0

# step NAME COMMAND...: runs it with its output in a log; shows the log's end when it fails.
step() {
    local name=$1 log start seconds verdict=ok count
    shift
    log=$logs/${name//[ \/]/-}.log
    start=$SECONDS
    printf '== %-28s ' "$name"
    "$@" >"$log" 2>&1 || verdict=FAILED
    seconds=$((SECONDS - start))
    count=$(sed -nE 's/^[0-9]+% tests passed, .* out of ([0-9]+)$/, \1 tests/p' "$log")
    echo "$verdict$count, $seconds s"
    summary+=("$(printf '%-28s %s%s, %s s' "$name" "$verdict" "$count" "$seconds")")
    [ $verdict = ok ] && return
    failed=1
    failed_logs+=("$log")
    tail -n 60 "$log"
    echo "   (all of it: $log)"
}

# Without a build nothing else makes sense.
must() {
    local before=$failed
    failed=0
    step "$@"
    [ $failed = 0 ] || finish
    failed=$before
}

# build PRESET UNIT_TESTS LONG_TESTS [OPTION...]
build() {
    cmake --preset "$1" -DPANELGATE_UNIT_TESTS="$2" -DPANELGATE_LONG_TESTS="$3" -DPANELGATE_UNITY=ON \
        -DPANELGATE_TEST_PCH=ON -DPANELGATE_WERROR=ON "${@:4}" && cmake --build --preset "$1"
}
run_tests() { ctest --preset "$1" -j "$jobs" "${@:2}"; }
# The soak judges values and sums, which hold however late a compiler beside it makes them.
begin_soak() {
    /usr/bin/python3 -B tests/soak/soak.py "$([ $mode = nightly ] && echo 14400 || echo 180)" >"$logs/soak-output.log" 2>&1 &
    soak=$!
}
end_soak() {
    local rc=0
    wait "$soak" || rc=$?
    cat "$logs/soak-output.log"
    return $rc
}
check_format() {
    find src include tests -name '*.[ch]pp' -print0 | xargs -0 clang-format-19 --dry-run -Werror
}

finish() {
    echo
    echo "Summary"
    printf '  %s\n' "${summary[@]}"
    echo "  all together $SECONDS s; logs in $logs"
    if [ $failed = 0 ]; then
        echo "Everything passed. Next: deploy/demo.sh, or one test: ctest --preset release -R NAME"
    else
        echo "Something FAILED, see above. One test alone: ctest --preset release -R NAME"
        # What failed comes last as well: a CI keeps the end of a long output.
        grep -hE '^(FAIL|ERROR): |^[A-Za-z_.]*(Error|Exception): |\[  FAILED  \] .*\(|: Failure$|\*\*\*(Failed|Timeout)' \
            "${failed_logs[@]}" | head -n 30 | cut -c1-300 || true
    fi
    exit $failed
}

must "packages" deploy/install_packages.sh build run test try
step "format" check_format
units=OFF
[ $mode = usual ] || units=ON
which=(-LE nightly)
[ $mode != nightly ] || which=()
must "build release" build release $units ON
[ $mode != nightly ] || step "model" bash -c "deploy/install_packages.sh model && tests/model/run.sh"
[ $mode != nightly ] || step "headers stand alone" cmake --build --preset release --target all_verify_interface_header_sets
if [ $mode != quick ]; then
    long=ON
    # Optimization takes longer than it saves where no test waits for the code.
    cold=-DPANELGATE_O0="panelgate;pg_commands;pg_config;pg_doctor;pg_explain;pg_gateway;pg_mbusd;pg_metrics;pg_mqtt;pg_plan;pg_points;pg_profile;pg_rt;pg_scan;pg_sim;pg_web_api;pg_web_http;pg_yaml"
    [ $mode = nightly ] || long=OFF
    begin_soak
    # Before the tests: a compiler beside them makes panels late, however nice it is.
    must "build asan" build asan ON $long "$cold" -DPANELGATE_TEST_UBSAN=$long
    step "soak" end_soak
fi
step "tests release" run_tests release "${which[@]}"
step "deploy/demo.sh" /usr/bin/python3 -B tests/system/demo_script.py
if [ $mode != quick ]; then
    export ASAN_SYMBOLIZER_PATH=/usr/bin/llvm-symbolizer-19 PANELGATE_SANITIZED=1
    [ $mode = nightly ] || which=(-L "unit|scenario|fuzz|sanitized")
    step "tests asan" run_tests asan "${which[@]}"
fi
finish
