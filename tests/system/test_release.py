"""deploy/release.sh: what it refuses, what it makes of packages that are there, and that apt takes it. The packages
are small ones of this test; those of the program are made at night (tests/run.sh --nightly)."""
import contextlib
import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import subprocess
import tarfile
import tempfile
import unittest

import yaml

import harness
from harness import ROOT

VERSION = re.search(r"project\(panelgate VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
READ = ("CMakeLists.txt", "CHANGELOG.md", "Dockerfile", "LICENSE", "README.md", "SECURITY.md", "deploy", "docs")
TOOLS = ("git", "dpkg-deb", "apt-ftparchive", "apt-get", "readelf")
DAY = "1795000000"


def deb(folder, name, architecture, files, links=()):
    """A package of these files (path: text)."""
    with tempfile.TemporaryDirectory() as made:
        root = pathlib.Path(made) / "root"
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        for path, target in links:
            (root / path).symlink_to(target)
        (root / "DEBIAN").mkdir(parents=True)
        version = f"{VERSION}-1" if name == "panelgate" else "1"
        (root / "DEBIAN/control").write_text(
            f"Package: {name}\nVersion: {version}\nArchitecture: {architecture}\nMaintainer: a <a@plant.example>\n"
            "Description: of a test\n")
        subprocess.run(["dpkg-deb", "--root-owner-group", "-Znone", "-b", root,
                        folder / f"{name}_{version}_{architecture}.deb"], check=True, capture_output=True,
                       env={**os.environ, "SOURCE_DATE_EPOCH": DAY})


def panelgate(folder, architecture):
    deb(folder, "panelgate", architecture, {
        "usr/bin/panelgate": f"{architecture}\n", "usr/share/doc/panelgate/copyright": "MIT\n",
        "usr/share/man/man1/panelgate.1": "", "usr/share/panelgate/sbom.cdx.json":
        json.dumps({"bomFormat": "CycloneDX", "components": [{"name": "libc6"}]})})


class Plan:
    """A repository with what a release reads, and packages for it."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.tree = self.folder / "tree"
        self.packages = self.folder / "packages"
        self.packages.mkdir()
        for architecture in ("amd64", "arm64", "armhf"):
            panelgate(self.packages, architecture)
        self.tree.mkdir()
        for name in READ:
            copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
            copy(ROOT / name, self.tree / name)
        self.git("init", "--quiet")
        self.git("add", "-A")
        self.commit()

    def git(self, *words):
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@plant.example", "-C", self.tree, *words],
                       check=True, capture_output=True,
                       env={**os.environ, "GIT_AUTHOR_DATE": f"{DAY} +0000", "GIT_COMMITTER_DATE": f"{DAY} +0000"})

    def commit(self, tag=f"v{VERSION}"):
        self.git("commit", "--quiet", "--allow-empty", "-am", "what is released")
        self.git("tag", "--force", tag)

    def release(self, *words):
        return subprocess.run([self.tree / "deploy/release.sh", "--packages", self.packages, "--without-image", *words],
                              capture_output=True, text=True, timeout=harness.PATIENCE, check=False)


@unittest.skipUnless(all(map(shutil.which, TOOLS)), f"wants {TOOLS}")
class Release(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.plan = Plan(cls.enterClassContext(tempfile.TemporaryDirectory()))
        cls.out = cls.plan.folder / "out"
        cls.done = cls.plan.release("--out", cls.out)
        assert cls.done.returncode == 0, cls.done.stdout + cls.done.stderr

    def test_it_makes_all_and_lists_it(self):
        name = f"panelgate-{VERSION}"
        architectures = ("amd64", "arm64", "armhf")
        for file in (f"{name}.tar.gz", f"{name}-docs.tar.gz", f"{name}-notes.md", "apt/dists/bookworm/Release",
                     *(f"panelgate_{VERSION}-1_{one}.deb" for one in architectures),
                     *(f"{name}-{one}.cdx.json" for one in architectures)):
            self.assertTrue((self.out / file).exists(), file)
        self.assertIn("no image, as asked", self.done.stdout)
        listed = subprocess.run(["sha256sum", "--check", "--strict", "SHA256SUMS"], cwd=self.out,
                                capture_output=True, text=True, check=False)
        self.assertEqual(listed.returncode, 0, listed.stdout)
        there = {str(file.relative_to(self.out)) for file in self.out.rglob("*") if file.is_file()}
        self.assertEqual({line.rpartition(": ")[0] for line in listed.stdout.splitlines()}, there - {"SHA256SUMS"})

    def test_its_notes_are_the_versions_own(self):
        notes = (self.out / f"panelgate-{VERSION}-notes.md").read_text()
        self.assertIn("### ", notes)
        self.assertNotRegex(notes, r"(?m)^## ")
        with tarfile.open(self.out / f"panelgate-{VERSION}-docs.tar.gz") as archive:
            self.assertIn(f"panelgate-{VERSION}-docs/docs/index.md", archive.getnames())

    def test_the_same_commit_makes_the_same(self):
        other = self.plan.folder / "again"
        self.assertEqual(self.plan.release("--out", other).returncode, 0)
        self.assertEqual((other / "SHA256SUMS").read_text(), (self.out / "SHA256SUMS").read_text())

    def test_apt_takes_a_package_out_of_the_folder(self):
        with tempfile.TemporaryDirectory() as folder:
            for part in ("state/lists/partial", "cache/archives/partial", "etc"):
                (pathlib.Path(folder) / part).mkdir(parents=True)
            source = pathlib.Path(folder) / "panelgate.list"
            source.write_text(f"deb [trusted=yes] file:{self.out}/apt bookworm main\n")
            status = pathlib.Path(folder) / "status"
            status.touch()

            def apt(*words):
                return subprocess.run(
                    ["apt-get", "-q", "-o", f"Dir::State={folder}/state", "-o", f"Dir::Cache={folder}/cache",
                     "-o", f"Dir::Etc={folder}/etc", "-o", f"Dir::Etc::SourceList={source}",
                     "-o", f"Dir::State::status={status}", "-o", "APT::Architecture=arm64",
                     "-o", "APT::Architectures::=arm64", "-o", "APT::Sandbox::User=", *words],
                    cwd=folder, capture_output=True, text=True, timeout=harness.PATIENCE, check=False)
            updated = apt("update")
            self.assertEqual((updated.returncode, updated.stderr), (0, ""), updated.stdout)
            got = apt("download", "panelgate")
            self.assertEqual(got.returncode, 0, got.stderr)
            [file] = pathlib.Path(folder).glob("panelgate_*.deb")
            self.assertEqual(file.read_bytes(), (self.out / f"panelgate_{VERSION}-1_arm64.deb").read_bytes())

    @unittest.skipUnless(shutil.which("gpg"), "no gpg here")
    def test_a_key_signs_the_folder_and_the_list(self):
        with tempfile.TemporaryDirectory(dir="/tmp") as home:  # gpg's sockets want a short path
            keys = {**os.environ, "GNUPGHOME": home}

            def gpg(*words):
                return subprocess.run(["gpg", "--batch", *words], env=keys, capture_output=True, text=True, check=False)
            made = gpg("--passphrase", "", "--quick-generate-key", "release@plant.example", "ed25519", "sign", "never")
            self.assertEqual(made.returncode, 0, made.stderr)
            signed = self.plan.folder / "signed"
            done = subprocess.run(
                [self.plan.tree / "deploy/release.sh", "--packages", self.plan.packages, "--without-image", "--out", signed,
                 "--sign", "release@plant.example"], env=keys, capture_output=True, text=True,
                timeout=harness.PATIENCE, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(gpg("--verify", f"{signed}/SHA256SUMS.asc", f"{signed}/SHA256SUMS").returncode, 0)
            self.assertEqual(gpg("--verify", f"{signed}/apt/dists/bookworm/InRelease").returncode, 0)
            subprocess.run(["gpgconf", "--kill", "all"], env=keys, check=False)

    def test_it_refuses_what_is_no_release(self):
        def refused(why, *words):
            done = self.plan.release("--out", self.plan.folder / "none", *words)
            self.assertEqual((done.returncode, done.stdout), (65, ""), done.stderr)
            self.assertRegex(done.stderr, why)
            self.assertFalse((self.plan.folder / "none").exists())
        refused(f"v9.9.9 is not v{VERSION}", "v9.9.9")
        with self.restored():
            (self.plan.tree / "left.txt").write_text("over")
            refused(r"(?s)the tree differs.*left\.txt")
        with self.restored():
            changelog = self.plan.tree / "CHANGELOG.md"
            changelog.write_text(changelog.read_text().replace(f"## {VERSION}", "## Other"))
            refused("the tree differs")
            self.plan.commit()
            refused(f"no section '## {VERSION}'")
        with self.restored():
            self.plan.git("commit", "--quiet", "--allow-empty", "-m", "behind the tag")
            refused(f"v{VERSION} is not the commit that is checked out")
        with self.restored():
            self.plan.git("tag", "--delete", f"v{VERSION}")
            refused(f"git tag v{VERSION}")

    @contextlib.contextmanager
    def restored(self):
        commit = subprocess.run(["git", "-C", self.plan.tree, "rev-parse", "HEAD"], check=True, capture_output=True,
                                text=True).stdout.strip()
        yield
        self.plan.git("reset", "--quiet", "--hard", commit)
        self.plan.git("clean", "--quiet", "-fd")
        self.plan.git("tag", "--force", f"v{VERSION}")

    def test_a_package_of_another_version_is_found(self):
        other = self.plan.folder / "other"
        shutil.copytree(self.plan.packages, other)
        shutil.copy(other / f"panelgate_{VERSION}-1_arm64.deb", other / f"panelgate_{VERSION}-1_armhf.deb")
        done = subprocess.run([self.plan.tree / "deploy/release.sh", "--packages", other, "--without-image", "--out",
                               self.plan.folder / "wrong"], capture_output=True, text=True,
                              timeout=harness.PATIENCE, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("says of itself that it is something else", done.stderr)


@unittest.skipUnless(all(map(shutil.which, TOOLS)), f"wants {TOOLS}")
class Image(unittest.TestCase):
    """Of packages' files, without an engine. That it runs is seen at night."""

    def make(self, folder, *, program="no program"):
        folder = pathlib.Path(folder)
        for architecture in ("amd64", "arm64"):
            (folder / architecture).mkdir()
            panelgate(folder / architecture, architecture)
            deb(folder / architecture, "libc6", architecture, {
                "lib/libc.so.6": "libc\n", "usr/share/doc/libc6/copyright": "LGPL\n", "usr/share/doc/libc6/NEWS": "",
                "usr/share/man/man7/libc.7": ""}, [("lib/libm.so", "libc.so.6")])
            deb(folder / architecture, "perl-base", architecture, {"usr/bin/perl": program})
        out = folder / "image.tar"
        subprocess.run([ROOT / "deploy/release/image.py", out, VERSION, "c0ffee", folder / "amd64", folder / "arm64"],
                       check=True, capture_output=True, env={**os.environ, "SOURCE_DATE_EPOCH": DAY})
        return out.read_bytes()

    @classmethod
    def blob(cls, archive, part):
        content = archive.extractfile("blobs/" + part["digest"].replace(":", "/")).read()
        assert hashlib.sha256(content).hexdigest() == part["digest"].removeprefix("sha256:")
        assert len(content) == part["size"]
        return content

    def test_each_architecture_has_its_own_program_and_the_dockerfiles_rights(self):
        with tempfile.TemporaryDirectory() as folder:
            archive = tarfile.open(fileobj=io.BytesIO(self.make(folder)))
        index = json.loads(archive.extractfile("index.json").read())["manifests"][0]
        images = json.loads(self.blob(archive, index))["manifests"]
        self.assertEqual([image["platform"]["architecture"] for image in images], ["amd64", "arm64"])
        for image in images:
            manifest = json.loads(self.blob(archive, image))
            config = json.loads(self.blob(archive, manifest["config"]))
            self.assertEqual(config["architecture"], image["platform"]["architecture"])
            self.assertEqual(config["config"]["User"], "10001:10001")
            self.assertEqual(config["config"]["Entrypoint"], ["panelgate"])
            self.assertEqual(config["config"]["Labels"]["org.opencontainers.image.version"], VERSION)
            files = {}
            for part, plain in zip(manifest["layers"], config["rootfs"]["diff_ids"]):
                layer = tarfile.open(fileobj=io.BytesIO(self.blob(archive, part)))
                unpacked = subprocess.run(["gzip", "-dc"], input=self.blob(archive, part), check=True,
                                          capture_output=True).stdout
                self.assertEqual(plain, "sha256:" + hashlib.sha256(unpacked).hexdigest())
                files.update({member.name: member for member in layer})
                if "usr/bin/panelgate" in layer.getnames():
                    self.assertEqual(layer.extractfile("usr/bin/panelgate").read().decode().strip(),
                                     config["architecture"])
            self.assertEqual(files["lib"].linkname, "usr/lib")
            self.assertEqual(files["usr/lib/libm.so"].linkname, "libc.so.6")
            own = {name for name, one in files.items() if (one.uid, one.gid) == (10001, 10001)}
            self.assertEqual(own, {"var/lib/panelgate", "var/log/panelgate"})
            self.assertEqual({(one.uid, one.gid) for name, one in files.items() if name not in own}, {(0, 0)})
            self.assertEqual({one.mtime for one in files.values()}, {int(DAY)})
            for name in ("usr/lib/libc.so.6", "usr/share/doc/libc6/copyright", "var/lib/dpkg/status.d/libc6",
                         "usr/share/panelgate/sbom.cdx.json", "etc/passwd", "tmp"):
                self.assertIn(name, files)
            for name in ("usr/share/doc/libc6/NEWS", "usr/share/man/man7/libc.7", "usr/share/man/man1/panelgate.1",
                         "usr/bin/perl"):
                self.assertNotIn(name, files)
        docker = json.loads(archive.extractfile("manifest.json").read())
        self.assertEqual([one["RepoTags"] for one in docker],
                         [[f"panelgate:{VERSION}-amd64"], [f"panelgate:{VERSION}-arm64"]])
        for one in docker:
            for name in [one["Config"], *one["Layers"]]:
                self.assertIn(name, archive.getnames())

    def test_the_same_packages_make_the_same_archive(self):
        with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as two:
            self.assertEqual(self.make(one), self.make(two))


class Version(unittest.TestCase):
    """It stands in CMakeLists.txt; what else has to name it, names this one."""

    def test_what_is_built_and_deployed_names_it(self):
        self.assertIn(f"panelgate {VERSION}\n", harness.run("--version").stdout)
        [base] = yaml.safe_load_all((ROOT / "deploy/kubernetes/base/kustomization.yaml").read_text())
        self.assertEqual([image["newTag"] for image in base["images"]], [VERSION])
        self.assertIn(f"\nARG VERSION={VERSION}\n", (ROOT / "Dockerfile").read_text())

    def test_pages_of_installing_name_it(self):
        for page in sorted((ROOT / "docs/install").glob("*.md")):
            if page.name == "upgrade.md":  # of another one, too
                continue
            for found in re.findall(r"panelgate[_:-]v?(\d+\.\d+\.\d+)", page.read_text()):
                self.assertEqual(found, VERSION, page.name)

    def test_the_changelog_has_a_place_for_what_comes_next(self):
        kinds = ["### Added", "### Changed", "### Removed", "### Fixed"]
        headings = re.findall(r"(?m)^##+ .*", (ROOT / "CHANGELOG.md").read_text())
        self.assertEqual(headings, ["## Unreleased", *kinds, f"## {VERSION}", *kinds])

    def test_the_changelog_is_short(self):
        _, *versions = (ROOT / "CHANGELOG.md").read_text().split("\n## ")
        told = [re.findall(r"(?m)^- .*", version) for version in versions]
        entries = [entry for version in told for entry in version]
        self.assertEqual([entry for entry in entries if len(entry) > 200], [])
        self.assertEqual(len(set(entries)), len(entries))
        self.assertLessEqual(max(map(len, told)), 60)


if __name__ == "__main__":
    unittest.main()
