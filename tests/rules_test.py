#!/usr/bin/env python3
"""rules_test.py SOURCE_ROOT: what comments and tests cite stands in src/rules.md and in the README.

Cited are promises (P4), rules of the protocol (MBAP-07) and of the house (HR-14), and headings of
the README ("README, REST"). First it plants what may not be and sees that each is found.
"""
import pathlib
import re
import sys
import tempfile

SUFFIXES = {".cpp", ".hpp", ".py", ".txt", ".sh", ".cmake", ".md"}
ID = re.compile(r"\b(?:[A-Z]{2,4}-\d\d|P\d{1,2}(?=\D|$))(?![\d-])")
HEADING = re.compile(r"\bREADME, ([A-Z][\w/]*)")
# Papers that are nowhere in the tree: whoever reads here could not follow.
ELSEWHERE = re.compile(r"\bcontract (?:section )?\d|\bhouse rules? \d|\bpains? \d|\bTable [AB]\b|\bspec-checklist\b")
NO_RULE = {"CRC-16"}


def listed(root):
    """The ids that have a row in src/rules.md, in their order."""
    return re.findall(r"^\| ([A-Z]+-?\d+) \|", (root / "src/rules.md").read_text(), re.M)


def files(root):
    own = pathlib.Path(__file__).name
    for top in ("src", "include", "tests"):
        for file in sorted((root / top).rglob("*")):
            path = file.relative_to(root)
            data = path.parts[:2] in (("tests", "data"), ("tests", "golden"))
            if file.suffix in SUFFIXES and file.name not in ("rules.md", own) and not data:
                yield path.as_posix(), file.read_text()
    yield "README.md", (root / "README.md").read_text()


def judge_line(line, rules, headings):
    for cited in ID.findall(line):
        if cited not in rules and cited not in NO_RULE:
            yield f"{cited} is not in src/rules.md"
    for heading in HEADING.findall(line):
        if heading not in headings:
            yield f"README.md has no heading '{heading}'"
    if found := ELSEWHERE.search(line):
        yield f"'{found[0]}' cites a paper that is not here: cite src/rules.md"


def check(root):
    """FILE:LINE: what is wrong; and how many citations were good."""
    rules = listed(root)
    readme = (root / "README.md").read_text()
    headings = re.findall(r"^## (.+)$", readme, re.M)
    problems = [f"src/rules.md:1: {rule} has two rows" for rule in sorted(set(rules)) if rules.count(rule) > 1]
    cited = set()
    for path, text in files(root):
        for number, line in enumerate(text.splitlines(), 1):
            problems += [f"{path}:{number}: {problem}" for problem in judge_line(line, rules, headings)]
            cited.update(ID.findall(line))
    for rule in rules:
        if rule.startswith("P") and not re.search(rf"^- \*\*{rule}\*\* ", readme, re.M) and "-" not in rule:
            problems.append(f"README.md:1: promise {rule} has no line of its own")
        if rule not in cited and not rule.startswith("HR-"):
            problems.append(f"src/rules.md:1: nobody cites {rule}")
    return len(cited), problems


GOOD = {
    "src/rules.md": "| P1 | Never. |\n| MBAP-07 | Half. |\n| HR-14 | Loop. |",
    "README.md": "- **P1** never\n## REST",
    "src/a/fine.cpp": "// (MBAP-07), P1, RS-485, CRC-16, UTF-8, README, REST, a contract between two",
}
PLANTED = {
    "src/a/b.cpp": "// as PIP-99 says",
    "tests/unit/c_test.cpp": "TEST(Thing, P12IsNoPromise) {}",
    "include/panelgate/d.hpp": "/// (contract 5)",
    "src/a/e.hpp": "/// (house rule 14)",
    "src/a/f.cpp": "// README, Rest",
}


def self_test():
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        for path, text in {**GOOD, **PLANTED}.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text + "\n")
        found = sorted(problem.split(":")[0] for problem in check(root)[1])
        assert found == sorted(PLANTED), f"planted {sorted(PLANTED)}, found {found}"
        rules = root / "src/rules.md"
        for row, wrong in (("| P2 | Not told, not cited. |", 2), ("| P1 | Twice. |", 1), ("| PIP-01 | Unused. |", 1)):
            before = rules.read_text()
            rules.write_text(before + row + "\n")
            count = len(check(root)[1]) - len(PLANTED)
            assert count == wrong, f"{row}: {count} found, not {wrong}"
            rules.write_text(before)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    self_test()
    count, problems = check(pathlib.Path(sys.argv[1]))
    print("\n".join(problems) or f"{count} rules cited, all of them there")
    sys.exit(bool(problems) or count == 0)


if __name__ == "__main__":
    main()
