"""Gateways with generated rules, their panels and the ways in, for test_access_cases."""
import collections
import contextlib
import http.client
import json
import os
import pathlib
import re
import select
import socket
import struct
import tempfile
import time
import tty

import config
import harness
import mqtt_side
from access_reference import COILS, DISCRETE, HOLDING, INPUT, Panel, Range, Rule, Station, Who
from rtu_bus import RtuBus
from test_points import until

SOURCES = ("127.0.0.1", "127.0.0.7", "127.0.1.7", "127.5.0.1")
NETWORKS = ("127.0.0.0/24", "127.0.0.7/32", "127.0.0.0/16", "127.0.0.0/8", "127.5.0.0/16", "0.0.0.0/0", "10.0.0.0/8", "fd00::/8")
TOKENS = {"eye": "viewer", "ops": "operator", "lab": "engineer", "boss": "admin"}
ROLES = ("viewer", "operator", "engineer", "admin")
NEAR, ALIASED, WEB, PLC = "127.0.0.2:0", "127.0.0.3:0", "127.0.0.1:0", "plc"
POLLED = (300, 20)  # holding registers of the meter
UNLISTED = 99
BAUD = 38400
# The panel of a file of its own: 04 reads the same registers as 03, and is not known to it.
TWIN = """
description: Acme Twin, a panel of this test
manual: none
stations: {first: 1, last: 99, source: p. 1}
serial: {baud: [38400], parity: [none], stop_bits: [1], source: p. 1}
functions: [{code: 3, source: p. 1}, {code: 16, broadcast: true, source: p. 1}]
areas:
  - {name: V, description: words, notation: {prefix: V}, table: holding-registers, also: [input-registers],
     readable: [0, 999], writable: [0, 999], source: p. 1}
timing: {frame_gap_characters: 3.5, source: p. 1}
exceptions: [{code: 2, meaning: no such word}]
"""


PANELS = {
    "generic": Panel(frozenset((1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 15, 16, 17, 20, 21, 22, 23, 24, 43)),
                     {"0": (COILS, 0, 65535), "1": (DISCRETE, 0, 65535), "3": (INPUT, 0, 65535), "4": (HOLDING, 0, 65535)}),
    "panasonic-gt": Panel(frozenset((1, 3, 4, 5, 6, 15, 16)), {"GDT": (HOLDING, 0, 2047), "GR": (COILS, 0, 4095)},
                          same=((HOLDING, INPUT, 2047),)),
    "autonics-gplp-s": Panel(frozenset((1, 3, 15, 16)), {"UW": (HOLDING, 0, 6047), "UB": (COILS, 0, 65535)}, words=4096),
    "omron-cp2e": Panel(frozenset((1, 3, 6, 15, 16)), {"D": (HOLDING, 0, 16383), "W": (COILS, 0, 2047)}),
    "acme-twin": Panel(frozenset((3, 16)), {"V": (HOLDING, 0, 999)}, same=((HOLDING, INPUT, 999),)),
}
# What REST may write there, by table.
WRITABLE = {"generic": {HOLDING: (0, 65535), COILS: (0, 65535)}, "panasonic-gt": {HOLDING: (0, 2047), COILS: (0, 4095)},
            "autonics-gplp-s": {HOLDING: (15, 6047), COILS: (240, 65535)}, "omron-cp2e": {HOLDING: (0, 16383), COILS: (0, 2047)},
            "acme-twin": {HOLDING: (0, 999)}}
LISTED = (("floor1", 1, "filler", "omron-cp2e"), ("floor1", 7, "meter", "generic"), ("floor1", 20, "oven", "panasonic-gt"),
          ("floor1", 31, "press", "autonics-gplp-s"), ("floor1", 40, "twin", "acme-twin"), ("floor2", 7, "annex", "generic"))
Point = collections.namedtuple("Point", "station name table first count")
READS_OF = {COILS: 1, HOLDING: 3}
# What the face `mqtt` needs.
BROKERS = bool(mqtt_side.BROKER and mqtt_side.paho)
ALIASES = {101: ("floor1", 7), 131: ("floor1", 31), 77: ("floor2", 7)}  # of the second listener


def notation(letter, address):
    if letter in ("UB", "GR"):
        return f"{letter}{address // 16}{address % 16:X}"
    if letter == "W":
        return f"W{address // 16}.{address % 16:02}"
    return f"{letter}{address + 1:05}" if letter in "0134" else f"{letter}{address}"


