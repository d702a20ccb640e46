#!/usr/bin/env bash
# deploy/release.sh [--out DIR] [--packages DIR] [--without-image] [--image-by HOW] [--sign KEY] [TAG]
# Makes what a release consists of, from a clean tree at TAG (default: v and the version of CMakeLists.txt),
# into DIR (default: build/dist/VERSION): Debian packages for amd64, arm64 and armhf, a folder that apt takes
# them from, an image for amd64 and arm64 (OCI archive), bills of materials (CycloneDX), sources,
# documentation, the notes cut out of CHANGELOG.md, and SHA256SUMS of all. The same commit and the same
# Debian make the same files, byte by byte.
#   --packages DIR   takes the packages from there instead of building them
#   --without-image  makes none
#   --image-by HOW   files: of the packages' files, without an engine (the default where no engine can);
#                    buildx, buildah: the Dockerfile's last stage by this engine. Its files are not the
#                    same byte by byte, as an engine writes times of its own.
#   --sign KEY       signs apt's folder and SHA256SUMS with this key of gpg
# Wants what deploy/install_packages.sh build package brings, and the network for Debian's libraries.
# Ends with 65 where the tree, the tag or the changelog is not that of a release.
set -euo pipefail
cd "$(dirname "$(readlink -f "$0")")/.."

usage() { sed -n '2,16s/^# //p' "$0" >&2; exit 64; }
die() { echo "release: $*" >&2; exit 1; }
refuse() { echo "release: $*" >&2; exit 65; }
say() { printf '== %s\n' "$*"; }

version=$(sed -n 's/^project(panelgate VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
out= packages= image=yes by= key= tag=
while [ $# -gt 0 ]; do
    case "$1" in
        --out) out=${2:?--out wants a folder}; shift ;;
        --packages) packages=${2:?--packages wants a folder}; shift ;;
        --without-image) image=no ;;
        --image-by) by=${2:?--image-by wants files, buildx or buildah}; shift ;;
        --sign) key=${2:?--sign wants a key}; shift ;;
        -*) usage ;;
        *) [ -z "$tag" ] || usage; tag=$1 ;;
    esac
    shift
done
tag=${tag:-v$version}
case "$by" in "" | files | buildx | buildah) ;; *) usage ;; esac
out=$(readlink -m "${out:-build/dist/$version}")
[ -z "$packages" ] || packages=$(readlink -e "$packages") || die "there is no such folder of packages"
name=panelgate-$version
architectures=(amd64 arm64 armhf)
pictured=(amd64 arm64)  # of the image

# What CHANGELOG.md says of this version, without its heading.
notes() {
    awk -v version="$version" '
        /^## / { inside = ($2 == version || $2 == "[" version "]"); next }
        inside' CHANGELOG.md | sed -e '/./,$!d'
}

check() {
    local changed commit
    commit=$(git rev-parse HEAD 2>/dev/null) || refuse "this is no clone of the repository; a release is made of a commit"
    [ "$tag" = "v$version" ] ||
        refuse "$tag is not v$version, which is what CMakeLists.txt says: set the version there, or name that tag"
    [ "$(git rev-parse -q --verify "refs/tags/$tag^{commit}")" = "$commit" ] ||
        refuse "$tag is not the commit that is checked out: git tag $tag, or git checkout $tag"
    changed=$(git status --porcelain)
    [ -z "$changed" ] || refuse "the tree differs from its commit; commit or remove this first:
$(head -n 10 <<<"$changed")"
    [ -n "$(notes)" ] || refuse "CHANGELOG.md has no section '## $version', or nothing in it"
    [ ! -e "$out" ] || [ -z "$(ls -A "$out")" ] || refuse "$out is not empty; remove it, or name another by --out"
    SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
    export SOURCE_DATE_EPOCH
}

deb() { echo "panelgate_$version-1_$1.deb"; }

make_packages() {
    local architecture
    mkdir -p "$out"
    for architecture in "${architectures[@]}"; do
        if [ -z "$packages" ]; then deploy/package.sh "$architecture"; fi
        cp "${packages:-build/packages}/$(deb "$architecture")" "$out/" ||
            die "there is no $(deb "$architecture") in ${packages:-build/packages}"
        [ "$(dpkg-deb -f "$out/$(deb "$architecture")" Package Version Architecture | paste -sd' ')" = \
            "Package: panelgate Version: $version-1 Architecture: $architecture" ] ||
            die "$(deb "$architecture") says of itself that it is something else"
        # As the package has it, so that the two agree
        dpkg-deb --fsys-tarfile "$out/$(deb "$architecture")" |
            tar -xO ./usr/share/panelgate/sbom.cdx.json >"$out/$name-$architecture.cdx.json" ||
            die "$(deb "$architecture") has no bill of materials"
    done
}

