"""Brokers of the tests, who listens to them, and a plant that knows one."""
import contextlib
import json
import pathlib
import re
import select
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time

import config
import harness
from test_events import Events

try:
    import paho.mqtt.client as paho
except ImportError:
    paho = None
BROKER = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin")
TOPIC = "plant/hall"
PRESS = """{id: 31, name: press, profile: autonics-gplp-s, points: [
      {name: level, at: UW100, type: i16, scale: 0.1, unit: celsius, writable: true, max: 400, every: 20ms},
      {name: mode, at: UW105, labels: {0: stopped, 1: running}, writable: true, every: 20ms},
      {name: ramp, at: UW201, every: 20ms}]}"""
LOCKED = """{id: 30, name: locked, profile: autonics-gplp-s, access: read_only, points: [
      {name: level, at: UW100, every: 20ms}]}"""
COUNTER = """{id: 31, name: press, profile: autonics-gplp-s, points: [
      {name: ramp, at: UW201, every: 100ms}]}"""
FAST = {"timing": "{response_timeout: 60ms}", "offline": "{probe_min: 100ms, probe_max: 200ms}"}


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


class Broker:
    """mosquitto with a store of its own, so that a restart loses nothing that it has acknowledged;
    a context manager."""

    def __init__(self, extra=""):
        self._folder = tempfile.TemporaryDirectory()
        self.port = free_port()
        self.file = pathlib.Path(self._folder.name) / "mosquitto.conf"
        self.file.write_text(f"listener {self.port} 127.0.0.1\n{extra or 'allow_anonymous true'}\n"
                             f"persistence true\npersistence_location {self._folder.name}/\n"
                             "max_queued_messages 0\nmax_inflight_messages 0\nqueue_qos0_messages true\n"
                             "log_dest stderr\nlog_type all\nuser root\n")
        self.process = None

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.stop()
        self._folder.cleanup()

    def start(self):
        self.process = subprocess.Popen([BROKER, "-c", str(self.file)], stderr=subprocess.PIPE,
                                        stdin=subprocess.DEVNULL, text=True, errors="replace")
        self.log = harness.Output(self.process.stderr)
        self.log.wait_for("mosquitto version .* running")

    def stop(self):
        if self.process is None:
            return
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(harness.PATIENCE)
        self.process = None

    def restart(self):
        self.stop()
        self.start()


class Listener:
    """What comes by a topic; a context manager. With a name it is remembered by the broker."""

    def __init__(self, broker, topic="#", name=None):
        self.received = []  # (topic, payload, retained)
        self._changed = threading.Condition()
        self._subscribed = threading.Event()
        self._client = paho.Client(name or "", clean_session=name is None)
        self._client.reconnect_delay_set(1, 1)
        self._client.on_connect = lambda client, *_: client.subscribe(topic, 1)
        self._client.on_subscribe = lambda *_: self._subscribed.set()
        self._client.on_message = self._take
        self._client.connect("127.0.0.1", broker.port)
        self._client.loop_start()

    def __enter__(self):
        assert self._subscribed.wait(harness.PATIENCE), "the broker takes no listener"
        return self

    def __exit__(self, *_):
        self._client.disconnect()
        self._client.loop_stop()

    def _take(self, _client, _user, message):
        with self._changed:
            self.received.append((message.topic, message.payload, message.retain))
            self._changed.notify_all()

    def publish(self, topic, payload, retain=False):
        self._client.publish(topic, payload, qos=1, retain=retain).wait_for_publish(harness.PATIENCE)

    def of(self, topic):
        """Payloads of a topic, as JSON."""
        with self._changed:
            return [json.loads(payload) for name, payload, _ in self.received if name == topic]

    def wait_for(self, topic, fits=lambda body: True, after=0):
        """The first of a topic's, behind so many of them, that fits."""
        found = []

        def look():
            found[:] = [body for body in self.of_locked(topic)[after:] if fits(body)]
            return found
        with self._changed:
            assert self._changed.wait_for(look, harness.PATIENCE), (topic, self.of_locked(topic)[-5:])
        return found[0]

    def of_locked(self, topic):
        return [json.loads(payload) for name, payload, _ in self.received if name == topic]


def flood(broker, topic, payload, count):
    """Publishes so many messages at once, of which the broker acknowledges none."""
    def text(part):
        return len(part).to_bytes(2, "big") + part

    def packet(kind, body):
        assert len(body) < 128
        return bytes([kind, len(body)]) + body

    with socket.create_connection(("127.0.0.1", broker.port), harness.PATIENCE) as peer:
        peer.sendall(packet(0x10, text(b"MQTT") + b"\x04\x02\x00\x3c" + text(b"flood")))
        assert peer.recv(4) == b"\x20\x02\x00\x00"
        peer.sendall(packet(0x30, text(topic.encode()) + payload) * count + b"\xe0\x00")
        assert not peer.recv(1)


