#!/usr/bin/env python3
"""hot_path.py PROGRAM OUTPUT: what a busy gateway executes, for PANELGATE_PROFILE. PROGRAM is one that was built
with PANELGATE_PROFILE=generate; OUTPUT is what the next build is given:

    cmake --preset release -B build/profile -DPANELGATE_UNITY=ON -DPANELGATE_PROFILE=generate
    cmake --build build/profile --target panelgate zoo_bus
    ZOO_BUS=build/profile/zoo_bus tests/bench/hot_path.py build/profile/panelgate src/hot_path.profdata

The way of a transaction at three rates, unpaced and over TCP, mostly reads. Needs Debian's llvm-19."""
import asyncio
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "system"))

UNITS = range(1, 9)
SECONDS = 6


async def write_now_and_then(port, end):
    client = await zoo_line.Client.connect(port)
    turn = 0
    while time.monotonic() < end:
        unit = UNITS[turn % len(UNITS)]
        await client.ask(unit, zoo_line.every_kind_of_write(turn))
        turn += 1
        await asyncio.sleep(0.25)
    client.close()


def train(baud, **wire):
    with zoo_line.odd_line(baud, UNITS, **wire) as line:
        port = line.program.modbus_port()
        readers = {unit: zoo_line.Reader(unit, count=10 if unit % 2 else 100) for unit in UNITS}
        asyncio.run(zoo_line.read_all(port, UNITS, SECONDS, readers,
                                      lambda end: write_now_and_then(port, end)))
        good = sum(reader.summary().good for reader in readers.values())
    print(f"{baud} {wire or 'tty'}: {good} good answers")
    if good == 0:
        sys.exit("hot_path.py: the gateway has answered nothing")


def main():
    output = pathlib.Path(sys.argv[2]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["LLVM_PROFILE_FILE"] = f"{folder}/%p.profraw"
        for baud in (9600, 38400, 115200):
            train(baud)
        train(115200, wire_baud=0)
        train(115200, tcp=True)
        raw = [str(path) for path in pathlib.Path(folder).glob("*.profraw")]
        if not raw:
            sys.exit(f"hot_path.py: {sys.argv[1]} was not built with PANELGATE_PROFILE=generate")
        subprocess.run(["llvm-profdata-19", "merge", "--sparse", "-o", str(output), *raw], check=True)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    os.environ["PANELGATE"] = str(pathlib.Path(sys.argv[1]).resolve())
    import zoo_line  # noqa: E402  (reads which program to run)
    main()
