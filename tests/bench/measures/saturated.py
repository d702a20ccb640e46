"""Eight clients that always want something: the share of the ideal master, CPU a transaction, and how
late the gap is left. One load gives all three."""
import contextlib
import subprocess
import sys
import tempfile

from measures import figures, rig
from measures.figures import Bar, Row

SHARE = "share of the ideal master"
BUSY = "share of the ideal master, both cores busy"
LIMIT = "share of what the wire allows"
RATE = "transactions a second, unpaced"
CPU = "CPU us a transaction"
LATE_P50, LATE_P99 = "gap late us, p50", "gap late us, p99"
OF_BRIDGE = "share of the libmodbus bridge's rate"
OVER_P50, OVER_P99 = (
    f"gap late us more than the ideal master, {word}" for word in ("p50", "p99"))
BESIDE = "115200, 10 registers, beside scrapes"

RATES = (9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600)
QUICK_RATES = (38400, 115200, 921600)
RIVAL_RATES = (9600, 38400, 115200)
REGISTERS = (10, 100)


def case_of(baud, registers):
    return f"{baud or 'unpaced'}, {registers} registers"


def cases(rates=RATES, registers=REGISTERS):
    return {case_of(baud, count) for baud in rates for count in registers}


BARS = [
    Bar(SHARE, cases(), least=0.995),
    Bar(BUSY, cases(), least=0.98),
    Bar(CPU, {case_of(9600, 10)}, most=120),
    Bar(CPU, {case_of(38400, 10)}, most=110),
    Bar(CPU, {case_of(115200, 10)}, most=100),
    Bar(CPU, cases((9600, 38400, 115200), (100,)), most=160),
    Bar(CPU, {case_of(0, 10), "unpaced tcp://, 10 registers"}, most=25),
    Bar(OF_BRIDGE, {case_of(0, 10)}, least=1.0),
    Bar(LATE_P50, {case_of(115200, 10)}, most=40),
    Bar(LATE_P99, {case_of(115200, 10)}, most=150),
]


def errors_of(seen, window):
    """What a good gateway has none of."""
    return {"exceptions": seen["all"]["exc"], "timeouts": seen["all"]["timeouts"],
            "wrong": sum(seen["mismatch"].values()), "closed": seen["closed_by_peer"],
            "gap_violations": window.violations}


def rows_of(subject, baud, registers, window, seen, ideal, share):
    case, name = case_of(baud, registers), subject.name
    errors = {what: n for what, n in errors_of(seen, window).items() if n}
    yield Row(share, case, name, window.rate / ideal.rate, "", {"errors": errors} if errors else None)
    yield Row(CPU, case, name, window.cpu_us(), "us", {"transactions": window.replies})
    if baud:
        late, best = window.lateness(baud), ideal.lateness(baud)
        for absolute, over, q in ((LATE_P50, OVER_P50, 0.5), (LATE_P99, OVER_P99, 0.99)):
            own = 1e6 * figures.quantile(late, q)
            yield Row(absolute, case, name, own, "us", {"gaps": len(late)})
            yield Row(over, case, name, own - 1e6 * figures.quantile(best, q), "us")
        yield Row(LIMIT, case, name, window.rate / rig.wire.wire_limit(baud, registers), "")
    else:
        yield Row(RATE, case, name, window.rate, "/s")


def ideal_rows(baud, registers, ideal):
    case = case_of(baud, registers)
    if not baud:
        yield Row(RATE, case, "ideal master", ideal.rate, "/s")
        return
    late = ideal.lateness(baud)
    yield Row(LIMIT, case, "ideal master", ideal.rate / rig.wire.wire_limit(baud, registers), "")
    yield Row(LATE_P50, case, "ideal master", 1e6 * figures.quantile(late, 0.5), "us")
    yield Row(LATE_P99, case, "ideal master", 1e6 * figures.quantile(late, 0.99), "us")


def measure_case(tools, subjects, baud, registers, *, turns, seconds, share=SHARE):
    """Rows of one line; the ideal master and all subjects take turns on it."""
    seconds = max(seconds, 12 / rig.wire.wire_limit(baud, registers)) if baud else seconds
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(tools, folder, baud) as line:
        for _ in range(turns):
            ideal = rig.bare(line, baud, registers, seconds)
            if share == SHARE:
                yield from ideal_rows(baud, registers, ideal)
            for subject in subjects:
                with subject.serving(line.link, baud) as gateway:
                    window, seen = rig.saturate(line, gateway.port, gateway.pid, registers, seconds)
                rows = rows_of(subject, baud, registers, window, seen, ideal, share)
                yield from (row for row in rows if share == SHARE or row.measure == share)


