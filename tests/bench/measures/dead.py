"""What silent stations leave to the others, and how long a write waits behind a full queue."""
import math
import subprocess
import tempfile

from measures import figures, latency, rig
from measures.figures import Row

HEALTHY = "healthy stations' share of what the wire allows"
BAUD = 38400
WAITS = "write behind a full queue, transactions"
FULL = "48 reads of 100 registers waiting"


def measure(run):
    """The first silences cost what they cost; what is measured comes after them."""
    for dead in (0, 1, 4) if run.quick else range(5):
        faults = [f"{station}:drop=1" for station in range(9 - dead, 9)]
        with tempfile.TemporaryDirectory() as folder, \
                rig.LoggedLine(run.tools, folder, BAUD, faults) as line:
            for subject in run.gateways + (run.rivals if dead <= 1 else []):
                with subject.serving(line.link, BAUD) as gateway:
                    warm = 1 if dead == 0 else 5 * dead + 1
                    window, _ = rig.saturate(line, gateway.port, gateway.pid, 10,
                                             4 if run.quick else 8, warm=warm)
                rate = 0.0 if math.isnan(window.rate) else window.rate
                yield Row(HEALTHY, f"{dead} of 8 dead, {BAUD}", subject.name,
                          rate / rig.wire.wire_limit(BAUD), "")


def write_times(run, line, gateway, seconds):
    """([microseconds], how many failed) of a client that writes while others keep a queue full."""
    load = [run.tools["mbload"], "--port", str(gateway.port), "--conns", "48", "--units", "1-8",
            "--regs", "100", "--time", str(seconds + 2), "--warm", "0"]
    with subprocess.Popen(load, stdout=subprocess.DEVNULL) as crowd:
        rig.until_replies(line, 4)
        taken = latency.probe(run.tools, "tcp", gateway.port, registers=1, pause=75_000,
                              seconds=seconds, function=6)
        crowd.terminate()
    return taken


def measure_writes(run):
    seconds = 5 if run.quick else 15
    per_second = rig.wire.wire_limit(BAUD, 100)
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, BAUD) as line:
        for subject in run.gateways + run.rivals:
            with subject.serving(line.link, BAUD) as gateway:
                times, failed = write_times(run, line, gateway, seconds)
            for word, share in (("p50", 0.5), ("p99", 0.99)):
                value = figures.quantile(times, share) / 1e6 * per_second
                yield Row(f"{WAITS}, {word}", f"{FULL}, {BAUD}", subject.name, value, "",
                          {"asked": len(times), "failed": failed})
