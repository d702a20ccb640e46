"""A thousand cached reads a second and fifty event clients beside a line at 115200 that is kept busy:
what they take of its rate. With and without them in turns, in one run."""
import contextlib
import subprocess
import sys
import tempfile

from measures import rig
from measures.figures import Bar, Row

BAUD = 115200
CASE = "115200, 10 registers"
SHARE = "line's rate beside 1000 cached reads/s, 50 event clients"
ASKED = "cached reads a second meanwhile"
BARS = [Bar(SHARE, {CASE}, least=0.99)]
STATION = "{id: 1, name: panel, points: [{name: level, at: 400001, type: u16}], max_age: 10s}"

# Asks at a steady pace over one connection, and tells how often a second it was answered.
READS = """
import socket, sys, time
port, rate, seconds = int(sys.argv[1]), 1000, float(sys.argv[2])
ask = b"GET /api/v1/stations/panel/points/level HTTP/1.1\\r\\nHost: 127.0.0.1:%d\\r\\n\\r\\n" % port
with socket.create_connection(("127.0.0.1", port)) as client:
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    begin, count = time.monotonic(), 0
    while (now := time.monotonic()) < begin + seconds:
        if count < (now - begin) * rate:
            client.sendall(ask)
            assert client.recv(4096).startswith(b"HTTP/1.1 200 ")
            count += 1
        else:
            time.sleep(0.0005)
print(count / (now - begin))
"""

# Fifty who listen to all there is, and read it.
LISTENERS = """
import selectors, socket, sys
selector = selectors.DefaultSelector()
for n in range(50):  # from some addresses: one may hold 32 connections
    client = socket.create_connection(("127.0.0.1", int(sys.argv[1])),
                                      source_address=("127.0.0.%d" % (2 + n // 20), 0))
    client.sendall(b"GET /api/v1/events?types=%s HTTP/1.1\\r\\nHost: 127.0.0.1:%s\\r\\n\\r\\n" %
                   (sys.argv[2].encode(), sys.argv[1].encode()))
    assert client.recv(4096).startswith(b"HTTP/1.1 200 ")
    selector.register(client, selectors.EVENT_READ)
print("all listen", flush=True)
while True:
    for key, _ in selector.select():
        key.fileobj.recv(65536)
"""
TYPES = "point,station,line"


@contextlib.contextmanager
def listened_to(port):
    with subprocess.Popen([sys.executable, "-c", LISTENERS, str(port), TYPES],
                          stdout=subprocess.PIPE, text=True) as listeners:
        try:
            assert listeners.stdout.readline() == "all listen\n"
            yield
        finally:
            listeners.terminate()


def beside(line, gateway, seconds):
    """(the window of the wire, reads a second)"""
    command = [sys.executable, "-c", READS, str(gateway.http_port()), str(seconds + 2)]
    with listened_to(gateway.http_port()), \
            subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as reader:
        window, _ = rig.saturate(line, gateway.port, gateway.pid, 10, seconds, warm=1)
        return window, float(reader.communicate()[0])


def measure(run):
    turns, seconds = (1, 3) if run.quick else (4, 8)
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, BAUD) as line:
        for subject in run.gateways:
            others = rig.config.station_ids(range(2, 9))
            text = rig.config.gateway(rig.config.line(
                "wire", line.link, f"{STATION}, {others}", baud=BAUD, parity="even"))
            with subject.running(text) as gateway:
                gateway.log.wait_for("line up")
                for _ in range(turns):
                    alone, _ = rig.saturate(line, gateway.port, gateway.pid, 10, seconds, warm=1)
                    window, reads = beside(line, gateway, seconds)
                    yield Row(SHARE, CASE, subject.name, window.rate / alone.rate, "")
                    yield Row(ASKED, CASE, subject.name, reads, "")
