#!/usr/bin/env python3
"""pymodbus_client.py HOST PORT: pymodbus' synchronous client with its own defaults. It speaks the
lines of plain_clients.py."""
import sys

import pymodbus
from pymodbus.client import ModbusTcpClient
from pymodbus.pdu import ExceptionResponse


def call(client, verb, table, unit, address, values):
    if verb == "read":
        reads = {"coils": client.read_coils, "discrete": client.read_discrete_inputs,
                 "holding": client.read_holding_registers, "inputs": client.read_input_registers}
        return reads[table](address, values[0], slave=unit)
    if verb == "set":
        if table == "coils":
            return client.write_coil(address, bool(values[0]), slave=unit)
        return client.write_register(address, values[0], slave=unit)
    if table == "coils":
        return client.write_coils(address, [bool(value) for value in values], slave=unit)
    return client.write_registers(address, values, slave=unit)


def told(reply, verb, table, count):
    if isinstance(reply, ExceptionResponse):
        return f"exception {reply.exception_code}"
    if reply.isError():
        return f"error {reply}"
    if verb != "read":
        return "ok"
    values = [int(bit) for bit in reply.bits[:count]] if table in ("coils", "discrete") else reply.registers
    return " ".join(["ok", *map(str, values)])


def main(host, port):
    with ModbusTcpClient(host, port=int(port)) as client:
        print("ready", pymodbus.version.version.short(), flush=True)
        for line in sys.stdin:
            verb, table, unit, address, *values = line.split()
            values = [int(value) for value in values]
            reply = call(client, verb, table, int(unit), int(address), values)
            print(told(reply, verb, table, values[0]), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
