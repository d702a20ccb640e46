#!/usr/bin/env python3
"""What a fleet costs: many gateways on this machine, each with a line of simulated panels that are
polled, and one Prometheus with the configuration and rules of deploy/prometheus that scrapes all. With
--mqtt each tells its points to one mosquitto besides: a point of each station moves.

The processor's share of a gateway has its simulated panels in it, which on a real box are outside.
"""
import argparse
import contextlib
import datetime
import gzip
import os
import pathlib
import platform
import re
import sys
import time
import urllib.request

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
from prometheus_server import Prometheus  # noqa: E402
from mqtt_side import Broker  # noqa: E402


def kilobytes(pid, key):
    text = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
    return int(re.search(rf"(?m)^{key}:\s+(\d+) kB", text)[1])


def cpu_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def own_metrics(prometheus):
    """What the server tells of itself: {name: value}."""
    url = f"http://127.0.0.1:{prometheus.port}/metrics"
    with urllib.request.urlopen(url, timeout=harness.PATIENCE) as response:
        text = response.read().decode()
    return {name: float(value) for name, value in re.findall(r'(?m)^(\w+)(?:\{type="float"\})? (\S+)$', text)}


def sizes(program):
    """(series, bytes of a scrape, bytes packed)."""
    text = program.get("/metrics")[1]
    series = sum(1 for line in text.splitlines() if not line.startswith("#"))
    return series, len(text), len(gzip.compress(text.encode(), 6))


def observe(programs, prometheus, seconds):
    pids = [program.process.pid for program in programs]
    used = [cpu_seconds(pid) for pid in pids]
    before, start = own_metrics(prometheus), time.monotonic()
    time.sleep(seconds)
    spent = time.monotonic() - start
    after = own_metrics(prometheus)
    shares = [100 * (cpu_seconds(pid) - then) / spent for pid, then in zip(pids, used)]
    both = {name: (after[name] - before[name]) / spent
            for name in after.keys() & before.keys()}
    count = len(programs)
    return {
        "resident memory of a gateway, kB": sum(kilobytes(p, "Rss") for p in pids) / count,
        "its share of it (Pss), kB": sum(kilobytes(p, "Pss") for p in pids) / count,
        "processor of a gateway with its panels, % of a core": sum(shares) / count,
        "series in Prometheus": after["prometheus_tsdb_head_series"],
        "samples a second": both["prometheus_tsdb_head_samples_appended_total"],
        "memory of Prometheus, MB": after["process_resident_memory_bytes"] / 1e6,
        "processor of Prometheus, % of a core": 100 * both["process_cpu_seconds_total"],
    }


def told(programs):
    """Messages to the broker so far, of all."""
    name = "panelgate_mqtt_published_total"
    texts = [program.get("/metrics")[1] for program in programs]
    return sum(float(re.search(rf"(?m)^{name} (\S+)$", text)[1]) for text in texts)


def observe_broker(programs, broker, seconds):
    pid = broker.process.pid
    used, before, start = cpu_seconds(pid), told(programs), time.monotonic()
    time.sleep(seconds)
    messages, spent = told(programs) - before, time.monotonic() - start
    return {
        "messages a second of a gateway": messages / spent / len(programs),
        "messages a second at the broker": messages / spent,
        "memory of the broker, MB": kilobytes(pid, "Rss") / 1e3,
        "processor of the broker, % of a core": 100 * (cpu_seconds(pid) - used) / spent,
    }


def configuration(stations, points, broker, number):
    text = config.wide(1, stations, points, every="1s")
    # What a panel of this profile moves by itself (its simulation).
    text = text.replace("at: UW100,", "at: UW201,")
    if broker is None:
        return text
    return text + (f'mqtt: {{broker: "mqtt://127.0.0.1:{broker.port}", topic: plant/{number}, '
                   f'client_id: box{number}}}\n')


def measure(gateways, stations, points, seconds, mqtt):
    """Rows of a table: what, and how much."""
    with contextlib.ExitStack() as stack:
        broker = stack.enter_context(Broker()) if mqtt else None
        texts = [configuration(stations, points, broker, n) for n in range(gateways)]
        programs = [stack.enter_context(harness.configured(text)) for text in texts]
        targets = [f"127.0.0.1:{program.http_port()}" for program in programs]
        prometheus = stack.enter_context(Prometheus(targets, quick=False))
        prometheus.until(lambda: prometheus.query(f"sum(up) == {gateways}"))
        series, plain, packed = sizes(programs[0])
        down = len(prometheus.query("up == 0"))
        rows = {"series of a gateway": series, "bytes of a scrape": plain, "packed": packed}
        rows |= observe(programs, prometheus, seconds)
        if broker:
            rows |= observe_broker(programs, broker, seconds)
        return {**rows, "scrapes that failed": down}


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--gateways", type=int, default=200, help="(%(default)s)")
    parser.add_argument("--stations", type=int, default=5, help="of each (%(default)s)")
    parser.add_argument("--points", type=int, default=4, help="of each station (%(default)s)")
    parser.add_argument("--seconds", type=float, default=60, help="looked at (%(default)s)")
    parser.add_argument("--mqtt", action="store_true", help="and a broker")
    options = parser.parse_args()
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}: {options.gateways} gateways, {options.stations} stations with "
          f"{options.points} points each, polled every second")
    for what, value in measure(options.gateways, options.stations, options.points,
                               options.seconds, options.mqtt).items():
        print(f"{what:<55}{value:>12,.2f}", flush=True)


if __name__ == "__main__":
    main()
