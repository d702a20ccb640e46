"""Modbus/TCP clients that note when they sent every request and when its answer came."""
import asyncio
import struct
import time


class Asked:
    """One request; `reply` is None while there is no answer."""

    def __init__(self, unit, pdu):
        self.unit = unit
        self.pdu = pdu
        self.sent = time.monotonic()
        self.answered = None
        self.reply = None
        self.done = asyncio.get_running_loop().create_future()

    @property
    def seconds(self):
        return self.answered - self.sent

    @property
    def exception(self):
        return self.reply[1] if self.reply[0] & 0x80 else None

    @property
    def is_good(self):
        return self.exception is None


class Client(asyncio.Protocol):
    """What came is in `asked` (in the order of sending); what nobody asked for is in `strays`;
    `closed`: by the other side."""

    def __init__(self):
        self.asked = []
        self.strays = []
        self.closed = False
        self._closing = False
        self._open = {}
        self._pending = b""
        self._transport = None

    @classmethod
    async def connect(cls, port, own_address=None):
        local = (own_address, 0) if own_address else None
        _, client = await asyncio.get_running_loop().create_connection(
            cls, "127.0.0.1", port, local_addr=local)
        return client

    def connection_made(self, transport):
        self._transport = transport  # asyncio has set TCP_NODELAY

    def connection_lost(self, _):
        self.closed = not self._closing
        for asked in self._open.values():
            asked.done.cancel()

    def close(self):
        self._closing = True
        self._transport.close()

    def send(self, unit, pdu):
        asked = Asked(unit, pdu)
        transaction = len(self.asked) & 0xFFFF
        assert transaction not in self._open
        self.asked.append(asked)
        self._open[transaction] = asked
        self._transport.write(struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu)
        return asked

    async def ask(self, unit, pdu):
        asked = self.send(unit, pdu)
        await asked.done
        return asked

    async def ask_until(self, end, requests, depth=1):
        """Keeps `depth` requests open, what requests() says next, until time.monotonic() == end;
        comes back when all are answered."""
        async def one_at_a_time():
            while time.monotonic() < end:
                await self.ask(*requests())
        await asyncio.gather(*(one_at_a_time() for _ in range(depth)))

    def data_received(self, data):
        now = time.monotonic()
        self._pending += data
        while len(self._pending) >= 6:
            transaction, protocol, length = struct.unpack(">HHH", self._pending[:6])
            assert protocol == 0, self._pending.hex(" ")
            if len(self._pending) < 6 + length:
                return
            body, self._pending = self._pending[6:6 + length], self._pending[6 + length:]
            asked = self._open.pop(transaction, None)
            if asked is None or asked.unit != body[0] or asked.pdu[0] != body[1] & 0x7F:
                self.strays.append((transaction, body))
                continue
            asked.answered, asked.reply = now, body[1:]
            asked.done.set_result(None)


async def with_clients(port, count, work):
    """Runs work(clients), closes them, and returns what it returned."""
    clients = [await Client.connect(port) for _ in range(count)]
    try:
        return await work(clients)
    finally:
        for client in clients:
            client.close()


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
