#!/usr/bin/env python3
"""tls.py: what TLS costs. Memory of 1024 connections, a plain client's latency and a line's use under
a flood of handshakes, CPU of a transaction beside a plain one. Prints one figure a line.

PANELGATE=build/release/panelgate python3 -B tests/bench/tls.py
"""
import contextlib
import os
import pathlib
import resource
import ssl
import statistics
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
# pylint: disable=wrong-import-position
import harness
from config import FREE_PORT, gateway, line
from harness import read_registers
from tls_plant import SecureClient, plant

TRANSACTIONS = int(os.environ.get("TLS_TRANSACTIONS", "3000"))
WINDOW = 20  # transactions, a seventh of a second
SECONDS = int(os.environ.get("TLS_SECONDS", "10"))
READ = read_registers(0, 10)


def cpu_seconds(program):
    """CPU of all threads: the scheduler's figure, as ticks of 10 ms are too coarse."""
    tasks = pathlib.Path(f"/proc/{program.process.pid}/task").iterdir()
    return sum(int((task / "schedstat").read_text().split()[0]) for task in tasks) / 1e9


def loop_seconds(program):
    """CPU of the loop's thread alone."""
    process = program.process.pid
    ran = pathlib.Path(f"/proc/{process}/task/{process}/schedstat").read_text().split()[0]
    return int(ran) / 1e9


def handshakes_done(program):
    return sum(float(line_.rsplit(" ", 1)[1]) for line_ in program.get("/metrics")[1].splitlines()
               if line_.startswith("panelgate_tls_handshakes_total"))


def memory_kib(program):
    text = pathlib.Path(f"/proc/{program.process.pid}/status").read_text()
    return int(text.split("VmRSS:")[1].split()[0])


def say(what, figure, unit):
    print(f"{what:58s} {figure:10.2f} {unit}", flush=True)


@contextlib.contextmanager
def served(made):
    """A plain listener and one with TLS, on one line of 115200 baud."""
    many = f"{FREE_PORT}, max_connections_per_address: 4096, max_connections: 4096"
    text = gateway(line(stations="{id: 31, name: press, profile: generic}", baud=115200), modbus=many).replace(
        "modbus_tcp: [", f"modbus_tcp: [{{{many}, {made.tls('required', role_from='certificate')}}}, ")
    (made.folder / "bench.yaml").write_text(text)
    with harness.Program("run", "-c", made.path("bench.yaml")) as program:
        program.http_port()
        yield program, program.modbus_port(1), program.modbus_port(2)


def latencies(client, seconds):
    found = []
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        begun = time.perf_counter()
        client.ask(31, READ)
        found.append((time.perf_counter() - begun) * 1000)
    return found


def show(what, found, phases=1):
    found = sorted(found)
    say(what + ", median", statistics.median(found), "ms")
    say(what + ", 99 %", found[int(len(found) * 0.99)], "ms")
    say(what + ", transactions a second", len(found) / SECONDS / phases, "1/s")


def memory(made):
    with served(made) as (program, secure, plain):
        context = made.context("scada")
        for kind, port in (("plain", plain), ("TLS", secure)):
            before = memory_kib(program)
            with contextlib.ExitStack() as stack:
                for _ in range(1024):
                    client = (SecureClient(port, context) if kind == "TLS" else harness.Client(port))
                    stack.enter_context(client)
                    client.ask(255, READ)
                say(f"memory of 1024 {kind} connections", (memory_kib(program) - before) / 1024, "MiB")


@contextlib.contextmanager
def handshaking(made, port, how_many=2):
    """Clients that only make connections, as fast as they are let: not at this line's cost, so at
    the lowest priority."""
    command = ["nice", "-n19", "openssl", "s_time", "-connect", f"127.0.0.1:{port}", "-new", "-time", "3600",
               "-cert", made.path("scada.crt"), "-key", made.path("scada.key")]
    floods = [subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
              for _ in range(how_many)]
    try:
        yield
    finally:
        for one in floods:
            one.kill()
            one.wait()


def flood(made):
    """Phases without and with, in turn, so that what else the machine does is in both."""
    with served(made) as (program, secure, plain), harness.Client(plain) as client:
        latencies(client, 1)
        alone, flooded = [], []
        busy = loop = cpu = done = 0
        for _ in range(2):
            begun = loop_seconds(program)
            alone += latencies(client, SECONDS)
            busy += loop_seconds(program) - begun
            with handshaking(made, secure):
                latencies(client, 1)
                before = loop_seconds(program), cpu_seconds(program), handshakes_done(program)
                flooded += latencies(client, SECONDS)
                loop += loop_seconds(program) - before[0]
                cpu += cpu_seconds(program) - before[1]
                done += handshakes_done(program) - before[2]
        cost = 100 * (1 - len(flooded) / len(alone))
        show("plain client alone", alone, 2)
        show("under a flood of handshakes", flooded, 2)
        say("a flood of handshakes costs the line", cost, "%")
        say("handshakes a second", done / SECONDS / 2, "1/s")
        say("CPU of the loop a handshake", (loop - busy * len(flooded) / len(alone)) / done * 1e6, "us")
        say("CPU beside the loop a handshake", (cpu - loop) / done * 1e6, "us")


@contextlib.contextmanager
def apart(program):
    """The program on one processor, its client on another: a client's own TLS, in Python, neither
    interrupts the program nor empties its caches."""
    allowed = sorted(os.sched_getaffinity(0))
    for task in pathlib.Path(f"/proc/{program.process.pid}/task").iterdir():
        os.sched_setaffinity(int(task.name), allowed[-1:])
    os.sched_setaffinity(0, allowed[:1])
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


def used_by(program, client, transactions_):
    """CPU of a transaction, in us."""
    begun = cpu_seconds(program)
    for _ in range(transactions_):
        client.ask(31, READ)
    return (cpu_seconds(program) - begun) / transactions_ * 1e6


def transactions(made):
    """Many short windows, plain and TLS beside each other, now the one first and now the other: what
    else the machine does meets both, and the median of the differences leaves out its outbreaks."""
    with served(made) as (program, secure, plain):
        used = {"plain": [], "TLS": []}
        with apart(program), SecureClient(secure, made.context("scada")) as safe, \
                harness.Client(plain) as open_one:
            pair = [("plain", open_one), ("TLS", safe)]
            for _, client in pair:
                used_by(program, client, WINDOW)
            for _ in range(max(TRANSACTIONS // WINDOW, 1)):
                for kind, client in pair:
                    used[kind].append(used_by(program, client, WINDOW))
                pair.reverse()
        for kind, found in used.items():
            say(f"CPU a transaction, {kind}, median of {len(found)} windows", statistics.median(found), "us")
        difference = sorted(secured - bare for secured, bare in zip(used["TLS"], used["plain"]))
        say("TLS beside plain, median of the pairs", statistics.median(difference), "us")
        spread = statistics.stdev(difference) / len(difference) ** 0.5 * 1.2533  # of a median
        say("its standard error", spread, "us")
        for kind, client in (("plain", harness.Client(plain)),
                             ("TLS", SecureClient(secure, made.context("scada")))):
            with client:
                show(f"115200 baud, {kind}", latencies(client, SECONDS))


def main():
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    print(f"OpenSSL of the client: {ssl.OPENSSL_VERSION}")
    with plant() as made:
        for one in (memory, flood, transactions):
            if len(sys.argv) < 2 or one.__name__ in sys.argv[1:]:
                one(made)


if __name__ == "__main__":
    main()
