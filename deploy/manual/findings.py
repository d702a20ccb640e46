"""docs/reference/findings.md: what the line doctor finds, and what is found of the gateway itself. The
doctor's causes stand in an enumeration, and what is said of each stands in the dashboard's table of words; a
cause that one of them lacks ends this. So does a cause of the gateway that the table below lacks."""
import json
import pathlib
import re

from tables import page, table

ROOT = pathlib.Path(__file__).resolve().parents[2]
CAUSES = ROOT / "include/panelgate/doctor/finding.hpp"
CODES = ROOT / "include/panelgate/doctor/settings.hpp"
WORDS = ROOT / "src/web/page/finding_words.js"
OWN = ROOT / "src/gateway/findings.cpp"
# cause: what it is, sign, remedy
OF_THE_GATEWAY = {
    "overload": ("more is asked of a line than it can carry",
                 "a line is in use for more than 95 % of a minute, or requests find no turn in each ten seconds "
                 "of a minute; `clients` has the addresses that asked, with their shares",
                 "Ask less often or in blocks, give stations a `max_age`, raise the baud, or take stations to a "
                 "second line."),
    "broker-away": ("values do not reach the MQTT broker", "no connection for 10 s",
                    "See whether the broker runs and can be reached; `mqtt not connected` in the log says why."),
    "audit-fails": ("the audit cannot be written", "the file takes no record; with `on_failure: refuse_writes` "
                    "every write is refused",
                    "`audit fails` in the log says why: a full disk, a folder that is not there, or rights."),
    "store-fails": ("events and history cannot be written to `store`'s file, and are lost meanwhile",
                    "the disk takes no event and no value; `evidence` has the reason",
                    "A full disk, a folder that is not there, or rights: mend it, or name another file in `store`."),
    "reload-refused": ("the running configuration is not that of the file",
                       "the last reload was refused; `evidence` has the first fault",
                       "Mend the file (`panelgate check`), and reload. A restart would fail with the file as it is."),
    "certificate-expires": ("a certificate ends within 14 days, or has expired",
                            "its last day; `name` is the listener or the broker",
                            "Put a new certificate in its place; the gateway takes it over by itself."),
}
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


def of_the_gateway():
    causes_there = re.findall(r'\.cause = "([\w-]+)"', OWN.read_text())
    if sorted(causes_there) != sorted(OF_THE_GATEWAY):
        raise SystemExit(f"{OWN} has other causes than {list(OF_THE_GATEWAY)}")
    lines = ["## Of the gateway itself", "",
             "They are in `/api/v1/findings`, in `panelgate status`, on the dashboard, in the log as `gateway "
             "finding`,", "and as `panelgate_findings{cause=\"...\"}` in `/metrics`.", ""]
    for cause, (what, sign, remedy) in OF_THE_GATEWAY.items():
        lines += [f"### {cause}", "", what[0].upper() + what[1:] + ".", "",
                  *table(("", ""), [("Sign", sign), ("Remedy", remedy)])]
    return lines


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
             *table(("cause", "what it is"), [(f"[`{code}`](#{code})", what) for code, what in found] +
                    [(f"[`{code}`](#{code})", of[0]) for code, of in OF_THE_GATEWAY.items()]),
             "## Of the whole line", ""]
    for place, (code, what) in enumerate(found):
        if place == OF_LINE:
            lines += ["## Of one panel", ""]
        lines += entry(all_words, code, what)
    return page(lines + of_the_gateway())
