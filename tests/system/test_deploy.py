"""What stands around the program: service, scrape configuration, scripts, the package list."""
import configparser
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest
import urllib.request

import yaml

import config
import harness
from harness import ROOT

SERVICE = ROOT / "deploy/systemd/panelgate.service"
ALERTS = ROOT / "deploy/prometheus/rules/alerts.yml"
ALERT = re.compile(r"- alert: (\w+)")
SCRIPTS = ("deploy/demo.sh", "deploy/install_packages.sh", "deploy/sbom.sh", "tests/run.sh",
           "tests/image.sh", "deploy/kubernetes/rules.sh", ".ci/run", "deploy/package.sh",
           "deploy/release.sh", "tests/release.sh", "tests/upgrade.sh", "tests/packages.sh", "tests/service.sh",
           "tests/model/run.sh", "deploy/package/demo_test.sh", "deploy/package/database.sh",
           "deploy/package/postinst", "deploy/package/prerm", "deploy/package/postrm")


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=harness.PATIENCE,
                          check=False)


def packages(section):
    text = re.sub(r"#.*", "", (ROOT / "deploy/packages.txt").read_text())
    found = re.search(rf"(?s)\[{section}\](.*?)(?=\[|\Z)", text)
    return found.group(1).split()


class Deploy(unittest.TestCase):
    @unittest.skipUnless(shutil.which("systemd-analyze"), "no systemd-analyze here")
    def test_the_service_is_understood_and_hardened(self):
        with tempfile.TemporaryDirectory() as folder:
            unit = pathlib.Path(folder) / SERVICE.name
            unit.write_text(SERVICE.read_text().replace("/usr/bin/panelgate", harness.PANELGATE))
            verified = run("systemd-analyze", "verify", "--man=no", str(unit))
            # An unknown key is told on stderr only.
            self.assertEqual((verified.returncode, verified.stderr), (0, ""))
            rated = run("systemd-analyze", "security", "--offline=true", "--threshold=20", str(unit))
            self.assertEqual(rated.returncode, 0, rated.stdout)

    def test_the_service_is_told_of_and_watched_over(self):
        text = SERVICE.read_text()
        for line in ("Type=notify", "NotifyAccess=main", "WatchdogSec=30", "Restart=on-failure",
                     "ExecReload=/bin/kill -HUP $MAINPID", "LoadCredential=panelgate-key"):
            self.assertIn(f"\n{line}\n", text)

    def test_P7_the_service_comes_back_as_often_as_it_takes_with_every_kind_of_uart(self):
        unit = configparser.ConfigParser(strict=False, interpolation=None, delimiters="=")
        unit.optionxform = str
        unit.read_string(SERVICE.read_text())
        self.assertEqual(unit["Unit"]["StartLimitIntervalSec"], "0")
        for key in ("Wants", "After"):
            self.assertIn("network-online.target", unit["Unit"][key])
        allowed = set(re.findall(r"(?m)^DeviceAllow=char-(\S+) rw$", SERVICE.read_text()))
        self.assertLessEqual({"ttyS", "ttyUSB", "ttyACM", "ttyAMA", "ttymxc", "ttyO", "ttySC", "ttyTHS",
                              "ttyXRUSB", "pts", "ptmx"}, allowed)

    def test_it_may_write_its_state_and_its_audit_and_a_purge_takes_both_away(self):
        text = SERVICE.read_text()
        purged = (ROOT / "deploy/package/postrm").read_text()
        for key, folder in (("StateDirectory", "/var/lib/panelgate"), ("LogsDirectory", "/var/log/panelgate")):
            self.assertIn(f"\n{key}=panelgate\n", text)
            self.assertRegex(purged, rf"rm -rf .*{folder}\b")
        self.assertIn("\nUser=panelgate\nGroup=panelgate\n", text)  # of the package: a folder that all find

    def test_a_token_of_the_service_is_taken(self):
        text = SERVICE.read_text()
        self.assertIn("\nConfigurationDirectory=panelgate\n", text)
        written = re.search(r"`file: (\S+/panelgate-operator)`", text)[1]
        self.assertIn(f"\nLoadCredential={pathlib.Path(written).name}\n", text)
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "panelgate-operator"
            token.write_text("a-token-of-the-service\n")
            token.chmod(0o400)
            tokens = f'[{{name: ops, role: operator, file: "{written}"}}]'
            http = f"{config.FREE_PORT}, anonymous: none, tokens: {tokens}"
            with harness.configured(config.gateway(config.line(), http=http),
                                    env={**os.environ, "CREDENTIALS_DIRECTORY": folder}) as program:
                asked = urllib.request.Request(
                    program.url("/api/v1/lines"),
                    headers={"Authorization": "Bearer a-token-of-the-service"})
                with urllib.request.urlopen(asked, timeout=harness.PATIENCE) as answer:
                    self.assertEqual(answer.status, 200)
                self.assertEqual(program.get("/api/v1/lines")[0], 401)

    @unittest.skipUnless(shutil.which("promtool"), "no promtool here")
    def test_prometheus_takes_the_scrape_configuration(self):
        checked = run("promtool", "check", "config", str(ROOT / "deploy/prometheus/prometheus.yml"))
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    @unittest.skipUnless(shutil.which("promtool"), "no promtool here")
    def test_each_alert_fires_when_it_should_and_not_when_it_should_not(self):
        tests = sorted(str(file) for file in (ROOT / "tests/prometheus").glob("*_test.yml"))
        tested = run("promtool", "test", "rules", *tests)
        self.assertEqual(tested.returncode, 0, tested.stdout + tested.stderr)
        played = "".join(pathlib.Path(file).read_text() for file in tests)
        for alert in ALERT.findall(ALERTS.read_text()):
            self.assertRegex(played, rf'labels: \'{{alertname="{alert}"', alert)

    def test_each_alert_says_what_to_do(self):
        listed = re.findall(r"(?m)^\| `(Panelgate\w+)`", (ROOT / "docs/operate/monitoring.md").read_text())
        self.assertEqual(set(listed), set(ALERT.findall(ALERTS.read_text())))
        for alert in ALERTS.read_text().split("- alert: ")[1:]:
            for key in ("severity", "summary", "description", "runbook"):
                self.assertRegex(alert, rf"\b{key}: \S", alert)

    def test_the_scripts_parse_and_may_be_executed(self):
        for script in SCRIPTS:
            self.assertTrue(os.access(ROOT / script, os.X_OK), script)
            self.assertEqual(run("bash", "-n", str(ROOT / script)).stderr, "")

    def test_an_unknown_section_is_an_error(self):
        asked = run(str(ROOT / "deploy/install_packages.sh"), "nothing")
        self.assertEqual(asked.returncode, 1)
        self.assertIn("no section 'nothing'", asked.stderr)

    @unittest.skipIf(harness.SANITIZED, "the sanitizers need more")
    @unittest.skipUnless(shutil.which("dpkg-query"), "not Debian")
    def test_every_library_that_the_program_needs_is_in_the_run_list(self):
        listed = set(packages("run")) | {"libc6", "libgcc-s1"}
        for name in re.findall(r"(?m)^\s*(\S+\.so\S*) =>", run("ldd", harness.PANELGATE).stdout):
            owners = run("dpkg-query", "-S", f"*/{name}").stdout
            self.assertTrue(listed & set(re.findall(r"(?m)^([^:,\s]+)", owners)), (name, owners))


