#!/usr/bin/env python3
"""What a look at everything costs those who are served: 32 lines of 31 stations with 10 points each.

One connection asks /healthz all the time; beside it each status path is asked a few times. What
/healthz waits longer than without anybody is what the loop was held. Give several programs to
compare them.
"""
import argparse
import datetime
import http.client
import os
import pathlib
import platform
import re
import subprocess
import sys
import threading
import time

HERE = pathlib.Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1] / "system"))
import config  # noqa: E402
import harness  # noqa: E402
from clients import percentile  # noqa: E402

LINES, STATIONS, POINTS = 32, 31, 10
PATHS = ["/metrics", "/metrics (gzip)", "/api/v1/stations", "/api/v1/lines",
         "/api/v1/stations/s1-1/points", "/api/v1/lines/line1/trace?last=500"]
FETCH = """
import http.client, sys
for line in sys.stdin:
    path, coding = line.split()
    client = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]))
    client.request("GET", path, headers={"Accept-Encoding": coding})
    answer = client.getresponse()
    body = answer.read()
    print(answer.status, len(body), flush=True)
    client.close()
"""


class Healthz:
    """How long each /healthz of one connection took, in ms."""

    def __init__(self, port):
        self._client = http.client.HTTPConnection("127.0.0.1", port)
        self.took = []
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._ask)
        self._thread.start()

    def _ask(self):
        while not self._ended.wait(0.001):
            start = time.monotonic()
            self._client.request("GET", "/healthz")
            self._client.getresponse().read()
            self.took.append(1000 * (time.monotonic() - start))

    def end(self):
        self._ended.set()
        self._thread.join()
        self._client.close()
        return self.took


class Fetcher:
    """Asks from another process, which does not hold up who measures."""

    def __init__(self, port):
        self._process = subprocess.Popen([sys.executable, "-c", FETCH, str(port)],
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def get(self, path, coding):
        self._process.stdin.write(f"{path} {coding}\n")
        self._process.stdin.flush()
        status, size = map(int, self._process.stdout.readline().split())
        assert status == 200, (path, status)
        return size

    def end(self):
        self._process.communicate()


def cpu_ms(pid):
    """(the loop's thread, all threads)."""
    def used(task):
        return int((task / "schedstat").read_text().split()[0]) / 1e6
    tasks = {task.name: used(task) for task in pathlib.Path(f"/proc/{pid}/task").iterdir()}
    return tasks[str(pid)], sum(tasks.values())


def lag_above(program, bound):
    """How many samples of the loop's lag were above `bound` seconds; None: it does not tell."""
    text = program.get("/metrics")[1]
    buckets = dict(re.findall(r'^panelgate_loop_lag_seconds_bucket\{le="([^"]+)"\} (\d+)$', text,
                              re.MULTILINE))
    return int(buckets["+Inf"]) - int(buckets[bound]) if buckets else None


def rest(program, seconds):
    """(CPU ms a second of the loop, of all threads, [/healthz ms]) while nobody asks for more."""
    healthz = Healthz(program.http_port())
    before, start = cpu_ms(program.process.pid), time.monotonic()
    time.sleep(seconds)
    spent = time.monotonic() - start
    after = cpu_ms(program.process.pid)
    return (after[0] - before[0]) / spent, (after[1] - before[1]) / spent, healthz.end()


def measure(program, fetcher, path, times, idle):
    """(size, seconds a time, loop's CPU ms a time, all CPU ms a time, [/healthz ms]); without the
    CPU of a program at rest."""
    real, _, coding = path.partition(" ")
    coding = coding.strip("()") or "identity"
    healthz = Healthz(program.http_port())
    before, start = cpu_ms(program.process.pid), time.monotonic()
    for _ in range(times):
        size = fetcher.get(real, coding)
    seconds, after = time.monotonic() - start, cpu_ms(program.process.pid)
    took = healthz.end()
    loop = (after[0] - before[0] - idle[0] * seconds) / times
    return size, seconds / times, loop, (after[1] - before[1] - idle[1] * seconds) / times, took


def report(binary, options):
    harness.PANELGATE = str(binary)
    print(f"\n{binary}")
    print(f"{'path':<36}{'bytes':>10}{'ms':>8}{'loop CPU':>10}{'all CPU':>9}"
          f"{'healthz p50':>13}{'p99':>8}{'max':>8}")
    text = config.wide(options.lines, options.stations, options.points, every=options.every)
    with harness.configured(text) as program:
        program.log.wait_for("line up", options.lines)
        fetcher = Fetcher(program.http_port())
        time.sleep(options.warm)
        *idle, took = rest(program, 3)
        print(f"{'(nothing else, a second)':<54}{idle[0]:>10.1f}{idle[1]:>9.1f}"
              f"{percentile(took, .5):>13.2f}{percentile(took, .99):>8.2f}{max(took):>8.2f}")
        for path in PATHS:
            size, seconds, loop, every, took = measure(program, fetcher, path, options.times, idle)
            print(f"{path:<36}{size:>10}{1000 * seconds:>8.1f}{loop:>10.1f}{every:>9.1f}"
                  f"{percentile(took, .5):>13.2f}{percentile(took, .99):>8.2f}{max(took):>8.2f}",
                  flush=True)
        print(f"samples of loop_lag_seconds above 2 ms: {lag_above(program, '0.002')}, "
              f"above 5 ms: {lag_above(program, '0.005')}")
        fetcher.end()


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", nargs="*", default=[harness.PANELGATE])
    parser.add_argument("--lines", type=int, default=LINES)
    parser.add_argument("--stations", type=int, default=STATIONS)
    parser.add_argument("--points", type=int, default=POINTS)
    parser.add_argument("--every", default="10s", help="of the points (%(default)s)")
    parser.add_argument("--times", type=int, default=10, help="each path (%(default)s)")
    parser.add_argument("--warm", type=float, default=12, help="seconds before (%(default)s)")
    options = parser.parse_args()
    print(f"{platform.machine()}, {os.cpu_count()} cores, Linux {platform.release()}, "
          f"{datetime.date.today()}")
    for binary in options.programs:
        report(pathlib.Path(binary).resolve(), options)


if __name__ == "__main__":
    main()
