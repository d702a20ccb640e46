"""What README.md shows is what happens. Each of its code blocks is marked with how it is tested:

script         the files that it calls exist; they are run by people and by CI, not from here
demo           pasted into a shell beside a running demo (on other ports)
config         a valid configuration
config-errors  exactly what `check` prints for that configuration, with the faults it speaks of
"""
import pathlib
import re
import subprocess
import tempfile
import unittest

import harness
from harness import ROOT
from markdown import Page

README = (ROOT / "README.md").read_text()
PAGE = Page(README)
# What is beside the manual, for those who change the program or look after it.
PAPERS = sorted([*ROOT.glob("*.md"), *(ROOT / "src").rglob("*.md"), *(ROOT / "tests").glob("*.md")])
WORDS_BELOW_SRC = 9000


def blocks(mark):
    found = PAGE.marked(mark)
    assert found, f"README.md has no block '{mark}'"
    return found


def commands(mark):
    return [line for block in blocks(mark) for line in block.commands()]


class Readme(unittest.TestCase):
    def paste(self, command):
        done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True,
                              text=True, timeout=harness.PATIENCE, check=False, cwd=ROOT)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}{done.stderr}")
        return done.stdout

    def test_every_block_of_commands_and_yaml_is_tested(self):
        self.assertEqual([block.line for block in PAGE.blocks
                          if block.kind in ("sh", "yaml") and not block.mark], [])

    def test_it_is_short(self):
        lines = README.splitlines()
        self.assertLessEqual(len(lines), 120)
        self.assertEqual([number for number, line in enumerate(lines, 1) if len(line) > 200], [])

    def test_ways_of_the_papers_arrive(self):
        for paper in PAPERS:
            for link in Page(paper.read_text()).links():
                path, _, anchor = link.partition("#")
                if re.match("[a-z]+:", link):
                    continue
                with self.subTest(paper=str(paper.relative_to(ROOT)), link=link):
                    there = paper.parent / path if path else paper
                    self.assertTrue(there.exists())
                    if anchor:
                        self.assertIn(anchor, Page(there.read_text()).anchors())

    def test_readmes_of_the_sources_are_short(self):
        words = {str(paper): len(paper.read_text().split()) for paper in (ROOT / "src").rglob("README.md")}
        self.assertLessEqual(sum(words.values()), WORDS_BELOW_SRC, words)

    def test_each_decision_names_what_was_refused(self):
        _, *decisions = (ROOT / "src/ARCHITECTURE.md").read_text().partition("\n## Decisions\n")[2].split("\n### ")
        self.assertEqual([text.splitlines()[0] for text in decisions if "Refused: " not in text], [])

    def test_scripts_and_files_that_it_names_exist(self):
        named = re.findall(r"\b(?:deploy|tests|config|src)/[\w./-]*\w|\.ci/run", README)
        self.assertTrue(named)
        for path in named:
            self.assertTrue((ROOT / path).exists(), path)
        presets = re.findall(r"--preset (\w+)", " ".join(commands("script")))
        for preset in presets:
            self.assertIn(f'"name": "{preset}"', (ROOT / "CMakePresets.json").read_text())

    def test_the_demos_commands_work(self):
        with harness.demo() as program:
            for command in commands("demo"):
                with self.subTest(command=command):
                    moved = command.replace(":8080", f":{program.http_port()}")
                    moved = moved.replace("-p 1502", f"-p {program.modbus_port()}")
                    self.assertNotEqual(moved, command)
                    self.assertNotRegex(self.paste(moved), r'"status":[45]\d\d')

    def test_its_configuration_is_valid_and_its_sample_errors_are_exact(self):
        [good] = blocks("config")
        [expected] = blocks("config-errors")
        good = good.text
        bad = good.replace("baud:", "bauds:").replace("500ms", "500")
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "good.yaml").write_text(good)
            (pathlib.Path(folder) / "panelgate.yaml").write_text(bad)
            checked = harness.run("check", "-c", "good.yaml", cwd=folder)
            self.assertEqual(checked.returncode, 0, checked.stderr)
            checked = harness.run("check", "-c", "panelgate.yaml", cwd=folder)
            self.assertEqual((checked.returncode, checked.stderr), (78, expected.text))


if __name__ == "__main__":
    unittest.main()
