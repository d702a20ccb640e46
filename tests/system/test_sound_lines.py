"""What answers late, or not at all, behind a tcp:// line (docs/how/threats.md)."""
import pathlib
import tempfile
import time
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import RtuBus, echo_address
from sound_line import DeviceServer, Poller
from zoo_line import in_parallel, percentile

SOON = 0.2  # s: more than a busy machine takes, less than a response_timeout


class GatewayBehind(unittest.TestCase):
    """What a gateway behind a tcp:// line says of a dead panel is an answer (T10): passed on at once,
    and nobody else waits for it."""
    ASKED = 12
    LINE = {"timing": "{response_timeout: 2500ms}", "queue": "{deadline: 5s}",
            "stations": "{id: 1, name: near}, {id: 2, name: dead}"}

    def ask_dead(self, program, first):
        """Seconds: the median and p90 of the dead panel's exceptions behind the `first` ones, and p90 of
        the good panel's answers."""
        with Poller(program, 1, lambda n: read_registers(n % 9, 2), 0.05) as near, \
                Poller(program, 2, lambda n: read_registers(n % 9, 2), 0.3) as dead:
            end = time.monotonic() + harness.PATIENCE
            while len(dead.replies) < first + self.ASKED and time.monotonic() < end:
                time.sleep(0.05)
        self.assertTrue(all(reply[0] == 3 for _, reply in near.replies), near.replies)
        self.assertEqual({reply[0] for _, reply in dead.replies}, {0x83})
        late = dead.seconds[first:]
        return percentile(late, 0.5), percentile(late, 0.9), percentile(near.seconds, 0.9)

    def scripted(self, code):
        """A gateway that finds out that a panel is dead by three timeouts, and then knows."""
        waits = [0.54, 0.97, 0.97]

        def answer(frame, _):
            if frame[0] == 1:
                time.sleep(0.02)
                return echo_address(frame)
            time.sleep(waits.pop(0) if waits else 0)
            return bytes([frame[1] | 0x80, code])
        with DeviceServer(answer) as far:
            text = config.gateway(config.line(device=far.device, **self.LINE))
            with harness.configured(text) as program:
                program.log.wait_for("line up")
                return self.ask_dead(program, 4)

    def two_gateways(self):
        """Two panelgates, one behind the other: the second one knows that its panel is off."""
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            far = config.gateway(
                config.line(device=link, stations=self.LINE["stations"]),
                modbus=config.FREE_PORT + ", framing: rtu")
            with RtuBus(link, {1: echo_address}), harness.configured(far) as behind:
                device = f"tcp://127.0.0.1:{behind.modbus_port()}"
                text = config.gateway(config.line(device=device, **self.LINE))
                with harness.configured(text) as program:
                    program.log.wait_for("line up")
                    return self.ask_dead(program, 6)

    def test_an_exception_of_the_gateway_behind_is_passed_on_at_once(self):
        cases = {"0A": lambda: self.scripted(0x0A), "0B": lambda: self.scripted(0x0B),
                 "04": lambda: self.scripted(0x04), "two panelgates": self.two_gateways}
        for name, (dead, dead_p90, near) in zip(cases, in_parallel(lambda case: case(),
                                                                   list(cases.values()))):
            print(f"\n  {name}: the dead panel's after {1000 * dead:.0f} ms (median), "
                  f"{1000 * dead_p90:.0f} ms (p90); the good panel's p90 {1000 * near:.0f} ms", end="")
            with self.subTest(name):
                self.assertLess(dead, SOON)
                self.assertLess(near, SOON)
                if name != "two panelgates":  # the far gateway probes its panel
                    self.assertLess(dead_p90, SOON)


class QuietAfterConnect(unittest.TestCase):
    """A device ignores the first seconds of each connection: a connection is not made anew again and
    again for silence alone (T8)."""
    WITHIN, STEADY = 20, 15  # s, and reads in a row

    def read_until_steady(self, deaf):
        """(seconds until the reads of the steady row began, or None; connections)."""
        def answer(frame, age):
            return echo_address(frame) if age > deaf else None
        with DeviceServer(answer) as dongle:
            text = config.gateway(config.line(device=dongle.device, baud=9600,
                                              stations="{id: 1, name: dongle}"))
            with harness.configured(text) as program, program.client() as client:
                start, row, since = time.monotonic(), 0, 0.0
                while row < self.STEADY:
                    asked = time.monotonic() - start
                    if row == 0:
                        since = asked
                    if since > self.WITHIN:
                        return None, dongle.connections()
                    row = row + 1 if client.ask(1, read_registers(row, 2))[0] == 3 else 0
                    time.sleep(0.2)
                return since, dongle.connections()

    def test_a_device_that_is_deaf_after_each_connection_is_read_and_stays_read(self):
        cases = (0, 0.5, 1.1, 1.5, 3)
        for deaf, (since, connections) in zip(cases, in_parallel(self.read_until_steady, cases)):
            read = "never read" if since is None else f"read after {since:.1f} s"
            print(f"\n  deaf for {deaf} s: {read}, {connections} connections", end="")
            with self.subTest(deaf=deaf):
                self.assertIsNotNone(since)


if __name__ == "__main__":
    unittest.main()