class Fleet(unittest.TestCase):
    """The repository and the tasks of docs/operate/fleet.md, played without Ansible."""

    def test_a_box_takes_what_the_repository_has_and_so_does_its_ci(self):
        page = (ROOT / "docs/operate/fleet.md").read_text()
        [named] = re.findall(r"`(profiles_dir: [^`]*)`", page)
        blocks = re.findall(r"(?ms)^```yaml\n(.*?)^```$", page)
        [tasks] = [yaml.safe_load(block.split("# handlers")[0]) for block in blocks if "ansible.builtin" in block]
        copies = [task["ansible.builtin.copy"] for task in tasks]
        self.assertEqual([copy["dest"] for copy in copies],
                         ["/etc/panelgate/profiles/", "/etc/panelgate/scada.hash", "/etc/panelgate/panelgate.yaml"])
        with tempfile.TemporaryDirectory() as folder:
            repository, box, elsewhere = (pathlib.Path(folder, name) for name in ("repository", "box", "copy"))
            own = (ROOT / "config/profiles/generic.yaml").read_text()
            text = f"{named}\n" + next(block for block in blocks if block.startswith("templates:"))
            text = text.replace("profile: generic", "profile: meter-of-ours")
            for file, content in ((repository / "profiles/meter-of-ours.yaml", own),
                                  (repository / "plants/hall3/box17.yaml", text),
                                  (elsewhere / "source", text.replace("/etc/panelgate", str(box)))):
                file.parent.mkdir(parents=True)
                file.write_text(content)
            shutil.copytree(repository / "profiles", box / "profiles")
            validated = copies[-1]["validate"].replace("/usr/bin/panelgate", harness.PANELGATE)
            done = run(*(validated % (elsewhere / "source")).split())
            self.assertEqual(done.returncode, 0, done.stderr)
            [variable] = re.findall(r"export (\w+)=\$PWD/profiles", page)
            done = subprocess.run([harness.PANELGATE, "check", "-c", "plants/hall3/box17.yaml"], cwd=repository,
                                  env={**os.environ, variable: f"{repository}/profiles"}, capture_output=True,
                                  text=True, timeout=harness.PATIENCE, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)


