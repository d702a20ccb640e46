"""Requests that cost most, asked without a pause by one address and by a hundred, beside a line at 115200
that is kept busy: what they take of its rate, and how late its answers come. In turns with the line alone."""
import contextlib
import os
import subprocess
import sys
import tempfile

from measures import rig
from measures.figures import Bar, Row

BAUD = 115200
SHARE = "line's rate beside costly requests"
LATER = "p99 of Modbus/TCP beside costly requests, ms later"
STATION = "{id: 1, name: panel, points: [{name: level, at: 400001, type: u16}], max_age: 10s}"
PLANT = 31, 31, 10  # lines, stations, points beside the busy line, without a device
BATCH = ",".join(['{"station": "panel", "point": "level"}'] * 256)

# name: method, path, headers, body
KINDS = {
    "points": ("GET", "/api/v1/points", "", ""),
    "points, gzip": ("GET", "/api/v1/points", "Accept-Encoding: gzip", ""),
    "points, csv": ("GET", "/api/v1/points", "Accept: text/csv", ""),
    "points not changed": ("GET", "/api/v1/points", "If-None-Match: *", ""),
    "points of a station": ("GET", "/api/v1/stations/s1-1/points?raw=true", "", ""),
    "stations": ("GET", "/api/v1/stations", "", ""),
    "stations not changed": ("GET", "/api/v1/stations", "If-None-Match: *", ""),
    "station": ("GET", "/api/v1/stations/panel", "", ""),
    "lines": ("GET", "/api/v1/lines", "", ""),
    "line": ("GET", "/api/v1/lines/wire", "", ""),
    "trace": ("GET", "/api/v1/lines/wire/trace?last=500", "", ""),
    "trace, gzip": ("GET", "/api/v1/lines/wire/trace?last=500", "Accept-Encoding: gzip", ""),
    "capture": ("GET", "/api/v1/lines/wire/trace.pcapng", "", ""),
    "history of a line": ("GET", "/api/v1/lines/wire/history", "", ""),
    "history of a point": ("GET", "/api/v1/stations/panel/points/level/history", "", ""),
    "metrics": ("GET", "/metrics", "", ""),
    "metrics, gzip": ("GET", "/metrics", "Accept-Encoding: gzip", ""),
    "configuration": ("GET", "/api/v1/configuration", "", ""),
    "document": ("GET", "/openapi.json", "", ""),
    "manual": ("GET", "/docs/rest.html", "", ""),
    "probe": ("GET", "/readyz", "", ""),
    "list of reads": ("POST", "/api/v1/read", "Content-Type: application/json", f'{{"read": [{BATCH}]}}'),
    "refused write": ("PUT", "/api/v1/stations/panel/holding-registers/70000", "Content-Type: application/json",
                      '{"values": [1]}'),
}
ALL = {f"{kind}, {n}" for kind in KINDS for n in (1, 100)}
ONE_CORE = ", one core"
BARS = [bar for where in ("", ONE_CORE) for bar in (Bar(SHARE + where, ALL, least=0.98), Bar(LATER + where, ALL, most=2))]

# Asks for the same over and over by so many addresses; stands for machines of others, so it gives way.
HAMMER = """
import os, selectors, socket, sys
port, addresses, seconds, text = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]), sys.argv[4].encode()
import time
os.nice(19)
selector = selectors.DefaultSelector()
class Client:
    def __init__(self, n):
        self.socket = socket.create_connection(("127.0.0.1", port), source_address=("127.0.1.%d" % (1 + n), 0))
        self.left, self.head = 0, b""
        selector.register(self.socket, selectors.EVENT_READ, self)
        self.socket.sendall(text)
    def read(self):
        got = self.socket.recv(1 << 20)
        if not got:
            sys.exit("closed")
        if self.left == 0:
            self.head += got
            head, found, rest = self.head.partition(b"\\r\\n\\r\\n")
            if not found:
                return 0
            length = [l for l in head.split(b"\\r\\n") if l.lower().startswith(b"content-length:")]
            self.left = (int(length[0].split(b":")[1]) if length and b" 304 " not in head[:20] else 0) - len(rest)
            self.head = b""
        else:
            self.left -= len(got)
        if self.left > 0:
            return 0
        self.left = 0
        self.socket.sendall(text)
        return 1
for n in range(addresses):
    Client(n)
print("all ask", flush=True)
end, count = time.monotonic() + seconds, 0
while time.monotonic() < end:
    for key, _ in selector.select(0.1):
        count += key.data.read()
print(count / seconds)
"""


@contextlib.contextmanager
def asked(port, kind, addresses, seconds):
    method, path, header, body = KINDS[kind]
    text = f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Length: {len(body)}\r\n" + \
        (header + "\r\n" if header else "") + f"\r\n{body}"
    command = [sys.executable, "-c", HAMMER, str(port), str(addresses), str(seconds), text]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as hammer:
        try:
            assert hammer.stdout.readline() == "all ask\n", kind
            yield
        finally:
            hammer.terminate()


def turns_of(run, subject, line, gateway, where):
    seconds = 2 if run.quick else 5
    for kind in KINDS:
        for addresses in (1, 100):
            alone, before = rig.saturate(line, gateway.port, gateway.pid, 10, seconds, warm=0.5)
            with asked(gateway.http_port(), kind, addresses, seconds + 2):
                window, seen = rig.saturate(line, gateway.port, gateway.pid, 10, seconds, warm=0.5)
            later = seen["all"]["lat_ms"]["p99"] - before["all"]["lat_ms"]["p99"]
            case = f"{kind}, {addresses}"
            yield Row(SHARE + where, case, subject.name, window.rate / alone.rate, "")
            yield Row(LATER + where, case, subject.name, later, "ms")


def measure(run):
    """On all cores, then with the gateway on one."""
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, BAUD) as line:
        for subject in run.gateways:
            others = rig.config.station_ids(range(2, 9))
            busy = rig.config.line("wire", line.link, f"{STATION}, {others}", baud=BAUD, parity="even")
            text = rig.config.gateway(busy, *rig.config.wide_lines(*PLANT, device="/dev/panelgate-nowhere-{}"),
                                      modbus=f"{rig.config.FREE_PORT}, lines: [wire]")
            with subject.running(text) as gateway:
                gateway.log.wait_for("line up")
                yield from turns_of(run, subject, line, gateway, "")
                for thread in os.listdir(f"/proc/{gateway.pid}/task"):
                    os.sched_setaffinity(int(thread), {0})
                yield from turns_of(run, subject, line, gateway, ONE_CORE)