# The layout that apt knows, for `deb [signed-by=...] file:FOLDER bookworm main`.
make_apt() {
    local architecture folder
    say "apt's folder"
    mkdir -p "$out/apt/pool/main/p/panelgate"
    for architecture in "${architectures[@]}"; do
        ln "$out/$(deb "$architecture")" "$out/apt/pool/main/p/panelgate/"
        folder=$out/apt/dists/bookworm/main/binary-$architecture
        mkdir -p "$folder"
        (cd "$out/apt" && apt-ftparchive --arch "$architecture" -o APT::FTPArchive::AlwaysStat=true packages pool) \
            >"$folder/Packages"
        gzip -9nk "$folder/Packages"
    done
    (cd "$out/apt/dists/bookworm" && apt-ftparchive \
        -o APT::FTPArchive::Release::Origin=panelgate -o APT::FTPArchive::Release::Label=panelgate \
        -o APT::FTPArchive::Release::Suite=bookworm -o APT::FTPArchive::Release::Codename=bookworm \
        -o APT::FTPArchive::Release::Components=main \
        -o APT::FTPArchive::Release::Architectures="${architectures[*]}" \
        -o APT::FTPArchive::Release::Description="panelgate $version for Debian 12" \
        -o APT::FTPArchive::MD5=false -o APT::FTPArchive::SHA1=false release . |
        sed "s/^Date: .*/Date: $(LC_ALL=C date -u -R -d "@$SOURCE_DATE_EPOCH" | sed 's/+0000/UTC/')/") >"$out/Release"
    mv "$out/Release" "$out/apt/dists/bookworm/Release"
    [ -z "$key" ] || {
        gpg --batch --yes --local-user "$key" --clearsign -o "$out/apt/dists/bookworm/InRelease" "$out/apt/dists/bookworm/Release"
        gpg --batch --yes --armor --export "$key" >"$out/apt/panelgate.asc"
    }
}

make_texts() {
    say "sources, documentation, notes"
    git archive --prefix="$name/" HEAD | gzip -9n >"$out/$name.tar.gz"
    git archive --prefix="$name-docs/" HEAD docs README.md CHANGELOG.md SECURITY.md LICENSE | gzip -9n >"$out/$name-docs.tar.gz"
    notes >"$out/$name-notes.md"
}

# Whether an engine can build for both, else why not.
engine_lacks() {
    case "$1" in
        buildx)
            if ! command -v docker >/dev/null; then echo "there is no docker"
            elif ! docker buildx version >/dev/null 2>&1; then echo "docker has no buildx"
            elif ! docker info >/dev/null 2>&1; then echo "no Docker engine answers"
            elif ! docker buildx inspect --bootstrap 2>/dev/null | grep -q linux/arm64; then
                echo "the builder runs no arm64 (docker run --privileged tonistiigi/binfmt)"; fi ;;
        buildah)
            local architecture
            command -v buildah >/dev/null || { echo "there is no buildah"; return; }
            for architecture in "${pictured[@]}"; do
                [ "$architecture" = "$(dpkg --print-architecture)" ] || arch-test "$architecture" >/dev/null 2>&1 ||
                    { echo "this machine runs no $architecture (qemu-user-static, and binfmt_misc mounted)"; return; }
                timeout 60 buildah "${store[@]}" pull --quiet --arch "$architecture" "docker.io/library/debian:$debian" \
                    >/dev/null 2>&1 || { echo "debian:$debian for $architecture cannot be pulled"; return; }
            done ;;
    esac
}

# What a bill of materials has besides the libraries that dpkg knows of in the image: what was compiled into it.
built_in() {
    python3 - "$1" <<'PYTHON'
import json, re, sys
for part in json.load(open(sys.argv[1]))["components"]:
    if re.search(r"-dev$|^libjs-", part["name"]):
        [source] = [one["value"] for one in part["properties"] if one["name"] == "debian:source"]
        print(part["name"], part["version"], re.search(r"arch=(\w+)", part["purl"])[1], *source.split(), sep="\t")
PYTHON
}

# The Dockerfile with what the packages have in place of its first stage.
make_context() {
    local architecture
    mkdir -p "$work/context"
    cp -r deploy "$work/context/"
    for architecture in "${pictured[@]}"; do
        dpkg-deb -x "$out/$(deb "$architecture")" "$work/deb-$architecture"
        mkdir -p "$work/context/image-$architecture/usr/share/doc/panelgate" "$work/context/image-$architecture/usr/share/panelgate"
        cp -r "$work/deb-$architecture/usr/bin" "$work/context/image-$architecture/usr/"
        cp "$work/deb-$architecture/usr/share/doc/panelgate/copyright" "$work/context/image-$architecture/usr/share/doc/panelgate/"
        built_in "$out/$name-$architecture.cdx.json" >"$work/context/image-$architecture/usr/share/panelgate/built-in.tsv"
    done
    awk '/^FROM .* AS build$/ { print; print "ARG TARGETARCH"; print "COPY image-${TARGETARCH} /image"; skip = 1; next }
         /^FROM / { skip = 0 }
         !skip' Dockerfile >"$work/context/Dockerfile"
}

