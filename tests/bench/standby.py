#!/usr/bin/env python3
"""standby.py: two gateways on one simulated line, of which the active one is killed or stopped again and again
while a client writes. The pause of each take-over, frames of both boxes that met, and what became of the writes.

PANELGATE=build/release/panelgate python3 -B tests/bench/standby.py [TAKEOVERS]
"""
import collections
import pathlib
import signal
import sys
import tempfile
import threading
import contextlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
# pylint: disable=wrong-import-position
import config
import harness
from harness import write_register
from shared_bus import SharedBus
from test_points import until
from test_standby import Box
from tls import say

EXCHANGE = 0.006  # seconds that a request and its reply need on this bus
STATIONS = "{id: 1, name: press}, {id: 2, name: oven}"


class Pair:
    """Two boxes that can be ended and begun again. A context manager."""

    def __init__(self, folder):
        self.files = []
        self.boxes = [None, None]
        for rank, device in enumerate(("a", "b")):
            line = config.line(device=folder / device, baud=115200, retries=0,
                               timing="{response_timeout: 100ms}", stations=STATIONS)
            self.files.append(folder / f"{device}.yaml")
            self.files[rank].write_text(config.gateway(line, http=config.ADMIN) + f"standby: {{rank: {rank}}}\n")

    def __enter__(self):
        for rank in (0, 1):
            self.begin(rank)
        return self

    def __exit__(self, *_):
        for box in self.boxes:
            box.process.kill()
            box.process.wait()
            box.__exit__()

    def begin(self, rank):
        self.boxes[rank] = Box("run", "-c", str(self.files[rank])).__enter__()
        self.boxes[rank].http_port()

    def role(self, rank):
        return self.boxes[rank].get("/api/v1/standby")[1]["role"]

    def end(self, rank):
        self.boxes[rank].process.kill()
        self.boxes[rank].process.wait()
        self.boxes[rank].__exit__()


class Writer(threading.Thread):
    """Writes 1, 2, 3 ... to the active box and keeps which ones were confirmed."""

    def __init__(self, pair):
        super().__init__(daemon=True)
        self.pair = pair
        self.active = 0
        self.ends = False
        self.rest = threading.Event()  # never set
        self.asked = 0
        self.confirmed = set()

    def run(self):
        while not self.ends:
            with contextlib.suppress(OSError, harness.Closed, ValueError), \
                    self.pair.boxes[self.active].client() as client:
                client.socket.settimeout(1)
                is_served = True
                while is_served and not self.ends:
                    self.asked += 1
                    is_served = client.ask(1, write_register(7, self.asked))[0] == 6
                    if is_served:
                        self.confirmed.add(self.asked)
            self.rest.wait(0.02)


def meetings(sent):
    """Frames of different boxes, one of which began within the other one's exchange."""
    return sum(1 for a, b in zip(sent, sent[1:]) if a.box != b.box and b.at - a.at < EXCHANGE)


def main(takeovers):
    with tempfile.TemporaryDirectory() as path, SharedBus([pathlib.Path(path) / name for name in "ab"], {1, 2}) as bus, \
            Pair(pathlib.Path(path)) as pair:
        until(lambda: pair.role(0) == "active")
        writer = Writer(pair)
        writer.start()
        pauses = []
        for number in range(takeovers):
            active, other = writer.active, 1 - writer.active
            kills = number % 2 == 0
            confirmed = len(writer.confirmed)
            until(lambda: len(writer.confirmed) > confirmed + 20)
            if kills:
                pair.end(active)
            else:
                pair.boxes[active].process.send_signal(signal.SIGSTOP)
            silent = bus.frames(active)[-1].at
            until(lambda: pair.role(other) == "active")
            pauses.append(bus.frames(other, silent)[0].at - silent)
            writer.active = other
            if kills:
                pair.begin(active)
            else:
                pair.boxes[active].process.send_signal(signal.SIGCONT)
            until(lambda: pair.role(active) == "standby")
        writer.ends = True
        writer.join()
        report(bus, writer, sorted(pauses))


def report(bus, writer, pauses):
    times = collections.Counter(int.from_bytes(one.bytes[4:6], "big") for one in bus.frames() if one.bytes[1] == 6)
    say("take-overs", len(pauses), "")
    say("pause, median", pauses[len(pauses) // 2], "s")
    say("pause, p99", pauses[min(len(pauses) - 1, len(pauses) * 99 // 100)], "s")
    say("frames of both boxes that met", meetings(bus.frames()), "")
    say("writes asked", writer.asked, "")
    say("writes on the wire", len(times), "")
    say("writes on the wire twice", sum(1 for count in times.values() if count > 1), "")
    say("writes confirmed", len(writer.confirmed), "")
    say("writes confirmed and not on the wire", len(writer.confirmed - set(times)), "")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
