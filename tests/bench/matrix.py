#!/usr/bin/env python3
"""Every foreign client that Debian or npm packages, against each of the five panels.

The gateway has one simulated line with all five, and its defaults. Each client reads and writes one and
several items of each table that the panel has, by its own usual calls. Another client has put there what is
read, mbpoll reads back what was written, and the trace tells which frames the panel got for each call: as many
and of such functions as the profile and the translation say. Exit code 1 when a value is wrong, when a client was
refused what the panel can do, or when the bus carried other frames. What is not installed is said.

Debian: mbpoll libmodbus-dev python3-pymodbus libqt5serialbus5-dev qt6-serialbus-dev g++ zabbix-agent2
collectd-core nmap linuxcnc-uspace; npm: modbus-serial jsmodbus modbus-stream h5.modbus node-red
node-red-contrib-modbus@5.23.3 (later ones want a library that npm does not have) @frangoteam/fuxa (with its
sqlite3 built), in a FOLDER: --npm FOLDER.
"""
import argparse
import contextlib
import datetime
import os
import pathlib
import platform
import re
import struct
import sys
import tempfile
import time
from collections import Counter, namedtuple

HERE = pathlib.Path(__file__).resolve()
sys.path[:0] = [str(HERE.parents[1] / "system"), str(HERE.parent / "foreign"), str(HERE.parent)]
import config  # noqa: E402
import harness  # noqa: E402
import plain_clients  # noqa: E402
import plant_tools  # noqa: E402
import polling_clients  # noqa: E402

LINE = "floor1"
FUNCTIONS = {("read", "coils"): 1, ("read", "discrete"): 2, ("read", "holding"): 3, ("read", "inputs"): 4,
             ("set", "coils"): 5, ("set", "holding"): 6, ("write", "coils"): 15, ("write", "holding"): 16}
INSTEAD = {5: 15, 6: 16}
NOT_PACKAGED = "minimalmodbus, umodbus, pyModbusTCP, Perl's Device::Modbus, modpoll"
SEVERAL, MOST = 10, 125
PAUSE = 0.2  # seconds between two looks at what a client has read by itself

Panel = namedtuple("Panel", "name unit profile has coils words fixed")
Panel.__doc__ = """`has`: functions of the manual; `coils`, `words`: where items may be written, None without;
`fixed`: what cannot be written, [(table, address, values)], values None: as the words there."""
PANELS = [
    Panel("press", 31, "autonics-gplp-s", (1, 3, 15, 16), 1600, 1000, ()),
    Panel("mixer", 5, "autonics-gp-2005", (3, 16), None, 1000, ()),
    Panel("io", 17, "autonics-arm", (1, 2, 3, 4, 5, 6, 16), 20, 600,
          (("discrete", 0, (0, 1, 0, 1, 1, 0, 0, 1)), ("inputs", 104, (16722, 19757, 17481, 12598)))),
    Panel("oven", 20, "panasonic-gt", (1, 3, 4, 5, 6, 15, 16), 275, 1000, (("inputs", 1000, None),)),
    Panel("filler", 1, "omron-cp2e", (1, 3, 6, 15, 16), 480, 1000, ()),
]

Call = namedtuple("Call", "verb table unit address values expected function")
Call.__doc__ = """`values`: of a read [how many]; `expected`: what it tells, or None: the panel has no such function;
`function`: the one on the wire."""


def words_of(seed, count):
    return [(seed * 7919 + i * 257 + 1) & 0xFFFF for i in range(count)]


def bits_of(seed, count):
    return [(seed + 1) * 0x9E3779B1 >> i + 12 & 1 for i in range(count)]


def on_the_wire(panel, verb, table):
    """(function, whether the panel has it)"""
    asked = FUNCTIONS[verb, table]
    sent = asked if asked in panel.has or INSTEAD.get(asked) not in panel.has else INSTEAD[asked]
    return sent, sent in panel.has


