"""A real Prometheus scrapes the demo: each query of dashboard and rules finds something, and each
alert is made to fire by a fault."""
import contextlib
import json
import pathlib
import re
import shutil
import signal
import tempfile
import unittest
import urllib.request

import config
import harness
from harness import ROOT, read_registers
from prometheus_server import DEPLOYED, Prometheus
from tls_plant import plant, served
from unread import Unread

DASHBOARD = ROOT / "deploy/grafana/dashboards/panelgate.json"
# A simulated line has no UART, and what a driver does not count is absent.
ONLY_OF_UARTS = re.compile("panelgate_(framing_errors|parity_errors|overruns|breaks)_total")
MANY = 60  # requests at once: the gateway takes 80 of a client before it answers
DEMO_FAULTS = {"filler": {"dead": True},       # StationOffline, RelayFails
               "mixer": {"duplicate": 0.5}}    # AddressDoubled
BOX_FAULTS = {"shaken": {"damage": 0.5},       # Errors; a reply that breaks off would cost a timeout
              "sluggish": {"slow_ms": 700}}    # LineOverloaded, LatencyBurnsFast and -Slowly
# Given up after 100 ms and here before the next poll: LateRepliesRise, when all has been well for
# half an hour (half a minute here).
LATE_FAULTS = {"tardy": {"late": 0.3, "late_by_ms": 180}}


def box(adapter):
    """A gateway with a real tty, a line with bad cables, two with panels that take their time, and
    one that fills its log."""
    def polled(station, name, every="200ms"):
        return (f"{{id: {station}, name: {name}, profile: generic, "
                f'points: [{{name: value, at: "400001", every: {every}}}]}}')
    return config.gateway(
        config.line("remote", adapter, polled(7, "pump")),
        config.line("cable", "sim", polled(1, "shaken") + ", " + polled(2, "sound")),
        config.line("late", "sim", polled(4, "tardy", "300ms"), retries=0,
                    timing="{response_timeout: 100ms}"),
        config.line("slow", "sim", polled(3, "sluggish", "10ms"), timing="{response_timeout: 2s}",
                    queue="{deadline: 10s}"),
        config.line("quick", "sim", polled(5, "loud"), baud=1000000),
        http=config.ADMIN, log="{level: trace}",
        audit=f"{{file: {adapter.parent}/none/audit.jsonl}}",  # AuditFails: there is no such folder
        mqtt="{broker: 'mqtt://127.0.0.1:1', topic: box}")  # BrokerAway


def alerts():
    return set(re.findall(r"(?m)^ +- alert: (\w+)$", (DEPLOYED / "rules/alerts.yml").read_text()))


def recorded():
    return re.findall(r"(?m)^ +- record: (\S+)$", (DEPLOYED / "rules/recording.yml").read_text())


def panels():
    return [p for p in json.loads(DASHBOARD.read_text())["panels"] if p["type"] != "row"]


def dashboard_queries():
    """As Grafana would send them, with everything chosen."""
    for panel in panels():
        for target in panel["targets"]:
            expression = target["expr"].replace("$__rate_interval", "5s")
            yield re.sub(r'"\$(instance|line|station)"', '".*"', expression)


def set_faults(port, faults):
    for station, fault in faults.items():
        request = urllib.request.Request(
            f"http://127.0.0.1:{port}/api/v1/simulator/{station}", json.dumps(fault).encode(),
            method="PUT")
        with urllib.request.urlopen(request, timeout=harness.PATIENCE) as answer:
            assert answer.status == 200


class Plant:
    """The demo, a box beside it, and clients that ask both."""

    def __init__(self, stack):
        self.folder = stack.enter_context(tempfile.TemporaryDirectory())
        adapter = pathlib.Path(self.folder) / "ttyUSB0"
        file = pathlib.Path(self.folder) / "panels.yaml"
        file.write_text(box(adapter))
        self.demo = stack.enter_context(harness.demo())
        self.far_end = stack.enter_context(
            harness.Program("simulate", "-c", str(file), "--line", f"remote={adapter}"))
        self.far_end.out.wait_for("Ctrl-C")
        self.box = stack.enter_context(Unread(box(adapter)))
        self.secure = stack.enter_context(plant())  # CertificateExpires
        self.secure.cert("new-server", "localhost", "127.0.0.1", "--days", "9", "--force")
        self.dated = stack.enter_context(served(self.secure, self.secure.tls()))
        self.client = stack.enter_context(self.demo.client())
        self.box_client = stack.enter_context(harness.Client(self.box.ports[0]))

    def targets(self):
        return [f"127.0.0.1:{self.demo.http_port()}", f"127.0.0.1:{self.box.ports[1]}",
                f"127.0.0.1:{self.dated.http_port()}"]

    def traffic(self):
        """Two panels of the demo, REST, and what fills the box's log."""
        for station in (31, 5):
            self.client.ask(station, read_registers(0))
        self.demo.get("/api/v1/stations/press/points")
        for _ in range(MANY):
            self.box_client.send(5, read_registers(0))
        for _ in range(MANY):
            self.box_client.receive()

    def hold_box(self, prometheus):
        """It gets no processor for a quarter of a second by Prometheus' clock, so that many a timer rings late."""
        def clock():
            return prometheus.query("time()")[0][1]
        self.box.process.send_signal(signal.SIGSTOP)
        begun = clock()
        while clock() < begun + 0.25:
            pass
        self.box.process.send_signal(signal.SIGCONT)


