#!/usr/bin/env python3
"""rules_test.py SOURCE_ROOT: what comments and tests cite stands in src/rules.md and in the README.

Cited are promises (P4), rules of the protocol (MBAP-07) and of the house (HR-14), and headings of
the README ("README, REST"). Threats (T2) are cited by the arbiter's and the tap's comments and by
docs; each T has a source and its section in docs/how/threats.md. No source, no rule: each constant
of the arbiter's timing.hpp and each row of kJudgeRows in its judge.hpp names what it serves. First
the test plants what may not be and sees that each is found.
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

# "T1" has other meanings elsewhere: threats are looked for in comments of these folders, and in docs.
THREAT = re.compile(r"\bT\d{1,2}\b")
THREATENED = ("src/arbiter/", "include/panelgate/arbiter/", "src/tap/", "include/panelgate/tap/")
THREATS_PAGE = "docs/how/threats.md"
ARBITER = "include/panelgate/arbiter"
CONSTANT = re.compile(r"^\s*inline constexpr\b[^=({]*?\b(k\w+)\s*[={]")
SERVES = re.compile(r"\b(?:T\d{1,2}|P\d{1,2}|(?:SL|AP) \d)")  # a threat, a promise or a clause
DECIDES = re.compile(r"\b(?:T\d{1,2}|P\d{1,2}|MST-\d\d)\b")


def listed(root):
    """The ids that have a row in src/rules.md, in their order."""
    return re.findall(r"^\| ([A-Z]+-?\d+) \|", (root / "src/rules.md").read_text(), re.M)


def sourceless(root):
    """The threats of src/rules.md whose row names no source."""
    rows = re.findall(r"^\| (T\d+) \|(.*)\|$", (root / "src/rules.md").read_text(), re.M)
    return [threat for threat, row in rows if len(cells := row.split(" | ")) < 2 or not cells[1].strip()]


def files(root):
    own = pathlib.Path(__file__).name
    for top in ("src", "include", "tests"):
        for file in sorted((root / top).rglob("*")):
            path = file.relative_to(root)
            data = path.parts[:2] in (("tests", "data"), ("tests", "golden"))
            if file.suffix in SUFFIXES and file.name not in ("rules.md", own) and not data:
                yield path.as_posix(), file.read_text()
    yield "README.md", (root / "README.md").read_text()
    for file in sorted((root / "docs").rglob("*.md")):
        yield file.relative_to(root).as_posix(), file.read_text()


def threats_of(path, line):
    """The threats that a line cites: the arbiter's and the tap's in comments, docs anywhere."""
    if path.startswith("docs/") or path == "README.md" or path.endswith(".md") and path.startswith(THREATENED):
        return THREAT.findall(line)
    return THREAT.findall(line.partition("//")[2]) if path.startswith(THREATENED) else []


def judge_line(path, line, rules, headings):
    for cited in threats_of(path, line):
        if cited not in rules:
            yield f"{cited} is not in src/rules.md"
    if path.startswith("docs/"):  # users' pages cite nothing else
        return
    for cited in ID.findall(line):
        if cited not in rules and cited not in NO_RULE:
            yield f"{cited} is not in src/rules.md"
    for heading in HEADING.findall(line):
        if heading not in headings:
            yield f"README.md has no heading '{heading}'"
    if found := ELSEWHERE.search(line):
        yield f"'{found[0]}' cites a paper that is not here: cite src/rules.md"


def headers(root, name):
    """The arbiter's headers of that name, where they may stand."""
    paths = [f"{ARBITER}/{name}", f"{ARBITER}/book/{name}"]
    return [path for path in paths if (root / path).is_file()]


def judge_constants(text):
    """Line and name of each constant whose comment names nothing that it serves. A comment is that
    of all constants below it, up to an empty line or the next comment."""
    comment, is_open = "", False  # open: the last line was of the comment
    for number, line in enumerate(text.splitlines(), 1):
        code, _, said = line.partition("//")
        if not code.strip():
            comment = (comment if is_open else "") + said
            is_open = bool(said)
            continue
        is_open = False
        if (found := CONSTANT.match(code)) and not SERVES.search(said or comment):
            yield number, found[1]


def judge_rows(text):
    """Each row of kJudgeRows, as line and whether it ends with a comment that names its reason."""
    before, _, table = text.partition("kJudgeRows[] = {\n")
    first = before.count("\n") + 2
    for number, line in enumerate(table.partition("\n};")[0].splitlines() if table else [], first):
        code, _, said = line.partition("//")
        if code.rstrip().rstrip(",").endswith("}"):
            yield number, bool(DECIDES.search(said))


def judge_arbiter(root):
    """No source, no rule: what in the arbiter's constants and in its table names nothing it serves."""
    for name in ("timing.hpp", "judge.hpp"):
        if not headers(root, name):
            yield f"{ARBITER}/{name}:1: not there, nor below book/"
    for path in headers(root, "timing.hpp"):
        text = (root / path).read_text()
        if not re.search("^inline constexpr", text, re.M):
            yield f"{path}:1: no constant"
        for number, constant in judge_constants(text):
            yield f"{path}:{number}: {constant} names no T, no clause (SL, AP) and no promise"
    for path in headers(root, "judge.hpp"):
        rows = list(judge_rows((root / path).read_text()))
        if not rows:
            yield f"{path}:1: no table kJudgeRows"
        for number, is_reasoned in rows:
            if not is_reasoned:
                yield f"{path}:{number}: the row ends with no T, no MST rule and no promise"


def judge_threats(root, rules):
    threats = [rule for rule in rules if THREAT.fullmatch(rule)]
    page = root / THREATS_PAGE
    told = re.findall(r"^## (T\d+):", page.read_text(), re.M) if page.is_file() else []
    for threat in sourceless(root):
        yield f"src/rules.md:1: {threat} has no source"
    for threat in threats:
        if threat not in told:
            yield f"{THREATS_PAGE}:1: no section '## {threat}: ...'"


