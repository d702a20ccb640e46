"""Two boxes on one line: one drives it, the other one listens and takes over."""
import contextlib
import pathlib
import signal
import tempfile
import unittest

import config
import harness
from harness import read_registers, write_register
from shared_bus import SharedBus
from test_history import Alertmanager
from test_points import until

STATIONS = ("{id: 1, name: press, points: [{name: level, at: '400005', every: 200ms, writable: true}]}, "
            "{id: 2, name: oven}")


class Box(harness.Program):
    """A gateway that may be killed."""

    def __exit__(self, *failure):
        if self.process.poll() is None:
            super().__exit__(*failure)


class Standby(unittest.TestCase):
    @contextlib.contextmanager
    def boxes(self, peer=False, stations=STATIONS, more="", timeout="300ms"):
        """Bus, box of rank 0, box of rank 1. `peer`: rank 1 asks rank 0."""
        with contextlib.ExitStack() as stack:
            folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
            bus = stack.enter_context(SharedBus([folder / "a", folder / "b"], {1, 2}))
            boxes = []
            for rank, device in enumerate(("a", "b")):
                line = config.line(device=folder / device, baud=115200, retries=0,
                                   timing=f"{{response_timeout: {timeout}}}", stations=stations)
                other = f", peer: 'http://127.0.0.1:{boxes[0].http_port()}'" if peer and boxes else ""
                file = folder / f"{device}.yaml"
                file.write_text(config.gateway(line, http=config.ADMIN) + f"standby: {{rank: {rank}{other}}}\n{more}")
                boxes.append(stack.enter_context(Box("run", "-c", str(file))))
                boxes[-1].http_port()
                until(lambda: self.role(boxes[0]) == "active")  # before the other one listens
            yield bus, *boxes

    def role(self, box):
        return box.get("/api/v1/standby")[1]["role"]

    def level(self, box):
        point = box.get("/api/v1/stations/press/points/level")[1]
        return point["value"], point["quality"]

    def test_the_standby_listens_and_takes_over_when_the_line_is_silent(self):
        with self.boxes() as (bus, first, second):
            until(lambda: self.level(second) == (4, "good"))
            self.assertEqual(self.role(second), "standby")
            self.assertEqual(bus.frames(1), [], "it sends nothing")
            with second.client() as client:
                self.assertEqual(client.ask(1, read_registers(4)), bytes([0x83, 0x0A]))
                self.assertEqual(client.ask(1, write_register(4, 9)), bytes([0x86, 0x0A]))
            status, why = second.rest("PUT", "/api/v1/stations/press/points/level", {"value": 9})
            self.assertEqual((status, why["rule"]), (503, "standby"))
            self.assertEqual(self.health(first), 0)
            self.assertEqual(self.health(second), 1)
            silent = max(one.at for one in bus.frames(0))
            first.process.kill()
            first.process.wait()
            until(lambda: self.role(second) == "active")
            began = min(one.at for one in bus.frames(1))
            self.assertGreater(began - silent, 1.0)
            with second.client() as client:
                until(lambda: client.ask(1, read_registers(4)) == bytes([3, 2, 0, 4]))
            until(lambda: self.level(second) == (4, "good"))
            self.assertEqual(self.health(second), 0)
            kinds = [one["text"] for one in second.get("/api/v1/journal?kind=standby")[1]["entries"]]
            self.assertIn("active: the line was silent, and a panel answers", kinds)

    def health(self, box):
        return harness.run("health", "--active", "--http", f"127.0.0.1:{box.http_port()}").returncode

    def test_an_active_box_is_never_silent_and_the_other_one_stays(self):
        with self.boxes() as (bus, _, second):
            since = bus.frames(0)[-1].at
            until(lambda: bus.frames(0)[-1].at > since + 3)
            times = [one.at for one in bus.frames(0, since)]
            self.assertLess(max(b - a for a, b in zip(times, times[1:])), 1.5)
            self.assertEqual((self.role(second), bus.frames(1)), ("standby", []))

    def test_a_box_that_was_stopped_listens_first(self):
        with self.boxes() as (bus, first, second):
            first.process.send_signal(signal.SIGSTOP)
            until(lambda: self.role(second) == "active")
            sent = len(bus.frames(0))
            first.process.send_signal(signal.SIGCONT)
            until(lambda: self.role(first) == "standby")
            until(lambda: self.level(first) == (4, "good"))
            self.assertLessEqual(len(bus.frames(0)) - sent, 1)
            self.assertEqual(self.role(second), "active", "nobody takes the line back")

    def test_roles_change_again_and_again(self):
        with self.boxes() as (_, *boxes):
            active, other = boxes
            for _ in range(4):
                active.process.send_signal(signal.SIGSTOP)
                until(lambda: self.role(other) == "active")
                active.process.send_signal(signal.SIGCONT)
                until(lambda: self.role(active) == "standby")
                until(lambda: self.level(other) == (4, "good"))
                active, other = other, active

    def stays(self, bus, second, seconds=4):
        """The first box sends on and on, and the second one listens."""
        since = bus.frames(0)[-1].at
        until(lambda: bus.frames(0)[-1].at > since + seconds)
        self.assertEqual((self.role(second), bus.frames(1)), ("standby", []))

    def test_a_gateway_that_polls_nothing_is_not_silent_either(self):
        with self.boxes(stations="{id: 1, name: press}, {id: 2, name: oven}") as (bus, _, second):
            self.stays(bus, second)

    def test_rules_of_access_are_for_clients(self):
        rules = "access: {default: deny, rules: [{name: scada, allow: [read], from: [10.0.0.1/32]}]}\n"
        with self.boxes(more=rules, stations="{id: 1, name: press}, {id: 2, name: oven}") as (bus, _, second):
            self.stays(bus, second)

    def test_a_master_that_waits_for_a_panel_is_not_gone(self):
        with self.boxes(timeout="3s") as (bus, first, second), first.client() as client:
            until(lambda: self.level(first) == (4, "good"))
            bus.panels.remove(2)
            sent = client.send(2, read_registers(1))
            self.assertEqual(client.receive()[0], sent)
            self.assertEqual((self.role(second), bus.frames(1)), ("standby", []))

    def test_the_panel_that_lives_is_found(self):
        many = ", ".join(f"{{id: {i}}}" for i in range(1, 9))
        with self.boxes(stations=many + ", {id: 9, name: press}, {id: 10, name: oven}") as (bus, first, second):
            bus.panels.clear()
            bus.panels.add(9)
            with first.client() as client:
                until(lambda: client.ask(9, read_registers(4))[0] == 3)
                until(lambda: second.get("/api/v1/stations/press")[1]["state"] == "heard")
            silent = bus.frames(0)[-1].at
            first.process.kill()
            first.process.wait()
            until(lambda: self.role(second) == "active")
            self.assertEqual(bus.frames(1, silent)[0].bytes[0], 9)
            self.assertEqual([one for one in bus.frames(1, silent) if one.bytes[0] not in (9,)][:1], [])

    def test_the_webhook_is_of_the_active_box(self):
        with Alertmanager([]) as hook:
            more = (f"alarm_webhook: {{url: {hook.url}, every: 1s}}\n"
                    "alarms: [{name: low, point: press/level, below: 5}]\n")
            with self.boxes(more=more) as (_, first, second):
                self.assertEqual(hook.alerts.get(timeout=harness.PATIENCE)["labels"]["alertname"], "low")
                first.process.kill()
                first.process.wait()
                until(lambda: self.role(second) == "active")
                while not hook.alerts.empty():
                    hook.alerts.get()
                self.assertEqual(hook.alerts.get(timeout=harness.PATIENCE)["labels"]["alertname"], "low")

    def test_after_a_cut_the_box_of_rank_one_leaves(self):
        with self.boxes() as (bus, first, second):
            bus.cut = True
            until(lambda: self.role(second) == "active")
            self.assertEqual(self.role(first), "active", "two lines now, each with its panels")
            bus.cut = False
            until(lambda: self.role(second) == "standby")
            self.assertEqual(self.role(first), "active")

    def test_a_deaf_box_asks_its_peer_and_stays_back(self):
        with self.boxes(peer=True) as (bus, first, second):
            bus.deaf.add(1)
            until(lambda: second.get("/api/v1/standby")[1]["peer"] == "active")
            sent = len(bus.frames(0))
            until(lambda: len(bus.frames(0)) > sent + 15)
            self.assertEqual((self.role(second), bus.frames(1)), ("standby", []))
            first.process.kill()
            first.process.wait()
            until(lambda: second.get("/api/v1/standby")[1]["lines"][0]["deaf"])
            self.assertEqual(self.role(second), "standby")
            bus.deaf.clear()
            until(lambda: self.role(second) == "active")

    def test_a_reload_keeps_the_role(self):
        with self.boxes() as (_, first, second):
            for box, role in ((first, "active"), (second, "standby")):
                file = pathlib.Path(box.arguments[2])
                file.write_text(file.read_text().replace("name: oven", "name: kiln"))
                self.assertEqual(box.rest("POST", "/api/v1/reload")[1]["outcome"], "applied")
                self.assertEqual(self.role(box), role)
                self.assertEqual(box.get("/api/v1/stations/kiln")[0], 200)


if __name__ == "__main__":
    unittest.main()
