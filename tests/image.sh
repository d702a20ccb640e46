#!/usr/bin/env bash
# tests/image.sh [--program FILE]
# Builds the image without Docker and runs it as deploy/compose.yaml does, cut off from all
# networks: health check, rights, read-only root, what it lists of itself, a clean end. Needs root and
# what deploy/install_packages.sh image brings; ends with 77 where something is missing.
# --program FILE puts this program into the image instead of building one there (some minutes).
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

program=
case "${1-}" in
    "") ;;
    --program) program=$(readlink -f "$2") ;;
    *) sed -n '2,6s/^# //p' "$0" >&2; exit 64 ;;
esac
for tool in mmdebstrap buildah podman runc; do
    command -v $tool >/dev/null || { echo "image.sh: skipped, there is no $tool here"; exit 77; }
done
[ "$(id -u)" = 0 ] || { echo "image.sh: skipped, it needs root"; exit 77; }

work=$(mktemp -d)
store=(--root "$work/store" --runroot "$work/run" --storage-driver overlay --log-level fatal)
box=panelgate-image-test-$$
image=localhost/panelgate:test
clean_up() {
    podman "${store[@]}" rm -f -t 5 $box >/dev/null 2>&1 || true
    umount "$work/store/overlay" 2>/dev/null || true
    rm -rf "$work"
}
trap clean_up EXIT

fail() { echo "image.sh: $*" >&2; podman "${store[@]}" logs $box >&2 || true; exit 1; }
must() { "$@" || fail "failed: $*"; }
inspect() { podman "${store[@]}" inspect --format "$1" "$2"; }

# FROM has to find the pinned day's image without asking a registry: today's Debian plays its part, with
# /usr merged from the start as there; else usrmerge comes along, and 12 MB of Perl with it.
base() {
    local tag
    tag=$(sed -n 's/^ARG DEBIAN=//p' Dockerfile)
    mmdebstrap --quiet --variant=minbase --mode=root --dpkgopt='path-exclude=/usr/share/doc/*' \
        --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
        --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
        --customize-hook='rm -rf "$1"/var/lib/apt/lists/* "$1"/var/cache/apt/*' \
        bookworm "$work/slim.tar"
    podman "${store[@]}" import -q --change 'CMD ["bash"]' "$work/slim.tar" \
        "docker.io/library/debian:$tag" >/dev/null
}

# The first stage is left out when the program is given: what it leaves behind is put there.
build() {
    local file=Dockerfile context=.
    if [ -n "$program" ]; then
        context=$work/context
        mkdir -p "$context/image/usr/bin" "$context/image/usr/share/panelgate"
        cp -r deploy "$context/"
        cp "$program" "$context/image/usr/bin/panelgate"
        strip "$context/image/usr/bin/panelgate"
        deploy/sbom.sh rows libboost1.81-dev >"$context/image/usr/share/panelgate/built-in.tsv"
        file=$work/Dockerfile
        awk '/^FROM .* AS build$/ { print; print "COPY image /image"; skip = 1; next }
             /^FROM / { skip = 0 }
             !skip' Dockerfile >"$file"
    fi
    buildah "${store[@]}" build --isolation chroot --pull-never --network host --format docker \
        -q -t $image -f "$file" "$context" >/dev/null
}

start() {
    podman "${store[@]}" --runtime runc run -d --name $box --network none --read-only \
        --cap-drop=ALL --security-opt no-new-privileges --memory 128m --pids-limit 64 \
        --ulimit nofile=20000:20000 --ulimit nproc=32768:32768 \
        --volume panelgate-state:/var/lib/panelgate --volume panelgate-audit:/var/log/panelgate \
        $image demo --http 0.0.0.0:8080 --modbus 0.0.0.0:1502 >/dev/null
}

inside() { podman "${store[@]}" exec $box "$@"; }

healthy() {
    local end=$((SECONDS + 30))
    until podman "${store[@]}" healthcheck run $box >/dev/null 2>&1; do
        [ $SECONDS -lt $end ] || fail "it does not become healthy"
    done
}

rights() {
    local status
    status=$(inside cat /proc/1/status)
    for line in 'Uid:\s*10001' 'CapEff:\s*0*$' 'CapBnd:\s*0*$' 'NoNewPrivs:\s*1' 'Seccomp:\s*2'; do
        grep -qP "^$line" <<<"$status" || fail "not so: $line in $status"
    done
    if inside touch /usr/x 2>/dev/null; then fail "its root can be written to"; fi
    for folder in /var/lib/panelgate /var/log/panelgate; do
        inside touch $folder/x || fail "$folder cannot be written to"
    done
}

listed() {
    inside cat /usr/share/panelgate/sbom.cdx.json >"$work/sbom.json"
    python3 - "$work/sbom.json" <<'PYTHON' || fail "its bill of materials lacks something"
import json, sys
names = {part["name"] for part in json.load(open(sys.argv[1]))["components"]}
missing = {"libc6", "libyaml-cpp0.7", "libprometheus-cpp-core1.0", "libboost1.81-dev"} - names
sys.exit(f"not in it: {missing}" if missing else 0)
PYTHON
    [ "$(inspect '{{.Config.StopSignal}}' $image)" = SIGTERM ] || fail "its stop signal"
    [ "$(inspect '{{index .Config.Labels "org.opencontainers.image.title"}}' $image)" = panelgate ] ||
        fail "its labels"
}

must base
must build
must start
healthy
rights
listed
memory=$(inside cat /proc/1/status | awk '/^VmRSS/ { print $2 }')
podman "${store[@]}" stop -t 30 $box >/dev/null
[ "$(inspect '{{.State.ExitCode}}' $box)" = 0 ] || fail "it ended with $(inspect '{{.State.ExitCode}}' $box)"
size=$(podman "${store[@]}" save $image | gzip -6 | wc -c)
below=$(gzip -6 <"$work/slim.tar" | wc -c)
echo "image.sh: fine; $((size / 1000)) kB packed (podman save | gzip), $((below / 1000)) kB of it Debian;" \
    "$memory kB resident; $(grep -c '"type"' "$work/sbom.json") packages listed"
