#!/usr/bin/env python3
"""pymodbus_forwarder.py TTY BAUD: pymodbus' own forwarder example, with a serial line behind it: a
RemoteSlaveContext for each unit on one serial client. Prints "listening PORT"."""
import asyncio
import sys

from pymodbus.client import ModbusSerialClient
from pymodbus.datastore import ModbusServerContext
from pymodbus.datastore.remote import RemoteSlaveContext
from pymodbus.server.async_io import ModbusTcpServer


async def serve(tty, baud):
    # A pseudo-terminal has no parity, and pyserial cannot set anything again once it has asked for it.
    client = ModbusSerialClient(port=tty, baudrate=baud, bytesize=8, parity="N", stopbits=1)
    assert client.connect(), tty
    units = {unit: RemoteSlaveContext(client, unit=unit) for unit in range(1, 9)}
    server = ModbusTcpServer(ModbusServerContext(slaves=units, single=False),
                             address=("127.0.0.1", 0), backlog=1024)
    served = asyncio.create_task(server.serve_forever())
    await server.serving
    print("listening", server.server.sockets[0].getsockname()[1], flush=True)
    await served


if __name__ == "__main__":
    asyncio.run(serve(sys.argv[1], int(sys.argv[2])))
