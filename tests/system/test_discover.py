"""Looking for unlisted stations on a line that runs."""
import pathlib
import subprocess
import tempfile
import unittest

from pymodbus.transaction import ModbusRtuFramer

import config
import harness
from harness import read_registers
from rtu_bus import RtuBus, echo_address
from test_ascii import BUILT, UNIT, ForeignSlave
from test_events import Events
from test_points import until

BAUD = 38400
PATH = "/api/v1/lines/{}/discover"
SIMULATED = config.line(stations=config.PRESS)
HEARD = config.line("heard", device="/dev/zero", mode="listen", stations="{id: 9, name: heard}")
DOWN = config.line("down", device="/dev/null", stations="{id: 8, name: scale}")


def state(program, line="floor1"):
    return program.get(PATH.format(line))[1]


def discover(program, line="floor1", patience=120, **wanted):
    """Looks until it is done; the report."""
    status, report = program.rest("POST", PATH.format(line), wanted)
    assert status == 202, report
    until(lambda: state(program, line)["state"] != "running", patience)
    return state(program, line)


class Rest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(
            harness.configured(config.gateway(SIMULATED, HEARD, DOWN, http=config.ADMIN)))

    def tearDown(self):
        self.program.rest("DELETE", PATH.format("floor1"))

    def test_one_at_a_time_with_progress_and_an_end(self):
        with Events(self.program, "?types=discovery&line=floor1") as events:
            status, begun = self.program.rest("POST", PATH.format("floor1"), {"stations": "20-25,31"})
            self.assertEqual((status, begun["state"], begun["of"]), (202, "running", 6))
            status, second = self.program.rest("POST", PATH.format("floor1"), {})
            self.assertEqual((status, "already" in second["detail"]), (409, True))
            self.assertEqual(events.next("discovery", asked=1)["state"], "running")
            ended = events.next("discovery", state="done")
            self.assertEqual((ended["asked"], ended["of"], ended["found"]), (6, 6, 0))
        report = state(self.program)
        self.assertEqual((report["state"], report["stations"], report["yaml"]), ("done", [], ""))
        self.assertEqual((report["asked_stations"], report["silent_stations"]), ("20-25", "20-25"))

    def test_it_is_ended_by_whoever_may_begin_it(self):
        self.program.rest("POST", PATH.format("floor1"), {"share_percent": 1})
        status, report = self.program.rest("DELETE", PATH.format("floor1"))
        self.assertEqual((status, report["state"]), (200, "stopped"))
        self.assertEqual(self.program.rest("POST", PATH.format("floor1"), {"stations": "5"})[0], 202)

    def test_not_where_somebody_else_is_master_and_not_without_a_line(self):
        status, problem = self.program.rest("POST", PATH.format("heard"), {})
        self.assertEqual((status, problem["rule"]), (409, "listen"))
        self.assertEqual(self.program.rest("POST", PATH.format("down"), {})[0], 502)
        self.assertEqual(self.program.rest("POST", PATH.format("attic"), {})[0], 404)
        self.assertEqual(state(self.program, "down")["state"], "never")

    def test_the_gateway_ends_while_it_looks(self):
        with harness.configured(config.gateway(SIMULATED, http=config.ADMIN)) as program:
            self.assertEqual(program.rest("POST", PATH.format("floor1"), {"share_percent": 1})[0], 202)
            until(lambda: state(program)["asked"] > 0)
            self.assertEqual(program.stop(), 0)


@unittest.skipUnless((BUILT / "serial_pair").exists(), "the paced pair is not built")
class Foreign(unittest.TestCase):
    def test_pymodbus_is_found_and_its_yaml_can_be_pasted(self):
        with tempfile.TemporaryDirectory() as folder:
            far, near = f"{folder}/far", f"{folder}/near"
            listed = config.line(device=far, stations="{id: 3, name: absent}",
                                 timing="{response_timeout: 60ms}")
            with harness.Helper([BUILT / "serial_pair", str(BAUD), far, near]) as pair:
                pair.out.wait_for("ready")
                with ForeignSlave(near, ModbusRtuFramer), \
                        harness.configured(config.gateway(listed, http=config.ADMIN)) as program:
                    program.log.wait_for("line up")
                    report = discover(program, stations="10-20", share_percent=50)
            self.assertEqual([one["id"] for one in report["stations"]], [UNIT])
            self.assertIn(f"id: {UNIT}, name: floor1-{UNIT}", report["yaml"])
            file = pathlib.Path(folder) / "with_it.yaml"
            text = config.gateway(config.line(device=far, stations="").replace("stations: []", "stations:"))
            file.write_text(text.replace("    stations:\n", "    stations:\n" + report["yaml"]))
            checked = subprocess.run([harness.PANELGATE, "check", "-c", str(file)], text=True,
                                     capture_output=True, timeout=harness.PATIENCE, check=False)
            self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr + file.read_text())


class Again(unittest.TestCase):
    """Panels that were off in the first search, and are on in the second."""

    def test_a_second_search_asks_everybody_again_and_leaves_no_incident(self):
        asked, on = [], set()

        def panel(frame):
            asked.append(frame[0])
            return echo_address(frame) if frame[0] in on else None
        addresses = set(range(3, 13))
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            listed = config.line(device=link, stations="{id: 1, name: press}", baud=115200,
                                 timing="{response_timeout: 60ms}")
            with RtuBus(link, {1: echo_address} | dict.fromkeys(addresses, panel)), \
                    harness.configured(config.gateway(listed, http=config.ADMIN)) as program:
                program.log.wait_for("line up")
                with program.client() as client:
                    client.ask(1, read_registers(7))
                first = discover(program, stations="3-12", share_percent=50)
                self.assertEqual((first["asked"], first["refused"], first["found"]), (10, 0, 0))
                self.assertEqual(set(asked), addresses)
                asked.clear()
                on.update((5, 9))
                second = discover(program, stations="3-12", share_percent=50)
                self.assertEqual((second["asked"], second["refused"]), (10, 0))
                self.assertEqual(set(asked), addresses)
                self.assertEqual([one["id"] for one in second["stations"]], [5, 9])
                self.assertEqual((second["asked_stations"], second["silent_stations"]),
                                 ("3-12", "3-4,6-8,10-12"))
                incidents = program.get("/api/v1/lines/floor1/incidents")[1]["incidents"]
                self.assertEqual(incidents, [])
                self.assertEqual(program.get("/api/v1/lines/floor1")[1]["findings"], [])


if __name__ == "__main__":
    unittest.main()
