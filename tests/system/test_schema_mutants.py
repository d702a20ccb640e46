"""`panelgate schema` and `panelgate check` on the same faults: every key of every kind of map, with
values that it may not have. What check takes the schema takes; what the schema takes and check
refuses stands in a list, with the reason why no schema can know."""
import concurrent.futures
import copy
import json
import pathlib
import subprocess
import tempfile
import unittest

import golden
import jsonschema
import yaml
from harness import PANELGATE, PATIENCE, ROOT, run
from test_schema import parsed

# One of each map; {} is the folder with the files.
PLAIN = """
profiles_dir: {}
templates: {{t: {{profile: generic}}}}
lines:
  - name: a
    device: sim
    serial: {{baud: 9600}}
    rs485: {{mode: off}}
    timing: {{reply_hole: 60ms}}
    queue: {{limit: 256}}
    offline: {{after: 3}}
    simulate: {{echo: false}}
    stations:
      - id: 1
        name: b
        timing: {{frame_gap: 5ms}}
        simulate: {{dead: false}}
        poll: [{{read: "400001"}}]
        points: [{{name: c, at: "400001", labels: {{0: zero}}, no_value: [1]}}]
modbus_tcp:
  - {{listen: "127.0.0.1:502", lines: [a], units: {{101: a/1}}, diagnostics_unit: 255,
     allow: [127.0.0.0/8]}}
serial_masters:
  - {{name: d, device: /dev/ttyS0, serial: {{baud: 9600}}, rs485: {{mode: off}}, lines: [a],
     units: {{101: a/1}}}}
http: {{listen: "127.0.0.1:80", hosts: [a], allow: [127.0.0.0/8], cors: ["http://a"],
       tokens: [{{name: e, role: viewer, file: {}/token}}]}}
relays: [{{from: b/400001, to: b/400102}}]
mqtt: {{broker: "mqtt://a"}}
access: {{roles: [{{name: f, rights: [read]}}], rules: [{{name: g, deny: [write]}}]}}
audit: {{file: /var/log/a.jsonl}}
log: {{level: info}}
realtime: {{priority: 0}}
"""
# Where the schema takes what check refuses, and why it has to.
ONLY_CHECK = {
    "what a profile has": {
        "lines/stations/points/at", "lines/stations/poll/read", "lines/stations/poll/count",
        "lines/stations/id", "lines/stations/profile", "relays/count", "relays/from", "relays/to",
        "access/rules/range"},
    "names that stand elsewhere, and those that would stand twice": {
        "lines/name", "lines/stations", "lines/stations/name", "lines/stations/template",
        "modbus_tcp/lines", "serial_masters/lines", "http/listen",
        "modbus_tcp/diagnostics_unit", "access/roles/name", "access/rules/stations",
        "access/rules/listeners", "access/rules/tokens", "http/anonymous", "http/tokens/role",
        "alarms/line", "alarms/point", "alarms/station", "images/points", "images/unit"},
    "what is in files": {
        "http/tokens/file", "mqtt/ca", "mqtt/certificate", "mqtt/key", "mqtt/password_file",
        "profiles_dir", "lines/stations/points_file"},
    "settings that do not go together": {
        "lines/offline/probe_max", "lines/queue/per_client", "lines/rs485/mode",
        "lines/serial/data_bits", "lines/serial/parity", "lines/serial/stop_bits",
        "lines/stations/points/bit", "lines/stations/points/labels", "lines/stations/points/max",
        "lines/stations/points/min", "lines/stations/timing/adaptive_ceiling",
        "serial_masters/framing", "access/rules/allow", "access/rules/deny",
        "alarms/above", "alarms/back", "alarms/down", "alarms/finding", "alarms/offline", "alarms/stale",
        "lines/in_flight", "lines/tls", "lines/stations/points/report/at_least",
        "lines/stations/points/report/at_most"},
    "numbers that are above 0": {"lines/stations/points/report/deadband"},
    "1e-3 is a name, and a number for YAML, which 0.5 is, too": {
        "lines/stations/points/name", "serial_masters/name", "http/hosts", "access/rules/name",
        "alarms/name", "images/name"},
}
ABSENT = object()
VARIABLE = "${NOT_SET:-1}"  # nobody knows what the environment will bring
ANY = (ABSENT, None, [], {}, "", True, 0, 1, -1, 2, 0.5, 10**12, "1", "nonsense", "Bad Name!",
       VARIABLE)
BY_KIND = {
    "duration": ("0ms", "1us", "999us", "1s", "01s", "1.5s", "1 s", "7s", "121s", "11min", "61min",
                 "1441min", "99999999999s", "-1s"),
    "text": ("a", "a/b", "a_b", "a/1", "/dev/x", "tcp://h", "tcp://h:1", "sim", ":8080",
             "127.0.0.1:502", "127.0.0.1:99999", "[::1]:5020", "mqtt://h", "x" * 129, "a+b", "a//b",
             8080),
    "map": ("x", [{}], {"nonsense": 1}, {"256": "a/1"}, {"5": "a/1"}, {"05": "a/1"}, {"0": "a/1"},
            {"-1": "zero"}, {"1": None}, {"t": None}, {"T": {}}, {"t": {"profile": "generic"}}),
    "list": ("x", [None], [[]], [{}], ["Bad Name!"], ["a"], [1], ["10.0.0.0/8"], ["10.0.0.0/99"],
             list(range(20))),
}


