#!/usr/bin/env python3
"""What `config get` lists is a file's notation: the values of a map, typed in at their paths, are accepted
and change nothing. What is not set is not listed, and is told as such."""
import collections
import pathlib
import subprocess
import tempfile
import unittest

import yaml

import harness
from harness import ROOT

NOT_SET, USAGE = 1, 64
MINIMAL = """
lines: [{name: a, device: sim, stations: [{id: 1, points: [{name: p, at: 400001}]}]}]
modbus_tcp: [{listen: 127.0.0.1:502}]
"""
# Neighbours rule each other's keys out, and texts need quotes.
FULL = """
profiles_dir: profiles
lines:
  - name: b
    device: /dev/ttyS1
    serial: {mode: ascii, data_bits: 8, ascii_lower_case: take}
    timing: {frame_gap: 7ms, reply_hole: 2s, response_timeout: adaptive, adaptive_ceiling: 900ms}
    stations:
      - id: 1
        name: x
        poll: [{read: 400001}, {read: 400001, count: 2}]
        simulate: {slow: 1ms}
        timing: {frame_gap: auto, response_timeout: 200ms, late_window: 1s}
        points:
          - {name: text, at: 400001, type: string, length: 4, word_order: BADC}
          - {name: bit, at: 400005, bit: 3}
          - {name: coil, at: "000001"}
          - {name: n, at: 400007, type: i16, scale: 0.1, min: -5, max: 5, no_value: [-1, -32768], writable: true,
             unit: "1,5: '$${x}' #"}
          - {name: l, at: 400009, type: i16, unit: "%", labels: {0: "off: [x]", 1: "null", -1: "- a"}}
      - {id: 2, name: y, access: read_only}
  - {name: c, device: "tcp://10.0.0.1:4001", rs485: {mode: off}, timing: {late_window: auto}, stations: [{id: 7}]}
  - {name: d, device: /dev/ttyS3, rs485: {mode: rts, delay_before_send: 1ms}, stations: [{id: 8, crc_order: high_first}]}
  - {name: a, device: /dev/ttyS4, mode: listen}
modbus_tcp:
  - {listen: "[::1]:502", framing: rtu, lines: [c, b], units: {101: b/1, 255: c/7}, allow: ["::1/128", "fd00::/8"]}
  - {listen: 127.0.0.1:503, framing: ascii, ascii_lower_case: take, broadcast: deny, diagnostics_unit: null}
  - {listen: 127.0.0.1:504, udp: true, retransmissions: pass}
serial_masters:
  - {name: plc, device: /dev/ttyS2, lines: [b], framing: ascii, response_timeout: 2s}
http: {hosts: ["::1", b.example, a.example], tokens: [{name: "a b", role: viewer, file: secret}]}
relays: [{from: x/400001, to: x/400101, on_change: true}]
mqtt: {broker: "mqtts://b:8883", format: sparkplug, group: none, username: "*u", password_file: secret, ca: secret}
"""


def scalar(node):
    return node.value if node.style is None else "'" + node.value.replace("'", "''") + "'"


def emit(node, indent=""):
    """As a block: a plain value that stands for a whole one may hold anything."""
    if isinstance(node, yaml.ScalarNode):
        return " " + scalar(node) + "\n"
    if isinstance(node, yaml.SequenceNode):
        return "\n" + "".join(indent + "-" + emit(item, indent + "  ").replace("\n" + indent + "  ", " ", 1)
                              for item in node.value)
    return "\n" + "".join(indent + scalar(key) + ":" + emit(value, indent + "  ") for key, value in node.value)


def get(node, key):
    return next((value for name, value in node.value if name.value == key), None)


def name_of(item, line):
    """By which its settings are found."""
    if get(item, "from"):
        return f"{get(item, 'from').value} to {get(item, 'to').value}".replace("/", ".")
    for key in ("name", "listen", "read"):
        if get(item, key):
            return get(item, key).value.strip("'")  # a listed text may have its quotes
    return f"{line}-{get(item, 'id').value}"


def put(node, path, value, line=""):
    """Sets what is at a path; maps that are missing are made."""
    if isinstance(node, yaml.SequenceNode):
        seen = {}
        for item in node.value:
            name = name_of(item, line)
            seen[name] = seen.get(name, 0) + 1
            name += f" ({seen[name]})" * (seen[name] > 1)
            if path.startswith(name + "."):
                return put(item, path[len(name) + 1:], value, get(item, "name").value if get(item, "name") else line)
        raise KeyError(path)
    for i, (key, below) in enumerate(node.value):
        if path == key.value:
            node.value[i] = (key, value)
            return None
        if path.startswith(key.value + "."):
            return put(below, path[len(key.value) + 1:], value, line)
    first, _, rest = path.partition(".")
    added = yaml.MappingNode("", []) if rest else value
    node.value.append((yaml.ScalarNode("", first), added))
    return put(added, rest, value, line) if rest else None


