"""docs/reference/findings.md: what the line doctor finds. Its causes stand in an enumeration, and what is
said of each stands in the dashboard's table of words; a cause that one of them lacks ends this."""
import json
import pathlib
import re

from tables import page, table

ROOT = pathlib.Path(__file__).resolve().parents[2]
CAUSES = ROOT / "include/panelgate/doctor/finding.hpp"
CODES = ROOT / "src/doctor/finding.cpp"
WORDS = ROOT / "src/web/page/finding_words.js"
OF_LINE = 9  # so many come first in the enumeration


def words():
    """{"advice.noise": its English text}"""
    return {key: json.loads(f'"{english}"') for key, english in
            re.findall(r'(?m)^"([\w.-]+)": \["((?:[^"\\]|\\.)*)"', WORDS.read_text())}


def causes():
    """[(code, what the source says of it)]"""
    block = CAUSES.read_text().split("enum class Cause")[1].split("};")[0]
    found = [(name.replace("_", "-"), what) for name, what in
             re.findall(r"(?m)^    (\w+),\s+///< (.*)$", block)]
    codes = re.findall(r'(?m)^    "([\w-]+)",$', CODES.read_text())
    if [code for code, _ in found] != codes:
        raise SystemExit(f"{CAUSES} and {CODES} differ")
    return found


def said(all_words, kind, code):
    """Its text and those of its variants."""
    texts = [text for key, text in all_words.items()
             if key == f"{kind}.{code}" or key.startswith(f"{kind}.{code}.")]
    return [re.sub(r"\{(\w+)\}", lambda name: {"who": "STATION"}.get(name[1], "N"), text) for text in texts]


def entry(all_words, code, what):
    title = said(all_words, "finding", code)
    advice = said(all_words, "advice", code)
    if not title or not advice:
        raise SystemExit(f"{WORDS} has nothing for {code}")
    signs = said(all_words, "evidence", code)
    if f"evidence.{code}" not in all_words:
        signs = said(all_words, "evidence", "damage") + signs
    sentence = title[0].removeprefix("STATION: ")
    return [f"### {code}", "", sentence[0].upper() + sentence[1:], "",
            *table(("", ""), [("Cause", what), ("Sign", "; or: ".join(signs)), ("Remedy", " Or: ".join(advice))])]


def text():
    all_words, found = words(), causes()
    lines = ["# Findings", "",
             "Made from the sources by `deploy/manual/reference.py`. The gateway looks for the causes of errors",
             "itself, from what it counts in the last minute. What it finds is in `findings` of",
             "`/api/v1/lines/{line}`, on the dashboard, in `panelgate status`, in the log as `line finding`, and as",
             "`panelgate_findings{cause=\"...\"}` in `/metrics`. N stands for a number that is measured.", "",
             "The gateway's own sentences may say more, with the settings and figures of the case.", "",
             "A finding needs some cases to appear, and half of that to stay. Where one cause explains damage,",
             "no other is named for it.", "",
             *table(("cause", "what it is"), [(f"[`{code}`](#{code})", what) for code, what in found]),
             "## Of the whole line", ""]
    for place, (code, what) in enumerate(found):
        if place == OF_LINE:
            lines += ["## Of one panel", ""]
        lines += entry(all_words, code, what)
    return page(lines)
