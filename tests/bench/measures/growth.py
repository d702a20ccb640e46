"""What costs more when there is more of it, and how much more: the exponent k of cost ~ size^k."""
import tempfile

import metrics
from measures import figures, lines, memory, rig
from measures.figures import Row

EXPONENT = "growth: exponent"
BAUD = 115200


def fitted(costs, what):
    """`costs`: {subject: {size: cost}}."""
    for name, own in costs.items():
        yield Row(EXPONENT, what, name, figures.growth(list(own), list(own.values())), "", {"costs": own})


def with_clients(run, seconds):
    costs = {}
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, BAUD) as line:
        for clients in (1, 8, 64, 200):
            for subject in run.gateways:
                with subject.serving(line.link, BAUD) as gateway:
                    window, _ = rig.saturate(line, gateway.port, gateway.pid, 10, seconds,
                                             clients=clients, warm=4)
                costs.setdefault(subject.name, {})[clients] = window.cpu_us()
    yield from fitted(costs, "CPU a transaction with clients, 1 to 200")


def with_stations(run, seconds):
    costs = {}
    for stations in (1, 8, 31, 200):
        units = f"1-{stations}"
        with tempfile.TemporaryDirectory() as folder, \
                rig.LoggedLine(run.tools, folder, BAUD, stations=units) as line:
            for subject in run.gateways:
                with subject.serving(line.link, BAUD, range(1, stations + 1)) as gateway:
                    window, _ = rig.saturate(line, gateway.port, gateway.pid, 10, seconds,
                                             clients=200, warm=3, units=units)
                costs.setdefault(subject.name, {})[stations] = window.cpu_us()
    yield from fitted(costs, "CPU a transaction with stations, 1 to 200")


def with_lines(run, seconds):
    costs, sizes = {}, {}
    for count in (1, 4, 16, 32):
        for row in lines.measure_plant(run, count, seconds):
            if row.measure == lines.CPU:
                costs.setdefault(row.subject, {})[count] = row.value
        with tempfile.TemporaryDirectory() as folder, \
                rig.Plant(run.tools, folder, BAUD, count) as plant:
            for subject in run.gateways:
                with subject.running(plant.configuration()) as gateway:
                    gateway.log.wait_for("line up", count)
                    pss = memory.mebibytes(gateway.pid, "smaps_rollup", "Pss")
                sizes.setdefault(subject.name, {})[count] = pss
    yield from fitted(costs, "CPU a transaction with lines, 1 to 32")
    yield from fitted(sizes, "memory with lines, 1 to 32")


def with_points(run):
    scrapes, starts = {}, {}
    for stations in (4, 8, 16, 31):
        points = 4 * stations * 80
        text = rig.config.wide(4, stations, 80)
        for subject in run.gateways:
            with memory.started(subject, text) as milliseconds:
                starts.setdefault(subject.name, {})[points] = milliseconds
            with subject.running(text) as program:
                fetcher = metrics.Fetcher(program.http_port())
                fetcher.get("/metrics", "identity")
                _, _, _, cpu, _ = metrics.measure(program, fetcher, "/metrics", 10, (0, 0))
                fetcher.end()
            scrapes.setdefault(subject.name, {})[points] = cpu
    yield from fitted(scrapes, "CPU of a scrape with points, 1280 to 9920")
    yield from fitted(starts, "start time with points, 1280 to 9920")


def measure(run):
    seconds = 2 if run.quick else 4
    yield from with_clients(run, seconds)
    yield from with_stations(run, seconds)
    yield from with_lines(run, seconds)
    yield from with_points(run)
