"""The cases of tests/golden/config, as tests/unit/config/golden_cases.hpp describes them."""
import re

from harness import ROOT


class Case:
    def __init__(self, file, name, text, expected):
        self.file, self.name, self.text, self.expected = file, name, text, expected

    @property
    def is_refused(self):
        return any(line and not line.startswith((" ", "\t")) and ": warning: " not in line
                   and re.match(r"[^ :]+:\d+:\d+: ", line) for line in self.expected.splitlines())


def cases():
    for file in sorted((ROOT / "tests/golden/config").glob("*.txt")):
        head, *rest = re.split(r"(?m)^==== ", file.read_text(encoding="utf-8", errors="replace"))
        prelude = re.sub(r"(?m)\A(#.*\n)*", "", head).rstrip("\n") + "\n"
        for one in rest:
            title, body = one.split("\n", 1)
            lines, expected = re.split(r"(?m)^----\n", body, maxsplit=1)
            name, _, whole = title.partition(" ")
            text = lines if whole or not prelude.strip() else prelude.replace("<case>\n", lines)
            yield Case(file.name, name, text, expected)
