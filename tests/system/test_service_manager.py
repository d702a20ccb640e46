"""What systemd is told of the gateway, played by the sockets that it holds the other end of."""
import contextlib
import os
import pathlib
import re
import signal
import socket
import subprocess
import tempfile
import unittest

import config
import harness

JOURNAL = pathlib.Path("/run/systemd/journal/socket")
TWO_LINES = config.gateway(config.line("a"), config.line("b", device="/dev/nothing-here",
                                                         stations="{id: 2, name: two}"))


class Manager:
    """The other end of NOTIFY_SOCKET: what has been told, in order."""

    def __init__(self, address):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.settimeout(harness.PATIENCE)
        self.socket.bind(address)

    def close(self):
        self.socket.close()

    def next(self):
        return dict(word.split("=", 1) for word in self.socket.recv(4096).decode().split("\n"))

    def wait_for(self, key):
        while True:
            told = self.next()
            if key in told:
                return told

    def wait_for_silence(self):
        """Takes what was told, until nothing comes for longer than the watchdog of these tests."""
        self.socket.settimeout(2)
        with contextlib.suppress(TimeoutError):
            while True:
                self.socket.recv(4096)
        self.socket.settimeout(harness.PATIENCE)


@contextlib.contextmanager
def managed(text, address=None, **more):
    with tempfile.TemporaryDirectory() as folder:
        name = address or str(pathlib.Path(folder) / "notify")
        with contextlib.closing(Manager(name.replace("@", "\0", 1))) as manager:
            env = {**os.environ, "NOTIFY_SOCKET": name, **more}
            with harness.configured(text, env=env) as program:
                yield manager, program


class ServiceManager(unittest.TestCase):
    def test_it_is_told_when_the_gateway_serves_and_how_many_lines_are_up(self):
        with managed(TWO_LINES) as (manager, program):
            told = manager.wait_for("READY")
            ports = (program.modbus_port(), program.http_port())
            status = (r"[01] of 2 lines up, listening on modbus_tcp 127\.0\.0\.1:%d, "
                      r"http 127\.0\.0\.1:%d" % ports)
            self.assertRegex(told["STATUS"], status)
            while not told["STATUS"].startswith("1 of 2"):
                told = manager.wait_for("STATUS")
            program.process.send_signal(signal.SIGTERM)
            told = manager.wait_for("STOPPING")
            self.assertGreaterEqual(int(told["EXTEND_TIMEOUT_USEC"]), 10_000_000)

    def test_it_is_told_of_a_reload_and_when_that_is_over_good_or_bad(self):
        with managed(TWO_LINES) as (manager, program):
            manager.wait_for("READY")
            file = pathlib.Path(program.arguments[2])
            for text in (TWO_LINES.replace("id: 2", "id: 3"), "lines: none"):
                file.write_text(text)
                program.process.send_signal(signal.SIGHUP)
                self.assertGreater(int(manager.wait_for("RELOADING")["MONOTONIC_USEC"]), 0)
                self.assertIn(" lines up, listening on ", manager.wait_for("READY")["STATUS"])

    def test_an_abstract_socket_is_told_too(self):
        with managed(TWO_LINES, f"@panelgate-{os.getpid()}") as (manager, _):
            self.assertEqual(manager.wait_for("READY")["READY"], "1")

    def test_a_loop_that_hangs_feeds_no_watchdog(self):
        with managed(TWO_LINES, WATCHDOG_USEC="200000") as (manager, program):
            for _ in range(3):
                manager.wait_for("WATCHDOG")
            program.process.send_signal(signal.SIGSTOP)
            try:
                manager.wait_for_silence()
            finally:
                program.process.send_signal(signal.SIGCONT)
            manager.wait_for("WATCHDOG")

    def test_the_watchdog_of_another_process_is_not_fed(self):
        with managed(TWO_LINES, WATCHDOG_USEC="200000", WATCHDOG_PID="1") as (manager, program):
            manager.wait_for("READY")
            program.stop()
            manager.socket.settimeout(0)
            with contextlib.suppress(BlockingIOError):
                while True:
                    self.assertNotIn("WATCHDOG", manager.next())


class Journal(unittest.TestCase):
    @unittest.skipIf(JOURNAL.exists(), "a journal runs here, and would be told")
    def test_where_stderr_is_the_journal_each_line_has_its_priority(self):
        reading, writing = os.pipe()
        file = os.fstat(writing)
        with open(reading) as journal, tempfile.TemporaryDirectory() as folder:
            with contextlib.closing(Manager(f"{folder}/notify")) as manager:
                path = pathlib.Path(folder) / "panelgate.yaml"
                path.write_text(TWO_LINES)
                env = {**os.environ, "NOTIFY_SOCKET": f"{folder}/notify",
                       "JOURNAL_STREAM": f"{file.st_dev}:{file.st_ino}"}
                program = subprocess.Popen([harness.PANELGATE, "run", "-c", str(path)], env=env,
                                           stdin=subprocess.DEVNULL, stderr=writing)
                os.close(writing)
                manager.wait_for("READY")
                program.terminate()
                self.assertEqual(program.wait(harness.PATIENCE), 0)
            lines = journal.read().splitlines()
        self.assertIn("<6>info stopping", lines)
        for line in lines:
            self.assertTrue(re.match(r"<6>info |<4>warn |<3>error ", line), line)


if __name__ == "__main__":
    unittest.main()