def take_in(peer, newest=5):
    """The broker accepts a connection of the gateway, if it knows the version of MQTT."""
    asked = peer.recv(4096)
    version = asked[asked.index(b"MQTT") + 4]
    if version > newest:
        peer.sendall(b"\x20\x02\x00\x01")
        return False
    peer.sendall(b"\x20\x03\x00\x00\x00" if version == 5 else b"\x20\x02\x00\x00")  # CONNACK
    return True


class Listening:
    """What connects is served by `_serve`, until the end of the context."""

    def __init__(self):
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        threading.Thread(target=self._serve, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._server.close()


class Strict(Listening):
    """A broker that knows no later version of MQTT, lets nobody read and, where the version has a
    word for it, ends the connection; a context manager."""

    def __init__(self, newest=5):
        self._newest = newest
        super().__init__()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                with self._server.accept()[0] as peer:
                    if take_in(peer, self._newest):
                        self._answer(peer)

    def _answer(self, peer):
        """To the SUBSCRIBE, with which the gateway begins."""
        said = peer.recv(65536)
        assert said[0] == 0x82, said
        middle = b"\x00" if self._newest == 5 else b""
        peer.sendall(bytes([0x90, 3 + len(middle)]) + said[2:4] + middle + b"\x80")
        if self._newest == 5 and peer.recv(65536):
            peer.sendall(b"\xe0\x02\x8e\x00")  # DISCONNECT: session taken over
        while peer.recv(65536):
            pass


class Rude(Listening):
    """A broker that takes each connection and ends it with the first message; a context manager."""

    def __init__(self):
        self.came = []  # by the clock
        self._changed = threading.Condition()
        super().__init__()

    def _serve(self):
        with contextlib.suppress(OSError):
            while True:
                peer, _ = self._server.accept()
                with self._changed:
                    self.came.append(time.monotonic())
                    self._changed.notify_all()
                with peer, contextlib.suppress(OSError):
                    take_in(peer)
                    peer.recv(1)

    def pauses(self, count):
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.came) > count, harness.PATIENCE), self.came
            return [after - before for before, after in zip(self.came, self.came[1:])]


class Chatty:
    """A broker of one connection that reads nothing any more once the last word may come, and goes on
    writing; a context manager."""

    def __init__(self):
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self._peer = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._server.close()
        if self._peer:
            self._peer.close()

    def take(self):
        self._server.settimeout(harness.PATIENCE)
        self._peer, _ = self._server.accept()
        take_in(self._peer)

    def write_until_it_ends(self):
        """PINGRESPs, as long as the gateway is there: whether it ended without a reset, and all that
        it has said."""
        events = 0
        poll = select.poll()
        poll.register(self._peer, select.POLLRDHUP | select.POLLERR)
        while not events:
            with contextlib.suppress(BlockingIOError):
                self._peer.send(b"\xd0\x00" * 32768, socket.MSG_DONTWAIT | socket.MSG_NOSIGNAL)
            for _, happened in poll.poll(0):
                events |= happened
        said = b""
        while not events & select.POLLERR and (part := self._peer.recv(65536)):
            said += part
        return not events & select.POLLERR, said


def plant(broker, *stations, more="", line=None):
    """A gateway with these stations that knows this broker."""
    mqtt = f"{{broker: 'mqtt://127.0.0.1:{broker.port}', topic: {TOPIC}, client_id: gateway{more}}}"
    return config.gateway(config.line(stations=", ".join(stations or [PRESS]), **(line or FAST)),
                          http=config.ADMIN, modbus=None, mqtt=mqtt)


def metric(program, name):
    found = re.search(rf"^panelgate_mqtt_{name} (\S+)$", program.get("/metrics")[1], re.M)
    return float(found.group(1))


class Truth:
    """What the gateway itself has read of a point, by its events, and how often the panel's state has
    changed; a context manager."""

    def __init__(self, program, point):
        self._events = Events(program, "?types=point,station&station=press")
        self._point = point
        self.states = []
        self.flips = 0
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        sock = self._events._connection.sock or self._events.response.fp.raw._sock
        with contextlib.suppress(OSError):
            sock.shutdown(socket.SHUT_RDWR)
        self._thread.join(harness.PATIENCE)

    @property
    def values(self):
        return [value for value, _ in self.states if value is not None]

    def _read(self):
        with contextlib.suppress(OSError, ValueError):
            for line in iter(self._events.response.readline, b""):
                said = json.loads(line[6:]) if line.startswith(b"data: ") else {}
                if said.get("name") == self._point:
                    self.states.append((said["value"], said["quality"]))
                self.flips += "event" in said


def changes(values):
    """Without what is as the one before."""
    return [value for i, value in enumerate(values) if i == 0 or value != values[i - 1]]


def first_told(messages):
    """The messages in the order in which each was told first: what was sent again is one."""
    seen, told = set(), []
    for body in messages:
        key = (body["time"], body["value"], body["quality"])
        if key not in seen:
            seen.add(key)
            told.append(body)
    return told
