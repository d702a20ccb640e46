"""Many lines in one process that may use one core: whether each is as fast as when it is alone."""
import contextlib
import os
import subprocess
import tempfile
import time

from measures import rig
from measures.figures import Bar, Row

SLOWEST = "slowest of the lines as a share of alone, one core"
CPU = "CPU us a transaction, many lines, one core"
BAUD = 115200


def case_of(lines):
    return f"{lines} lines at {BAUD}, all saturated"


BARS = [Bar(SLOWEST, {case_of(32)}, least=0.97)]


@contextlib.contextmanager
def on_core(core):
    """What is started in the block may use this core only."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {core})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


@contextlib.contextmanager
def loaded(tools, port, lines, seconds):
    """Four clients a line, on these lines (numbers)."""
    units = ",".join(map(str, lines))
    command = [tools["mbload"], "--port", str(port), "--conns", str(4 * len(lines)), "--units", units,
               "--time", str(seconds + 2), "--warm", "0"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as load:
        time.sleep(1)  # warm
        try:
            yield
        finally:
            load.terminate()


@contextlib.contextmanager
def ideal_masters(plant, lines, seconds, core):
    """One alone on each of these lines, all on that core; they ask station 1."""
    with contextlib.ExitStack() as stack:
        with on_core(core):
            masters = [stack.enter_context(subprocess.Popen(
                [plant.tools["bare"], plant.links[n - 1], str(plant.baud), "1", "10", str(seconds + 2)],
                stdout=subprocess.DEVNULL)) for n in lines]
        time.sleep(1)  # warm
        try:
            yield
        finally:
            for master in masters:
                master.terminate()


def rates(plant, lines, seconds):
    """Transactions a second of each of these lines (numbers)."""
    before, begin = plant.replies(), time.monotonic()
    time.sleep(seconds)
    after, end = plant.replies(), time.monotonic()
    return [(after[n - 1] - before[n - 1]) / (end - begin) for n in lines]


def measure_plant(run, count, seconds):
    """The gateway has the first core, the bus and the load have the last one."""
    cores = sorted(os.sched_getaffinity(0))
    everybody = list(range(1, count + 1))
    for subject in run.gateways:
        pinned = subject.but(core=cores[0])
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
            with on_core(cores[-1]):
                plant = stack.enter_context(rig.Plant(run.tools, folder, BAUD, count))
            gateway = stack.enter_context(pinned.running(plant.configuration()))
            gateway.log.wait_for("line up", count)
            with on_core(cores[-1]):
                with loaded(run.tools, gateway.port, [1], seconds):
                    alone = rates(plant, [1], seconds)[0]
                with loaded(run.tools, gateway.port, everybody, seconds):
                    cpu = rig.cpu_seconds(gateway.pid)
                    together = rates(plant, everybody, seconds)
                    cpu = rig.cpu_seconds(gateway.pid) - cpu
        yield Row(SLOWEST, case_of(count), subject.name, min(together) / alone, "",
                  {"alone": alone, "mean_together": sum(together) / count})
        yield Row(CPU, case_of(count), subject.name, 1e6 * cpu / (sum(together) * seconds), "us")


def measure_ideal(run, count, seconds):
    """What the bus itself loses when all of its lines are busy."""
    cores = sorted(os.sched_getaffinity(0))
    everybody = list(range(1, count + 1))
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        with on_core(cores[-1]):
            plant = stack.enter_context(rig.Plant(run.tools, folder, BAUD, count))
        with ideal_masters(plant, [1], seconds, cores[0]):
            alone = rates(plant, [1], seconds)[0]
        with ideal_masters(plant, everybody, seconds, cores[0]):
            together = rates(plant, everybody, seconds)
    yield Row(SLOWEST, case_of(count), "ideal masters", min(together) / alone, "")


def measure(run):
    for _ in range(1 if run.quick else 3):
        yield from measure_ideal(run, 32, 3 if run.quick else 4)
        yield from measure_plant(run, 32, 3 if run.quick else 4)