image_by_engine() {
    local platforms=linux/amd64,linux/arm64 revision
    local told=(--build-arg "VERSION=$version" --build-arg "REVISION=$(git rev-parse HEAD)"
        --build-arg "CREATED=$(date -u -d "@$SOURCE_DATE_EPOCH" +%FT%TZ)")
    make_context
    if [ "$1" = buildx ]; then
        docker buildx build --platform $platforms "${told[@]}" --output "type=oci,dest=$out/$name-image.tar,name=panelgate:$version" \
            "$work/context"
    else
        buildah "${store[@]}" build --isolation chroot --network host --platform $platforms "${told[@]}" \
            --manifest "panelgate:$version" "$work/context"
        buildah "${store[@]}" manifest push --all "panelgate:$version" "oci-archive:$out/$name-image.tar:$version"
    fi
}

# Of packages that are only unpacked: nothing of another architecture runs here.
image_by_files() {
    local architecture needed mirror=()
    [ ! -e /etc/apt/sources.list.d/debian.sources ] || mirror=(/etc/apt/sources.list.d/debian.sources)
    [ -z "${PANELGATE_MIRROR-}" ] || mirror=("$PANELGATE_MIRROR")
    for architecture in "${pictured[@]}"; do
        mkdir -p "$work/image/$architecture"
        needed=$(dpkg-deb -f "$out/$(deb "$architecture")" Depends |
            sed 's/([^)]*)//g; s/ //g' | tr , '\n' | grep -v '^adduser$' | paste -sd,)
        mmdebstrap --quiet --variant=extract --architectures="$architecture" --include="$needed" \
            --hook-dir=/usr/share/mmdebstrap/hooks/merged-usr \
            --extract-hook="cp \"\$1\"/var/cache/apt/archives/*.deb '$work/image/$architecture/'" \
            bookworm "$work/root-$architecture" "${mirror[@]}" >"$work/log" 2>&1 || { cat "$work/log" >&2; die "no libraries for $architecture"; }
        cp "$out/$(deb "$architecture")" "$work/image/$architecture/"
    done
    deploy/release/image.py "$out/$name-image.tar" "$version" "$(git rev-parse HEAD)" "${pictured[@]/#/$work/image/}"
}

make_image() {
    local engine lacks
    if [ -z "$by" ]; then
        for engine in buildx buildah; do
            lacks=$(engine_lacks $engine)
            if [ -z "$lacks" ]; then by=$engine; break; fi
            say "image: not by $engine: $lacks"
        done
    elif [ "$by" != files ]; then
        lacks=$(engine_lacks "$by")
        [ -z "$lacks" ] || die "no image by $by: $lacks"
    fi
    by=${by:-files}
    case $by in
        files) say "image for ${pictured[*]}, of the packages' files: the same each time, without a shell and Debian's scripts"
            image_by_files ;;
        *) say "image for ${pictured[*]}, by $by of the Dockerfile: not the same byte by byte"
            image_by_engine "$by" ;;
    esac
}

make_sums() {
    (cd "$out" && find . -type f ! -name 'SHA256SUMS*' -printf '%P\0' | LC_ALL=C sort -z | xargs -0 sha256sum >SHA256SUMS)
    [ -z "$key" ] || gpg --batch --yes --local-user "$key" --armor --detach-sign "$out/SHA256SUMS"
}

check
debian=$(sed -n 's/^ARG DEBIAN=//p' Dockerfile)
work=$(mktemp -d)
store=(--root "$work/store" --runroot "$work/run")
clean_up() {
    umount "$work/store/overlay" 2>/dev/null || true
    rm -rf "$work"
}
trap clean_up EXIT
left=$(awk '/^## / { inside = ($2 ~ /Unreleased/) } inside && /^- /' CHANGELOG.md | wc -l)
[ "$left" = 0 ] || say "CHANGELOG.md has $left lines under Unreleased: they are not in the notes of $version"
say "panelgate $version of $(git rev-parse --short HEAD), $(date -u -d "@$SOURCE_DATE_EPOCH" +%F)"
make_packages
make_apt
make_texts
[ $image = no ] && say "no image, as asked" || make_image
make_sums
say "$out"
(cd "$out" && du -a --apparent-size -B1 --exclude=apt . | awk '$2 != "." { printf "%12d  %s\n", $1, substr($2, 3) }' | sort -k2)