class ConfigGet(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "secret").write_text("0123456789abcdef")
        (self.folder / "profiles").mkdir()

    def run_it(self, *words):
        return subprocess.run([harness.PANELGATE, *words], cwd=self.folder, capture_output=True, text=True)

    def listed(self):
        said = self.run_it("config", "get", "-c", "base.yaml")
        self.assertEqual(said.returncode, 0, said.stderr)
        return [line.split(": ", 1) for line in said.stdout.splitlines()]

    def each_value_typed_back(self, text):
        base = self.folder / "base.yaml"
        base.write_text(emit(yaml.compose(text)))
        maps = collections.defaultdict(list)
        for path, value in self.listed():
            maps[path.rpartition(".")[0]].append((path, value))
        for settings in maps.values():
            tree = yaml.compose(text)
            for path, value in settings:
                put(tree, path, yaml.ScalarNode("", value))
            (self.folder / "typed.yaml").write_text(emit(tree))
            said = self.run_it("check", "-c", "typed.yaml", "--diff", "base.yaml", "--allow-overload")
            with self.subTest(settings=settings):
                self.assertEqual(said.returncode, 0, said.stderr)
                self.assertTrue(said.stdout.startswith("nothing changes"), said.stdout)

    def test_of_the_example(self):
        self.each_value_typed_back((ROOT / "config/panelgate.example.yaml").read_text())

    def test_of_a_minimal_file(self):
        self.each_value_typed_back(MINIMAL)

    def test_of_a_file_with_what_the_example_has_not(self):
        self.each_value_typed_back(FULL)

    def test_what_is_not_set_is_told_as_such(self):
        (self.folder / "base.yaml").write_text(FULL)
        for path, told in (("lines.b.stations.x.points.l.min", "is not set\n"),
                           ("lines.b.stations.x.points.n.labels", "is not set\n"),
                           ("lines.b.stations.x.points.bit.scale", "is not set: not with type: bool or string\n"),
                           ("lines.c.rs485.rts_on_send", "is not set: only with mode: kernel or rts\n"),
                           ("lines.b.stations.x.crc_order", "is not set\n"),
                           ("mqtt.client_id", "is not set\n"), ("mqtt.qos", "is not set: only with format: json\n"),
                           ("modbus_tcp.127.0.0.1:504.allow", "is not set\n"), ("lines.a.stations", "is not set\n"),
                           ("lines.b.stations.x.template", "keys are shown at each station\n")):
            said = self.run_it("config", "get", "-c", "base.yaml", path)
            with self.subTest(path):
                self.assertEqual((said.returncode, said.stdout), (NOT_SET, ""))
                self.assertTrue(said.stderr.startswith(f"panelgate: {path} is "), said.stderr)
                self.assertTrue(said.stderr.endswith(told), said.stderr)

    def test_one_value_is_raw(self):
        (self.folder / "base.yaml").write_text(FULL)
        for path, value in (("lines.b.stations.x.points.n.unit", "1,5: '${x}' #"), ("mqtt.username", "*u"),
                            ("lines.b.stations.x.points.l.labels.1", "null"), ("lines.c.timing.frame_gap", "auto"),
                            ("relays.x/400001 to x/400101.to", "x/400101"), ("modbus_tcp.[::1]:502.listen", "[::1]:502"),
                            ("modbus_tcp.[::1]:502.units", "modbus_tcp.[::1]:502.units.101: b/1\n"
                                                           "modbus_tcp.[::1]:502.units.255: c/7"),
                            ("lines.b.stations.x.poll.400001 (2).read", "400001"), ("profiles_dir", "profiles"),
                            ("http.tokens.a b.secret", "(secret)")):
            with self.subTest(path):
                self.assertEqual(self.run_it("config", "get", "-c", "base.yaml", path).stdout, value + "\n")
        self.assertNotIn("secret)", self.run_it("config", "get", "-c", "base.yaml").stdout)

    def test_a_path_without_names_is_told_how_to_write_it(self):
        (self.folder / "base.yaml").write_text(FULL)
        self.assertEqual(self.run_it("config", "get", "-c", "base.yaml", "http.allow.0").returncode, USAGE)
        for path, told in (("lines.serial.mode", "write lines.NAME.serial.mode, with one of: b, c, d, a\n"),
                           ("lines.b.stations.1.id", "write lines.b.stations.NAME.id, with one of: x, y\n"),
                           ("lines.stations.id", "write lines.NAME.stations.NAME.id, with one of: b, c, d, a\n")):
            said = self.run_it("config", "get", "-c", "base.yaml", path)
            self.assertEqual((said.returncode, said.stderr),
                             (USAGE, f"panelgate: there is no setting '{path}'; {told}"))


if __name__ == "__main__":
    unittest.main()