def kind_of(schema):
    """(what a key takes besides words, its words and bounds)"""
    if "items" in schema:
        return "list", []
    if "properties" in schema or "patternProperties" in schema:
        return "map", []
    bounds = []
    kind = "word"
    for choice in [schema, *schema.get("anyOf", [])]:
        name = choice.get("$ref", "").rpartition("/")[2]
        if name.startswith("duration"):
            kind = "duration"
            bounds += name.split("-")[1:]
        elif name == "text" or "string" in (choice.get("type") or ()):
            kind = "text"
        elif choice.get("type") in ("integer", "number"):
            kind = "number"
            bounds += [choice[key] + step for key in ("minimum", "maximum") if key in choice
                       for step in (-1, 0, 1)]
        bounds += choice.get("enum", [])
    return kind, bounds


def keys_of(schema, path=""):
    """(path, schema) of every key, places in lists left out."""
    for name, one in schema.get("properties", {}).items():
        if name == "<<":
            continue
        whole = f"{path}/{name}" if path else name
        yield whole, one
        yield from keys_of(one.get("items", one), whole)


def maps_at(value, path):
    """The maps of a configuration that `path` leads to."""
    if isinstance(value, list):
        for item in value:
            yield from maps_at(item, path)
    elif isinstance(value, dict) and path:
        if path[0] in value:
            yield from maps_at(value[path[0]], path[1:])
    elif isinstance(value, dict):
        yield value


class Mutants(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.schema = json.loads(run("schema").stdout)
        cls.validator = jsonschema.Draft202012Validator(cls.schema)
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        (cls.folder / "token").write_text("0123456789abcdef")
        cls.pool = concurrent.futures.ThreadPoolExecutor(4)
        cls.addClassCleanup(cls.pool.shutdown)
        texts = [PLAIN.format(cls.folder, cls.folder)]
        texts += [path.read_text() for path in sorted((ROOT / "config").glob("*.yaml"))]
        texts += [case.text for case in golden.cases() if not case.is_refused]
        values = [value for value in map(parsed, texts) if value is not None]
        cls.bases = [value for value, taken in zip(values, cls.pool.map(cls.takes, values)) if taken]

    @classmethod
    def takes(cls, value):
        """Whether check does, key by key on lines of their own as people write."""
        text = yaml.safe_dump(value, sort_keys=False, allow_unicode=True)
        return subprocess.run([PANELGATE, "check", "-c", "-", "--allow-overload"], input=text,
                              capture_output=True, text=True, timeout=PATIENCE,
                              check=False).returncode == 0

    def mutants_of(self, path, schema):
        """(value, configuration) of one key: in a file that has it, else where it could stand."""
        *above, key = path.split("/")
        having = [base for base in self.bases
                  if any(key in one for one in maps_at(base, above))]
        base = (having or self.bases)[0]
        kind, bounds = kind_of(schema)
        for value in (*ANY, *BY_KIND.get(kind, ()), *bounds):
            mutant = copy.deepcopy(base)
            maps = list(maps_at(mutant, above))
            if not maps:  # `tls` of listeners, whose files would have to be there
                return
            one = next((one for one in maps if key in one), maps[0])
            if value is ABSENT:
                one.pop(key, None)
            else:
                one[key] = value
            yield value, mutant

    def test_plain_is_taken(self):
        self.assertTrue(self.takes(self.bases[0]))
        self.assertIn("templates", self.bases[0])
        self.assertGreater(len(self.bases), 60)

    def test_takes_what_check_takes_and_refuses_what_it_can_know(self):
        mutants = [(path, value, mutant) for path, schema in keys_of(self.schema)
                   for value, mutant in self.mutants_of(path, schema)]
        taken = list(self.pool.map(lambda mutant: self.takes(mutant[2]), mutants))
        refused, missed = 0, {}
        for (path, value, mutant), takes in zip(mutants, taken):
            faults = [fault.message for fault in self.validator.iter_errors(mutant)]
            if takes:
                self.assertEqual(faults, [], f"{path}: {value!r}")
            elif faults:
                refused += 1
            elif value != VARIABLE:
                missed.setdefault(path, []).append(value)
        self.assertEqual(set(missed), set().union(*ONLY_CHECK.values()), missed)
        self.assertGreater(len(mutants), 4000)
        self.assertGreaterEqual(sum(taken), 500)
        self.assertGreaterEqual(refused, 6 * sum(map(len, missed.values())))


if __name__ == "__main__":
    unittest.main()
