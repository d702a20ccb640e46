"""What the pages of docs/ show is what happens, and each way they point somewhere arrives.

Each block of sh, yaml, python, js or json has a mark on the line before its fence:

test: demo             commands, pasted into a shell beside a running demo (on other ports); print something.
                       Commands of panelgate that ask a gateway ask that one, without --http
test: program          commands of panelgate, in the page's folder, where its last `config` is panelgate.yaml
test: program-N        the same, with exit code N
test: config           a whole configuration that `check` takes
test: station          entries of `stations:` (of a line as `serial: 9600 8E1` in a mark before says)
test: config-part KEY  top-level keys beside a line floor1 with the stations press and oven
test: file NAME        a file in the page's folder, for what follows
test: output           what the block before prints: all these lines in this order, `...` for anything,
                       blanks as one
test: python           a script, run beside the demo
test: script           the files that it names exist
not run: REASON        it wants what is not here

To run some pages by hand: test_docs.py with DOCS=start,install/docker.md, and PANELGATE for the program.
"""
import contextlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import urllib.request

import harness
from harness import ROOT
from markdown import Page

DOCS = ROOT / "docs"
PAGES = {str(path.relative_to(DOCS)): Page(path.read_text()) for path in sorted(DOCS.rglob("*.md"))}
WANTED = tuple(filter(None, os.environ.get("DOCS", "").split(",")))
FOLLOWED = {name: page for name, page in PAGES.items() if not WANTED or name.startswith(WANTED)}
# Where a generator has made the page, its style is the generator's.
WRITTEN = {name: page for name, page in FOLLOWED.items() if "by `deploy/manual/reference.py`" not in page.text}

ASKING = r"(?m)^(panelgate (?:read|write|watch|status|top|trace|report)\b[^|&;\n]*?)(?=\s*(?:[|&;]|$))"
MARKED = "sh bash shell console yaml yml python py js javascript json".split()
MARKS = r"demo|program(-\d+)?|config|station|config-part|file|output|python|script|not run|"
UNWANTED = r"(?i)\b(whoever|nobody in particular|owed?)\b"
# A sentence begins with its subject. (A question may begin so.)
HEADLESS = re.compile(r"(?:^|[.!?] )((?:Of|Where|Who|Whom|Whose) [^.!?]*[.!])")

STATION = """lines:
  - name: floor1
    device: /dev/ttyUSB0
    serial: {{baud: {}, data_bits: {}, parity: {}, stop_bits: {}}}
    stations:
{}modbus_tcp: [{{listen: 127.0.0.1:1502}}]
"""
BASE = {"lines": """lines:
  - name: floor1
    device: /dev/ttyUSB0
    serial: {baud: 38400, parity: none}
    stations:
      - {id: 31, name: press, profile: autonics-gplp-s}
      - {id: 5, name: oven, profile: panasonic-gt}
""", "modbus_tcp": "modbus_tcp: [{listen: 127.0.0.1:1502}]\n",
        "http": "http: {listen: 127.0.0.1:8080}\n"}
HELD = r"(?:\$\{\w+:-/etc/credstore\}|/run/secrets|/run/credentials/[\w.]+|/etc/credstore|/etc/panelgate)/[\w./-]+"


def as_station(block):
    baud, letters = block.serial.split()
    parity = {"N": "none", "E": "even", "O": "odd"}[letters[1]]
    items = "".join(f"      {line}\n" for line in block.text.splitlines())
    return STATION.format(baud, letters[0], parity, letters[2], items)


def as_part(block):
    keys = re.findall(r"(?m)^(\w+):", block.text)
    assert block.argument in keys, f"no key '{block.argument}' at the left edge"
    return block.text + "".join(text for key, text in BASE.items() if key not in keys)


