"""Dockerfile and compose file: limits, rights, pinned versions, and names that fit each other. That
the image is built and runs is seen by tests/image.sh."""
import json
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import yaml

import config
import harness
from harness import ROOT

DEPLOY = ROOT / "deploy"
COMPOSE = DEPLOY / "compose.yaml"
DOCKERFILE = (ROOT / "Dockerfile").read_text()
SBOM = str(DEPLOY / "sbom.sh")


def services(text=None):
    return yaml.safe_load(text or COMPOSE.read_text())["services"]


def uncommented():
    """The compose file with the block for a real adapter instead of the demo's lines."""
    text = COMPOSE.read_text()
    block = re.search(r"(?s)# --- real adapter\n(.*?)    # ---\n", text)[1]
    own = re.sub(r"(?m)^    # ", "    ", block)
    return re.sub(r'(?m)^    command: demo .*\n    ports:\n(?:      - .*\n)+    # .*\n    volumes:\n(?:      - .*\n)+', own, text)


def mounts(service):
    return dict(volume.split(":")[:2] for volume in service["volumes"])


class Compose(unittest.TestCase):
    def test_each_service_has_limits_and_no_rights(self):
        for name, service in services().items():
            with self.subTest(name=name):
                self.assertEqual(service["cap_drop"], ["ALL"])
                own = ["seccomp:seccomp.json"] if name == "panelgate" else []
                self.assertEqual(service["security_opt"], ["no-new-privileges:true", *own])
                self.assertTrue(service["read_only"])
                self.assertEqual(service["restart"], "unless-stopped")
                self.assertEqual(set(service["logging"]["options"]), {"max-size", "max-file"})
                self.assertTrue(service["mem_limit"] and service["pids_limit"])
                self.assertTrue(service["stop_grace_period"])
                for port in service["ports"]:
                    self.assertTrue(port.startswith("127.0.0.1:"), port)
                if "build" not in service:
                    self.assertRegex(service["image"], r":v?\d+\.\d+\.\d+$")
                    self.assertIn("healthcheck", service)

    def test_names_ports_and_files_fit(self):
        gateway, prometheus, grafana = (services()[name] for name in
                                        ("panelgate", "prometheus", "grafana"))
        ports = {port.rsplit(":", 1)[1] for port in gateway["ports"]}
        self.assertEqual(set(re.findall(r"0\.0\.0\.0:(\d+)", gateway["command"])), ports)
        scraped = yaml.safe_load((DEPLOY / "prometheus/prometheus.yml").read_text())
        [target] = scraped["scrape_configs"][0]["static_configs"][0]["targets"]
        self.assertEqual(target, f"{gateway['hostname']}:8080")
        source = yaml.safe_load(
            (DEPLOY / "grafana/provisioning/datasources/prometheus.yml").read_text())
        self.assertEqual(source["datasources"][0]["url"], "http://prometheus:9090")
        self.assertEqual(source["datasources"][0]["jsonData"]["timeInterval"],
                         scraped["global"]["scrape_interval"])
        for service in (prometheus, grafana):
            for outside in mounts(service):
                if outside.startswith("."):
                    self.assertTrue((DEPLOY / outside).exists(), outside)
        provider = yaml.safe_load(
            (DEPLOY / "grafana/provisioning/dashboards/panelgate.yml").read_text())["providers"][0]
        self.assertEqual(mounts(grafana)["./grafana/dashboards"], provider["options"]["path"])
        home = grafana["environment"]["GF_DASHBOARDS_DEFAULT_HOME_DASHBOARD_PATH"]
        self.assertTrue((DEPLOY / "grafana/dashboards" / pathlib.Path(home).name).exists())

    def test_the_block_for_a_real_adapter_fits_a_configuration(self):
        gateway = services(uncommented())["panelgate"]
        self.assertEqual(gateway["command"], "run")
        inside = mounts(gateway)
        self.assertEqual(inside["/dev"], "/host/dev")
        self.assertRegex(COMPOSE.read_text(), f"device: {inside['/dev']}/serial/by-id/")
        for rule in gateway["device_cgroup_rules"]:
            self.assertRegex(rule, r"^c \d+:\* rw$")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(config.gateway(
                config.line(device=f"{inside['/dev']}/serial/by-id/usb-adapter"),
                modbus="listen: 0.0.0.0:502, access: read_only", http="listen: 0.0.0.0:8080"))
            checked = harness.run("check", "-c", str(file))
            self.assertEqual(checked.returncode, 0, checked.stderr)

    def test_what_the_gateway_writes_has_a_volume_of_its_own_and_an_owner(self):
        for text in (COMPOSE.read_text(), uncommented()):
            there = mounts(services(text)["panelgate"])
            for name, inside in (("state", "/var/lib/panelgate"), ("audit", "/var/log/panelgate")):
                self.assertEqual(there.get(name), inside)
                self.assertIn(name, yaml.safe_load(text)["volumes"])
        made = re.search(r"\nRUN install -d -o (\d+) -g (\d+) (.*)\n", DOCKERFILE.split("\nFROM ")[-1])
        self.assertEqual(made.groups(), ("10001", "10001", "/var/lib/panelgate /var/log/panelgate"))

    @unittest.skipUnless(shutil.which("docker-compose"), "no docker-compose here")
    def test_docker_compose_takes_it(self):
        for text in (COMPOSE.read_text(), uncommented()):
            taken = subprocess.run(["docker-compose", "-f", "-", "config", "-q"], input=text,
                                   capture_output=True, text=True, timeout=harness.PATIENCE,
                                   check=False, cwd=DEPLOY)
            self.assertEqual(taken.returncode, 0, taken.stderr)


