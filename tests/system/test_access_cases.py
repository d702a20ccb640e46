"""Generated gateways, each with many rules, asked over all faces: what is answered, and what is on the wire, is what a reference
evaluator says that was written from the contract alone. ACCESS_CASES says how many, ACCESS_SEED which."""
import collections
import contextlib
import http.client
import os
import random
import re
import unittest

import mqtt_side
from access_plant import (ALIASED, ALIASES, BROKERS, NEAR, POLLED, READS_OF, SOURCES, TOKENS, UNLISTED, WRITABLE, Generator, answer,
                          notation, running)
from access_reference import COILS, DISCRETE, HOLDING, INPUT, denying, touches

CASES = int(os.environ.get("ACCESS_CASES", "200"))
SEED = int(os.environ.get("ACCESS_SEED", "0")) or random.SystemRandom().randint(1, 10**9)
EACH = 50 if CASES < 1000 else 100  # cases of one gateway
RANKS = ("viewer", "operator", "engineer", "admin")
READING = (1, 2, 3, 4, 7, 11, 17, 20, 24, 43)
POLL = (3).to_bytes(1, "big") + POLLED[0].to_bytes(2, "big") + POLLED[1].to_bytes(2, "big")


class Ask:
    """One thing that somebody asks. parts: [(stations, PDU as asked)], more than one of a batch; besides: raw, broadcast."""

    def __init__(self, client, start, parts, besides=(), needed="viewer"):
        self.client, self.start, self.parts, self.besides, self.hidden = client, start, parts, besides, False
        self.knocks_in_vain = client.who.face == "http" and RANKS.index(client.who.role) < RANKS.index(needed)

    def denials(self, of):
        """[names of the rules that deny a part]"""
        return [denying(of.rules, of.default, self.client.who, stations, pdu, self.besides) for stations, pdu in self.parts]

    def sent(self, index):
        """(line, station, PDU) of a part as it should be on the wire."""
        stations, pdu = self.parts[index]
        first = stations[0]
        if "broadcast" in self.besides:
            return first.line, 0, pdu
        return first.line, first.id, first.panel.sent(pdu) if first.translates else pdu

    def __repr__(self):
        return f"{self.client.who} {self.start} {self.besides}"


