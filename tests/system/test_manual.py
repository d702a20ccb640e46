"""The man pages and the completion: made of what the program says, whole, and in order."""
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import harness
from harness import ROOT

GETTERS = ("text|required_text|integer|required_integer|number|boolean|duration|choice|choice_index|"
           "child|map|sequence|has")
KEY = re.compile(rf'(?:\.|->)(?:{GETTERS})(?:<[^;(]*>)?\(\s*"([a-z_]+)"')


def plain(page):
    """The words of a page, without its macros."""
    return page.replace(r"\-", "-").replace(r"\e", "\\")


class Manual(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        subprocess.run([ROOT / "deploy/manual/manual.py", cls.folder, harness.PANELGATE], check=True,
                       env={**os.environ, "SOURCE_DATE_EPOCH": "1771588800"}, timeout=harness.PATIENCE)

    def page(self, name):
        return plain((self.folder / name).read_text())

    @unittest.skipUnless(shutil.which("mandoc"), "no mandoc here")
    def test_the_pages_are_sound(self):
        for name in ("panelgate.1", "panelgate.yaml.5"):
            linted = subprocess.run(["mandoc", "-T", "lint", "-W", "warning", self.folder / name],
                                    capture_output=True, text=True, check=False)
            self.assertEqual((linted.returncode, linted.stdout), (0, ""))

    def test_each_command_with_each_option_is_in_the_page(self):
        page = self.page("panelgate.1")
        listed = harness.run("help").stdout.split("\nExamples:")[0].split("\nBegin:")[1]
        commands = set(re.findall(r"(?m)^  (\w+)", listed)) - {"help", "version"}
        self.assertIn("run", commands)
        for command in commands:
            part = page.split(f"\n.Ss {command}\n")[1].split("\n.S")[0]
            options = re.findall(r"(?m)^  (?:-\w,)?--([\w-]+)", harness.run("help", command).stdout)
            for option in options:
                self.assertEqual(f" -{option}" in part, option != "help", (command, option))
        self.assertIn(".Dd February 20, 2026\n", page)

    def test_each_exit_code_is_in_the_page(self):
        page = self.page("panelgate.1")
        codes = (ROOT / "include/panelgate/explain/load.hpp").read_text()
        for code in re.findall(r"\bk\w+ = (\d+)", codes):
            self.assertIn(f"\n.It {code}\n", page)

    def test_each_key_of_the_configuration_is_in_the_page(self):
        page = self.page("panelgate.yaml.5")
        keys = {key for file in (ROOT / "src/config").glob("*.cpp")
                for key in KEY.findall(file.read_text())}
        self.assertGreater(len(keys), 80)
        self.assertEqual([key for key in sorted(keys) if f"\n.It Ic {key} No :" not in page], [])

    def test_the_page_of_the_configuration_says_what_the_reference_says(self):
        page = " ".join(self.page("panelgate.yaml.5").split())
        rows = re.findall(r"(?m)^\| `([\w-]+)` \| (.*?) \| (.*?) \| (.*?) \| (.*?) ?\|$",
                          (ROOT / "docs/reference/configuration.md").read_text())
        self.assertGreater(len(rows), 100)
        for key, values, _, text, change in rows:
            for said in (f".It Ic {key} No : {values}", text, change):
                self.assertIn(" ".join(said.replace("`", "").replace("\\|", "|").split()), page, key)

    def test_what_help_says_is_in_the_page_and_in_the_reference(self):
        page = " ".join(self.page("panelgate.1").split())
        reference = (ROOT / "docs/reference/cli.md").read_text()
        for command in re.findall(r"(?m)^### (\w+)$", reference):
            about = harness.run("help", command).stdout.splitlines()[0]
            about = about[0].upper() + about[1:] + "."
            self.assertIn(about, page)
            self.assertIn(about, reference)
        for code, meaning in re.findall(r"(?m)^\| (\d+) \| (.*) \|$", reference):
            self.assertIn(f".It {code} ", page)

    def shell(self, *command):
        path = f"{pathlib.Path(harness.PANELGATE).parent}:{os.environ['PATH']}"
        return subprocess.run(command, env={**os.environ, "PATH": path}, text=True,
                              capture_output=True, check=True).stdout.split()

    def completed(self, *words):
        return self.shell("bash", "-c", f"source {self.folder}/panelgate.bash; COMP_WORDS=({' '.join(words)}); "
                          "COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); _panelgate; echo ${COMPREPLY[@]}")

    def completed_by_zsh(self, *words):
        return self.shell("zsh", "-fc", "compadd() { shift; print -l -- $@ }; _files() { print files }; "
                          "_describe() { print -l ${commands%%:*} }; "
                          f"words=({' '.join(words)}); CURRENT=$#words; source {self.folder}/panelgate.zsh")

    def completed_by_fish(self, line):
        return self.shell("fish", "-c", f"source {self.folder}/panelgate.fish; complete -C '{line}' | cut -f1")

    def test_bash_completes_commands_options_and_their_values(self):
        self.assertEqual(self.completed("panelgate", "che"), ["check"])
        self.assertEqual(self.completed("panelgate", "run", "--s"), ["--simulate"])
        self.assertEqual(self.completed("panelgate", "check", "--format", '""'), ["text", "json"])
        self.assertEqual(self.completed("panelgate", "address", "omr"), ["omron-cp2e"])
        file = str(self.folder / "panelgate.y")
        self.assertEqual(self.completed("panelgate", "run", "-c", file), [file + "aml.5"])

    def test_bash_completes_stations_and_points_of_a_running_gateway(self):
        with harness.demo() as gateway:
            at = ("--http", f"127.0.0.1:{gateway.http_port()}")
            self.assertEqual(self.completed("panelgate", "read", *at, "o"), ["oven"])
            self.assertEqual(self.completed("panelgate", "watch", *at, "oven", "t"), ["temperature"])
            self.assertEqual(self.completed("panelgate", "read", *at, "oven/t"), ["oven/temperature"])
            self.assertEqual(self.completed("panelgate", "watch", *at, "oven/mode", "pr"), ["press"])
            self.assertEqual(self.completed("panelgate", "write", *at, "oven/mode", '""'), [])
            self.assertEqual(self.completed("panelgate", "trace", *at, "--station", "mi"), ["mixer"])
            self.assertIn("--token-file", self.completed("panelgate", "write", *at, "oven", "--to"))
            if shutil.which("zsh"):
                self.assertEqual(self.completed_by_zsh("panelgate", "read", *at, "oven", "t"),
                                 ["temperature", "mode"])
                self.assertIn("oven/mode", self.completed_by_zsh("panelgate", "watch", *at, "press/running", "oven/m"))
            if shutil.which("fish"):
                self.assertEqual(self.completed_by_fish(f"panelgate read {' '.join(at)} oven/t"), ["oven/temperature"])
                self.assertEqual(self.completed_by_fish(f"panelgate watch {' '.join(at)} oven/mode pr"), ["press"])
                self.assertEqual(self.completed_by_fish(f"panelgate trace {' '.join(at)} --station mi"), ["mixer"])

    def test_config_is_completed(self):
        self.assertEqual(self.completed("panelgate", "config", "k"), ["keys"])
        self.assertEqual(self.completed("panelgate", "config", "keys", "lines.serial.b"), ["lines.serial.baud"])
        if shutil.which("fish"):
            self.assertEqual(self.completed_by_fish("panelgate config k"), ["keys"])
            self.assertEqual(self.completed_by_fish("panelgate config keys lines.serial.b"), ["lines.serial.baud"])

    @unittest.skipUnless(shutil.which("zsh"), "no zsh here")
    def test_zsh_completes_the_same(self):
        self.assertLessEqual({"read", "check", "run"}, set(self.completed_by_zsh("panelgate", "c")))
        self.assertEqual(self.completed_by_zsh("panelgate", "check", "--format", '""'), ["text", "json", "files"])
        self.assertIn("--simulate", self.completed_by_zsh("panelgate", "run", "--s"))
        self.assertEqual(self.completed_by_zsh("panelgate", "run", "-c", '""'), ["files"])

    @unittest.skipUnless(shutil.which("fish"), "no fish here")
    def test_fish_completes_the_same(self):
        completed = self.completed_by_fish
        self.assertIn("check", completed("panelgate che"))
        self.assertEqual(completed("panelgate check --format "), ["json", "text"])
        self.assertIn("--simulate", completed("panelgate run --s"))
        self.assertEqual(completed("panelgate address omr"), ["omron-cp2e"])

    def test_no_completion_lacks_an_option(self):
        texts = {shell: (self.folder / f"panelgate.{shell}").read_text() for shell in ("bash", "zsh", "fish")}
        for option in set(re.findall(r"--([a-z][\w-]+)", harness.run("help", "trace").stdout)):
            self.assertIn(f"--{option}", texts["bash"])
            self.assertIn(f"--{option}", texts["zsh"])
            self.assertIn(f"-l {option}", texts["fish"])


if __name__ == "__main__":
    unittest.main()
