"""P7: an adapter that is unplugged and plugged in again a hundred times, under load, or
moved to another socket."""
import contextlib
import os
import pathlib
import struct
import tempfile
import time
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import RtuBus, echo_address

ROUNDS = 20 if harness.SANITIZED else 100
DOWN = b"\x83\x0a"


def shaky_line(link):
    """A configuration with a line that comes and goes."""
    return config.gateway(config.line("shaky", link, "{id: 1, name: one}", baud=115200,
                                      timing="{response_timeout: 200ms}"), config.STEADY_LINE)


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Replug(unittest.TestCase):
    def test_P7_a_hundred_replugs_under_load(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            with harness.configured(shaky_line(link)) as program, program.client() as client, \
                    program.client() as other:
                pid = program.process.pid
                steady = other.ask(31, read_registers(0))
                refusals, returns, counts = [], [], []
                for _ in range(ROUNDS):
                    with RtuBus(link, {1: echo_address}):
                        start = time.monotonic()
                        while client.ask(1, read_registers(5))[0] != 3:
                            pass
                        returns.append(time.monotonic() - start)
                        counts.append(descriptors(pid))
                    while client.ask(1, read_registers(5)) != DOWN:  # on the wire when it went
                        pass
                    start = time.monotonic()
                    self.assertEqual(client.ask(1, read_registers(5)), DOWN)
                    refusals.append(time.monotonic() - start)
                    self.assertEqual(other.ask(31, read_registers(0)), steady)
                print(f"\n  back after {max(returns) * 1000:.0f} ms, refused after "
                      f"{max(refusals) * 1000:.1f} ms at most; descriptors {min(counts)} to "
                      f"{max(counts)}")
                self.assertLess(max(refusals), 0.1)
                self.assertLess(max(returns), 1)
                self.assertLessEqual(max(counts) - min(counts), 1)
                self.assertRegex(program.get("/metrics")[1],
                                 rf'line_reopens_total\{{line="shaky"\}} {ROUNDS - 1}')

    def test_P7_a_link_that_names_another_device_by_now_is_followed(self):
        # As when an adapter is moved to another socket: udev points its link to the new node, and
        # the old one hangs up afterwards.
        def panel(value):
            return lambda frame: struct.pack(">BBH", 3, 2, value)

        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as bus:
            link = pathlib.Path(folder) / "tty"
            bus.enter_context(RtuBus(link, {1: panel(0)}))
            with harness.configured(shaky_line(link)) as program, program.client() as client:
                program.log.wait_for("line up.*line=shaky")
                returns = []
                for value in range(ROUNDS // 4):
                    other = contextlib.ExitStack()
                    other.enter_context(RtuBus(link, {1: panel(value + 1)}))
                    old = struct.pack(">BBH", 3, 2, value)
                    self.assertEqual(client.ask(1, read_registers(5)), old)  # open, and works
                    bus.close()
                    bus.enter_context(other)
                    start = time.monotonic()
                    while (reply := client.ask(1, read_registers(5)))[0] != 3:
                        pass
                    returns.append(time.monotonic() - start)
                    self.assertEqual(reply, struct.pack(">BBH", 3, 2, value + 1))
                print(f"\n  on the new device after {max(returns) * 1000:.0f} ms at most")
                self.assertLess(max(returns), 1)

    def test_P7_a_missing_device_costs_next_to_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "tty"
            with harness.configured(shaky_line(link)) as program, program.client() as client:
                before, start = cpu_seconds(program.process.pid), time.monotonic()
                # The steady line measures the time: a few hundred transactions.
                while time.monotonic() - start < 2:
                    self.assertEqual(client.ask(31, read_registers(0))[0], 3)
                    if (pathlib.Path(folder) / "noise").exists():
                        (pathlib.Path(folder) / "noise").unlink()
                    else:
                        (pathlib.Path(folder) / "noise").touch()
                busy = (cpu_seconds(program.process.pid) - before) / (time.monotonic() - start)
                print(f"\n  {busy * 100:.1f} % of a processor, a busy line included")
                self.assertLess(busy, 0.25 if harness.SANITIZED else 0.15)


if __name__ == "__main__":
    unittest.main()
