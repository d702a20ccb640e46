#!/usr/bin/env bash
# tests/run.sh [--quick | --nightly] [--gcc]: installs what is missing, builds, tests, says what was seen.
# Two builds: what users get runs the system tests, the scenarios and the explorer; the one with
# AddressSanitizer and UndefinedBehaviorSanitizer the unit tests, shorter scenarios, the fuzzers' replays and
# a system test of each face. --quick: the first build alone, with the unit tests. --nightly: all of it in
# both, what needs real time to prove what the scenarios prove in virtual time, and a release with its upgrade.
# --gcc: the unit tests of the pure modules with the second compiler, too.
# A build begins while the tests of the build before run, which wait more than they compute: it takes what they
# leave of the processor, and no more.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

mode=usual
gcc=no
for word; do
    case "$word" in
        --quick | --nightly) mode=${word#--} ;;
        --gcc) gcc=yes ;;
        *) echo "usage: tests/run.sh [--quick | --nightly] [--gcc]" >&2; exit 64 ;;
    esac
done

logs=$PWD/build/test-logs
mkdir -p "$logs"
# The tests wait more than they compute.
jobs=$(($(nproc) + 1))
summary=()
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
    tail -n 60 "$log"
    echo "   (all of it: $log)"
}

# later NAME COMMAND...: begins it beside the steps that follow, with the processor's time that these leave.
declare -A begun
later() {
    local name=$1
    shift
    set -m  # a process group of its own
    {
        chrt --idle --pid 0 "$BASHPID" || renice -n 19 "$BASHPID" || true
        SECONDS=0
        "$@" && echo "took $SECONDS s beside others"
    } >"$logs/${name//[ \/]/-}.begun.log" 2>&1 &
    begun[$name]=$!
    set +m
}
end_of() {
    local verdict=0
    wait "${begun[$1]}" || verdict=$?
    cat "$logs/${1//[ \/]/-}.begun.log"
    return $verdict
}
# What wants the machine for itself gets it.
hold() { local group; for group in "${begun[@]}"; do kill "-$1" -- "-$group" 2>/dev/null || true; done; }

# What goes on when this ends would be in the way of the next.
trap 'hold TERM' EXIT

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
    fi
    exit $failed
}

# Optimization takes longer than it saves where no test waits for the code.
build_asan() {
    local long=OFF
    [ $mode != nightly ] || long=ON
    build asan ON $long -DPANELGATE_TEST_UBSAN=$long \
        -DPANELGATE_O0="panelgate;pg_app;pg_cli;pg_config;pg_doctor;pg_metrics;pg_mqtt;pg_plan;pg_points;pg_profile;pg_rt;pg_scan;pg_sim;pg_web_api;pg_web_http;pg_yaml"
}

# Warnings are clang's affair: g++ 12 warns about every moved std::variant and in GoogleTest's macros.
pure=(base modbus yaml profile arbiter doctor)
build_gcc() {
    cmake --preset gcc -DPANELGATE_WERROR=OFF -DPANELGATE_UNITY=ON &&
        cmake --build --preset gcc --target "${pure[@]/#/unit_}"
}
run_gcc() {
    local module
    for module in "${pure[@]}"; do "build/gcc/unit_$module" --gtest_brief=1 || return; done
}

# Packages of all architectures, the image, and an upgrade from the version before.
release() {
    local script verdict
    deploy/install_packages.sh package || return
    for script in release packages upgrade; do
        verdict=0
        "tests/$script.sh" || verdict=$?
        [ $verdict = 0 ] || [ $verdict = 77 ] || return $verdict
    done
}

must "packages" deploy/install_packages.sh build run test try
step "format" check_format
units=OFF
[ $mode = usual ] || units=ON
less="|nightly"
[ $mode != nightly ] || less=
must "build release" build release $units ON
[ $mode = quick ] || later "build asan" build_asan
[ $mode != nightly ] || step "model" bash -c "deploy/install_packages.sh model && tests/model/run.sh"
[ $mode != nightly ] || step "headers stand alone" cmake --build --preset release --target all_verify_interface_header_sets
step "tests release" run_tests release -LE "alone$less"
hold STOP
step "tests release alone" run_tests release -L alone ${less:+-LE nightly}
hold CONT
step "deploy/demo.sh" /usr/bin/python3 -B tests/system/demo_script.py
if [ $mode != quick ]; then
    must "build asan" end_of "build asan"
    [ $gcc = no ] || [ $mode = nightly ] || later "build g++" build_gcc
    export ASAN_SYMBOLIZER_PATH=/usr/bin/llvm-symbolizer-19
    which=()
    [ $mode = nightly ] || which=(-L "unit|scenario|fuzz|sanitized")
    PANELGATE_SANITIZED=1 step "tests asan" run_tests asan "${which[@]}"
fi
if [ $gcc = yes ]; then
    [ -n "${begun["build g++"]-}" ] || later "build g++" build_gcc
    must "build g++" end_of "build g++"
    step "tests g++" run_gcc
fi
[ $mode != nightly ] || step "release" release
finish
