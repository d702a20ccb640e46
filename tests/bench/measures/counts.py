"""What a transaction takes that does not depend on the machine's mood: instructions and allocations.
The same load twice, once longer: start and end are in both, and the difference is the transactions'."""
import pathlib
import re
import shutil
import subprocess
import tempfile

from measures import rig
from measures.figures import Bar, Row
from measures.saturated import case_of

SOURCE = pathlib.Path(__file__).resolve().parent / "count_allocations.c"
INSTRUCTIONS = "instructions a transaction"
ALLOCATIONS = "allocations a transaction"
CALLGRIND = ["--tool=callgrind", "--callgrind-out-file=/dev/null"]
# What timers and statistics take now and then is no transaction's.
BARS = [Bar(ALLOCATIONS, {case_of(baud, registers) for baud in (0, 115200) for registers in (10, 100)},
            most=0.01)]


def ask(tools, port, registers, count):
    """That many reads of eight clients, all answered."""
    subprocess.run([tools["mbload"], "--port", str(port), "--conns", "8", "--units", "1-8",
                    "--regs", str(registers), "--warm", "0", "--time", "300", "--count", str(count)],
                   stdout=subprocess.DEVNULL, check=True)


def instructions(tools, subject, line, registers, count):
    """All that the program executed, valgrind says."""
    with subject.but(wrapper=("/usr/bin/valgrind", CALLGRIND)).serving(line.link, line.baud) as gateway:
        ask(tools, gateway.port, registers, count)
    return int(re.search(r"Collected : (\d+)", gateway.log.finished_text()).group(1))


def allocations(tools, subject, line, registers, count):
    told = pathlib.Path(f"{line.link}.allocations")
    environment = {"LD_PRELOAD": tools["count_allocations"], "ALLOCATIONS": str(told)}
    with subject.but(environment=environment).serving(line.link, line.baud) as gateway:
        ask(tools, gateway.port, registers, count)
    return int(told.read_text())


def per_transaction(count_all, few, many):
    return (count_all(many) - count_all(few)) / (many - few)


def rows(run, measure, count_all, baud, few, many):
    gateways = run.gateways if baud else rig.without_gap(run)
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, baud) as line:
        for registers in (10, 100):
            for subject in gateways:
                value = per_transaction(
                    lambda count, who=subject, regs=registers:
                    count_all(run.tools, who, line, regs, count), few, many)
                yield Row(measure, case_of(baud, registers), subject.name, value, "")


def measure_instructions(run):
    if not shutil.which("valgrind"):
        run.left_out.append("instructions (valgrind is needed)")
        return
    yield from rows(run, INSTRUCTIONS, instructions, 0, 500, 1500 if run.quick else 4500)
    if not run.quick:
        # A slow line, so that the simulated processor keeps up and wakes as often as a real one.
        yield from rows(run, INSTRUCTIONS, instructions, 9600, 20, 80)


def measure_allocations(run):
    with tempfile.TemporaryDirectory() as folder:
        built = f"{folder}/count_allocations.so"
        done = subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", built, SOURCE], check=False)
        if done.returncode != 0:
            run.left_out.append("allocations (gcc is needed)")
            return
        run.tools["count_allocations"] = built
        yield from rows(run, ALLOCATIONS, allocations, 0, 2000, 4000 if run.quick else 12000)
        yield from rows(run, ALLOCATIONS, allocations, 115200, 100, 300 if run.quick else 900)
