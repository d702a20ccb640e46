"""`panelgate schema`, held against what the loader takes and refuses."""
import json
import re
import unittest

import golden
import jsonschema
import yaml
from harness import ROOT, run

# What the loader says that a schema can say, too.
WRONG = re.compile(r"unknown key|must be a whole number|must be true or false|must be a map of keys"
                   r"|must be a list|must be a duration|needs '")
# A schema sees the value that YAML made of a text, not the text; and each map by itself.
EXCEPTIONS = {
    "baud-leading-zero",  # 09600 is 9600 by then
    "value-baud-exponent",  # 9.6e3 is 9600
    "value-retries-float",  # 1.0 is 1, which JSON takes for an integer
    "variable-of-wrong-number",  # nobody knows what the environment will bring
    "syntax-exclamation-mark-alone",  # a tag without a value is an empty text, here null
}


class Core(yaml.SafeLoader):
    """YAML 1.2, as editors read it: on, off, yes, no and 1:30 are texts, a merge is a key."""


Core.yaml_implicit_resolvers = {}
for tag, pattern, first in (
        ("bool", r"^(?:true|True|TRUE|false|False|FALSE)$", "tTfF"),
        ("int", r"^[-+]?[0-9]+$", "-+0123456789"),
        ("float", r"^[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$", "-+.0123456789"),
        ("null", r"^(?:~|null|Null|NULL|)$", ["~", "n", "N", ""])):
    Core.add_implicit_resolver(f"tag:yaml.org,2002:{tag}", re.compile(pattern), list(first))
Core.add_constructor("tag:yaml.org,2002:int", lambda loader, node: int(node.value))


def as_json(value):
    """Keys of JSON are texts."""
    if isinstance(value, dict):
        return {str(key): as_json(one) for key, one in value.items()}
    return [as_json(one) for one in value] if isinstance(value, list) else value


def parsed(text):
    """None: no YAML, of which a schema says nothing."""
    try:
        return as_json(yaml.load(text, Core))  # a SafeLoader
    except (yaml.YAMLError, ValueError, RecursionError):
        return None


class Schema(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        printed = run("schema")
        assert printed.returncode == 0, printed.stderr
        cls.schema = json.loads(printed.stdout)
        cls.validator = jsonschema.Draft202012Validator(cls.schema)

    def faults(self, value):
        return [f"{'/'.join(map(str, fault.path))}: {fault.message}"
                for fault in self.validator.iter_errors(value)]

    def test_is_a_schema(self):
        jsonschema.Draft202012Validator.check_schema(self.schema)
        self.assertEqual(self.schema["$schema"], "https://json-schema.org/draft/2020-12/schema")

    def test_takes_every_configuration_that_is_shipped(self):
        readme = (ROOT / "README.md").read_text()
        example = re.search(r"<!-- test: config -->\n```yaml\n(.*?)```", readme, re.DOTALL).group(1)
        texts = {path: path.read_text() for path in (ROOT / "config").glob("*.yaml")}
        for path, text in {**texts, "README.md": example}.items():
            with self.subTest(path=path):
                self.assertEqual(self.faults(parsed(text)), [])

    def test_takes_what_the_loader_takes(self):
        taken = 0
        for case in golden.cases():
            value = parsed(case.text)
            if case.is_refused or value is None:
                continue
            taken += 1
            with self.subTest(case=case.name):
                self.assertEqual(self.faults(value), [])
        self.assertGreaterEqual(taken, 60)

    def test_refuses_unknown_keys_and_wrong_types_as_the_loader_does(self):
        refused = 0
        for case in golden.cases():
            value = parsed(case.text)
            if not WRONG.search(case.expected) or not case.is_refused or value is None:
                continue
            with self.subTest(case=case.name):
                self.assertEqual(bool(self.faults(value)), case.name not in EXCEPTIONS)
            refused += 1
        self.assertGreaterEqual(refused, 60)

    def test_refuses_what_a_schema_can_know(self):
        line = {"name": "a", "device": "sim"}
        http = {"listen": "127.0.0.1:80"}

        def point(**keys):
            station = {"id": 1, "points": [{"name": "p", "at": "400001", **keys}]}
            return {"lines": [{**line, "stations": [station]}], "http": http}

        self.assertEqual(self.faults({"lines": [line], "http": http}), [])
        self.assertEqual(self.faults(point(type="string", length=8)), [])
        for wrong in (
                {"lines": [], "http": http}, {"lines": None, "http": http},
                {"lines": [line]}, {"lines": [line], "http": None}, {"lines": [line], "mqtt": None},
                {"lines": [line], "modbus_tcp": []},
                {"lines": [{**line, "name": "A"}], "http": http},
                {"lines": [{**line, "device": "ttyUSB0"}], "http": http},
                {"lines": [{**line, "timing": {"response_timeout": "0ms"}}], "http": http},
                {"lines": [{**line, "timing": {"response_timeout": "3min"}}], "http": http},
                {"lines": [{**line, "stations": [{"id": 1, "simulate": {"late": 2}}]}],
                 "http": http},
                *({"lines": [line], "http": {key: value}}
                  for key, value in (("allow", []), ("allow", None), ("hosts", []),
                                     ("tokens", None), ("listen", 8080), ("listen", ":8080"))),
                {"lines": [line], "modbus_tcp": [{"lines": []}]},
                {"lines": [line], "modbus_tcp": [{"units": None}]},
                {"lines": [line], "modbus_tcp": [{"units": {"256": "a/1"}}]},
                {"lines": [line], "mqtt": {"broker": "h"}},
                {"lines": [line], "http": http, "templates": {"t": None}},
                {"lines": [line], "http": http, "templates": {"T": {}}},
                point(scale=0), point(type="string"), point(length=8), point(name="P")):
            with self.subTest(wrong=wrong):
                self.assertNotEqual(self.faults(wrong), [])

    def test_tells_an_editor_what_a_key_means_and_what_it_is_by_default(self):
        line = self.schema["properties"]["lines"]["items"]["properties"]
        self.assertEqual(line["retries"]["default"], 1)
        self.assertEqual(line["retries"]["anyOf"][0], {"type": "integer", "minimum": 0, "maximum": 10})
        timeout = line["timing"]["properties"]["response_timeout"]
        self.assertIn("1ms to 2min", timeout["description"])
        self.assertIn({"enum": ["adaptive"]}, timeout["anyOf"])
        self.assertEqual(line["serial"]["properties"]["parity"]["anyOf"][0],
                         {"enum": ["none", "even", "odd"]})
        (template,) = self.schema["properties"]["templates"]["patternProperties"].values()
        body = template["properties"]
        self.assertNotIn("id", body)
        self.assertIn("points", body)


if __name__ == "__main__":
    unittest.main()
