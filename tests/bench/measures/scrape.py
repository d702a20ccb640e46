"""How long a look at everything holds the loop: 32 lines of 31 stations of 10 points. A client asks for
a register of the gateway itself, which needs no bus; what it waits longer is what it was held."""
import subprocess

import metrics
from measures import figures, rig
from measures.figures import Bar, Row

HOLD = "longest hold of the loop beside scrapes, ms"
WAIT = "answer of the gateway itself, ms"
COST = "a scrape, CPU ms"
CASE = "32 lines of 31 stations of 10 points"
BARS = [Bar(HOLD, {CASE}, most=2)]
OWN_UNIT = 255


def asking(tools, port, seconds):
    return subprocess.Popen([tools["probe"], "tcp", str(port), str(OWN_UNIT), "3", "1", "100",
                             str(seconds)], stdout=subprocess.PIPE, text=True)


def waits(client):
    """What a client that has ended waited, in ms."""
    lines = client.communicate()[0].split()
    assert "fail" not in lines
    return [float(line) / 1000 for line in lines]


def scrape_until_end(fetcher, client):
    """How often."""
    count = 0
    while client.poll() is None:
        fetcher.get("/metrics", "gzip")
        count += 1
    return count


def measure(run):
    text = rig.config.wide(32, 31, 10) + \
        f"modbus_tcp: [{{{rig.config.FREE_PORT}, lines: [line1]}}]\n"
    seconds = 3 if run.quick else 6
    for _ in range(1 if run.quick else 3):
        for subject in run.gateways:
            with subject.running(text) as program:
                program.log.wait_for("line up", 32)
                *idle, _ = metrics.rest(program, 2)
                alone = waits(asking(run.tools, program.port, seconds))
                fetcher = metrics.Fetcher(program.http_port())
                fetcher.get("/metrics", "gzip")
                before = rig.cpu_seconds(program.pid)
                client = asking(run.tools, program.port, seconds)
                scrapes = scrape_until_end(fetcher, client)
                cpu = 1000 * (rig.cpu_seconds(program.pid) - before) - idle[1] * seconds
                beside = waits(client)
                fetcher.end()
            yield Row(HOLD, CASE, subject.name, max(beside) - figures.quantile(alone, 0.5), "ms",
                      {"asked": len(beside), "scrapes": scrapes})
            for when, took in (("nobody scrapes", alone), ("beside scrapes", beside)):
                for word, share in (("p50", 0.5), ("p99", 0.99), ("longest", 1)):
                    yield Row(f"{WAIT}, {word}", when, subject.name, figures.quantile(took, share), "ms")
            yield Row(COST, CASE, subject.name, cpu / scrapes, "ms")
