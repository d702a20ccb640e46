"""Memory, start time and size."""
import contextlib
import os
import pathlib
import re
import subprocess
import tempfile
import time

from measures import rig
from measures.figures import Bar, Row

PSS, PEAK = "memory MiB (Pss)", "memory MiB, at most (VmHWM)"
START, SIZE = "start ms, until it listens", "size MiB"
BAUD = 115200


def case_of(lines, connections):
    return f"{lines} lines, {connections} connections"


FULL = case_of(32, 1000)
BARS = [Bar(PSS, {FULL}, most=32), Bar(PEAK, {FULL}, most=32)]


def mebibytes(pid, file, field):
    text = pathlib.Path(f"/proc/{pid}/{file}").read_text()
    return int(re.search(rf"^{field}:\s+(\d+) kB$", text, re.M).group(1)) / 1024


def under_load(tools, gateway, units, connections, seconds):
    """(Pss, VmHWM) while that many connections ask, all of them at once."""
    command = [tools["mbload"], "--port", str(gateway.port), "--conns", str(connections),
               "--units", units, "--time", str(seconds), "--warm", "0"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as load:
        time.sleep(seconds - 0.5)
        assert len(os.listdir(f"/proc/{gateway.pid}/fd")) > connections, "not all are connected"
        seen = (mebibytes(gateway.pid, "smaps_rollup", "Pss"), mebibytes(gateway.pid, "status", "VmHWM"))
        load.terminate()
    return seen


def rows_of(case, name, seen):
    for measure, value in zip((PSS, PEAK), seen):
        yield Row(measure, case, name, value, "MiB")


def measure(run):
    seconds = 3 if run.quick else 6
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, BAUD) as line:
        for subject in run.gateways + run.rivals:
            for connections in (1, 64):
                with subject.serving(line.link, BAUD) as gateway:
                    seen = under_load(run.tools, gateway, "1-8", connections, seconds)
                yield from rows_of(case_of(1, connections), subject.name, seen)
    for subject in run.gateways:
        for lines, connections in ((1, 1000), (32, 1), (32, 1000)):
            with tempfile.TemporaryDirectory() as folder, \
                    rig.Plant(run.tools, folder, BAUD, lines) as plant, \
                    subject.running(plant.configuration()) as gateway:
                gateway.log.wait_for("line up", lines)
                seen = under_load(run.tools, gateway, f"1-{lines}", connections, seconds)
            yield from rows_of(case_of(lines, connections), subject.name, seen)


@contextlib.contextmanager
def started(subject, text):
    """Yields the milliseconds from its start until the last listener is open."""
    begin = time.monotonic()
    with subject.running(text) as program:
        program.http_port()
        yield 1000 * (time.monotonic() - begin)


def measure_start(run):
    small = rig.config.gateway(rig.config.line())
    large = rig.config.wide(32, 31, 10)
    for subject in run.gateways:
        yield Row(SIZE, "the program", subject.name, os.stat(subject.program).st_size / 2**20, "MiB")
        for case, text in (("one line", small), ("32 lines of 31 stations of 10 points", large)):
            for _ in range(3 if run.quick else 7):
                with started(subject, text) as milliseconds:
                    yield Row(START, case, subject.name, milliseconds, "ms")
