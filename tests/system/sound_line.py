"""What tests of lines without a fault share: panels on a pseudo-terminal or behind TCP, in Python,
and a client that asks every so often."""
import contextlib
import pathlib
import socket
import struct
import tempfile
import threading
import time

import config
import harness
from rtu_bus import RtuBus


def reading(pdu, value):
    """The reply to 01 to 04; `value`: function(address) of a register, or of a coil."""
    function, address, count = struct.unpack(">BHH", pdu)
    values = [value(address + i) for i in range(count)]
    if function > 2:
        return struct.pack(f">BB{count}H", function, 2 * count, *values)
    data = sum(bool(v) << i for i, v in enumerate(values)).to_bytes((count + 7) // 8, "little")
    return bytes([function, len(data)]) + data


def fault(function, code):
    return bytes([function | 0x80, code])


@contextlib.contextmanager
def line_of(panels, stations="", baud=9600, **keys):
    """(program, bus): panels on a pseudo-terminal, which is not paced, and a gateway. With echo: off
    the gateway sends no read of its own before the first write."""
    keys = {"echo": "off", **keys}
    with tempfile.TemporaryDirectory() as folder:
        link = pathlib.Path(folder) / "tty"
        text = config.gateway(config.line(device=link, stations=stations, baud=baud, **keys))
        with RtuBus(link, panels) as bus, harness.configured(text) as program:
            program.log.wait_for("line up")
            yield program, bus


class DeviceServer:
    """answer: function(frame, age of its connection in seconds) -> reply PDU, or None for silence.
    Each connection has a thread. Each read of the socket is one frame: the gateway sends a frame in
    one piece."""

    def __init__(self, answer):
        self._answer = answer
        self._server = socket.create_server(("127.0.0.1", 0))
        self.device = f"tcp://127.0.0.1:{self._server.getsockname()[1]}"
        self._lock = threading.Lock()
        self._frames, self._connections = [], []
        threading.Thread(target=self._accept, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.shutdown(socket.SHUT_RDWR)  # wakes the thread that accepts
        self._server.close()
        with self._lock:
            for connection in self._connections:
                with contextlib.suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)

    def frames(self, station=None):
        with self._lock:
            return [f for f in self._frames if station in (None, f[0])]

    def connections(self):
        with self._lock:
            return len(self._connections)

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self._server.accept()
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                with self._lock:
                    self._connections.append(connection)
                threading.Thread(target=self._serve, args=(connection,), daemon=True).start()

    def _serve(self, connection):
        began = time.monotonic()
        with connection, contextlib.suppress(OSError):
            while frame := connection.recv(300):
                assert harness.crc(frame[:-2]) == frame[-2:], frame.hex(" ")
                with self._lock:
                    self._frames.append(frame)
                reply = self._answer(frame, time.monotonic() - began)
                if reply is not None:
                    connection.sendall(harness.rtu(frame[0], reply))


class Poller:
    """A client that asks a panel every so often: each reply, and how long each took."""

    def __init__(self, program, unit, request, pause):
        self._program, self._unit, self._request, self._pause = program, unit, request, pause
        self.replies, self.seconds = [], []
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join(harness.PATIENCE)

    def _run(self):
        with self._program.client() as client:
            while not self._stop.is_set():
                pdu = self._request(len(self.replies))
                start = time.monotonic()
                self.replies.append((pdu, client.ask(self._unit, pdu)))
                self.seconds.append(time.monotonic() - start)
                self._stop.wait(self._pause)
