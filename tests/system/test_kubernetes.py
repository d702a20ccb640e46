"""The manifests of deploy/kubernetes: they are YAML, kustomize makes of them what is meant, their
names, ports and labels fit each other, and the pod keeps to the restricted standard."""
import functools
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import yaml

import harness
from harness import ROOT

FOLDER = ROOT / "deploy/kubernetes"
BASE = FOLDER / "base"
# Pod Security Standards, restricted: the volumes that a pod may have
HARMLESS_VOLUMES = {"configMap", "secret", "emptyDir", "projected", "downwardAPI", "csi",
                    "persistentVolumeClaim", "ephemeral"}


def documents(text):
    return [document for document in yaml.safe_load_all(text) if document]


def load(name):
    return documents((BASE / name).read_text())


def by_kind(found):
    return {f"{document['kind']}/{document['metadata']['name']}": document for document in found}


@functools.cache
def base():
    """All that is applied but the generated ConfigMap, by kind and name."""
    kustomization = load("kustomization.yaml")[0]
    return by_kind(document for name in kustomization["resources"] for document in load(name))


def pod_of(found):
    return found["DaemonSet/panelgate"]["spec"]["template"]["spec"]


def kustomized(name):
    built = subprocess.run(["kubectl", "kustomize", str(FOLDER / name)], capture_output=True,
                           text=True, timeout=harness.PATIENCE, check=False)
    assert built.returncode == 0, built.stderr
    return documents(built.stdout)


def breaches(pod):
    """What the restricted standard forbids."""
    security = pod.get("securityContext", {})
    found = [key for key in ("hostNetwork", "hostPID", "hostIPC") if pod.get(key)]
    found += [f"volume {v['name']}" for v in pod["volumes"]
              if not HARMLESS_VOLUMES & (set(v) - {"name"})]
    if security.get("seccompProfile", {}).get("type") != "RuntimeDefault":
        found.append("seccompProfile")
    for container in pod["containers"]:
        own = {**security, **container["securityContext"]}
        if not own.get("runAsNonRoot") or own.get("runAsUser", 0) == 0:
            found.append("root")
        if own.get("privileged") or own.get("allowPrivilegeEscalation", True):
            found.append("privileges")
        if own.get("capabilities") != {"drop": ["ALL"]}:
            found.append("capabilities")
        found += ["hostPort" for port in container["ports"] if "hostPort" in port]
    return found


def listens(configuration):
    """The ports of modbus_tcp and http."""
    found = yaml.safe_load(configuration)
    return [int(one["listen"].rsplit(":", 1)[1]) for one in (*found["modbus_tcp"], found["http"])]


class Manifests(unittest.TestCase):
    def test_every_file_is_yaml_and_applied(self):
        for kustomization in FOLDER.glob("*/kustomization.yaml"):
            here = kustomization.parent
            [found] = documents(kustomization.read_text())
            named = set(found["resources"])
            for generator in found.get("configMapGenerator", []):
                named |= set(generator["files"])
            for name in named:
                self.assertTrue((here / name).exists(), f"{here.name}: {name}")
            files = {file.name for file in here.iterdir()} - {"kustomization.yaml"}
            self.assertLessEqual(files, named, here.name)

    def test_labels_ports_and_names_fit(self):
        found = base()
        daemon = found["DaemonSet/panelgate"]["spec"]
        labels = daemon["template"]["metadata"]["labels"]
        ports = {p["name"]: p["containerPort"] for p in pod_of(found)["containers"][0]["ports"]}
        self.assertEqual(daemon["selector"]["matchLabels"], labels)
        for name in ("Service/panelgate", "Service/panelgate-modbus"):
            self.assertEqual(found[name]["spec"]["selector"], labels)
            for port in found[name]["spec"]["ports"]:
                self.assertIn(port["targetPort"], ports)
        policy = found["NetworkPolicy/panelgate"]["spec"]
        self.assertEqual(policy["podSelector"]["matchLabels"], labels)
        self.assertEqual({p["port"] for rule in policy["ingress"] for p in rule["ports"]}, set(ports))
        monitor = found["ServiceMonitor/panelgate"]["spec"]
        scraped = found["Service/panelgate"]
        self.assertEqual(monitor["selector"]["matchLabels"], scraped["metadata"]["labels"])
        self.assertNotEqual(found["Service/panelgate-modbus"]["metadata"]["labels"],
                            scraped["metadata"]["labels"])
        self.assertIn(monitor["endpoints"][0]["port"], [p["name"] for p in scraped["spec"]["ports"]])
        rules = (ROOT / "deploy/prometheus/rules/alerts.yml").read_text()
        self.assertEqual(set(re.findall(r'job="(\w+)"', rules)), {scraped["metadata"]["name"]})

    def test_names_and_a_broker_are_reached_out_of_the_pod(self):
        ways = {(port["port"], port.get("protocol", "TCP"))
                for rule in base()["NetworkPolicy/panelgate"]["spec"]["egress"] for port in rule["ports"]}
        self.assertEqual(ways, {(53, "UDP"), (53, "TCP"), (1883, "TCP"), (8883, "TCP")})

    def test_the_two_folders_that_are_written_are_there_on_a_read_only_root(self):
        pod = pod_of(base())
        [container] = pod["containers"]
        self.assertTrue(container["securityContext"]["readOnlyRootFilesystem"])
        written = {m["mountPath"]: m["name"] for m in container["volumeMounts"] if not m.get("readOnly")}
        self.assertEqual(set(written), {"/var/lib/panelgate", "/var/log/panelgate"})
        self.assertLessEqual(set(written.values()), {volume["name"] for volume in pod["volumes"]})
        self.assertEqual(pod["securityContext"]["fsGroup"], pod["securityContext"]["runAsGroup"])

    def test_the_pod_keeps_to_the_restricted_standard(self):
        self.assertEqual(breaches(pod_of(base())), [])
        labels = base()["Namespace/panelgate"]["metadata"]["labels"]
        self.assertEqual({labels[f"pod-security.kubernetes.io/{mode}"]
                          for mode in ("enforce", "audit", "warn")}, {"restricted"})
        careless = {"volumes": [{"name": "dev", "hostPath": {"path": "/dev"}}], "hostNetwork": True,
                    "containers": [{"securityContext": {"privileged": True},
                                    "ports": [{"hostPort": 502}]}]}
        self.assertEqual(len(breaches(careless)), 7)

    def test_the_configurations_are_valid_and_listen_where_the_pod_says(self):
        container = pod_of(base())["containers"][0]
        ports = [port["containerPort"] for port in container["ports"]]
        for file in (BASE / "panelgate.yaml", *(FOLDER / "per-node").glob("box*.yaml")):
            checked = harness.run("check", "-c", str(file))
            # That of the open viewer alone: what networkpolicy.yaml keeps out, no file shows.
            self.assertEqual(checked.returncode, 0, file)
            self.assertRegex(checked.stderr, r"^\S+: warning: any client that reaches port 8080 of any "
                             r"address may see the configuration, .*\n$", file)
            self.assertEqual(listens(file.read_text()), ports, file)
        [generator] = load("kustomization.yaml")[0]["configMapGenerator"]
        [mount] = [m for m in container["volumeMounts"] if m["name"] == "configuration"]
        self.assertIn("--watch", container["args"])
        self.assertEqual(container["args"][-1], f"{mount['mountPath']}/{generator['files'][0]}")

    def test_the_probes_are_answered(self):
        container = pod_of(base())["containers"][0]
        with harness.demo() as program:
            for probe in ("readinessProbe", "livenessProbe"):
                self.assertEqual(program.get(container[probe]["httpGet"]["path"])[0], 200)

    def test_the_rules_become_those_of_the_operator(self):
        script = str(FOLDER / "rules.sh")
        self.assertTrue(os.access(script, os.X_OK))
        made = documents(subprocess.run([script], capture_output=True, text=True, check=True,
                                        timeout=harness.PATIENCE).stdout)
        self.assertEqual({document["kind"] for document in made}, {"PrometheusRule"})
        for document in made:
            name = document["metadata"]["name"].removeprefix("panelgate-")
            [own] = documents((ROOT / f"deploy/prometheus/rules/{name}.yml").read_text())
            self.assertEqual(document["spec"], own)