class Reader:
    """Does what one page says, from its top to its end, in a folder of its own."""

    def __init__(self, page, folder, beside):
        self.page = page
        self.folder = pathlib.Path(folder)
        self.beside = beside  # gives the demo that runs
        self.printed = None
        self.moved = lambda text: text
        tools = self.folder / ".tools"
        tools.mkdir()
        (tools / "panelgate").symlink_to(pathlib.Path(harness.PANELGATE).resolve())
        self.environment = {**os.environ, "PATH": f"{tools}:{os.environ['PATH']}"}

    def follow(self, block):
        kind, _, code = block.mark.partition("-")
        if block.mark == "output":
            self.has_printed(block.text)
        elif kind == "program":
            self.printed = "".join(self.paste(line, int(code or 0)) for line in self.of_program(block))
        elif block.mark == "demo":
            self.printed = "".join(self.shown(line, block) for line in block.commands())
        elif block.mark == "python":
            self.run([sys.executable, "-B", "-c", self.by_its_ports(block.text)], block.text, 0)
        elif block.mark == "config":
            (self.folder / "panelgate.yaml").write_text(block.text)
            self.check("panelgate.yaml", block.text)
        elif block.mark in ("station", "config-part"):
            self.check("part.yaml", as_station(block) if block.mark == "station" else as_part(block))
        elif block.mark == "file":
            file = self.folder / block.argument
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.text)
        elif block.mark == "script":
            for path in re.findall(r"\b(?:deploy|tests|config|src)/[\w./-]*\w|\.ci/run", block.text):
                assert (ROOT / path).exists(), f"{path} is not there"

    def of_program(self, block):
        for line in block.commands():
            assert line.startswith("panelgate "), line
        return block.commands()

    def check(self, name, text):
        def made(found):  # what the machine holds, such as tokens, is in the page's folder
            file = self.folder / re.sub(r"[${}:]", "", found[0]).lstrip("/")
            file.parent.mkdir(parents=True, exist_ok=True)
            if not file.exists() and not re.search(r"profiles\b", found[0]):
                file.write_text("0123456789abcdef0123456789abcdef\n")
                file.chmod(0o600)
            return str(file)
        (self.folder / name).write_text(re.sub(HELD, made, text))
        self.run(["panelgate", "check", "-c", name], text, 0)
        (self.folder / name).write_text(text)

    def by_its_ports(self, text):
        demo = self.beside()
        text = re.sub(ASKING, r"\1 --http 127.0.0.1:8080", text)
        return re.sub(r"\b1502\b", str(demo.modbus_port()), re.sub(r"\b8080\b", str(demo.http_port()), text))

    def shown(self, command, block):
        printed = self.paste(self.by_its_ports(command), 0)
        assert printed, f"{command}\nprinted nothing"
        problem = re.search(r'"status": ?[45]\d\d', printed)
        assert not problem or self.tells_of_problems(block), f"{command}\n{printed}"
        return printed

    def tells_of_problems(self, block):
        """Whether the block after it shows the answer that is a problem."""
        following = [other for other in self.page.blocks if other.line > block.line][:1]
        return any(other.mark == "output" and '"status"' in other.text for other in following)

    def paste(self, command, code):
        return self.run(["bash", "-o", "pipefail", "-c", command], command, code)

    def run(self, arguments, shown, code):
        done = subprocess.run(arguments, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, timeout=harness.PATIENCE,
                              check=False, cwd=self.folder, env=self.environment)
        assert done.returncode == code, f"{shown}\nexit code {done.returncode}:\n{done.stdout}"
        self.printed = done.stdout
        return done.stdout

    def has_printed(self, expected):
        assert self.printed is not None, "no block before it that prints"
        here = iter([" ".join(line.split()) for line in self.printed.splitlines()])
        for line in filter(None, [" ".join(line.split()) for line in expected.splitlines()]):
            like = ".*".join(map(re.escape, line.split("...")))
            assert any(re.fullmatch(like, other) for other in here), \
                f"not printed, or not there:\n{line}\nbut:\n{self.printed}"


class Blocks(unittest.TestCase):
    def test_each_has_a_mark(self):
        for name, page in FOLLOWED.items():
            for block in page.blocks:
                with self.subTest(page=name, line=block.line):
                    self.assertTrue(block.kind, "the fence does not say of what kind it is")
                    self.assertTrue(block.mark or block.kind not in MARKED, "no mark")
                    self.assertRegex(block.mark, f"^(?:{MARKS})$")

    def test_each_does_what_the_page_says(self):
        with contextlib.ExitStack() as running:
            demo = []

            def beside():
                if not demo:
                    demo.append(running.enter_context(harness.demo()))
                    until_read(demo[0])
                return demo[0]
            for name, page in FOLLOWED.items():
                with tempfile.TemporaryDirectory() as folder:
                    reader = Reader(page, folder, beside)
                    for block in page.blocks:
                        with self.subTest(page=name, line=block.line):
                            reader.follow(block)
                if "/simulator/" in page.text and demo:  # the next page meets healthy panels
                    running.close()
                    demo.clear()


