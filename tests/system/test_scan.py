"""`panelgate scan` on simulated lines: what it finds, what it prints, and what it never does."""
import contextlib
import fcntl
import os
import pathlib
import re
import select
import signal
import struct
import subprocess
import tempfile
import termios
import time
import tty
import unittest

import config
import harness
from harness import PATIENCE, read_registers, rtu
from test_sixth_panel import PANEL

SIX = """
      {id: 31, profile: autonics-gplp-s}, {id: 5, profile: autonics-gp-2005},
      {id: 17, profile: autonics-arm}, {id: 20, profile: panasonic-gt},
      {id: 1, profile: omron-cp2e},
      {id: 7, profile: autonics-gplp-s, simulate: {duplicate: 1}}"""
FOUND = {1: "omron-cp2e", 5: "autonics-gp-2005", 7: "autonics-gplp-s", 17: "autonics-arm",
         20: "panasonic-gt", 31: "autonics-gplp-s"}
LIMIT = 60  # seconds: what a person at the panel waits for
COLUMNS = 64


def six(name):
    return config.line(name, stations=SIX)


def only_first_served(*lines):
    first = re.search(r"name: (\S+)", lines[0]).group(1)
    return config.gateway(*lines, modbus=f"{config.FREE_PORT}, lines: [{first}]", http=None)


@contextlib.contextmanager
def simulated(*lines):
    """{name: device} of these lines, simulated."""
    names = [re.search(r"name: (\S+)", line).group(1) for line in lines]
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "lines.yaml"
        file.write_text(only_first_served(*lines))
        links = {name: f"{folder}/{name}" for name in names}
        arguments = [a for name in names for a in ("--line", f"{name}={links[name]}")]
        with harness.Program("simulate", "-c", str(file), *arguments) as program:
            for name in names:
                program.log.wait_for(f"simulating line={name} ")
            wait_until(lambda: all(map(os.path.exists, links.values())))
            yield links


def wait_until(is_so):
    end = time.monotonic() + PATIENCE
    while not is_so():
        assert time.monotonic() < end
        select.select([], [], [], 0.01)


def start(*arguments, stderr=subprocess.PIPE):
    return subprocess.Popen([harness.PANELGATE, "scan", *arguments], stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=stderr, text=True)


def scan(*arguments):
    """(exit code, stdout, stderr); without what it says meanwhile."""
    process = start(*arguments)
    out, err = process.communicate(timeout=3 * LIMIT)
    return process.returncode, out, re.sub(r"(?m)^panelgate: (\d+ %|found station \d+:) ?.*\n", "", err)


def drain(descriptor, process):
    """What a process writes to the terminal behind `descriptor`, until it has ended."""
    seen = b""
    while True:
        ended = process.poll() is not None
        if select.select([descriptor], [], [], 0 if ended else 0.1)[0]:
            try:
                seen += os.read(descriptor, 4096)
                continue
            except OSError:
                return seen.decode()
        if ended:
            return seen.decode()


@contextlib.contextmanager
def terminal():
    """(our side, the side of a program) of a terminal that is COLUMNS wide."""
    ours, theirs = os.openpty()
    try:
        tty.setraw(theirs)
        fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, COLUMNS, 0, 0))
        yield ours, theirs
    finally:
        os.close(ours)
        os.close(theirs)