@unittest.skipUnless(shutil.which("prometheus"), "no Prometheus here")
@unittest.skipIf(harness.SANITIZED, "its latencies are not those of the program")
class Scraped(unittest.TestCase):
    def test_every_query_finds_something_and_every_alert_fires(self):
        with contextlib.ExitStack() as stack:
            plant = Plant(stack)
            prometheus = stack.enter_context(Prometheus(plant.targets()))
            self.a_healthy_demo_has_no_alert(prometheus, plant)
            self.faults_fire_what_they_should(prometheus, plant)
            self.queries_find_something(prometheus)
            plant.box.process.kill()
            prometheus.until(lambda: prometheus.query(
                'ALERTS{alertname="PanelgateDown", alertstate="firing"}'))

    def a_healthy_demo_has_no_alert(self, prometheus, plant):
        prometheus.until(lambda: prometheus.query("panelgate_relay_writes_total > 0"), plant.traffic)
        demo = plant.targets()[0]
        self.assertEqual(prometheus.query(f'ALERTS{{instance="{demo}", alertstate="firing"}}'), [])

    def faults_fire_what_they_should(self, prometheus, plant):
        set_faults(plant.demo.http_port(), DEMO_FAULTS)
        set_faults(plant.box.ports[1], BOX_FAULTS)
        plant.far_end.stop()
        with open(plant.box.file, "a") as file:  # ReloadFailed
            file.write("nonsense: 1\n")
        plant.box.process.send_signal(signal.SIGHUP)
        pathlib.Path(plant.secure.path("localhost.crt")).write_text("none")  # CertificateKept
        expected = alerts() - {"PanelgateDown"}
        texts = {}

        def meanwhile():
            plant.traffic()
            plant.hold_box(prometheus)

        def all_fired():
            for alert in prometheus.api("alerts")["alerts"]:
                if alert["state"] == "firing":
                    texts[alert["labels"]["alertname"]] = alert["annotations"]
            return texts.keys() >= expected

        def silent():
            return f"silent: {expected - texts.keys()}"
        expected -= {"PanelgateLateRepliesRise"}
        prometheus.until(all_fired, meanwhile, silent)
        prometheus.until(lambda: prometheus.query("panelgate_late_frames_total offset 25s"), meanwhile)
        set_faults(plant.box.ports[1], LATE_FAULTS)
        expected |= {"PanelgateLateRepliesRise"}
        prometheus.until(all_fired, meanwhile, silent)
        for name, annotations in texts.items():
            self.assertEqual(set(annotations), {"summary", "description", "runbook"}, name)
            self.assertNotRegex(" ".join(annotations.values()), "<no value>|error", name)

    def queries_find_something(self, prometheus):
        queries = list(dashboard_queries())
        self.assertGreater(len(queries), 40)
        for query in queries + recorded():
            with self.subTest(query=query):
                self.assertEqual(prometheus.query(query) == [], bool(ONLY_OF_UARTS.search(query)))


class Dashboard(unittest.TestCase):
    def test_its_panels_are_one_beside_the_other(self):
        ids = [panel["id"] for panel in panels()]
        self.assertEqual(len(ids), len(set(ids)))
        taken = set()
        for panel in panels():
            self.assertTrue(panel["title"])
            place = panel["gridPos"]
            cells = {(x, y) for x in range(place["x"], place["x"] + place["w"])
                     for y in range(place["y"], place["y"] + place["h"])}
            self.assertFalse(cells & taken, panel["title"])
            self.assertLessEqual(place["x"] + place["w"], 24)
            taken |= cells

    def test_it_asks_for_what_there_is(self):
        listed = "".join(file.read_text() for file in (ROOT / "src/metrics").glob("*.cpp"))
        names = set(re.findall(r'"((?:panelgate|process)_\w+)"', listed))
        for query in dashboard_queries():
            for name in re.findall(r"(?<![:\w])(?:panelgate|process)_\w+", query):
                self.assertIn(re.sub("_(bucket|sum|count)$", "", name), names, query)


if __name__ == "__main__":
    unittest.main()
