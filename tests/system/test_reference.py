#!/usr/bin/env python3
"""Documents that are made from the program and its sources are those of this program, and have each key."""
import json
import pathlib
import re
import subprocess
import tempfile
import unittest

import harness
from harness import ROOT


class Reference(unittest.TestCase):
    def run_it(self, *words):
        return subprocess.run([harness.PANELGATE, *words], check=True, capture_output=True, text=True).stdout

    def keys(self):
        return json.loads(self.run_it("config", "keys", "--format", "json"))["keys"]

    def test_documents_are_those_of_this_program(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([ROOT / "deploy/manual/reference.py", folder, harness.PANELGATE], check=True)
            made = [path for path in pathlib.Path(folder).rglob("*") if path.is_file()]
            self.assertGreater(len(made), 8)
            for file in made:
                path = file.relative_to(folder)
                with self.subTest(path=path):
                    self.assertEqual(file.read_text(), (ROOT / path).read_text(),
                                     f"{path}: run deploy/manual/reference.py . build/release/panelgate")

    def test_a_page_that_nothing_makes_is_written_by_hand(self):
        pages = {path.name for path in (ROOT / "docs/reference").glob("*.md")}
        by_hand = {name for name in pages
                   if "by `deploy/manual/reference.py`" not in (ROOT / "docs/reference" / name).read_text()}
        self.assertEqual(by_hand, {"limits.md", "mqtt.md"})

    def test_each_key_is_in_each_output(self):
        """Drift is impossible where all come from one row: a key that one of them lost would be seen here."""
        page = (ROOT / "docs/reference/configuration.md").read_text()
        example = (ROOT / "config/panelgate.example.yaml").read_text()
        schema = json.dumps(json.loads(self.run_it("schema")))
        listed = self.run_it("config", "keys")
        for key in self.keys():
            name = key["path"].rsplit(".", 1)[-1]
            with self.subTest(key["path"]):
                self.assertTrue(f"| `{name}` |" in page, "page")
                self.assertTrue(re.search(rf"(?m)^[ #-]*{re.escape(name)}:", example), "example")
                self.assertTrue(f'"{name}":' in schema, "schema")
                self.assertTrue(re.search(rf"(?m)^{re.escape(key['path'])}\b", listed), "config keys")
                self.assertTrue(key.get("text"), "what it is for")

    def test_one_sign_taken_out_of_a_block_that_is_off_changes_nothing(self):
        """It would be a key of the map before the block: of the listener in place of the serial master."""
        example = (ROOT / "config/panelgate.example.yaml").read_text().splitlines()
        block = None
        for line in example:
            off = line.lstrip().startswith("##")
            indent = len(line) - len(line.lstrip())
            if block is not None and line.strip() and indent <= block and not off:
                block = None
            if block is None and off:
                block = indent
            if block is not None and line.lstrip().startswith("#"):
                self.assertTrue(off or line.lstrip().startswith("# "), line)
        self.assertTrue(any(line.lstrip().startswith("##framing:") for line in example))

    def test_a_block_that_is_off_can_be_taken_in_as_a_whole(self):
        example = (ROOT / "config/panelgate.example.yaml").read_text()
        example = re.sub(r"/run/secrets/\w+", "token", example)
        taken = re.sub(r"(?m)^( *)##(?!#)", r"\1", example)
        taken = re.sub(r"(?m)^( +)simulate: *\n(?:\1 .*\n)+", "", taken)  # of another kind of line
        self.assertNotEqual(taken, example)
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "token").write_text("0123456789abcdef")
            (pathlib.Path(folder) / "all.yaml").write_text(taken)
            said = subprocess.run([harness.PANELGATE, "check", "-c", "all.yaml", "--allow-overload"],
                                  cwd=folder, capture_output=True, text=True)
            self.assertEqual(said.returncode, 0, said.stderr)

    def test_each_key_behind_one_sign_can_be_taken_in_alone(self):
        example = (ROOT / "config/panelgate.example.yaml").read_text()
        off = re.findall(r"(?m)^ *(?:- )?#(?![# ]).*$", example)
        self.assertGreater(len(off), 40)
        with tempfile.TemporaryDirectory() as folder:
            whole = pathlib.Path(folder) / "whole.yaml"
            for line in off:
                whole.write_text(example.replace("\n" + line + "\n", "\n" + line.replace("#", "", 1) + "\n", 1))
                said = subprocess.run([harness.PANELGATE, "check", "-c", whole], capture_output=True, text=True)
                with self.subTest(line):
                    self.assertEqual(said.returncode, 0, said.stderr)

    def test_the_example_says_what_is_left_out(self):
        """A commented key has the value that it has when it is left out: typed in, nothing changes."""
        example = (ROOT / "config/panelgate.example.yaml").read_text()
        with tempfile.TemporaryDirectory() as folder:
            whole = pathlib.Path(folder) / "whole.yaml"
            changed = 0
            for key in self.keys():
                name, default = key["path"].rsplit(".", 1)[-1], key.get("default")
                line = rf"(?m)^( *)#({re.escape(name)}: {re.escape(default or '')})$"
                off = key["path"].startswith(("serial_masters", "mqtt", "realtime"))
                if off or not default or not re.search(line, example):
                    continue
                whole.write_text(re.sub(line, r"\1\2", example, count=1))
                said = subprocess.run([harness.PANELGATE, "check", "-c", whole, "--diff",
                                       ROOT / "config/panelgate.example.yaml"], capture_output=True, text=True)
                if said.returncode == 0:  # a few belong to another value of a neighbour
                    self.assertIn("nothing changes", said.stdout, key["path"])
                    changed += 1
        self.assertGreater(changed, 30)


if __name__ == "__main__":
    unittest.main()