def calls_of(panel, seed):
    """What a client does to this panel; reads first, because writes change what they find."""
    def call(verb, table, address, values, expected=()):
        function, is_there = on_the_wire(panel, verb, table)
        return Call(verb, table, panel.unit, address, values, list(expected) if is_there else None, function)

    words = words_of(seed, MOST)
    yield from (call("read", "holding", panel.words, [n], words[:n]) for n in (1, SEVERAL, MOST))
    for table, address, values in panel.fixed:
        yield from (call("read", table, address, [n], (values or words)[:n]) for n in (1, 4))
    # What is written lies beside what is read: some clients do both all the time.
    new = words_of(seed + 1, SEVERAL)
    yield call("set", "holding", panel.words + 200, new[:1])
    yield call("write", "holding", panel.words + 210, new)
    if panel.coils is not None:
        bits = bits_of(seed, SEVERAL)
        yield from (call("read", "coils", panel.coils, [n], bits[:n]) for n in (1, SEVERAL))
        yield from (call("set", "coils", panel.coils + SEVERAL, [bit]) for bit in (1, 0))
        yield call("write", "coils", panel.coils + SEVERAL + 1, bits_of(seed + 1, SEVERAL))


def prepare(program, panel, seed):
    """Puts what is to be read, by functions that the panel has."""
    words, bits = words_of(seed, MOST), bits_of(seed, SEVERAL)
    requests = [struct.pack(f">BHHB{n}H", 16, panel.words + at, n, 2 * n, *words[at:at + n])
                for at, n in ((0, 100), (100, MOST - 100))]
    if panel.coils is not None and 15 in panel.has:
        packed = sum(bit << i for i, bit in enumerate(bits))
        requests.append(struct.pack(">BHHBH", 15, panel.coils, SEVERAL, 2, (packed & 0xFF) << 8 | packed >> 8))
    elif panel.coils is not None:
        requests += [struct.pack(">BHH", 5, panel.coils + i, 0xFF00 * bit) for i, bit in enumerate(bits)]
    with program.client() as client:
        for request in requests:
            answer = client.ask(panel.unit, request)
            assert answer == request[:5], (panel.name, request.hex(), answer.hex())


class Wire:
    """What went out to panels, as the trace has it, by unit: `requests`, and what the gateway asked `again`, as it
    does when an answer may be a copy of an earlier one."""

    def __init__(self, program):
        self._program = program
        self._next = 0
        self.requests, self.again = Counter(), Counter()
        self.functions()
        self.requests.clear()
        self.again.clear()

    def functions(self, unit=None):
        """Of the requests since the last time, to this unit or to all."""
        found = []
        while True:
            body = self._program.get(f"/api/v1/lines/{LINE}/trace?since={self._next}")[1]
            if not body["frames"]:
                return found
            self._next = body["next"]
            for frame in body["frames"]:
                if frame["direction"] == "sent":
                    data, is_first = bytes.fromhex(frame["bytes"]), frame["note"] == "request"
                    (self.requests if is_first else self.again)[data[0]] += 1
                    found += [data[1]] if is_first and unit in (None, data[0]) else []


def counted(program):
    """Requests that were on the wire by station, as the metrics have it."""
    found = re.findall(r'panelgate_requests_total\{[^}]*station="([^"]+)"[^}]*outcome="(?:ok|exception)"\} (\d+)',
                       program.get("/metrics")[1])
    total = Counter()
    for station, count in found:
        total[station] += int(count)
    return total


class Result:
    """Of a client at a panel."""

    def __init__(self):
        self.right = self.calls = self.refused = self.frames = self.again = 0
        self.broken = []

    def text(self):
        refused = f" ({self.refused} refused)" if self.refused else ""
        return f"{self.right}/{self.calls}{refused}, {self.frames}+{self.again}"


def wanted_answer(call):
    if call.expected is None:
        return "exception 1"
    return plain_clients.told(call.expected) if call.verb == "read" else "ok"


def asked_until_right(ask, call, wanted, patience):
    end = time.monotonic() + patience
    while True:
        answer = ask(*call[:5])
        if answer == wanted or time.monotonic() > end:
            return answer
        time.sleep(PAUSE)


def read_back(reader, call, patience):
    """What is wrong with what stands there now; [] when it is what was written."""
    asked = call._replace(verb="read", values=[len(call.values)])
    wanted = plain_clients.told(call.values)
    seen = asked_until_right(reader, asked, wanted, patience)
    return [] if seen == wanted else [f"written {call.values}, there is {seen}"]


