"""A serial master on a port of the gateway, beside eight clients that always want something: how much
of the line is used, against nine clients in turns on the same line, and how long the master waits."""
import os
import pathlib
import select
import tempfile
import threading
import time
import tty

from measures import figures, rig
from measures.figures import Bar, Row
from measures.saturated import LIMIT

USED = "line's use with a master, share of that with nine clients"
FIRST_P50, FIRST_P99 = "master's reply begins, ms, p50", "master's reply begins, ms, p99"
OF_TIMEOUT = "master's p99 as a share of its timeout"
MISSED = "master's requests without their values in time"

RATES = (9600, 38400, 115200)
REGISTERS = 10
TIMEOUT = 0.5  # libmodbus' own, from its write() to the first byte
PAIR = pathlib.Path(rig.harness.PANELGATE).resolve().parent / "serial_pair"
REPLY = 5 + 2 * REGISTERS


def case_of(baud):
    return f"{baud}, {REGISTERS} registers, master"


CASES = {case_of(baud) for baud in RATES}
BARS = [Bar(USED, CASES, least=0.98), Bar(OF_TIMEOUT, CASES, most=1), Bar(MISSED, CASES, most=0)]


class Master:
    """Reads known registers of all stations in turn, one request at a time."""

    def __init__(self, device):
        self._device = os.open(device, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self._device)
        self.waits, self.missed = [], 0
        self._turn = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._device)

    def forget(self):
        """What was before is not counted."""
        self.waits, self.missed = [], 0

    def poll(self, ended):
        while not ended.is_set():
            unit = rig.STATIONS[self._turn % len(rig.STATIONS)]
            address = self._turn * 7919 % 2000
            self._turn += 1
            self._ask(unit, address)

    def _ask(self, unit, address):
        values = b"".join(((unit * 257 + (address + i) * 31 + 7) & 0xFFFF).to_bytes(2, "big")
                          for i in range(REGISTERS))
        wanted = rig.harness.rtu(unit, bytes([3, 2 * REGISTERS]) + values)
        begin = time.monotonic()
        os.write(self._device, rig.harness.rtu(unit, rig.harness.read_registers(address, REGISTERS)))
        first, heard = None, b""
        while heard != wanted:
            if not select.select([self._device], [], [], TIMEOUT)[0]:
                self.missed += 1
                return
            first = first or time.monotonic() - begin
            heard += os.read(self._device, REPLY)
        if first > TIMEOUT:
            self.missed += 1
        self.waits.append(first)


def beside_master(subject, line, baud, seconds):
    """(window, master) of eight clients and a master on a port of the line's own rate."""
    with tempfile.TemporaryDirectory() as folder:
        far, near = f"{folder}/far", f"{folder}/near"
        entry = f"[{{name: plc, device: {far}, serial: {{baud: {baud}, parity: none}}}}]"
        with rig.harness.Helper([PAIR, baud, far, near]) as pair:
            pair.out.wait_for("ready")
            with subject.serving(line.link, baud, serial_masters=entry) as gateway, \
                    Master(near) as master:
                gateway.log.wait_for("serial master up")
                with rig.in_background(master.poll):
                    forget = threading.Timer(rig.warm_time(baud, REGISTERS), master.forget)
                    forget.start()
                    window, _ = rig.saturate(line, gateway.port, gateway.pid, REGISTERS, seconds)
                    forget.join()
    return window, master


def rows_of(subject, baud, master, window, nine):
    case, limit = case_of(baud), rig.wire.wire_limit(baud, REGISTERS)
    p50, p99 = (figures.quantile(master.waits, share) for share in (0.5, 0.99))
    yield Row(USED, case, subject.name, window.rate / nine.rate, "")
    yield Row(LIMIT, case, subject.name, window.rate / limit, "")
    yield Row(LIMIT, f"{baud}, {REGISTERS} registers, nine clients", subject.name,
              nine.rate / limit, "")
    yield Row(FIRST_P50, case, subject.name, 1e3 * p50, "ms", {"answers": len(master.waits)})
    yield Row(FIRST_P99, case, subject.name, 1e3 * p99, "ms")
    yield Row(OF_TIMEOUT, case, subject.name, p99 / TIMEOUT, "")
    yield Row(MISSED, case, subject.name, master.missed, "")


def measure(run):
    if not PAIR.exists():
        run.left_out.append(f"a serial master: there is no {PAIR}")
        return
    turns, seconds = (1, 3) if run.quick else (2, 10)
    for baud in RATES:
        with tempfile.TemporaryDirectory() as folder, \
                rig.LoggedLine(run.tools, folder, baud) as line:
            for subject in run.gateways * turns:
                with subject.serving(line.link, baud) as gateway:
                    nine, _ = rig.saturate(line, gateway.port, gateway.pid, REGISTERS, seconds,
                                           clients=9)
                window, master = beside_master(subject, line, baud, seconds)
                yield from rows_of(subject, baud, master, window, nine)
