"""What a gateway adds to the time that one client waits, over the same client alone on the line."""
import math
import subprocess
import tempfile

from measures import figures, rig
from measures.figures import Bar, Row
from measures.saturated import case_of

QUANTILES = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}
ADDED = {name: f"added latency ms, {name}" for name in QUANTILES}
BARS = [Bar(ADDED["p50"], {case_of(115200, 10)}, most=0.15)]
PAUSE_US = 2500  # longer than the gap above 19200 baud


def pause_us(baud):
    return max(PAUSE_US, round(1e6 * figures.standard_gap(baud)) + 500) if baud else 200


def probe(tools, way, where, *, registers, pause, seconds, unit=1, function=3):
    """([microseconds], how many failed) of one client with one request open."""
    done = subprocess.run([tools["probe"], way, str(where), str(unit), str(function), str(registers),
                           str(pause), str(seconds)], capture_output=True, text=True, check=True)
    lines = done.stdout.split()
    good = [float(line) for line in lines if line != "fail"]
    return good, len(lines) - len(good)


def rows_of(case, name, taken, alone):
    """`taken`: (times, failed) of a gateway; `alone`: the times without one."""
    times, failed = taken
    for word, share in QUANTILES.items():
        added = (figures.quantile(times, share) - figures.quantile(alone, share)) / 1000
        yield Row(ADDED[word], case, name, added if times else math.nan, "ms",
                  {"asked": len(times), "failed": failed})


def measure_case(run, subjects, baud, *, turns, seconds, registers=10):
    """The samples of all turns are one: p99.9 wants many."""
    alone, taken = [], {subject.name: ([], 0) for subject in subjects}
    how = {"registers": registers, "pause": pause_us(baud), "seconds": seconds}
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, baud) as line:
        for _ in range(turns):
            alone += probe(run.tools, "rtu", line.link, **how)[0]
            for subject in subjects:
                with subject.serving(line.link, baud) as gateway:
                    probe(run.tools, "tcp", gateway.port, **{**how, "seconds": 0.3})
                    times, failed = probe(run.tools, "tcp", gateway.port, **how)
                before = taken[subject.name]
                taken[subject.name] = (before[0] + times, before[1] + failed)
    for subject in subjects:
        yield from rows_of(case_of(baud, registers), subject.name, taken[subject.name], alone)


def measure(run):
    turns, seconds = (2, 2) if run.quick else (3, 5)
    for baud in (115200,) if run.quick else (9600, 38400, 115200, 921600):
        rivals = run.rivals if baud == 115200 else []
        yield from measure_case(run, run.gateways + rivals, baud, turns=turns, seconds=seconds)
    yield from measure_case(run, rig.without_gap(run) + run.rivals, 0, turns=turns,
                            seconds=min(seconds, 3))