def judge(client, ask, reader, wire, call, result):
    patience = harness.PATIENCE if client.polls else 0
    wanted = wanted_answer(call)
    wire.functions()
    answer = asked_until_right(ask, call, wanted, patience)
    functions = wire.functions(call.unit)
    wrong = [] if answer == wanted else [f"{answer} instead of {wanted}"]
    is_once = functions == [call.function] or (client.insists and call.expected is None)
    if not client.polls and not is_once:
        wrong.append(f"functions {functions} on the bus instead of [{call.function}]")
    if call.verb != "read" and call.expected is not None:
        wrong += read_back(reader, call, patience)
    result.calls += 1
    result.right += not wrong
    result.refused += call.expected is None
    if wrong:
        what = " ".join(map(str, [call.verb, call.table, call.address, *call.values[:4]]))
        result.broken.append(f"{what}: {'; '.join(wrong)}")


def try_client(client, seed):
    """{panel: Result}"""
    stations = ", ".join(f"{{id: {p.unit}, name: {p.name}, profile: {p.profile}}}" for p in PANELS)
    calls = {p: [c for c in calls_of(p, seed) if client.can(c)] for p in PANELS}
    results = {panel: Result() for panel in PANELS}
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        program = stack.enter_context(harness.configured(
            config.gateway(config.line(LINE, stations=stations), http=config.ADMIN)))
        for panel in PANELS:
            prepare(program, panel, seed)
        port = program.modbus_port()
        reader = stack.enter_context(plain_clients.Mbpoll("reader").running(port, folder, []))
        wire, before = Wire(program), counted(program)
        with client.running(port, folder, sum(calls.values(), [])) as ask:
            for panel, result in results.items():
                for call in calls[panel]:
                    judge(client, ask, reader, wire, call, result)
                for wrong in client.survey(panel.unit):
                    result.calls += 1
                    result.right += not wrong
                    result.broken += [wrong] if wrong else []
        wire.functions()
        after = counted(program)
        for panel, result in results.items():
            result.frames, result.again = wire.requests[panel.unit], wire.again[panel.unit]
            asked = after[panel.name] - before[panel.name]
            if abs(result.frames - asked) > client.polls:  # it may leave while one is under way
                result.broken.append(f"{result.frames} frames for {asked} requests")
    return results


def head():
    text = re.search(r'PRETTY_NAME="(.*)"', pathlib.Path("/etc/os-release").read_text()).group(1)
    return (f"{platform.machine()}, {os.cpu_count()} cores, {text}, Linux {platform.release()}, "
            f"{datetime.date.today()}; {harness.run('--version').stdout.splitlines()[0]}\n"
            "calls that went right / calls (of these: what the panel has no function for, and says so), frames of "
            "requests on the bus + those asked again; reading back is among them\n"
            f"{'client':<30}" + "".join(f"{panel.name:<26}" for panel in PANELS))


def print_row(client, results):
    print(f"{client.name + ' ' + client.version:<30}"
          + "".join(f"{result.text():<26}" for result in results.values()), flush=True)
    for panel, result in results.items():
        for line in result.broken:
            print(f"    {panel.name}: {line}", flush=True)


def main():
    clients = plain_clients.everyone() + plant_tools.everyone() + polling_clients.everyone()
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--panelgate", help="the program (default: $PANELGATE, else build/release)")
    parser.add_argument("--npm", default="", metavar="FOLDER", help="where npm has installed its clients")
    parser.add_argument("--only", nargs="+", metavar="CLIENT", choices=[c.name for c in clients])
    chosen = parser.parse_args()
    if chosen.panelgate:
        harness.PANELGATE = chosen.panelgate
    os.environ["NODE_PATH"] = str(pathlib.Path(chosen.npm).resolve() / "node_modules")
    print(head(), flush=True)
    failed = 0
    for seed, client in enumerate(clients, 1):
        if chosen.only and client.name not in chosen.only:
            continue
        if reason := client.missing():
            print(f"{client.name:<30}left out: {reason}", flush=True)
            continue
        results = try_client(client, 100 * seed)
        failed += any(result.broken for result in results.values())
        print_row(client, results)
    print(f"not packaged by Debian 12: {NOT_PACKAGED}")
    sys.exit(failed > 0)


if __name__ == "__main__":
    main()