class Gateway:
    """The generator's requests to one plant, and what is made of them."""

    def __init__(self, test, generator, plant):
        self.test, self.of, self.plant, self.random = test, generator, plant, generator.random
        self.denied = 0
        self.tally = collections.Counter()

    def stations_of(self, line):
        return [one for one in self.of.stations if one.line == line]

    # What is asked

    def modbus(self):
        random = self.random
        kind = random.choice(("near", "near", "aliased", "udp", "serial"))
        source = random.choice(SOURCES)
        client = {"near": lambda: self.plant.client("modbus", NEAR, source), "udp": lambda: self.plant.client("udp", source),
                  "aliased": lambda: self.plant.client("modbus", ALIASED, source), "serial": lambda: self.plant.client("serial")}[kind]()
        if kind != "serial" and random.random() < 0.12:
            pdu = self.of.pdu(self.of.stations[1], broadcast=True)
            return Ask(client, (0, pdu), [(self.stations_of("floor1"), pdu)], ("broadcast",))
        station, unit = self.target(kind)
        pdu = self.of.pdu(station)
        return Ask(client, (unit, pdu), [([station], pdu)])

    def target(self, kind):
        """(station, unit by which it is asked)"""
        if kind == "aliased" and self.random.random() < 0.6:
            unit, place = self.random.choice(list(ALIASES.items()))
            return next(one for one in self.of.stations if one.place == place), unit
        listed = self.stations_of("floor1")
        if kind != "serial" and self.random.random() < 0.1:
            return self.of.unlisted, UNLISTED
        station = self.random.choice(listed)
        return station, station.id

    def rest_client(self):
        return self.plant.client("http", self.random.choice(SOURCES), self.random.choice(("", *TOKENS)))

    def rest(self):
        client = self.rest_client()
        kind = self.random.choice(("read", "read", "write", "write", "raw", "broadcast", "reads", "writes"))
        if kind == "read":
            path, _, part = self.place(writes=False)
            return Ask(client, ("GET", path), [part])
        if kind == "write":
            path, entry, part = self.place(writes=True)
            return Ask(client, ("PUT", path, {"values": entry["values"]}), [part], needed="operator")
        if kind == "raw":
            station = self.random.choice([*self.of.stations, self.of.unlisted])
            pdu = self.of.pdu(station)
            body = {"station": station.id, "pdu": pdu.hex()}
            return Ask(client, ("POST", f"/api/v1/lines/{station.line}/raw", body), [([station], pdu)], ("raw",), "engineer")
        if kind == "broadcast":
            return self.rest_broadcast(client)
        entries = [self.place(writes=kind == "writes")[1:] for _ in range(self.random.randint(2, 5))]
        path = "/api/v1/write" if kind == "writes" else "/api/v1/read"
        return Ask(client, ("POST", path, {"items": [entry for entry, _ in entries]}), [part for _, part in entries],
                   needed="operator" if kind == "writes" else "viewer")

    def rest_broadcast(self, client):
        line, table = self.random.choice(("floor1", "floor2")), self.random.choice((HOLDING, COILS))
        first, count = self.of.span(self.stations_of(line)[0], table)
        values = [self.random.randint(0, 1) for _ in range(count)]
        alone = count == 1 and line == "floor2"  # most panels of the other have 15 and 16 only
        body = {"table": table, "address": first, "values": values}
        return Ask(client, ("POST", f"/api/v1/lines/{line}/broadcast", body),
                   [(self.stations_of(line), written(table, first, values, alone))], ("broadcast",), "engineer")

    def place(self, writes):
        """(path, entry of a batch, part) of items of a station, by table or in its notation."""
        random = self.random
        station = random.choice([*self.of.stations, self.of.unlisted])
        limits = WRITABLE[self.of.profiles.get(station.name, "generic")]
        tables = list(limits)
        if not writes:
            tables += {"meter": [INPUT, DISCRETE], "annex": [INPUT, DISCRETE], "oven": [INPUT]}.get(station.name, [])
        table = random.choice(tables)
        first, count = self.of.span(station, table, *limits.get(table, limits[HOLDING]))
        name = station.name or f"{station.line}:{station.id}"
        letter = next((one for one, known in station.panel.letters.items() if known[0] == table), "")
        if letter and random.random() < 0.5:
            path, entry = f"devices/{notation(letter, first)}", {"station": name, "device": notation(letter, first)}
        else:
            path, entry = f"{table}/{first}", {"station": name, "table": table, "address": first}
        path = f"/api/v1/stations/{name}/{path}"
        if not writes:
            function = {COILS: 1, DISCRETE: 2, HOLDING: 3, INPUT: 4}[table]
            return f"{path}?count={count}", {**entry, "count": count}, ([station], self.of.pdu_of(station, function, first, count))
        values = [random.randint(0, 1) for _ in range(count)]
        alone = count == 1 and (5 if table == COILS else 6) in station.panel.functions
        return path, {**entry, "values": values}, ([station], written(table, first, values, alone))

    def same_read(self):
        """The same read of several clients."""
        random = self.random
        station = random.choice(self.stations_of("floor1"))
        function = 3 if station.name in ("twin", "press") else random.choice((3, 3, 4, 1))
        table = {1: COILS, 3: HOLDING, 4: INPUT}[function]
        first, count = self.of.span(station, table, *WRITABLE[self.of.profiles[station.name]].get(table, (0, 2047)))
        if station.name == "meter" and function == 3 and random.random() < 0.5:  # what is polled
            first, count = POLLED[0] + random.randint(0, 10), random.randint(1, 9)
        pdu = self.of.pdu_of(station, function, first, count)
        asks = [Ask(self.plant.client("modbus", NEAR, source), (station.id, pdu), [([station], pdu)]) for source in SOURCES]
        asks.append(Ask(self.plant.client("udp", random.choice(SOURCES)), (station.id, pdu), [([station], pdu)]))
        if function != 4 or 4 in station.panel.functions:
            path = f"/api/v1/stations/{station.name}/{table}/{first}?count={count}"
            tokens = random.sample(("", *TOKENS), 2)
            asks += [Ask(self.plant.client("http", SOURCES[0], token), ("GET", path), [([station], pdu)]) for token in tokens]
        random.shuffle(asks)
        return asks[:random.randint(2, len(asks))]

    def mqtt(self):
        """A write of a point by way of the broker."""
        point = self.random.choice(self.of.points)
        client = self.plant.client("mqtt")
        value = self.random.randint(0, 1 if point.table == COILS else 60000)
        values = [value] if point.count == 1 else [0, value]
        alone = point.count == 1 and (5 if point.table == COILS else 6) in point.station.panel.functions
        place = f"{point.station.name}/{point.name}"
        part = ([point.station], written(point.table, point.first, values, alone))
        ask = Ask(client, (place, bool(value) if point.table == COILS else value), [part])
        ask.hidden = place not in self.readable()
        return ask

    def readable(self):
        """"STATION/POINT" of what the broker's clients may read."""
        who = self.plant.client("mqtt").who
        return {f"{one.station.name}/{one.name}" for one in self.of.points
                if not denying(self.of.rules, self.of.default, who, [one.station], self.read_of(one))}

    def read_of(self, point):
        return self.of.pdu_of(point.station, READS_OF[point.table], point.first, point.count)

    # What is made of it

    def compare_published(self):
        """The broker is told of what its clients may read, and of nothing else."""
        self.test.assertEqual(self.plant.published(), self.readable(), "topics of points")

    def step(self):
        """Returns how many cases it was."""
        chance = self.random.random()
        if self.of.points and chance > 0.85:
            asks = [self.mqtt()]
        else:
            asks = self.same_read() if chance < 0.2 else [self.modbus() if chance < 0.6 else self.rest()]
        before = self.plant.frames()
        for ask in asks:
            ask.client.start(*ask.start)
        allowed = []
        for ask in asks:
            allowed += self.judge(ask, ask.client.finish())
        for line in {line for line, station, _ in allowed if station == 0}:  # told once it has left; now it has come
            self.await_broadcasts(line, before[line], sum(1 for one, station, _ in allowed if (one, station) == (line, 0)))
        self.compare(self.plant.since(before), allowed, asks)
        return len(asks)

    def await_broadcasts(self, line, before, count):
        bus = self.plant.buses[line]
        earlier = sum(1 for frame in bus.frames()[:before] if frame.bytes[0] == 0)
        bus.wait_for(earlier + count, 0)

    def judge(self, ask, got):
        """Compares an answer; returns [(line, station, PDU)] of what may have been sent for it."""
        denials = ask.denials(self.of)
        if ask.hidden:  # it has no topics
            self.test.assertEqual((got[0], got[1].get("detail")), (400, "there is no such point"), (ask, got))
            self.tally["hidden", "mqtt"] += 1
            return []
        if ask.client.who.face == "mqtt":
            results = [(got[0] == 200, got[0], got[1].get("rule"))]
        elif ask.client.who.face != "http":
            results = [(got[0] & 0x80 == 0, got[1] if got[0] & 0x80 else None, None)]
        elif ask.knocks_in_vain:
            self.test.assertIn(got[0], (401, 403), (ask, got))
            self.test.assertNotIn("rule", got[1], (ask, got))
            self.tally["role"] += 1
            return []
        else:
            bodies = [(one["status"], one) for one in got[1]["results"]] if "results" in got[1] else [got]
            results = [(status in (200, 202), status, body.get("rule")) for status, body in bodies]
        self.test.assertEqual(len(results), len(denials), (ask, got))
        allowed = []
        for index, ((passed, code, rule), names) in enumerate(zip(results, denials)):
            about = f"{ask} part {index}: {got}, by the contract denied by {names or 'nobody'}"
            self.test.assertEqual(passed, not names, about)
            self.tally["denied" if names else "allowed", ask.client.who.face] += 1
            if passed:
                allowed.append(ask.sent(index))
                continue
            self.denied += 1
            self.test.assertIn(code, (1, 403), about)
            if code == 403:
                self.test.assertIn(rule, names, about)
        if allowed and ask.client.who.face not in ("http", "mqtt") and ask.parts[0][1][0] in (1, 2, 3, 4, 23):
            self.test.assertEqual(got, answer(b"\0" + ask.parts[0][1] + b"\0\0"), ask)
        return allowed

    def compare(self, frames, allowed, asks):
        """Only what was allowed is on the wire, and each write once."""
        writes = collections.Counter(one for one in allowed if one[2][0] not in READING)
        for line, station, pdu in frames:
            about = f"{line} {station} {pdu.hex(' ')} is on the wire for {asks}"
            if writes[line, station, pdu] > 0:
                writes[line, station, pdu] -= 1
            elif (line, station, pdu) != ("floor1", 7, POLL):
                self.test.assertIn(pdu[0], READING, about)
                may = {one for where, which, sent in allowed if (where, which) == (line, station) for one in named(sent)}
                asked = set(named(pdu))
                polled = [set(named(POLL))] if (line, station) == ("floor1", 7) else []
                polled += [set(named(self.read_of(one))) for one in self.of.points if one.station.place == (line, station)]
                with_poll = any(poll <= asked <= poll | may for poll in polled)
                self.test.assertTrue(asked <= may or with_poll or self.joins(line, station, pdu, asks), about)
        self.test.assertEqual(+writes, collections.Counter(), f"sent: {frames}, for {asks}")
        is_cached = any(one[:2] == ("floor1", 7) for one in allowed)
        self.test.assertTrue(frames or not allowed or is_cached, f"nothing was sent for {asks}")

    def joins(self, line, station, pdu, asks):
        """Entries of a batch are read together where their client may read what is between them, too."""
        return any(len(ask.parts) > 1 and not denying(self.of.rules, self.of.default, ask.client.who, stations, pdu)
                   for ask in asks for stations, _ in ask.parts if (stations[0].line, stations[0].id) == (line, station))

    def counted(self):
        """By access_denied_total."""
        status, text = self.auditor("/metrics")
        self.test.assertEqual(status, 200)
        return sum(int(float(value)) for value in re.findall(r'^panelgate_access_denied_total\{rule="[^"]*"\} (\S+)$', text, re.M))

    def auditor(self, path):
        connection = http.client.HTTPConnection("127.0.0.1", self.plant.program.http_port())
        connection.request("GET", path, headers={"Authorization": "Bearer token-of-auditor-0123456789"})
        response = connection.getresponse()
        text = response.read().decode()
        connection.close()
        return response.status, text


