#!/usr/bin/env python3
"""pymodbus_slave.py TTY BAUD UNIT: pymodbus' own serial server. It prints `ready`. A holding register
holds unit * 257 + address * 31 + 7 until somebody writes it."""
import asyncio
import sys

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server.async_io import ModbusSerialServer
from pymodbus.transaction import ModbusRtuFramer

ALL = 0x10000


async def serve(tty, baud, unit):
    registers = [(unit * 257 + a * 31 + 7) & 0xFFFF for a in range(ALL)]
    panel = ModbusSlaveContext(co=ModbusSequentialDataBlock(0, [False] * ALL),
                               hr=ModbusSequentialDataBlock(0, registers), zero_mode=True)
    server = ModbusSerialServer(ModbusServerContext(slaves={unit: panel}, single=False),
                                framer=ModbusRtuFramer, port=tty, baudrate=baud)
    await server.start()
    print("ready", flush=True)
    await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(serve(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