def rates(run):
    return [baud for baud in run.rates if baud in QUICK_RATES or not run.quick]


def measure(run):
    """Paced lines and the unpaced one; rivals at some rates, one turn each."""
    turns, seconds = (1, 2) if run.quick else (2, 4)
    for baud in rates(run):
        for registers in REGISTERS:
            rivals = run.rivals if baud in RIVAL_RATES and registers == 10 else []
            yield from measure_case(run.tools, run.gateways + rivals, baud, registers,
                                    turns=turns, seconds=seconds)


def of_bridge(rows, case):
    """Turn by turn, the rates of all others as a share of the bridge's."""
    rates = {}
    for row in rows:
        if row.measure == RATE:
            rates.setdefault(row.subject, []).append(row.value)
    for name, own in rates.items():
        for rate, bridge in zip(own, rates.get("libmodbus bridge", [])):
            yield Row(OF_BRIDGE, case, name, rate / bridge, "")


def measure_unpaced(run):
    turns, seconds = (1, 2) if run.quick else (3, 3)
    gateways = rig.without_gap(run)
    for registers in REGISTERS:
        rows = []
        for row in measure_case(run.tools, gateways + run.rivals, 0, registers,
                                turns=turns, seconds=seconds):
            rows.append(row)
            yield row
        yield from of_bridge(rows, case_of(0, registers))


def over_tcp(registers):
    return f"unpaced tcp://, {registers} registers"


def measure_tcp(run):
    """The line on which `frame_gap: 0us` is allowed."""
    turns, seconds = (1, 2) if run.quick else (3, 3)
    gateways = rig.without_gap(run, "tcp://127.0.0.1:4001")
    for registers in REGISTERS:
        with rig.TcpLine(run.tools) as line:
            for subject in gateways * turns:
                with subject.serving(line.link, 0) as gateway:
                    window, seen = rig.saturate(line, gateway.port, gateway.pid, registers, seconds)
                errors = {what: n for what, n in errors_of(seen, window).items() if n}
                detail = {"errors": errors} if errors else None
                yield Row(RATE, over_tcp(registers), subject.name, window.rate, "/s", detail)
                yield Row(CPU, over_tcp(registers), subject.name, window.cpu_us(), "us", detail)


def measure_busy(run):
    turns, seconds = (1, 2) if run.quick else (2, 4)
    with rig.busy_cores():
        for baud in rates(run):
            for registers in REGISTERS:
                yield from measure_case(run.tools, run.gateways, baud, registers,
                                        turns=turns, seconds=seconds, share=BUSY)


SCRAPE = """
import http.client, sys, time
paths = ["/metrics", "/api/v1/stations", "/api/v1/lines/wire/trace?last=200"]
turn = 0
while True:
    client = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]))
    client.request("GET", paths[turn % len(paths)])
    client.getresponse().read()
    client.close()
    turn += 1
    time.sleep(0.02)
"""


@contextlib.contextmanager
def scraped(port):
    """Somebody looks at everything, some thirty times a second."""
    with subprocess.Popen([sys.executable, "-c", SCRAPE, str(port)],
                          stderr=subprocess.DEVNULL) as scraper:
        try:
            yield
        finally:
            scraper.terminate()


def measure_beside(run):
    """The gap beside REST and scrapes, and without, in turns on one line."""
    turns, seconds = (1, 3) if run.quick else (3, 8)
    baud, registers = 115200, 10
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, baud) as line:
        for _ in range(turns):
            for subject in run.gateways:
                with subject.but(http=rig.config.FREE_PORT).serving(line.link, baud) as gateway, \
                        scraped(gateway.http_port()):
                    window, _ = rig.saturate(line, gateway.port, gateway.pid, registers, seconds)
                late = window.lateness(baud)
                for name, share in ((LATE_P50, 0.5), (LATE_P99, 0.99)):
                    yield Row(name, BESIDE, subject.name, 1e6 * figures.quantile(late, share), "us")