def until_read(demo):
    """Follows the events until every point has its first value."""
    _, body = demo.get("/api/v1/stations")
    missing = {(station["name"], point["name"]) for station in body["stations"]
               for point in demo.get(f"/api/v1/stations/{station['name']}/points")[1]["points"]}
    with urllib.request.urlopen(demo.url("/api/v1/events?types=point"), timeout=harness.PATIENCE) as events:
        for line in events:
            if line.startswith(b"data: "):
                event = json.loads(line[6:])
                if event["quality"] == "good":
                    missing.discard((event["station"], event["name"]))
            if not missing:
                return


class Itself(unittest.TestCase):
    """What is planted is found."""

    def test_marks_belong_to_the_next_fence(self):
        page = Page("<!-- serial: 9600 7E2 -->\n<!-- test: config-part mqtt -->\n```yaml\na: 1\n```\n"
                    "<!-- not run: no broker -->\n\n- x\n  ```sh\n  a \\\n    b\n  ```\n")
        first, second = page.blocks
        self.assertEqual((first.mark, first.argument, first.serial, first.line),
                         ("config-part", "mqtt", "9600 7E2", 3))
        self.assertEqual((second.mark, second.commands()), ("", ["a b"]))  # the empty line parts them

    def test_a_block_that_says_what_is_not_is_found(self):
        for text in ("<!-- test: program -->\n```sh\npanelgate frobnicate\n```\n",
                     "<!-- test: program-1 -->\n```sh\npanelgate --version\n```\n",
                     "<!-- test: program -->\n```sh\npanelgate --version\n```\n"
                     "<!-- test: output -->\n```text\npanelgate ...\nand more\n```\n",
                     "<!-- test: program -->\n```sh\ntrue\n```\n",
                     "<!-- test: config -->\n```yaml\nlines: 7\n```\n",
                     "<!-- test: station -->\n```yaml\n- {id: 256}\n```\n",
                     "<!-- test: config-part mqtt -->\n```yaml\nlog: {level: info}\n```\n",
                     "<!-- test: script -->\n```sh\ndeploy/nothing.sh\n```\n"):
            with self.subTest(text=text), tempfile.TemporaryDirectory() as folder:
                reader = Reader(Page(text), folder, None)
                with self.assertRaises(AssertionError):
                    for block in reader.page.blocks:
                        reader.follow(block)

    def test_prose_is_cut_into_paragraphs_links_and_anchors(self):
        page = Page("# A `b`, c\n\none\ntwo\n\n- three\n- [four](x.md#y 'z') `[no](no)`\n\n| five |\n"
                    "```text\n[no](no)\n```\n## A b c\n## A b c\n")
        self.assertEqual([text.split()[-1] for _, text in page.paragraphs()], ["two", "three", "`[no](no)`"])
        self.assertEqual(page.links(), ["x.md#y"])
        self.assertEqual(page.anchors(), ["a-b-c", "a-b-c-1", "a-b-c-2"])


class Words(unittest.TestCase):
    def test_ways_arrive(self):
        for name, page in PAGES.items():
            for link in page.links():
                if re.match(r"[a-z]+:", link) or (WANTED and name not in FOLLOWED):
                    continue
                with self.subTest(page=name, link=link):
                    path, _, anchor = link.partition("#")
                    there = (DOCS / name).parent / path if path else DOCS / name
                    self.assertTrue(there.exists(), "no such file")
                    if anchor and there.suffix == ".md":
                        self.assertIn(anchor, Page(there.read_text()).anchors())

    def test_the_index_leads_to_every_page(self):
        index = PAGES.get("index.md")
        self.assertIsNotNone(index, "no docs/index.md")
        led = {(DOCS / link.partition("#")[0]).resolve() for link in index.links()}
        self.assertEqual([name for name in PAGES if name != "index.md" and DOCS / name not in led], [])

    def test_lines_and_paragraphs_are_short(self):
        for name, page in WRITTEN.items():
            for number, line in enumerate(page.text.splitlines(), 1):
                with self.subTest(page=name, line=number):
                    self.assertLessEqual(len(line), 400)
            for number, text in page.paragraphs():
                with self.subTest(page=name, line=number):
                    self.assertLessEqual(len(text.split()), 80, text)

    def test_sentences_begin_with_their_subject(self):
        for name, page in WRITTEN.items():
            for number, text in page.paragraphs():
                with self.subTest(page=name, line=number):
                    self.assertEqual(HEADLESS.findall(text), [])

    def test_words_that_say_nothing(self):
        for name, page in PAGES.items():
            for number, line in enumerate(page.text.splitlines(), 1):
                with self.subTest(page=name, line=number):
                    self.assertNotRegex(line, UNWANTED)


if __name__ == "__main__":
    unittest.main()