def named(pdu):
    """What a request is about: its items, or itself."""
    return [one if one[1] else pdu for one in touches(pdu)]


def written(table, first, values, alone):
    """The PDU of a write; alone: by 05 or 06."""
    head = first.to_bytes(2, "big")
    if table == COILS:
        bits = sum(value << i for i, value in enumerate(values)).to_bytes((len(values) + 7) // 8, "little")
        return b"\x05" + head + (b"\xff\0" if values[0] else b"\0\0") if alone else \
            b"\x0f" + head + len(values).to_bytes(2, "big") + bytes([len(bits)]) + bits
    words = b"".join(value.to_bytes(2, "big") for value in values)
    return b"\x06" + head + words if alone else b"\x10" + head + len(values).to_bytes(2, "big") + bytes([len(words)]) + words


class Cases(unittest.TestCase):
    def test_answers_and_wire_are_what_the_contract_says(self):
        print(f"ACCESS_CASES={CASES} ACCESS_SEED={SEED}", flush=True)
        tally, done, number = collections.Counter(), 0, 0
        while done < CASES:
            number += 1
            with contextlib.ExitStack() as stack, self.subTest(gateway=number, seed=SEED):
                broker = stack.enter_context(mqtt_side.Broker()) if BROKERS else None
                generator = Generator(random.Random(f"{SEED} {number - 1}"), broker)
                plant = stack.enter_context(running(generator))
                gateway, asked = Gateway(self, generator, plant), 0
                if generator.points:
                    gateway.compare_published()
                while asked < min(EACH, CASES - done):
                    asked += gateway.step()
                self.assertEqual(gateway.counted(), gateway.denied, "refusals, by the metric")
                tally += gateway.tally
            done += EACH
        print(f"{number} gateways: {dict(tally)}", flush=True)
        denied = sum(count for key, count in tally.items() if key[0] == "denied")
        self.assertGreater(denied, max(0, CASES // 10 - 20), "the rules refuse too little to say anything")


if __name__ == "__main__":
    unittest.main()