@unittest.skipUnless(shutil.which("kubectl"), "no kubectl here: kustomize is not run")
class Kustomized(unittest.TestCase):
    def test_the_base_is_built(self):
        found = kustomized("base")
        built = by_kind(found)
        for name, document in built.items():
            if not name.startswith("Namespace/"):
                self.assertEqual(document["metadata"]["namespace"], "panelgate", name)
        [volume] = [v for v in pod_of(built)["volumes"] if v["name"] == "configuration"]
        generated = built[f"ConfigMap/{volume['configMap']['name']}"]
        self.assertEqual(generated["data"]["panelgate.yaml"], (BASE / "panelgate.yaml").read_text())
        self.assertRegex(pod_of(built)["containers"][0]["image"], r"^panelgate:\d+\.\d+\.\d+$")
        self.assertEqual(breaches(pod_of(built)), [])

    def test_another_configuration_keeps_its_name_so_that_the_pods_reload_it(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = pathlib.Path(folder) / "base"
            shutil.copytree(BASE, copy)
            with (copy / "panelgate.yaml").open("a") as file:
                file.write("log: {level: debug}\n")
            before, behind = by_kind(kustomized("base")), by_kind(kustomized(copy))
        self.assertEqual([name for name in behind if behind[name] != before.get(name)],
                         ["ConfigMap/panelgate"])
        self.assertIn("--watch", pod_of(behind)["containers"][0]["args"])

    def test_hostpath_brings_the_devices_and_says_what_that_costs(self):
        built = by_kind(kustomized("hostpath"))
        pod = pod_of(built)
        container = pod["containers"][0]
        self.assertEqual(breaches(pod), ["volume devices", "privileges", "capabilities"])
        self.assertEqual(built["Namespace/panelgate"]["metadata"]["labels"]
                         ["pod-security.kubernetes.io/enforce"], "privileged")
        self.assertNotIn("squat.ai/serial", str(container["resources"]))
        [mount] = [m for m in container["volumeMounts"] if m["name"] == "devices"]
        self.assertIn(f"device: {mount['mountPath']}/serial/by-id/",
                      (FOLDER / "hostpath/kustomization.yaml").read_text())

    def test_boxes_that_differ_have_a_file_each(self):
        built = by_kind(kustomized("per-node"))
        container = pod_of(built)["containers"][0]
        [variable] = container["env"]
        self.assertEqual(container["args"][-1], f"/etc/panelgate/$({variable['name']}).yaml")
        [generated] = [d for d in built.values() if d["kind"] == "ConfigMap"]
        self.assertEqual(set(generated["data"]), {"box17.yaml", "box18.yaml"})


if __name__ == "__main__":
    unittest.main()