def answer(frame):
    """What each panel answers: registers hold their own address, and everything is taken. No sooner than on a
    real line: what confirms a write before that can have left may be its echo, and is read back."""
    time.sleep(11 * len(frame) / BAUD + 0.002)
    pdu = frame[1:-2]
    function, (first, count) = pdu[0], struct.unpack(">HH", pdu[1:5].ljust(4, b"\0"))
    if function in (1, 2):
        return bytes((function, (count + 7) // 8)) + bytes((count + 7) // 8)
    if function in (3, 4, 23):
        return struct.pack(f">BB{count}H", function, 2 * count, *((first + i) & 0xFFFF for i in range(count)))
    fixed = {7: "07 00", 11: "0B 0000 0000", 17: "11 02 01 FF", 20: "14 06 05 06 000D 00FE", 24: "18 0004 0001 0007",
             43: "2B 0E 01 01 00 00 00", 65: "41 01 00"}
    if function in fixed:
        return bytes.fromhex(fixed[function])
    return pdu[:5] if function in (5, 6, 15, 16) else pdu  # 08, 21, 22: as they came


class Generator:
    """Rules and requests that meet each other at their edges."""

    def __init__(self, random, broker=None):
        self.random, self.broker = random, broker
        self.listeners = (NEAR, ALIASED, WEB, PLC, *([broker_name(broker)] if broker else []))
        translating = {name: random.random() < 0.7 for _, _, name, _ in LISTED}
        self.stations = [Station(line, number, PANELS[profile], name, translating[name])
                         for line, number, name, profile in LISTED]
        self.profiles = {name: profile for _, _, name, profile in LISTED}
        self.unlisted = Station("floor1", UNLISTED, Panel(frozenset(range(128)), {}))
        self.max_age = random.choice(("0ms", "10s"))
        self.default = random.random() < 0.6
        # One client who may see all: the test itself.
        self.rules = [Rule("auditor-reads", True, ("read",), tokens=("auditor",))]
        self.rules += [self._rule(i) for i in range(random.randint(3, 24))]
        self.points = [point for one in self.stations for point in self._points(one)] if broker else []

    def _some(self, chance, of, most=3):
        if self.random.random() >= chance:
            return ()
        return tuple(self.random.sample(of, self.random.randint(1, min(most, len(of)))))

    def _rule(self, number):
        random = self.random
        stations = self._some(0.5, [*self.stations, self.unlisted])
        found = self._range(stations) if random.random() < 0.6 else None
        return Rule(f"rule-{number}", random.random() < 0.5,
                    tuple(random.sample(("read", "write", "broadcast", "raw"), random.randint(1, 4))),
                    sources=self._some(0.3, NETWORKS), roles=self._some(0.25, ROLES), tokens=self._some(0.1, list(TOKENS)),
                    faces=self._some(0.25, ("modbus_tcp", "http", "serial_master", "mqtt")),
                    listeners=self._some(0.15, self.listeners), places=tuple(one.place for one in stations),
                    functions=self._some(0.25, (1, 3, 4, 5, 6, 15, 16, 20, 22, 23, 24, 43, 65), 6), range=found)

    def _range(self, stations):
        random = self.random
        panels = [one.panel for one in stations] or [one.panel for one in self.stations]
        letters = [letter for panel in panels for letter in panel.letters]
        if stations:  # it has to be known at each of them
            letters = [letter for letter in letters if all(letter in panel.letters for panel in panels)]
        letter = random.choice(letters) if letters and random.random() < 0.6 else ""
        table = next(panel.letters[letter][0] for panel in panels if letter in panel.letters) if letter else \
            random.choice((HOLDING, HOLDING, INPUT, COILS, DISCRETE))
        base = random.choice((100, 104, 110, *POLLED[:1])) + random.randint(0, 6)
        count = random.choice((1, 1, 2, 5, 16, 40))
        if table in (COILS, DISCRETE):
            base, count = base * 16 + random.randint(0, 15), random.choice((1, 3, 16, 33, 64))
            if letter in ("GR", "W"):
                base %= 1900  # within the panel
        if random.random() < 0.05 and letter in ("", "0", "1", "3", "4"):
            base, count = 65535 - count, count + 1  # to the very end
        return Range(table, base, base + count - 1, letter)

    def _points(self, station):
        """One in each table in which it has writable memory: no two of them are read together."""
        for letter, (table, _, _) in station.panel.letters.items():
            limits = WRITABLE[self.profiles[station.name]].get(table)
            if limits is None:
                continue
            first, count = self.span(station, table, *limits)
            count = 1 if table == COILS else min(count, 2)
            yield Point(station, f"{'bit' if table == COILS else 'word'}-{letter.lower()}", table, first, count)

    def edges(self, station, table):
        """Addresses around which somebody's rights change."""
        found = set()
        for rule in self.rules:
            if rule.range is None:
                continue
            first, last = rule.range.first, rule.range.last
            if rule.range.table in (COILS, DISCRETE) and table in (HOLDING, INPUT):
                first, last = first // 16, last // 16
            elif rule.range.table in (HOLDING, INPUT) and table in (COILS, DISCRETE):
                first, last = first * 16, last * 16 + 15
            found |= {first, last + 1}
        return sorted(one for one in found if 0 <= one <= 65535) or [100]

    def span(self, station, table, least=0, most=65535):
        random = self.random
        count = random.choice((1, 1, 2, 3, 5, 12))
        near = random.choice(self.edges(station, table)) if random.random() < 0.85 else random.randint(90, 330)
        return max(least, min(near - random.randint(0, count), most - count + 1)), count

    def pdu(self, station, broadcast=False):
        random = self.random
        functions = (5, 6, 15, 16) if broadcast else (1, 2, 3, 3, 4, 4, 5, 6, 15, 16, 22, 23, 23, 8, 11, 17, 20, 21, 24, 43, 65, 7)
        function = random.choice(functions)
        table = {1: COILS, 2: DISCRETE, 4: INPUT, 5: COILS, 15: COILS}.get(function, HOLDING)
        return self.pdu_of(station, function, *self.span(station, table))

    def pdu_of(self, station, function, first, count):
        random = self.random
        if function in (1, 2, 3, 4):
            return struct.pack(">BHH", function, first, count)
        if function == 5:
            return struct.pack(">BHH", 5, first, random.choice((0, 0xFF00)))
        if function == 6:
            return struct.pack(">BHH", 6, first, random.randint(0, 65535))
        if function == 15:
            data = bytes((count + 7) // 8)
            return struct.pack(">BHHB", 15, first, count, len(data)) + data
        if function == 16:
            return struct.pack(">BHHB", 16, first, count, 2 * count) + random.randbytes(2 * count)
        if function == 22:
            return struct.pack(">BHHH", 22, first, 0xFFFF, 0)
        if function == 23:
            read, number = self.span(station, HOLDING)
            return struct.pack(">BHHHHB", 23, read, number, first, count, 2 * count) + bytes(2 * count)
        return bytes.fromhex({7: "07", 8: "08 0000 A537", 11: "0B", 17: "11", 20: "14 07 06 0004 0001 0002",
                              21: "15 09 06 0004 0007 0001 06AF", 24: "18 04DE", 43: "2B 0E 01 00", 65: "41 01 07"}[function])

    def text(self, folder, buses, serial):
        """The gateway's file."""
        def station(one):
            more = f", max_age: {self.max_age}, poll: [{{read: \"400301\", count: {POLLED[1]}, every: 200ms}}]" if one.name == "meter" else ""
            profile = self.profiles[one.name]
            points = ", ".join(point(each) for each in self.points if each.station is one)
            return (f"{{id: {one.id}, name: {one.name}, profile: {profile}, translate: {'auto' if one.translates else 'off'}{more}"
                    f"{f', points: [{points}]' if points else ''}}}")

        def point(one):
            letter = next(letter for letter, known in one.station.panel.letters.items() if known[0] == one.table)
            kind = "" if one.table == COILS else f", type: u{16 * one.count}"
            return f'{{name: {one.name}, at: "{notation(letter, one.first)}"{kind}, writable: true, every: 600min}}'
        quick = {"echo": "off", "timing": "{broadcast_turnaround: 5ms}", "serial": f"{{baud: {BAUD}, parity: none}}"}
        lines = []
        for name, link in buses.items():
            own = ", ".join(station(one) for one in self.stations if one.line == name)
            lines.append(f"  - {{name: {name}, device: {link}, " + ", ".join(f"{k}: {v}" for k, v in quick.items()) +
                         f", stations: [{own}]}}\n")
        tokens = ", ".join(f"{{name: {name}, role: {role}, file: {folder}/{name}}}" for name, role in
                           (*TOKENS.items(), ("auditor", "viewer")))
        units = ", ".join(f"{unit}: {line}/{number}" for unit, (line, number) in ALIASES.items())
        text = config.gateway(*lines, modbus=None, http=f'listen: "{WEB}", anonymous: operator, tokens: [{tokens}]',
                              profiles_dir=folder, serial_masters=f"[{{name: {PLC}, device: {serial}, lines: [floor1], "
                                                                  "serial: {baud: 38400, parity: none}}]")
        text += f'modbus_tcp:\n  - {{listen: "{NEAR}", lines: [floor1], udp: true}}\n'
        text += f'  - {{listen: "{ALIASED}", lines: [floor1], units: {{{units}}}}}\n'
        if self.broker:
            text += f"mqtt: {{broker: '{broker_name(self.broker)}', topic: {mqtt_side.TOPIC}, write: points}}\n"
        text += f"access:\n  default: {'allow' if self.default else 'deny'}\n  rules:\n"
        return text + "".join(f"    - {self._yaml(rule)}\n" for rule in self.rules)

    def _yaml(self, rule):
        keys = {"name": rule.name, "allow" if rule.allow else "deny": _list(rule.acts), "from": _list(f'"{one}"' for one in rule.sources),
                "roles": _list(rule.roles), "tokens": _list(rule.tokens), "faces": _list(rule.faces),
                "listeners": _list(f'"{one}"' for one in rule.listeners), "functions": _list(rule.functions),
                "stations": _list(next((s.name for s in self.stations if s.place == place), f"{place[0]}/{place[1]}")
                                  for place in rule.places)}
        if rule.range:
            named = rule.range
            if named.letter:
                first, last = notation(named.letter, named.first), notation(named.letter, named.last)
                keys["range"] = f'"{first}-{last}"' if named.last > named.first else f'"{first}"'
            else:
                keys["range"] = f"{{table: {named.table}, address: {named.first}, count: {named.last - named.first + 1}}}"
        return "{" + ", ".join(f"{key}: {value}" for key, value in keys.items() if value != "[]") + "}"


def broker_name(broker):
    return f"mqtt://127.0.0.1:{broker.port}"


def _list(words):
    return f"[{', '.join(str(word) for word in words)}]"


class Modbus:
    """A client of a Modbus/TCP listener, by TCP or UDP."""

    def __init__(self, port, listener, source, datagrams=False):
        host = listener.split(":")[0]
        self.who = Who("udp" if datagrams else "modbus_tcp", "operator", listener, source)
        self._socket = socket.socket(type=socket.SOCK_DGRAM if datagrams else socket.SOCK_STREAM)
        self._socket.settimeout(harness.PATIENCE)
        self._socket.bind((source, 0))
        self._socket.connect((host, port))
        self._sent = 0

    def close(self):
        self._socket.close()

    def start(self, unit, pdu):
        self._sent += 1
        self._socket.sendall(harness.adu(self._sent, unit, pdu))

    def finish(self):
        """The reply's PDU."""
        data = self._socket.recv(512)
        while len(data) < 7 or len(data) < 6 + int.from_bytes(data[4:6], "big"):
            data += self._socket.recv(512)
        return data[7:]


class Serial:
    """A master on the gateway's serial port."""

    def __init__(self, device):
        self.who = Who("serial_master", "operator", PLC)
        self._master = device

    def close(self):
        pass

    def start(self, unit, pdu):
        os.write(self._master, harness.rtu(unit, pdu))

    def finish(self):
        data = b""
        while len(data) < 5 or harness.crc(data[:-2]) != data[-2:]:
            if not select.select([self._master], [], [], harness.PATIENCE)[0]:
                raise AssertionError(f"the master heard no more than {data.hex()}")
            data += os.read(self._master, 300)
        return data[1:-2]


class Rest:
    """A client of REST; its answers are (status, body)."""

    def __init__(self, port, source, token=""):
        self.who = Who("http", TOKENS.get(token, "operator"), WEB, source, token)
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=harness.PATIENCE, source_address=(source, 0))
        self._headers = {"Authorization": f"Bearer token-of-{token}-0123456789"} if token else {}

    def close(self):
        self._connection.close()

    def start(self, method, path, body=None):
        self._connection.request(method, path, None if body is None else json.dumps(body), self._headers)

    def finish(self):
        response = self._connection.getresponse()
        return response.status, json.loads(response.read())


class Mqtt:
    """A client of the broker; its answers are (status, body)."""

    def __init__(self, listener, broker):
        self.who = Who("mqtt", "operator", broker_name(broker))
        self._listener, self._result, self._before = listener, None, 0

    def close(self):
        pass

    def start(self, place, value):
        topic = f"{mqtt_side.TOPIC}/{place}/set"
        self._result = f"{topic}/result"
        self._before = len(self._listener.of(self._result))
        self._listener.publish(topic, json.dumps(value))

    def finish(self):
        body = self._listener.wait_for(self._result, after=self._before)
        return (200 if body["ok"] else body["status"]), body


class Plant:
    """A running gateway with the generator's rules. `listener`: at the broker."""

    def __init__(self, program, buses, master, broker=None, listener=None):
        self.program, self.buses = program, buses
        self.broker, self.listener = broker, listener
        self._master = master
        self._clients = {}
        self._looker = None
        port = lambda listener: int(program.log.wait_for(rf"listening modbus_tcp={re.escape(listener[:-1])}(\d+)$").group(1))
        self._ports = {NEAR: port(NEAR), ALIASED: port(ALIASED)}

    def client(self, kind, *of):
        """modbus LISTENER SOURCE | udp SOURCE | http SOURCE TOKEN | serial | mqtt; one of each is kept."""
        key = (kind, *of)
        if key not in self._clients:
            self._clients[key] = self._made(kind, *of)
        return self._clients[key]

    def _made(self, kind, *of):
        if kind == "modbus":
            return Modbus(self._ports[of[0]], *of)
        if kind == "udp":
            return Modbus(self._ports[NEAR], NEAR, of[0], datagrams=True)
        if kind == "mqtt":
            return Mqtt(self.listener, self.broker)
        return Serial(self._master) if kind == "serial" else Rest(self.program.http_port(), *of)

    def has_read(self, count):
        """So many points; none is read again by itself."""
        self._looker = self._looker or Rest(self.program.http_port(), SOURCES[0], "auditor")
        self._looker.start("GET", "/api/v1/points")
        points = self._looker.finish()[1]["points"]
        return len(points) == count and all(one["quality"] == "good" for one in points)

    def published(self):
        """"STATION/POINT" of all points that the broker has been told of by now."""
        until(lambda: mqtt_side.metric(self.program, "stored") == 0)
        marker = f"{mqtt_side.TOPIC}/marker"  # behind all of them
        self.listener.publish(marker, "0")
        self.listener.wait_for(marker)
        beginning = f"{mqtt_side.TOPIC}/"
        told = {topic.removeprefix(beginning) for topic, _, _ in self.listener.received}
        return {place for place in told if re.fullmatch(r"[^/]+/(bit|word)-[^/]+", place)}

    def frames(self):
        """{line: how many so far}"""
        return {line: len(bus.frames()) for line, bus in self.buses.items()}

    def since(self, before):
        """[(line, station, PDU)]"""
        return [(line, frame.bytes[0], frame.bytes[1:-2]) for line, bus in self.buses.items() for frame in bus.frames()[before[line]:]]

    def close(self):
        for one in (*self._clients.values(), *([self._looker] if self._looker else [])):
            one.close()


@contextlib.contextmanager
def running(generator):
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
        for name in (*TOKENS, "auditor"):
            file = pathlib.Path(folder) / name
            file.write_text(f"token-of-{name}-0123456789")
            file.chmod(0o600)
        (pathlib.Path(folder) / "acme-twin.yaml").write_text(TWIN)
        stations = {one: answer for one in range(1, 248)}
        links = {line: f"{folder}/{line}" for line in ("floor1", "floor2")}
        buses = {line: stack.enter_context(RtuBus(link, stations)) for line, link in links.items()}
        master, slave = os.openpty()
        stack.callback(os.close, master)
        stack.callback(os.close, slave)
        tty.setraw(slave)
        broker = generator.broker
        listener = stack.enter_context(mqtt_side.Listener(broker)) if broker else None
        text = generator.text(folder, links, os.ttyname(slave))
        with harness.configured(text) as program:
            program.log.wait_for("line up line=floor2")
            program.log.wait_for("line up line=floor1")
            program.log.wait_for("serial master up")  # what came before is not heard
            plant = Plant(program, buses, master, broker, listener)
            stack.callback(plant.close)
            if broker:
                program.log.wait_for("mqtt connected")
                until(lambda: plant.has_read(len(generator.points)))
            yield plant
