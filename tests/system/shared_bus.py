"""One serial line with two boxes: each has a pty, hears what the other one sends, and the panels' replies."""
import os
import select
import threading
import time
import tty
from collections import namedtuple

import harness
from rtu_bus import echo_address, request_length

Sent = namedtuple("Sent", "at box bytes")  # at: time.monotonic()


class SharedBus:
    """`links`: paths of the two devices; `panels`: ids of stations that answer. A context manager."""

    def __init__(self, links, panels):
        self.panels = set(panels)
        self.deaf = set()  # boxes that hear nothing
        self.cut = False   # both boxes are alone, and have the panels to themselves
        self.sent = []
        self._pairs = [os.openpty() for _ in links]
        for link, (_, slave) in zip(links, self._pairs):
            tty.setraw(slave)
            os.symlink(os.ttyname(slave), link)
        self._ends = False
        self._lock = threading.Lock()

    def __enter__(self):
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._ends = True
        self._thread.join()
        for pair in self._pairs:
            for one in pair:
                os.close(one)

    def frames(self, box=None, since=0.0):
        with self._lock:
            return [one for one in self.sent if one.at >= since and box in (None, one.box)]

    def _give(self, box, data):
        if box not in self.deaf:
            os.write(self._pairs[box][0], data)

    def _run(self):
        heard = [b"" for _ in self._pairs]
        masters = [pair[0] for pair in self._pairs]
        while not self._ends:
            for master in select.select(masters, [], [], 0.05)[0]:
                box = masters.index(master)
                heard[box] += os.read(master, 4096)
                while (length := request_length(heard[box])) and len(heard[box]) >= length:
                    frame, heard[box] = heard[box][:length], heard[box][length:]
                    self._take(box, frame)

    def _take(self, box, frame):
        with self._lock:
            self.sent.append(Sent(time.monotonic(), box, frame))
        others = [] if self.cut else [one for one in range(len(self._pairs)) if one != box]
        for other in others:
            self._give(other, frame)
        if frame[0] not in self.panels:
            return
        time.sleep(0.005)  # the panel thinks
        pdu = echo_address(frame[1:-2] and frame)
        reply = harness.rtu(frame[0], pdu)
        for one in [box, *others]:
            self._give(one, reply)
