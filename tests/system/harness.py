"""Starts the real program on free ports and speaks to it.

Nothing here sleeps and no port is fixed: the program is asked for port 0 and says on stderr what
it got; everything else waits for a line of output, a byte or the end of a process.
"""
import contextlib
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parents[2]
PANELGATE = os.environ.get("PANELGATE", str(ROOT / "build/release/panelgate"))
SANITIZED = os.environ.get("PANELGATE_SANITIZED") == "1"
PATIENCE = 30  # seconds: a limit for what should happen at once, never a pause


class Output:
    """The lines of one stream, as they come."""

    def __init__(self, stream):
        self._lines = []
        self._changed = threading.Condition()
        self._ended = False
        self._thread = threading.Thread(target=self._read, args=(stream,), daemon=True)
        self._thread.start()

    def _read(self, stream):
        with stream:
            for line in stream:
                with self._changed:
                    self._lines.append(line.rstrip("\n"))
                    self._changed.notify_all()
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def text(self):
        with self._changed:
            return "\n".join(self._lines)

    def wait_for(self, pattern, count=1):
        """The count-th match of a line; an AssertionError with all output when it does not come."""
        with self._changed:
            def matches():
                return [m for m in map(re.compile(pattern).search, self._lines) if m]
            self._changed.wait_for(lambda: len(matches()) >= count or self._ended, PATIENCE)
            found = matches()
        if len(found) < count:
            raise AssertionError(f"no line {count}x {pattern!r} in:\n{self.text()}")
        return found[count - 1]

    def finished_text(self):
        self._thread.join(PATIENCE)
        return self.text()


class Helper:
    """A program beside the gateway, ended with the block; `out`: its lines."""

    def __init__(self, command, **options):
        self.process = subprocess.Popen([str(part) for part in command], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True, errors="replace",
                                        **options)
        self.out = Output(self.process.stdout)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.terminate()
        self.process.wait(PATIENCE)


class Program:
    """A running panelgate; a context manager that ends it and fails when it crashed. `under`: a
    command that becomes it."""
    ends_with = 0  # its exit code

    def __init__(self, *arguments, under=(), **options):
        self.arguments = arguments
        self.process = subprocess.Popen(
            [*under, PANELGATE, *arguments], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, text=True, errors="replace", **options)
        self.out = Output(self.process.stdout)
        self.log = Output(self.process.stderr)

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        code = self.stop()
        if kind is None and code != self.ends_with:
            raise AssertionError(f"{self.arguments} ended with {code}:\n{self.log.text()}")

    def stop(self, sent=signal.SIGTERM):
        if self.process.poll() is None:
            self.process.send_signal(sent)
        return self.wait()

    def wait(self):
        try:
            return self.process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self.process.kill()
            raise AssertionError(f"{self.arguments} did not end:\n{self.log.text()}") from None

    def modbus_port(self, which=1):
        return int(self.log.wait_for(r"listening modbus_tcp=\S*:(\d+)$", which).group(1))

    def http_port(self):
        return int(self.log.wait_for(r"listening http=\S*:(\d+)$").group(1))

    def url(self, path):
        return f"http://127.0.0.1:{self.http_port()}{path}"

    def client(self, **options):
        return Client(self.modbus_port(), **options)

    def rest(self, method, path, body=None):
        """(status, parsed JSON, or the text when it is none)."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.url(path), data=data, method=method)
        try:
            with urllib.request.urlopen(request, timeout=PATIENCE) as response:
                return response.status, _parsed(response)
        except urllib.error.HTTPError as problem:
            with problem:
                return problem.code, _parsed(problem)

    def get(self, path):
        return self.rest("GET", path)

    def values(self, path):
        status, body = self.get(path)
        assert status == 200, (path, status, body)
        return body["values"]

    def trace(self, line, last=200):
        """[(direction, bytes)], the oldest first."""
        status, body = self.get(f"/api/v1/lines/{line}/trace?last={last}")
        assert status == 200, body
        return [(f["direction"], bytes.fromhex(f["bytes"])) for f in body["frames"]]


def _parsed(response):
    text = response.read().decode()
    return json.loads(text) if "json" in response.headers.get("Content-Type", "") else text


def run(*arguments, **options):
    """A command that ends by itself: CompletedProcess with text."""
    return subprocess.run([PANELGATE, *arguments], stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, timeout=PATIENCE, check=False, **options)


def demo():
    return Program("demo", "--http", "127.0.0.1:0", "--modbus", "127.0.0.1:0")


@contextlib.contextmanager
def configured(text, *arguments, **options):
    """`run` with this configuration, listening; ends with the block."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "panelgate.yaml"
        file.write_text(text)
        with Program("run", "-c", str(file), *arguments, **options) as program:
            program.http_port()  # the last that it opens
            yield program


class Closed(Exception):
    """The other side closed the connection."""


class Client:
    """Raw Modbus/TCP: what was sent is what the test says, nothing is repaired."""

    def __init__(self, port, patience=PATIENCE, receive_buffer=None, host="127.0.0.1"):
        self.socket = socket.socket()
        self.socket.settimeout(patience)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect((host, port))
        self._transaction = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.socket.close()

    def send_bytes(self, data):
        self.socket.sendall(data)

    def send(self, unit, pdu):
        """Sends a request and returns its transaction id."""
        self._transaction = (self._transaction + 1) & 0xFFFF
        self.send_bytes(adu(self._transaction, unit, pdu))
        return self._transaction

    def receive(self):
        """(transaction, unit, PDU) of the next reply."""
        transaction, protocol, length = struct.unpack(">HHH", self._exactly(6))
        assert protocol == 0 and 2 <= length <= 254, (protocol, length)
        body = self._exactly(length)
        return transaction, body[0], body[1:]

    def ask(self, unit, pdu):
        """The reply's PDU; transaction and unit are checked."""
        sent = self.send(unit, pdu)
        transaction, echoed, reply = self.receive()
        assert (transaction, echoed) == (sent, unit), (transaction, sent, echoed, unit)
        return reply

    def _exactly(self, count):
        data = b""
        while len(data) < count:
            try:
                more = self.socket.recv(count - len(data))
            except ConnectionResetError:
                more = b""
            if not more:
                raise Closed(f"after {len(data)} of {count} bytes")
            data += more
        return data

    def is_closed_by_peer(self):
        """Waits for the end of the connection; bytes before it do not count as one."""
        try:
            return self.socket.recv(1) == b""
        except ConnectionResetError:
            return True


def adu(transaction, unit, pdu):
    return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu


def read_registers(address, count=1, function=3):
    return struct.pack(">BHH", function, address, count)


def write_register(address, value):
    return struct.pack(">BHH", 6, address, value)


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return struct.pack("<H", value)


def rtu(station, pdu):
    frame = bytes([station]) + pdu
    return frame + crc(frame)
