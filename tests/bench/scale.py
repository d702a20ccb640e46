#!/usr/bin/env python3
"""scale.py: 1, 4, 16, 64 and 256 lines of 16 panels at 19200 behind device servers, and 2000 clients, in one process.
A row each: rate of the slowest line as a share of one line alone, CPU of a transaction, p99, memory.

PANELGATE=build/release/panelgate python3 -B tests/bench/scale.py
"""
import contextlib
import os
import pathlib
import resource
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
# pylint: disable=wrong-import-position
import config
import harness
from tls import cpu_seconds, memory_kib

PEER = pathlib.Path(os.environ["PANELGATE"]).resolve().parent / "scale_peer"
SECONDS = float(os.environ.get("SCALE_SECONDS", "20"))
BAUD, PANELS, CLIENTS = 19200, 16, 2000
OF_A_LISTENER = 15  # lines: 240 units
OF_A_LINE = 64  # clients at most: a queue has 256 places


@contextlib.contextmanager
def buses(count):
    with subprocess.Popen([PEER, "bus", str(count), str(BAUD)], stdout=subprocess.PIPE, text=True) as bus:
        try:
            yield [int(bus.stdout.readline()) for _ in range(count)]
        finally:
            bus.kill()


def plant(ports):
    """A listener serves as many lines as have places among its units."""
    stations = ", ".join(f"{{id: {i}}}" for i in range(1, PANELS + 1))
    lines = [f"  - {{name: l{n}, device: 'tcp://127.0.0.1:{port}', serial: {{baud: {BAUD}, parity: even}}, "
             f"echo: off, stations: [{stations}]}}\n" for n, port in enumerate(ports)]
    listeners = []
    for begin in range(0, len(ports), OF_A_LISTENER):
        served = range(begin, min(begin + OF_A_LISTENER, len(ports)))
        units = ", ".join(f"{(n - begin) * PANELS + 1}-{(n - begin + 1) * PANELS}: l{n}/1-{PANELS}" for n in served)
        listeners.append(f"{{listen: '127.0.0.{len(listeners) + 1}:0', max_connections: 2048, "
                         "max_connections_per_address: 2048, "
                         f"lines: [{', '.join(f'l{n}' for n in served)}], units: {{{units}}}}}")
    return "lines:\n" + "".join(lines) + f"modbus_tcp: [{', '.join(listeners)}]\nhttp: {{{config.FREE_PORT}}}\n"


def rows_of(program, lines, clients):
    """HOST PORT LINE FIRST_UNIT UNITS of each connection: the same number on each line."""
    ports = [program.modbus_port(i + 1) for i in range(-(-lines // OF_A_LISTENER))]
    return "".join(f"{n // OF_A_LISTENER + 1} {ports[n // OF_A_LISTENER]} {n} {n % OF_A_LISTENER * PANELS + 1} {PANELS}\n"
                   for _ in range(max(1, clients // lines)) for n in range(lines))


def measure(lines, clients):
    with buses(lines) as ports, harness.configured(plant(ports)) as program:
        for n in range(lines):
            program.log.wait_for(f"line up line=l{n} ")
        rows = rows_of(program, lines, clients)
        subprocess.run([PEER, "load", "3"], input=rows, text=True, check=True, stdout=subprocess.DEVNULL)  # warm
        begun, used = time.monotonic(), cpu_seconds(program)
        told = subprocess.run([PEER, "load", str(SECONDS)], input=rows, text=True, check=True,
                              capture_output=True).stdout
        share = (cpu_seconds(program) - used) / (time.monotonic() - begun)
        answers = [[float(one) for one in row.split()] for row in told.splitlines()]
        rates = [row[1] / SECONDS for row in answers]
        return {"slowest": min(rates), "all": sum(rates), "share": share, "wrong": sum(row[2] for row in answers),
                "p99": max(row[3] for row in answers), "mib": memory_kib(program) / 1024}


def main():
    alone = None
    hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    print("lines clients  all tr/s  slowest  of alone  CPU %   CPU us/tr  p99 ms  wrong    MiB", flush=True)
    for lines in (1, 4, 16, 64, 256):
        for clients in sorted({4 * lines, min(CLIENTS, OF_A_LINE * lines)}):
            seen = measure(lines, clients)
            alone = alone or seen["slowest"]
            print(f"{lines:5d} {clients:7d} {seen['all']:9.1f} {seen['slowest']:8.2f} {seen['slowest'] / alone:9.3f} "
                  f"{100 * seen['share']:6.1f} {1e6 * seen['share'] / seen['all']:11.1f} {seen['p99']:7.1f} "
                  f"{seen['wrong']:6.0f} {seen['mib']:6.1f}", flush=True)


if __name__ == "__main__":
    main()
