"""A serial line in Python: a pty behind a link, panels that do what a test says, and a record of
every frame that came along, with the time."""
import fcntl
import os
import select
import struct
import termios
import threading
import time
import tty
from collections import namedtuple

import harness

Frame = namedtuple("Frame", "at bytes")  # at: time.monotonic() when its last byte had been read

# Of requests: where the byte count is and how many bytes there are besides; 65, user-defined, has
# one here as well.
COUNTED = {20: (2, 5), 21: (2, 5), 23: (10, 13), 65: (2, 5)}
FIXED = {8: 8, 22: 10, 24: 6, 43: 7}


def request_length(data):
    """Bytes of the request ADU that starts here, None while nothing can be said."""
    if len(data) < 2:
        return None
    if data[1] in (1, 2, 3, 4, 5, 6):
        return 8
    if data[1] in (15, 16):
        return None if len(data) < 7 else 9 + data[6]
    if data[1] in (7, 11, 12, 17):
        return 4
    if data[1] in COUNTED:
        at, rest = COUNTED[data[1]]
        return None if len(data) <= at else rest + data[at]
    if data[1] in FIXED:
        return FIXED[data[1]]
    raise AssertionError(f"no rule for function {data[1]}")


def echo_address(frame):
    """A panel whose every register holds its own address, and that takes every write."""
    function, address, count = struct.unpack(">BHH", frame[1:6])
    if function in (3, 4):
        values = range(address, address + count)
        return struct.pack(f">BB{count}H", function, 2 * count, *values)
    return frame[1:6]


class RtuBus:
    """panels: {station: function(frame) -> reply PDU | Raw(bytes) | Pieces | None for silence}
    echo: function(frame) -> what the adapter hears of the frame that it sends; glued: in one piece
    with the reply"""

    def __init__(self, link, panels, echo=None, glued=False):
        self._panels = panels
        self._echo = echo or (lambda frame: b"")
        self._glued = glued
        self._frames = []
        self._changed = threading.Condition()
        self._error = None
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave, termios.TCSANOW)
        os.symlink(os.ttyname(self._slave), str(link) + ".new")
        os.rename(str(link) + ".new", link)
        self._link = link
        self._wake, self._end = os.pipe()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def __enter__(self):
        return self

    def stop(self):
        """Nothing is answered any more."""
        if self._end is not None:
            os.close(self._end)
            self._end = None
        self._thread.join(harness.PATIENCE)

    def __exit__(self, *_):
        self.stop()
        if os.readlink(self._link) == os.ttyname(self._slave):  # not another bus' by now
            os.unlink(self._link)
        for descriptor in (self._wake, self._master, self._slave):
            os.close(descriptor)
        if self._error:
            raise self._error

    def settings(self):
        """What the gateway set the device to: (iflag, oflag, cflag, lflag, characters, bit/s)."""
        tcgets2 = 0x802C542A
        raw = fcntl.ioctl(self._slave, tcgets2, bytes(44))
        *flags, _, characters, _, speed = struct.unpack("4IB19s2I", raw)
        return (*flags, characters, speed)

    def inject(self, data):
        """Bytes on the wire that nobody asked for."""
        self.say(data)

    def frames(self, station=None):
        with self._changed:
            return [f for f in self._frames if station is None or f.bytes[0] == station]

    def wait_for(self, count, station=None):
        """The count-th frame (to this station)."""
        with self._changed:
            def seen():
                return [f for f in self._frames if station is None or f.bytes[0] == station]
            self._changed.wait_for(lambda: self._error or len(seen()) >= count, harness.PATIENCE)
            if len(seen()) < count:
                raise AssertionError(f"{count} frames were awaited, {seen()} came") from self._error
            return seen()[count - 1]

    def _serve(self):
        try:
            self._listen()
        except (AssertionError, OSError) as error:
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _listen(self):
        pending = b""
        while True:
            readable, _, _ = select.select([self._master, self._wake], [], [])
            if self._wake in readable:
                return
            pending += os.read(self._master, 1024)
            while (length := request_length(pending)) and len(pending) >= length:
                frame, pending = pending[:length], pending[length:]
                self._heard(frame)

    def _heard(self, frame):
        assert harness.crc(frame[:-2]) == frame[-2:], frame.hex(" ")
        with self._changed:
            self._frames.append(Frame(time.monotonic(), frame))
            self._changed.notify_all()
        panel = self._panels.get(frame[0])
        reply = panel(frame) if panel else None
        if isinstance(reply, Pieces):
            reply.send(self.say)
            return
        if reply is not None and not isinstance(reply, Raw):
            reply = harness.rtu(frame[0], reply)
        pieces = [self._echo(frame), reply or b""]
        for piece in [b"".join(pieces)] if self._glued else pieces:
            if piece:
                self.say(piece)

    def say(self, data):
        """What the box hears."""
        os.write(self._master, data)


class Raw(bytes):
    """A reply that goes out as it is, address and CRC included."""


class Pieces:
    """A reply with holes: [(seconds of silence, the bytes behind it)]. Without an echo."""

    def __init__(self, pieces):
        self._pieces = pieces
        self.longest = 0.0  # seconds, of the holes as they came out

    def send(self, say):
        before = None
        for pause, data in self._pieces:
            time.sleep(pause)
            say(data)
            now = time.monotonic()
            self.longest = max(self.longest, now - (before or now))
            before = now


def scripted(*replies):
    """A panel that gives these replies (PDU, Raw, None or a function of the frame) in turn, the
    last one for ever."""
    rest = list(replies)

    def panel(frame):
        reply = rest.pop(0) if len(rest) > 1 else rest[0]
        return reply(frame) if callable(reply) else reply
    return panel
