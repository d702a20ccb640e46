#!/usr/bin/env python3
"""image.py OUT.tar VERSION REVISION FOLDER...: an OCI archive for several architectures, without an engine.

A FOLDER is named by its architecture (of Debian) and has .deb files: panelgate's and those of the libraries
that it wants. Their files are the image: two layers, Debian's libraries and the program. No script of a package
runs, so there is no shell, no package manager and nothing that a machine of another architecture would have to
execute; what is unpacked is told to scanners in /var/lib/dpkg/status.d. Rights, ports and health check are those
of the Dockerfile. The same packages and SOURCE_DATE_EPOCH make the same archive, byte by byte.

Beside index.json (OCI: podman, buildah, skopeo, containerd) it has a manifest.json for `docker load`, with a
tag for each architecture.
"""
import gzip
import hashlib
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
EPOCH = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
USER = 10001
# What the root file system of Debian has as links, since /usr is merged.
MERGED = ("bin", "lib", "lib32", "lib64", "libx32", "sbin")
# Of libraries: nothing that explains them, but for their licences, and no tables of foreign alphabets.
LEFT_OUT = re.compile(r"usr/share/(doc/.*(?<!/copyright)|man/.*|locale/.*|lintian/.*|bug/.*|gdb/.*|doc-base/.*)$"
                      r"|usr/lib/[^/]+/gconv/|usr/lib/[^/]+/(audit|engines-3|ossl-modules)/")
# Of panelgate: the program, its licences and its bill of materials.
TAKEN = re.compile(r"usr/(bin/panelgate|share/doc/panelgate/copyright|share/panelgate/sbom\.cdx\.json)$")
# Without systemd and users to make the program wants none of these; the rest is scripts of packages.
UNWANTED = {"adduser", "init-system-helpers", "debconf", "perl-base", "passwd", "dpkg", "tar"}
WRITTEN = ("var/lib/panelgate", "var/log/panelgate")  # by the program; a new volume takes over their owner
FILES = {
    "etc/passwd": f"root:x:0:0:root:/:/sbin/nologin\npanelgate:x:{USER}:{USER}::/:/sbin/nologin\n",
    "etc/group": f"root:x:0:\ndialout:x:20:\npanelgate:x:{USER}:\n",
    "etc/nsswitch.conf": "passwd: files\ngroup: files\nhosts: files dns\n",
}
OCI = "application/vnd.oci.image."


def field(deb, name):
    return subprocess.run(["dpkg-deb", "-f", deb, name], check=True, capture_output=True, text=True).stdout.strip()


def merged(name):
    first, _, rest = name.partition("/")
    return f"usr/{name}" if first in MERGED and rest else name


class Layer:
    """Files by their path; written in its order, each of one time and of root."""

    def __init__(self):
        self.entries = {}

    def add(self, name, content=b"", **more):
        info = tarfile.TarInfo(name)
        info.mtime, info.mode, info.size = EPOCH, 0o644, len(content)
        for key, value in more.items():
            setattr(info, key, value)
        self.entries[name] = (info, content)

    def folder(self, name, mode=0o755):
        if name and name not in self.entries:
            self.folder(name.rpartition("/")[0])
            self.add(name, type=tarfile.DIRTYPE, mode=mode)

    def unpack(self, deb, wanted):
        packed = subprocess.run(["dpkg-deb", "--fsys-tarfile", deb], check=True, capture_output=True).stdout
        with tarfile.open(fileobj=io.BytesIO(packed)) as archive:
            for member in archive:
                name = merged(member.name.removeprefix("./").rstrip("/"))
                if member.isdir() or not wanted(name):
                    continue  # folders come with what is in them
                self.folder(name.rpartition("/")[0])
                more = {"mode": member.mode, "type": member.type, "linkname": member.linkname}
                if member.islnk():
                    more["linkname"] = merged(member.linkname.removeprefix("./"))
                self.add(name, archive.extractfile(member).read() if member.isreg() else b"", **more)

    def packed(self):
        made = io.BytesIO()
        with tarfile.open(fileobj=made, mode="w", format=tarfile.GNU_FORMAT) as archive:
            for name in sorted(self.entries):
                info, content = self.entries[name]
                archive.addfile(info, io.BytesIO(content))
        return made.getvalue()


def layers(folder):
    """Debian's libraries, and the program."""
    below, above = Layer(), Layer()
    for name in MERGED[:2] + ("lib64", "sbin"):
        below.add(name, type=tarfile.SYMTYPE, mode=0o777, linkname=f"usr/{name}")
    below.folder("tmp", 0o1777)
    for name, text in FILES.items():
        below.folder(name.rpartition("/")[0])
        below.add(name, text.encode())
    below.folder("var/lib/dpkg/status.d")
    for name in WRITTEN:
        below.folder(name.rpartition("/")[0])
        below.add(name, type=tarfile.DIRTYPE, mode=0o755, uid=USER, gid=USER)
    for deb in sorted(folder.glob("*.deb")):
        name = field(deb, "Package")
        if name == "panelgate":
            above.unpack(deb, TAKEN.match)
        elif name not in UNWANTED:
            below.unpack(deb, lambda path: not LEFT_OUT.match(path))
            control = subprocess.run(["dpkg-deb", "-f", deb], check=True, capture_output=True).stdout
            below.add(f"var/lib/dpkg/status.d/{name}", control)
    if "usr/bin/panelgate" not in above.entries:
        sys.exit(f"image.py: there is no panelgate package in {folder}")
    complete(below.entries | above.entries, folder.name)
    return below, above