@unittest.skipUnless(os.geteuid() == 0 and shutil.which("unshare"), "wants root, for mounts of its own")
class ServiceUser(unittest.TestCase):
    """Commands of root on a machine where the package has made its user."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.folder.chmod(0o755)
        for name, entry in (("passwd", "panelgate:x:951:951::/nonexistent:/usr/sbin/nologin"),
                            ("group", "panelgate:x:951:")):
            (self.folder / name).write_text(pathlib.Path("/etc", name).read_text() + entry + "\n")

    def as_root(self, *words):
        mounts = ("umask 077; for name in passwd group; do mount --bind $0/$name /etc/$name || exit 99; done; "
                  'exec "$@"')
        return run("unshare", "--mount", "sh", "-c", mounts, str(self.folder), harness.PANELGATE, *words)

    def test_a_hash_is_readable_by_the_service_and_by_nobody_else(self):
        file = self.folder / "scada.hash"
        made = self.as_root("token", "new", "--name", "scada", "-o", str(file))
        self.assertEqual(made.returncode, 0, made.stderr)
        self.assertIn(f"{file}, which the service's group panelgate may read", made.stdout)
        self.assertEqual((file.stat().st_gid, file.stat().st_mode & 0o777), (951, 0o640))
        file.unlink()
        alone = harness.run("token", "new", "--name", "scada", "-o", str(file))
        self.assertRegex(alone.stdout, f"able to read: sudo (chgrp panelgate|chown USER) {file}\n")

    def test_check_asks_for_the_service(self):
        token, file = self.folder / "scada.hash", self.folder / "panelgate.yaml"
        token.write_text("sha256:" + "ab" * 32)
        token.chmod(0o600)
        audit = self.folder / "log"
        audit.mkdir(mode=0o700)
        tokens = f"[{{name: scada, role: operator, file: {token}}}]"
        file.write_text(config.gateway(config.line(), http=f"listen: 127.0.0.1:8080, tokens: {tokens}")
                        + f"audit: {{file: {audit}/audit.jsonl}}\n")
        file.chmod(0o644)
        told = self.as_root("check", "-c", str(file))
        self.assertEqual(told.returncode, 0, told.stderr)
        for doubt in (f"cannot read {token}: chgrp panelgate {token}; chmod 640 {token}",
                      f"cannot write in {audit}: chgrp panelgate {audit}; chmod 770 {audit}"):
            self.assertIn(f"the service's user panelgate {doubt}", told.stderr)
        for path, mode in ((token, 0o640), (audit, 0o770)):
            os.chown(path, 0, 951)
            path.chmod(mode)
        self.assertEqual(self.as_root("check", "-c", str(file)).stderr, "")


if __name__ == "__main__":
    unittest.main()
