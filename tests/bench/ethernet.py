#!/usr/bin/env python3
"""ethernet.py: devices that speak Modbus/TCP. Transactions a second with one and with 16 requests in flight at a
device that needs a millisecond; CPU and memory for 100,000 points a second of ten devices. One figure a line.

PANELGATE=build/release/panelgate python3 -B tests/bench/ethernet.py
"""
import contextlib
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
# pylint: disable=wrong-import-position
import harness
from config import FREE_PORT, gateway
from tls import cpu_seconds, memory_kib, say

PEER = pathlib.Path(os.environ["PANELGATE"]).resolve().parent / "ethernet_peer"
SECONDS = float(os.environ.get("ETHERNET_SECONDS", "10"))
DELAY_US = 1000
DEVICES, GROUPS, POINTS = 10, 10, 1000  # each point a float, two registers, once a second


@contextlib.contextmanager
def devices(count, delay_us):
    """Their ports."""
    with subprocess.Popen([PEER, "device", str(count), str(delay_us)], stdout=subprocess.PIPE, text=True) as peer:
        try:
            yield [int(peer.stdout.readline()) for _ in range(count)]
        finally:
            peer.kill()


def device_line(name, port, more):
    return f"  - {{name: {name}, device: 'modbus-tcp://127.0.0.1:{port}', {more}}}\n"


def rate(in_flight):
    with devices(1, DELAY_US) as (port,):
        text = gateway(device_line("eth", port, f"in_flight: {in_flight}, stations: [{{id: 1, name: press}}]"),
                       modbus=FREE_PORT)
        with harness.configured(text) as program:
            program.log.wait_for("line up line=eth")
            begun, used = time.monotonic(), cpu_seconds(program)
            said = subprocess.run([PEER, "load", str(program.modbus_port()), "1", "16", str(SECONDS)],
                                  check=True, capture_output=True, text=True).stdout.split()
            share = (cpu_seconds(program) - used) / (time.monotonic() - begun)
            return float(said[0]), int(said[1]), share


def points(folder, http):
    """10 devices with 10 groups of 1000 floats, each read once a second."""
    lines = []
    for station in range(1, GROUPS + 1):
        rows = [f"p{i},{300001 + 2 * i},f32,1s" for i in range(POINTS)]
        (folder / f"g{station}.csv").write_text("name,at,type,every\n" + "\n".join(rows) + "\n")
    with devices(DEVICES, DELAY_US) as ports:
        for n, port in enumerate(ports):
            listed = ", ".join(f"{{id: {i}, name: d{n}-{i}, points_file: {folder}/g{i}.csv}}"
                               for i in range(1, GROUPS + 1))
            lines.append(device_line(f"eth{n}", port, f"in_flight: 4, stations: [{listed}]"))
        units = ", ".join(f"{n * GROUPS + i}: eth{n}/{i}" for n in range(DEVICES) for i in range(1, GROUPS + 1))
        text = gateway(*lines, modbus=f"{FREE_PORT}, units: {{{units}}}", http=FREE_PORT if http else None)
        (folder / "bench.yaml").write_text(text)
        with harness.Program("run", "-c", str(folder / "bench.yaml")) as program:
            program.log.wait_for("line up line=eth9")
            time.sleep(5)
            begun, used = time.monotonic(), cpu_seconds(program)
            time.sleep(SECONDS)
            share = (cpu_seconds(program) - used) / (time.monotonic() - begun)
            also = "with" if http else "without"
            say(f"100,000 points a second {also} HTTP: CPU", 100 * share, "% of a core")
            say(f"100,000 points a second {also} HTTP: memory", memory_kib(program) / 1024, "MiB")


def main():
    for in_flight in (1, 16):
        answers, wrong, share = rate(in_flight)
        say(f"{in_flight} in flight at 1 ms", answers, f"tr/s ({wrong} wrong)")
        say(f"{in_flight} in flight at 1 ms: CPU a transaction", 1e6 * share / answers, "us")
    for http in (False, True):
        with tempfile.TemporaryDirectory() as folder:
            points(pathlib.Path(folder), http)


if __name__ == "__main__":
    main()
