#!/usr/bin/env bash
# tests/release.sh [DIR]   (default: build/dist/test)
# Makes a release of the commit that is checked out, as if it had the tag, into DIR: packages for all architectures,
# the image, and all else. Then the image's programs are asked: this machine's and, by qemu, arm64's. With podman and
# runc the image is run as well. Ends with 77 where something is missing.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."
. tests/support/debian.sh
fail() { echo "release.sh: $*" >&2; exit 1; }

for tool in mmdebstrap git python3 readelf qemu-aarch64-static; do
    command -v $tool >/dev/null || skip "there is no $tool here"
done
out=$(readlink -m "${1:-build/dist/test}")
version=$(sed -n 's/^project(panelgate VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
work=$(mktemp -d)
box=panelgate-release-test-$$
store=(--root "$work/store" --runroot "$work/run" --storage-driver overlay --log-level error)
clean_up() {
    podman "${store[@]}" rm -f -t 5 $box >/dev/null 2>&1 || true
    umount "$work/store/overlay" 2>/dev/null || true
    rm -rf "$work"
}
trap clean_up EXIT

rm -rf "$out"
for architecture in amd64 arm64 armhf; do deploy/package.sh $architecture; done
git clone --quiet --shared . "$work/tree"
git -C "$work/tree" -c user.name=test -c user.email=test@plant.example tag --force "v$version" >/dev/null
SECONDS=0
"$work/tree/deploy/release.sh" --packages "$PWD/build/packages" --image-by files --out "$out"
say "made in $SECONDS s, packages not counted"
(cd "$out" && must sha256sum --check --quiet --strict SHA256SUMS)

say "the programs of the image"
python3 - "$out/panelgate-$version-image.tar" "$work" <<'PYTHON'
import io, json, pathlib, sys, tarfile
archive = tarfile.open(sys.argv[1])
def blob(part):
    return archive.extractfile("blobs/" + part["digest"].replace(":", "/")).read()
[index] = json.loads(archive.extractfile("index.json").read())["manifests"]
for image in json.loads(blob(index))["manifests"]:
    for layer in json.loads(blob(image))["layers"]:
        tarfile.open(fileobj=io.BytesIO(blob(layer))).extractall(pathlib.Path(sys.argv[2]) / image["platform"]["architecture"])
PYTHON
said() { sed -n 's/^panelgate //p'; }
[ "$(dpkg --print-architecture)" != amd64 ] || [ "$(chroot "$work/amd64" /usr/bin/panelgate --version | said)" = "$version" ] ||
    fail "that of amd64 does not run with what is in the image alone"
cp "$(command -v qemu-aarch64-static)" "$work/arm64/usr/bin/qemu"
[ "$(chroot "$work/arm64" /usr/bin/qemu /usr/bin/panelgate --version | said)" = "$version" ] ||
    fail "that of arm64 does not run with what is in the image alone"

if command -v podman >/dev/null && command -v runc >/dev/null; then
    say "the image, as its file says, by podman"
    podman "${store[@]}" pull --quiet "oci-archive:$out/panelgate-$version-image.tar" >/dev/null
    podman "${store[@]}" --runtime runc run -d --name $box --network none --read-only --cap-drop=ALL \
        --security-opt no-new-privileges --memory 128m --pids-limit 64 --ulimit nofile=20000:20000 \
        --ulimit nproc=32768:32768 "docker.io/library/panelgate:$version" demo --http 0.0.0.0:8080 --modbus 0.0.0.0:1502 >/dev/null
    healthy() { podman "${store[@]}" exec $box panelgate health >/dev/null 2>&1; }
    within healthy
    podman "${store[@]}" exec $box panelgate status || fail "its stations are not well"
    podman "${store[@]}" stop -t 30 $box >/dev/null
    [ "$(podman "${store[@]}" inspect --format '{{.State.ExitCode}}' $box)" = 0 ] || fail "it ended badly"
fi
echo "release.sh: $version in $out: as it should be"