def complete(entries, architecture):
    """Every library that a program or a library of the image names is in it."""
    there = {name.rpartition("/")[2] for name in entries}
    for name, (info, content) in entries.items():
        if info.isreg() and content.startswith(b"\x7fELF"):
            with tempfile.NamedTemporaryFile() as file:
                file.write(content)
                file.flush()
                told = subprocess.run(["readelf", "-d", file.name], check=True, capture_output=True, text=True).stdout
            for needed in re.findall(r"\(NEEDED\).*\[(.*)\]", told):
                if needed not in there:
                    sys.exit(f"image.py: {architecture}: {name} wants {needed}, which no package has")


def settings(architecture, version, revision):
    """What the Dockerfile says of a container, as the image's configuration."""
    text = re.sub(r"\\\n\s*", "", (ROOT / "Dockerfile").read_text()).split("\nFROM ")[-1]

    def said(word):
        return re.search(rf"(?m)^{word} (.*)$", text)[1]
    check = dict(re.findall(r"--([a-z-]+)=(\d+)", said("HEALTHCHECK")))
    labels = dict(re.findall(r'(org\.[\w.]+)="([^"]*)"', said("LABEL")))
    created = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(EPOCH))
    labels.update({"org.opencontainers.image.version": version, "org.opencontainers.image.revision": revision,
                   "org.opencontainers.image.created": created, "org.opencontainers.image.base.name": "scratch"})
    return {"created": created, "architecture": architecture, "os": "linux", "config": {
        "User": said("USER"), "ExposedPorts": {f"{port}/tcp": {} for port in said("EXPOSE").split()},
        "Env": ["PATH=/usr/bin"], "Entrypoint": json.loads(said("ENTRYPOINT")), "Cmd": json.loads(said("CMD")),
        "StopSignal": said("STOPSIGNAL"), "Labels": labels,
        "Healthcheck": {"Test": ["CMD", *json.loads(said("HEALTHCHECK").partition(" CMD ")[2])],
                        "Interval": int(check["interval"]) * 10**9, "Timeout": int(check["timeout"]) * 10**9,
                        "StartPeriod": int(check["start-period"]) * 10**9, "Retries": int(check["retries"])}}}


class Archive:
    def __init__(self):
        self.blobs = {}

    def blob(self, kind, content, **more):
        digest = hashlib.sha256(content).hexdigest()
        self.blobs[f"blobs/sha256/{digest}"] = content
        return {"mediaType": OCI + kind, "digest": f"sha256:{digest}", "size": len(content), **more}

    def document(self, kind, value, **more):
        return self.blob(kind, json.dumps(value, separators=(",", ":")).encode(), **more)

    def image(self, folder, version, revision):
        """Adds one; returns its manifest and what `docker load` wants of it."""
        architecture = folder.name
        config = settings(architecture, version, revision)
        packed = [layer.packed() for layer in layers(folder)]
        config["rootfs"] = {"type": "layers", "diff_ids": ["sha256:" + hashlib.sha256(one).hexdigest()
                                                            for one in packed]}
        config["history"] = [{"created": config["created"], "created_by": f"deploy/release/image.py: {what}"}
                             for what in ("Debian's libraries", "panelgate")]
        held = self.document("config.v1+json", config)
        parts = [self.blob("layer.v1.tar+gzip", gzip.compress(one, 9, mtime=0)) for one in packed]
        manifest = {"schemaVersion": 2, "mediaType": OCI + "manifest.v1+json", "config": held, "layers": parts}
        path = {one["digest"]: "blobs/" + one["digest"].replace(":", "/") for one in [held, *parts]}
        return (self.document("manifest.v1+json", manifest, platform={"architecture": architecture, "os": "linux"}),
                {"Config": path[held["digest"]], "RepoTags": [f"panelgate:{version}-{architecture}"],
                 "Layers": [path[one["digest"]] for one in parts]})

    def write(self, file, version, images):
        index = self.document("index.v1+json", {
            "schemaVersion": 2, "mediaType": OCI + "index.v1+json", "manifests": [image for image, _ in images]},
            annotations={"org.opencontainers.image.ref.name": version,
                         "io.containerd.image.name": f"docker.io/library/panelgate:{version}"})
        texts = {"oci-layout": {"imageLayoutVersion": "1.0.0"},
                 "index.json": {"schemaVersion": 2, "manifests": [index]},
                 "manifest.json": [docker for _, docker in images]}
        made = Layer()
        made.folder("blobs/sha256")
        for name, content in self.blobs.items():
            made.add(name, content)
        for name, value in texts.items():
            made.add(name, json.dumps(value, separators=(",", ":")).encode())
        pathlib.Path(file).write_bytes(made.packed())


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    out, version, revision, *folders = sys.argv[1:]
    archive = Archive()
    archive.write(out, version, [archive.image(pathlib.Path(folder), version, revision) for folder in folders])


if __name__ == "__main__":
    main()