class Scan(unittest.TestCase):
    def test_six_addresses_one_of_them_doubled(self):
        with simulated(six("a"), six("b")) as links, terminal() as (ours, theirs):
            begun = time.monotonic()
            shown = start(links["a"], stderr=theirs)
            piped = start(links["b"], "--yaml")
            drawn = drain(ours, shown)
            table = shown.communicate(timeout=PATIENCE)[0]
            text, err = piped.communicate(timeout=LIMIT)
            took = time.monotonic() - begun
            print(f"six addresses: {took:.1f} s", flush=True)
            self.assertLess(took, LIMIT)
            self.assertEqual((shown.returncode, piped.returncode), (0, 0), err)
            self.assertRegex(err, r"^(panelgate: (\d found, \d+ questions left at most: 38400 8N1, |found station ).*\n)+$")
            self.check_named(err)
            self.check_table(links["a"], table)
            self.check_progress(drawn)
            self.check_configuration(text)

    def check_table(self, device, table):
        first, heading, *rows = table.splitlines()
        self.assertEqual(first, f"{device}: 38400 8N1, 6 stations, 1 address shared by two")
        self.assertRegex(heading, r"^ADDRESS  PROFILE +EVIDENCE$")
        self.assertEqual({int(row.split()[0]): row.split()[1] for row in rows}, FOUND)
        for row in rows:
            self.assertEqual("seem to share address 7: " in row, row.startswith("7 "), row)

    def check_progress(self, drawn):
        lines = drawn.replace("\x1b[K", "").replace("\n", "").split("\r")
        self.assertLess(max(map(len, lines)), COLUMNS)
        self.check_named(drawn)
        self.assertRegex(drawn, r"\d found, \d+ questions left at most: 38400 8N1, station")
        self.assertTrue(drawn.endswith("\r\x1b[K"), repr(drawn[-80:]))
        left = [int(count) for count in re.findall(r"(\d+) questions left", drawn)]
        self.assertLess(left[-1], left[0] / 10)

    def check_named(self, told):
        """Each panel, before the scan is at its end."""
        named = re.findall(r"panelgate: found station (\d+): ([\w-]+)", told)
        self.assertEqual({int(address): profile for address, profile in named}, FOUND)
        last = max(found.end() for found in re.finditer("found station", told))
        self.assertRegex(told[last:], r"found, \d+ questions left")

    def test_a_quick_scan_ends_with_a_configuration_to_paste(self):
        with simulated(six("a")) as links:
            begun = time.monotonic()
            code, out, err = scan(links["a"], "--quick")
            took = time.monotonic() - begun
        print(f"six addresses, quick: {took:.1f} s", flush=True)
        self.assertEqual(code, 0, err)
        self.assertIn("--quick has asked each address once", err)
        table, text = out.split("\n\n", 1)
        self.check_table(links["a"], table)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "found.yaml"
            file.write_text(text)
            checked = harness.run("check", "-c", str(file))
        self.assertEqual((checked.returncode, checked.stderr), (0, ""))

    def check_configuration(self, text):
        self.assertIn("# two stations seem to share address 7: ", text)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "found.yaml"
            file.write_text(text)
            checked = harness.run("check", "-c", str(file))
            self.assertEqual((checked.returncode, checked.stderr), (0, ""))
            file.write_text(text.replace("127.0.0.1:1502", "127.0.0.1:0"))
            with harness.Program("run", "-c", str(file)) as program:
                program.log.wait_for("line up")
                with program.client() as client:
                    self.assertEqual(client.ask(31, read_registers(0))[2:], b"\x00\x0a")
                    self.assertEqual(client.ask(5, read_registers(30))[2:], b"\x00\x0a")

    def test_another_format_is_found_and_only_that_is_understood(self):
        odd = config.line("odd", stations="{id: 20, profile: panasonic-gt}", baud=9600,
                          parity="odd")
        with simulated(odd) as links:
            code, out, err = scan(links["odd"], "--stations", "19,20")
            self.assertEqual((code, err), (0, ""))
            self.assertEqual(out.splitlines()[0], f"{links['odd']}: 9600 8O1, 1 station")
            self.assertRegex(out, r"(?m)^20 +panasonic-gt ")
            code, out, err = scan(links["odd"], "--stations", "20", "--baud", "38400,9600",
                                  "--parity", "none,even")
            self.assertEqual((code, out), (69, f"{links['odd']}: no station answered\n"))
            self.assertIn("nothing answered: ", err)

    def test_a_panel_that_only_a_file_describes_is_recognised(self):
        with tempfile.TemporaryDirectory() as folder:
            panels, link = pathlib.Path(folder) / "panels", pathlib.Path(folder) / "tty"
            panels.mkdir()
            (panels / "acme-ax-7.yaml").write_text(PANEL)
            file = pathlib.Path(folder) / "hall.yaml"
            hall = config.line("hall", stations="{id: 9, profile: acme-ax-7}", baud=19200,
                               parity="even")
            file.write_text(config.gateway(hall, http=None, profiles_dir=panels))
            with harness.Program("simulate", "-c", str(file), "--line", f"hall={link}"):
                wait_until(link.exists)
                limits = ("--stations", "9", "--baud", "19200")
                self.assertNotIn("acme", scan(str(link), *limits)[1])
                code, out, err = scan(str(link), *limits, "--profiles", str(panels), "--yaml")
            self.assertEqual((code, err), (0, ""))
            self.assertIn("{id: 9, name: station-9, profile: acme-ax-7}", out)
            (pathlib.Path(folder) / "found.yaml").write_text(out)
            checked = harness.run("check", "-c", "found.yaml", cwd=folder)
            self.assertEqual(checked.returncode, 0, checked.stderr)
            (panels / "broken.yaml").write_text("description: nothing else\n")
            code, out, err = scan(str(link), "--profiles", str(panels))
            self.assertEqual((code, out), (78, ""))
            self.assertRegex(err, r"broken\.yaml:1:1: ")

    def test_a_device_server_needs_no_format(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "far.yaml"
            file.write_text(only_first_served(six("far")))
            with harness.Program("simulate", "-c", str(file), "--line",
                                 "far=tcp://127.0.0.1:0") as program:
                port = program.log.wait_for(r"rtu_over_tcp=127\.0\.0\.1:(\d+)").group(1)
                device = f"tcp://127.0.0.1:{port}"
                code, out, err = scan(device, "--stations", "5,17")
            self.assertEqual((code, err), (0, ""))
            self.assertEqual(out.splitlines()[0], f"{device}: 2 stations")
            self.assertRegex(out, r"(?m)^5 +autonics-gp-2005 ")

    def test_while_another_master_talks_nothing_is_said(self):
        with terminal() as (ours, theirs):
            process = start(os.ttyname(theirs))
            while process.poll() is None:
                os.write(ours, rtu(17, read_registers(0, 5)))
                select.select([], [], [], 0.1)
            out, err = process.communicate(timeout=PATIENCE)
            self.assertEqual(process.returncode, 69)
            self.assertIn("another master is talking at 38400 8N1, nothing was asked", out)
            self.assertIn("(station 17 function 3): stop it, or scan all the same with --speak",
                          err)
            self.assertEqual(select.select([ours], [], [], 0)[0], [], "not a byte was sent")

    def test_an_interrupted_scan_tells_what_it_has(self):
        with simulated(six("a")) as links, terminal() as (ours, theirs):
            process = start(links["a"], stderr=theirs)
            seen = ""
            while not re.search(r"[1-9] found", seen) and process.poll() is None:
                if select.select([ours], [], [], 0.1)[0]:
                    seen += os.read(ours, 4096).decode()
            process.send_signal(signal.SIGINT)
            drain(ours, process)
            out = process.communicate(timeout=PATIENCE)[0]
            self.assertEqual(process.returncode, 69)
            self.assertTrue(out.splitlines()[0].endswith(" (interrupted)"), out)
            self.assertRegex(out, r"(?m)^1 +")

    def test_a_device_that_cannot_be_used_is_told_at_once(self):
        code, out, err = scan("/dev/not-there")
        self.assertEqual((code, out), (69, ""))
        first, rest = err.split("\n", 1)
        self.assertEqual(first, "panelgate: cannot open /dev/not-there: No such file or directory")
        self.assertRegex(rest, "^  (no USB adapter is here|USB adapters that are here:)")
        with simulated(six("a")) as links, open(links["a"], "rb") as held:
            fcntl.flock(held, fcntl.LOCK_EX)
            code, out, err = scan(links["a"])
            self.assertEqual((code, out), (69, ""))
            self.assertIn(" holds it", err)
        code, out, err = scan("tcp://127.0.0.1:1", "--stations", "1")
        self.assertEqual((code, out), (69, ""))
        self.assertIn("cannot reach tcp://127.0.0.1:1: ", err)

    def test_what_is_no_list_is_refused(self):
        for wrong in (["--baud", "fast"], ["--parity", "mark"], ["--stations", "0-31"]):
            code, out, err = scan("/dev/not-there", *wrong)
            self.assertEqual((code, out), (64, ""), wrong)
            self.assertRegex(err, rf"^panelgate: {wrong[0]} '{wrong[1]}' is not a list of .*\n$")
        for wrong in (["sim"], ["tcp://nowhere"], ["tcp://h:1", "--baud", "9600"], []):
            self.assertEqual(scan(*wrong)[0], 64, wrong)


if __name__ == "__main__":
    unittest.main()