class Alertmanager(unittest.TestCase):
    def test_one_cause_is_one_message(self):
        page = (ROOT / "docs/operate/monitoring.md").read_text()
        [block] = re.findall(r"(?ms)^```yaml\n(route:.*?)^```$", page)
        rules = (DEPLOY / "prometheus/rules/alerts.yml").read_text()
        for inhibition in yaml.safe_load(block)["inhibit_rules"]:
            [source] = inhibition["source_matchers"]
            self.assertIn(f"- alert: {source.removeprefix('alertname = ')}\n", rules)


class Image(unittest.TestCase):
    def test_it_is_pinned_labelled_and_runs_without_rights(self):
        self.assertRegex(DOCKERFILE, r"(?m)^ARG DEBIAN=bookworm-\d{8}-slim$")
        self.assertEqual(set(re.findall(r"(?m)^FROM (\S+)", DOCKERFILE)), {"debian:${DEBIAN}"})
        final = DOCKERFILE.split("\nFROM ")[-1]
        for line in ("USER 10001:10001", "STOPSIGNAL SIGTERM", "HEALTHCHECK ",
                     'ENTRYPOINT ["panelgate"]', 'CMD ["run"]'):
            self.assertIn(f"\n{line}", final)
        version = re.search(r"project\(panelgate VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())
        self.assertIn(f"\nARG VERSION={version[1]}\n", final)

    def test_what_it_copies_is_in_the_build_context(self):
        allowed = set(re.findall(r"(?m)^!(\S+)$", (ROOT / ".dockerignore").read_text()))
        for sources in re.findall(r"(?m)^COPY (?!--from)(.*) \S+$", DOCKERFILE):
            for source in sources.split():
                self.assertIn(source, allowed)

    def test_its_health_check_is_true_of_a_program_that_is_ready_only(self):
        command = json.loads(re.search(r"HEALTHCHECK .*?CMD (\[.*?\])\n", DOCKERFILE)[1])
        self.assertEqual(command[0], "panelgate")  # and no shell
        with harness.demo() as program:
            ready = [harness.PANELGATE, *command[1:], "--http", f"127.0.0.1:{program.http_port()}"]
            self.assertEqual(self.exit_code(ready), 0)
        self.assertEqual(self.exit_code(ready), 1)

    def exit_code(self, command):
        return subprocess.run(command, capture_output=True, timeout=harness.PATIENCE,
                              check=False).returncode

    @unittest.skipUnless(shutil.which("dpkg-query"), "not Debian")
    def test_its_bill_of_materials_lists_what_dpkg_has(self):
        rows = subprocess.run([SBOM, "rows", "bash", "libstdc++6"], capture_output=True, text=True,
                              timeout=harness.PATIENCE, check=True).stdout
        made = subprocess.run([SBOM, "cyclonedx"], input=rows, capture_output=True, text=True,
                              timeout=harness.PATIENCE, check=True).stdout
        found = json.loads(made)
        self.assertEqual(found["bomFormat"], "CycloneDX")
        self.assertEqual([part["name"] for part in found["components"]], ["bash", "libstdc++6"])
        for part, row in zip(found["components"], rows.splitlines()):
            self.assertEqual([part["name"], part["version"]], row.split("\t")[:2])
            self.assertRegex(part["purl"], r"^pkg:deb/debian/[a-z0-9.%B-]+@[^+:]+\?arch=\w+&distro=")
        self.assertEqual(self.exit_code([SBOM]), 64)


if __name__ == "__main__":
    unittest.main()
