"""What soak.py has around the gateway: a serial line and an Ethernet device with random faults, clients that check
each answer, and things that happen to the plant."""
import collections
import contextlib
import http.client
import json
import os
import pathlib
import socket
import struct
import sys
import threading
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
# pylint: disable=wrong-import-position
import harness
from harness import read_registers, write_register
from rtu_bus import Pieces, Raw, RtuBus
from test_modbus_tcp_device import Device

# Exceptions that a gateway may give for a panel that does not answer well: 0A, 0B, 06; 04 is the panel's own.
GATEWAY = {0x04, 0x06, 0x0A, 0x0B}


def value_of(station, address):
    return (station * 1000 + address) & 0xFFFF


def reads_of(station, frame):
    _, address, count = struct.unpack(">BHH", frame[1:6])
    return struct.pack(f">BB{count}H", frame[1], 2 * count, *(value_of(station, address + i) for i in range(count)))


class OtherBox(RtuBus):
    """Where the second box is at the line of some Panels."""

    def __init__(self, link, panels):
        self._line = panels
        super().__init__(link, {})
        os.set_blocking(self._master, False)

    def say(self, data):
        with contextlib.suppress(BlockingIOError):  # a box that is stopped does not read
            super().say(data)

    def _heard(self, frame):
        self._line.asked(frame, self._line.say_to_first)


class Panels(RtuBus):
    """Stations 1, 2 and 3 of a line, with the faults of T1 to T14 by chance. With `other_link` there are two boxes: each
    hears what the other one sends, and all replies. `written`: values, as often as they came."""

    def __init__(self, link, other_link, chance, share=0.03):
        self.written = collections.Counter()
        self.chance = chance
        self.share = share
        self._wire = threading.Lock()
        self._other = OtherBox(other_link, self) if other_link else None
        super().__init__(link, {station: self._answer for station in (1, 2, 3)})
        self._frames = collections.deque(maxlen=64)
        os.set_blocking(self._master, False)

    def __exit__(self, *failure):
        if self._other:  # each of the two writes to both boxes
            self._other.stop()
            self.stop()
            self._other.__exit__(*failure)
        super().__exit__(*failure)

    def say_to_first(self, data):
        with contextlib.suppress(BlockingIOError):
            super().say(data)

    def say(self, data):
        self.say_to_first(data)
        self.say_to_second(data)

    def say_to_second(self, data):
        if self._other:
            self._other.say(data)

    def asked(self, frame, tell):
        """`tell`: to the box that has not asked."""
        tell(frame)
        with self._wire:
            super()._heard(frame)

    def _heard(self, frame):
        self.asked(frame, self.say_to_second)

    def _answer(self, frame):
        if frame[1] == 6:
            self.written[int.from_bytes(frame[4:6], "big")] += 1
        pdu = frame[1:6] if frame[1] == 6 else reads_of(frame[0], frame)
        if self.chance.random() >= self.share:
            return pdu
        good = harness.rtu(frame[0], pdu)
        cut = self.chance.randrange(1, len(good))
        damaged = bytearray(good)
        damaged[cut] ^= 1 << self.chance.randrange(8)
        return self.chance.choice([
            None,                                                   # silence
            Pieces([(0.15, good)]),                                 # late
            Pieces([(0, good[:cut]), (0.02, good[cut:])]),          # a hole
            Raw(good[:cut]),                                        # cut off
            Raw(bytes(damaged)),
            Raw(bytes([0x00]) + good),                              # a byte too many
            Raw(harness.rtu(9, pdu)),                               # another station
            bytes([frame[1] | 0x80, 4]),
            Raw(harness.rtu(frame[0], bytes([frame[1] ^ 1, 2, 0, 0])))])


class Shaky(Device):
    """A Modbus/TCP device whose replies are late, missing, of other ids, in pieces, or the last one."""

    def __init__(self, chance, share=0.03, port=0):
        super().__init__(self._change, port)
        self.chance = chance
        self.share = share

    def _change(self, _, reply):
        if self.chance.random() >= self.share:
            return [reply]
        number = int.from_bytes(reply[:2], "big")
        other = struct.pack(">H", (number + 4711) & 0xFFFF) + reply[2:]
        return self.chance.choice([[], [other], [other, reply], [reply, reply], [reply[:5], reply[5:]], [None]])


class Client(threading.Thread):
    """Asks until `ends`. `tally`: what came, by word; `wrong`: what must not have come."""

    def __init__(self, plant, name, seed):
        super().__init__(daemon=True, name=name)
        self.plant = plant
        self.chance = seed
        self.tally = collections.Counter()
        self.wrong = []

    def run(self):
        while not self.plant.ends.is_set():
            try:
                self.work()
            except (OSError, harness.Closed, http.client.HTTPException) as why:
                self.tally[f"connection: {type(why).__name__}"] += 1
                self.plant.ends.wait(0.05)
            except AssertionError as why:
                self.wrong.append(f"{self.name}: {why}")
                return

    def work(self):
        raise NotImplementedError


