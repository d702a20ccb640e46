#!/usr/bin/env python3
"""A plain Modbus/TCP to RTU bridge, as many are: one request after the other, the oldest first, 500
ms for a reply, a read once more when none came, what is there thrown away behind an error, and the
silence of the standard between two frames. It guards nothing. What has waited for a second is not
asked any more: its client has given up, and a backlog must not outlive the fault that made it.

plain_bridge.py TTY BAUD: prints its port, and serves until stdin ends.
"""
import asyncio
import contextlib
import os
import pathlib
import struct
import sys
import termios
import time
import tty

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))
from harness import crc  # noqa: E402

PATIENCE = 1.0  # s that clients wait
TIMEOUT = 0.5  # s, for the reply to begin, and between its pieces
READS = (1, 2, 3, 4)


def reply_length(frame):
    """Of address, PDU and checksum; None while nothing can be said."""
    if len(frame) < 3:
        return None
    if frame[1] & 0x80:
        return 5
    if frame[1] in READS:
        return 5 + frame[2]
    return 8


class Wire:
    def __init__(self, path, baud):
        self._fd = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._fd)
        self._gap = 0.00175 if baud > 19200 else 38.5 / baud
        self._character = 10 / baud
        self._heard = asyncio.Event()
        self._bytes = b""
        self._free_at = 0.0
        asyncio.get_running_loop().add_reader(self._fd, self._read)

    def _read(self):
        with contextlib.suppress(BlockingIOError):  # it has been thrown away meanwhile
            self._bytes += os.read(self._fd, 4096)
            self._heard.set()

    async def _more(self):
        """False when nothing has come within the timeout."""
        self._heard.clear()
        try:
            await asyncio.wait_for(self._heard.wait(), TIMEOUT)
        except asyncio.TimeoutError:
            return False
        return True

    async def transact(self, frame):
        """The reply's PDU, or None."""
        await asyncio.sleep(max(0.0, self._free_at - time.monotonic()))
        self._bytes = b""
        os.write(self._fd, frame)
        await asyncio.sleep(len(frame) * self._character)
        good = await self._reply(frame)
        if good is None:
            termios.tcflush(self._fd, termios.TCIFLUSH)
            self._bytes = b""
        self._free_at = time.monotonic() + self._gap
        return good

    async def _reply(self, asked):
        while True:
            length = reply_length(self._bytes)
            if length is not None and len(self._bytes) >= length:
                frame, self._bytes = self._bytes[:length], self._bytes[length:]
                if crc(frame[:-2]) != frame[-2:]:
                    return None
                if frame[0] == asked[0] and frame[1] & 0x7F == asked[1]:
                    return frame[1:-2]
                continue  # somebody else's, or late
            if not await self._more():
                return None


class Bridge:
    def __init__(self, wire):
        self._wire, self._queue = wire, asyncio.Queue()

    async def serve(self, reader, writer):
        try:
            while True:
                transaction, _, length = struct.unpack(">HHH", await reader.readexactly(6))
                body = await reader.readexactly(length)
                await self._queue.put((time.monotonic(), transaction, body, writer))
        except (asyncio.IncompleteReadError, ConnectionError):
            writer.close()

    async def run(self):
        while True:
            arrived, transaction, body, writer = await self._queue.get()
            if time.monotonic() > arrived + PATIENCE:
                continue
            frame = body + crc(body)
            reply = await self._wire.transact(frame)
            if reply is None and body[1] in READS:
                reply = await self._wire.transact(frame)
            if reply is None:
                reply = bytes([body[1] | 0x80, 0x0B])
            if not writer.is_closing():
                writer.write(struct.pack(">HHHB", transaction, 0, len(reply) + 1, body[0]) + reply)


async def main():
    bridge = Bridge(Wire(sys.argv[1], int(sys.argv[2])))
    server = await asyncio.start_server(bridge.serve, "127.0.0.1", 0)
    print(server.sockets[0].getsockname()[1], flush=True)
    work = asyncio.create_task(bridge.run())
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    work.cancel()


if __name__ == "__main__":
    asyncio.run(main())