def check(root):
    """FILE:LINE: what is wrong; and how many citations were good."""
    rules = listed(root)
    readme = (root / "README.md").read_text()
    headings = re.findall(r"^## (.+)$", readme, re.M)
    problems = [f"src/rules.md:1: {rule} has two rows" for rule in sorted(set(rules)) if rules.count(rule) > 1]
    cited = set()
    for path, text in files(root):
        for number, line in enumerate(text.splitlines(), 1):
            problems += [f"{path}:{number}: {problem}" for problem in judge_line(path, line, rules, headings)]
            cited.update(threats_of(path, line) if path.startswith("docs/") else
                         ID.findall(line) + threats_of(path, line))
    for rule in rules:
        if rule.startswith("P") and not re.search(rf"^- \*\*{rule}\*\* ", readme, re.M) and "-" not in rule:
            problems.append(f"README.md:1: promise {rule} has no line of its own")
        if rule not in cited and not rule.startswith("HR-"):
            problems.append(f"src/rules.md:1: nobody cites {rule}")
    problems += [*judge_threats(root, rules), *judge_arbiter(root)]
    return len(cited), problems


TIMING = f"{ARBITER}/book/timing.hpp"
JUDGE = f"{ARBITER}/judge.hpp"
GOOD = {
    "src/rules.md": "| P1 | Never. |\n| T1 | Silence. | SL 2.4.1 |\n| MBAP-07 | Half. |\n| MST-04 | Nobody asked. |\n| HR-14 | Loop. |",
    "README.md": "- **P1** never\n## REST",
    "docs/how/threats.md": "## T1: silence\nRS-485 and ABC-12 are no rules of ours",
    "src/a/fine.cpp": "// (MBAP-07), P1, RS-485, CRC-16, UTF-8, README, REST, a contract between two, T28, t1.5",
    "src/arbiter/fine.cpp": "template <class T2> void f();  // T1, t3.5",
    TIMING: """/// How long (T1).
inline constexpr Duration kLong = 1s;
inline constexpr Duration kAsLong =
    2s;

/// Of the line,
/// SL 2.4.1.
inline constexpr int kMost{3};
inline constexpr int kFew = 4;  ///< P1""",
    JUDGE: """inline constexpr JudgeRow kJudgeRows[] = {
    {fact::a, Done::b},  // T1
    {fact::a |
         fact::c,
     Done::b},  // P1
    {0, Done::d},  // MST-04
};""",
}
PLANTED = {
    "src/a/b.cpp": "// as PIP-99 says",
    "tests/unit/c_test.cpp": "TEST(Thing, P12IsNoPromise) {}",
    "include/panelgate/d.hpp": "/// (contract 5)",
    "src/a/e.hpp": "/// (house rule 14)",
    "src/a/f.cpp": "// README, Rest",
    "src/arbiter/g.cpp": "int a;  // (T15)",
    "src/tap/README.md": "As T16 says",
    "docs/h.md": "T77 happens",
}
# Changes of one file, and how many problems more each makes: (file, before, after, problems).
CHANGED = (
    ("src/rules.md", "| HR-14", "| P2 | Not told, not cited. |\n| HR-14", 2),
    ("src/rules.md", "| HR-14", "| P1 | Twice. |\n| HR-14", 1),
    ("src/rules.md", "| HR-14", "| PIP-01 | Unused. |\n| HR-14", 1),
    ("src/rules.md", "| HR-14", "| T2 | Not cited, no section. | SL 1 |\n| HR-14", 2),
    ("src/rules.md", "| SL 2.4.1 |", "|", 1),
    ("src/rules.md", "| SL 2.4.1 |", "|  |", 1),
    ("docs/how/threats.md", "## T1", "## About T1", 1),
    (TIMING, "(T1)", "", 2),
    (TIMING, "SL 2.4.1", "section 2.4.1", 1),
    (TIMING, "  ///< P1", "  ///< at most", 1),
    (TIMING, "inline constexpr Duration kAsLong", "\ninline constexpr Duration kAsLong", 1),
    (TIMING, "inline constexpr", "constexpr", 1),
    (JUDGE, "// T1", "// why not", 1),
    (JUDGE, "  // P1", "", 1),
    (JUDGE, "MST-04", "of nobody", 2),  # and then nobody cites it
    (JUDGE, "kJudgeRows", "kRows", 1),
)


def self_test():
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        for path, text in {**GOOD, **PLANTED}.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text + "\n")
        found = sorted(problem.split(":")[0] for problem in check(root)[1])
        assert found == sorted(PLANTED), f"planted {sorted(PLANTED)}, found {found}"
        usual = len(check(root)[1])
        for path, before, after, wrong in CHANGED:
            text = (root / path).read_text()
            assert before in text, f"{path}: {before}"
            (root / path).write_text(text.replace(before, after))
            count = len(check(root)[1]) - usual
            assert count == wrong, f"{path}: '{after}' for '{before}': {count} found, not {wrong}"
            (root / path).write_text(text)
        for path in (TIMING, JUDGE, THREATS_PAGE):
            (root / path).rename(root / "aside")
            found = {problem for problem in check(root)[1] if "not there" in problem or "no section" in problem}
            assert len(found) == 1, f"{path} is not missed"
            (root / "aside").rename(root / path)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    self_test()
    count, problems = check(pathlib.Path(sys.argv[1]))
    print("\n".join(problems) or f"{count} rules cited, all of them there")
    sys.exit(bool(problems) or count == 0)


if __name__ == "__main__":
    main()