class Reader(Client):
    """Reads of one station, up to 8 on their way, each answered once, in order, with its own value."""

    def __init__(self, plant, unit, seed):
        super().__init__(plant, f"reader of {unit}", seed)
        self.unit = unit

    def work(self):
        with self.plant.client() as client:
            for _ in range(200):
                asked = [(self.chance.randrange(300), self.chance.randrange(1, 20))
                         for _ in range(self.chance.randrange(1, 9))]
                sent = [client.send(self.unit, read_registers(*one, function=4)) for one in asked]
                self.tally["asked"] += len(sent)
                for number, (address, count) in zip(sent, asked):
                    transaction, unit, reply = client.receive()
                    assert (transaction, unit) == (number, self.unit), (transaction, number, unit)
                    self.judge(reply, address, count)
                if self.plant.ends.is_set():
                    return

    def judge(self, reply, address, count):
        self.tally["answered"] += 1
        if reply[0] == 4:
            said = list(struct.unpack(f">{count}H", reply[2:]))
            assert said == [value_of(self.unit, address + i) for i in range(count)], (self.unit, address, said)
            self.tally["good"] += 1
        else:
            assert reply[0] == 0x84 and reply[1] in GATEWAY, reply
            self.tally[f"exception {reply[1]:02X}"] += 1


class Writer(Client):
    """Writes `first`, and each second value from there on; `confirmed`: values that the gateway says are written."""
    VALUES = 0x8000

    def __init__(self, plant, first, seed):
        super().__init__(plant, "writer", seed)
        self.unit = None  # any station of the serial line
        self.value = first
        self.confirmed = set()

    def work(self):
        with self.plant.client() as client:
            for _ in range(100):
                self.value = (self.value + 2) % (2 * self.VALUES)
                self.tally["asked"] += 1
                reply = client.ask(self.chance.randrange(1, 4), write_register(500, self.value))
                self.tally["answered"] += 1
                if reply[0] == 6:
                    self.confirmed.add(self.value)
                    self.tally["good"] += 1
                else:
                    assert reply[0] == 0x86 and reply[1] in GATEWAY, reply
                    self.tally[f"exception {reply[1]:02X}"] += 1
                self.plant.ends.wait(0.02)


class Rest(Client):
    """Points, metrics, pages and writes over HTTP: each answer is one that the document knows."""
    PATHS = ("/api/v1/points", "/api/v1/lines", "/metrics", "/", "/api/v1/journal?limit=20", "/api/v1/alarms",
             "/api/v1/stations/p1/points/level/history", "/api/v1/images/plant", "/api/v1/findings", "/readyz")

    def work(self):
        connection = http.client.HTTPConnection("127.0.0.1", self.plant.http, timeout=harness.PATIENCE)
        with contextlib.closing(connection):
            for _ in range(50):
                path = self.chance.choice(self.PATHS)
                connection.request("GET", path)
                answer = connection.getresponse()
                answer.read()
                self.tally[f"status {answer.status}"] += 1
                assert answer.status in (200, 503), (path, answer.status)
                self.plant.ends.wait(0.05)


class Crowd(Client):
    """Connections that come, say nothing or half a request, and go."""

    def work(self):
        with self.plant.client() as client:
            client.send_bytes(self.chance.choice([b"", b"\x00\x01\x00\x00\x00\x06\x01", b"GET / HTTP/1.1\r\n\r\n",
                                                  harness.adu(1, 1, read_registers(1))]))
            self.tally["came"] += 1
            self.plant.ends.wait(self.chance.uniform(0, 0.1))


class Images(Client):
    """Reads of an image: points of all lines at once."""

    def work(self):
        with self.plant.client() as client:
            for _ in range(50):
                reply = client.ask(100, read_registers(0, 4))
                self.tally["answered"] += 1
                if reply[0] == 3:
                    said = struct.unpack(">4H", reply[2:])
                    assert said == tuple(value_of(unit, 7) for unit in (1, 2, 3, 11)), said
                    self.tally["good"] += 1
                self.plant.ends.wait(0.05)


class Memory(threading.Thread):
    """Resident KiB and open files of a process, each second."""

    def __init__(self, process, ends):
        super().__init__(daemon=True)
        self.folder = pathlib.Path(f"/proc/{process}")
        self.ends = ends
        self.samples = []  # (seconds, KiB, files)

    def run(self):
        begun = time.monotonic()
        while not self.ends.wait(1):
            with contextlib.suppress(OSError, IndexError):
                kib = int((self.folder / "status").read_text().split("VmRSS:")[1].split()[0])
                files = len(list((self.folder / "fd").iterdir()))
                self.samples.append((time.monotonic() - begun, kib, files))

    def slope(self, since):
        """kB an hour, by least squares, of the samples from that second on."""
        seen = [(at, kib * 1.024) for at, kib, _ in self.samples if at >= since]
        if len(seen) < 2:
            return 0.0
        mean_at = sum(at for at, _ in seen) / len(seen)
        mean = sum(kb for _, kb in seen) / len(seen)
        spread = sum((at - mean_at) ** 2 for at, _ in seen)
        return 3600 * sum((at - mean_at) * (kb - mean) for at, kb in seen) / spread


def sum_of(metrics, family, **labels):
    """The sum of a family's series that have these labels."""
    wanted = [f'{key}="{value}"' for key, value in labels.items()]
    return sum(float(row.rsplit(" ", 1)[1]) for row in metrics.splitlines()
               if row.startswith(family + "{") and all(one in row for one in wanted))


def records_of(audit):
    """The records of all files of an audit, the oldest first."""
    for file in sorted(audit.parent.glob(audit.name + "*")):
        for row in file.read_text().splitlines():
            yield json.loads(row)


def reset(peer):
    """Ends a connection without a word of TCP."""
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    peer.close()
