#!/usr/bin/env python3
"""panels.py FOLDER PROGRAM...: what `PROGRAM profiles` and `PROGRAM address` know of the panels, into
the pages FOLDER/docs/panels/*.md, between `<!-- generated: profile NAME -->` (or `profiles`: all of them
in one table) and `<!-- end -->`. The rest of a page is left as it is. PROGRAM may have words before it.
"""
import pathlib
import re
import subprocess
import sys

sys.dont_write_bytecode = True
from tables import table  # noqa: E402

BLOCK = re.compile(r"(?ms)^<!-- generated: (?:profile (\S+)|profiles) -->\n.*?^<!-- end -->$")
CITED = re.compile(r"^(.*?)(?:  \[(.*)\])?$")
DIGIT = {"coil": "0", "discrete input": "1", "input register": "3", "holding register": "4"}

# The manual's own examples, and the ends of what may be read and written.
EXAMPLES = {
    "autonics-gplp-s": "UB0 UB150 UB180 UB1000 UB1878 UB4095F UW0 UW15 UW100 UW6047",
    "autonics-gplp-a": "UB0 UB810 UB1000 UB4095F UW0 UW81 UW100 UW65535",
    "autonics-gp-2005": "UW0 UW15 UW30 UW100 UW6047",
    "autonics-gp-2005-old": "UW0 UW15 UW30 UW100 UW6047",
    "autonics-arm": "000001 000010 000064 100001 100010 300001 300110 301010 400001 400301 401029 41029",
    "panasonic-gt": "GR0 GR20 GR12F GR173 GR255F GDT0 GDT108 GDT510 GDT1230 GDT2047 GDT9080 GDT9086",
    "omron-cp2e": "W0.00 W1.04 W2.06 W127.15 D0 D1000 D4095 D8191 D16383",
    "generic": "000001 100001 300001 400001 400101 465536",
}
PAGES = {"autonics-gplp-s": "autonics-gp-lp.md", "autonics-gplp-a": "autonics-gp-lp.md",
         "autonics-gp-2005": "autonics-gp-2005.md", "autonics-gp-2005-old": "autonics-gp-2005.md",
         "autonics-arm": "autonics-arm.md", "panasonic-gt": "panasonic-gt.md",
         "omron-cp2e": "omron-cp2e.md", "generic": "any-other.md"}


def cited(text):
    said, source = CITED.match(text).groups()
    return said, source or ""


class Place:
    """One notation, as `address` explains it."""

    def __init__(self, program, profile, notation):
        out = subprocess.run([*program, "address", profile, notation], check=True,
                             capture_output=True, text=True).stdout
        what = r"(coil|discrete input|input register|holding register) (\d+) (0x\w{4})"
        self.notation, self.table, address, self.hex = re.match(rf"(\S+) -> {what}\n", out).groups()
        self.written_as, self.address = notation, int(address)
        by = r"(?m)^  read by function ([\d, ]+), written by ([\d, ]*\d|none)"
        self.read, self.write = re.search(by, out).groups()
        notes = re.findall(r"(?m)^  ((?:is bit|its bits are) .*)$", out)
        notes += [f"{name} {at}, by {by}" for name, at, by in
                  re.findall(rf"(?m)^  also {what[:what.index(' (0x')]} 0x\w+: read by function (\d+)", out)]
        if notation != self.notation:
            notes.append(f"the same as {self.notation}")
        self.notes = "; ".join(notes)
        self.number = f"{DIGIT[self.table]}{self.address + 1:05d}"


class Profile:
    def __init__(self, program, name):
        self.program, self.name = program, name
        out = subprocess.run([*program, "profiles", name], check=True, capture_output=True,
                             text=True).stdout.splitlines()
        self.description = out[0].split(": ", 1)[1]
        self.facts = dict(line.split(": ", 1) for line in out[1:] if line[0] != " " and ": " in line)
        self.lists, below = {}, None
        for line in out:
            if line[0] != " ":
                below = self.lists.setdefault(line.rstrip(":"), [])
            else:
                below.append(line.strip())
        serial, self.serial_source = cited(self.facts["serial"])
        known = (r"baud (?P<baud>.*?); parity (?P<parity>.*?); stop bits (?P<stop>.*?)"
                 r"(?:; CRC (?P<crc>.*) byte first)?$")
        self.serial = re.match(known, serial).groupdict()

    def place(self, notation):
        return Place(self.program, self.name, notation)

    def functions(self):
        """(code, name, most, broadcast, source) of each."""
        for line in self.lists["functions"]:
            said, source = cited(line)
            code, name, rest = re.match(r"(\d+)\s+(.{30})(.*)$", said.ljust(40)).groups()
            most = re.search(r"up to (\d+)", rest)
            one = "1" if "single" in name else ""
            yield int(code), name.strip(), most[1] if most else one, "broadcast" in rest, source

    def areas(self):
        """(name, table, first, last, first and last that is written or None, source) of each; of what no
        function reaches (prefix, reason)."""
        known = (r"(\S+) +(coil|discrete input|input register|holding register) +read (\S+) to (\S+) +"
                 r"(?:write (\S+) to ([^\s,]+)|read only)")
        reached, others = [], []
        for line in self.lists["areas"]:
            said, source = cited(line)
            if found := re.match(known, said):
                reached.append((*found.groups(), source))
            else:
                others.append(said.split(None, 1))
        return reached, others

    def settings(self):
        gap, gap_source = cited(self.facts["frame gap"])
        rows = [("stations", self.facts["stations"]), ("baud", self.serial["baud"]),
                ("parity", self.serial["parity"]), ("stop bits", self.serial["stop"]),
                ("CRC", f"{self.serial['crc'] or 'low'} byte first"), ("between two frames", gap)]
        sources = [f"{what}: {source}" for what, source in
                   (("serial settings", self.serial_source), ("gap", gap_source)) if source]
        return [*table(("setting", "value"), rows), f"Source of the {'; of the '.join(sources)}.", ""]

    def memory(self):
        rows = []
        for name, kind, first, last, first_write, last_write, source in self.areas()[0]:
            one, other = self.place(first), self.place(last)
            rows.append((name, kind, f"{first} to {last}", f"{one.address} to {other.address}",
                         f"{one.number} to {other.number}",
                         f"{first_write} to {last_write}" if first_write else "no", source))
        return table(("memory", "Modbus table", "read", "address, from 0", "number, from 1", "written",
                      "source"), rows)

    def notations(self):
        places = [self.place(notation) for notation in EXAMPLES[self.name].split()]
        return table(("you write", "Modbus table", "address, from 0", "hex", "number, from 1", "read by",
                      "written by", "also"),
                     [(f"`{p.written_as}`", p.table, p.address, p.hex, p.number, p.read, p.write, p.notes)
                      for p in places])

    def block(self):
        lines = [f"Made from `panelgate profiles {self.name}`: {self.description}. Manual: {self.facts['manual']}.",
                 "", f"### {self.name}: settings and stations", "", *self.settings(),
                 f"### {self.name}: functions", "",
                 *table(("function", "hex", "what it does", "at most in one frame", "broadcast", "source"),
                        [(code, f"{code:02X}", name, most, "yes" if broadcast else "no", source)
                         for code, name, most, broadcast, source in self.functions()]),
                 f"### {self.name}: memory", "", *self.memory()]
        for prefix, reason in self.areas()[1]:
            lines += [f"`{prefix}`: {reason}.", ""]
        lines += [f"### {self.name}: notation", "", *self.notations()]
        if "exceptions" in self.lists:
            lines += [f"### {self.name}: exceptions", "",
                      *table(("code", "what the panel means by it"),
                             [line.split(None, 1) for line in self.lists["exceptions"]])]
        if "identified by" in self.lists:
            told = [re.match(r"([0-9a-f ]+) -> ([0-9a-f ]+) \.\.\.  (.*)$", line).groups()
                    for line in self.lists["identified by"]]
            lines += [f"### {self.name}: how a scan knows it", "",
                      *table(("asked (function and data)", "the reply begins with", "what it shows", "source"),
                             [(f"`{asked.upper()}`", f"`{reply.upper()}`", *cited(means))
                              for asked, reply, means in told])]
        return lines

    def row(self):
        codes = ", ".join(f"{code:02X}" for code, *_ in self.functions())
        memory = "; ".join(f"{first} to {last}" for _, _, first, last, *_ in self.areas()[0])
        return (f"[`{self.name}`]({PAGES[self.name]})", self.description, self.facts["stations"],
                self.serial["baud"], self.serial["parity"], self.serial["stop"], codes, memory)


def all_profiles(program):
    out = subprocess.run([*program, "profiles"], check=True, capture_output=True, text=True).stdout
    names = [line.split()[0] for line in out.splitlines()]
    return [Profile(program, name) for name in names if name != "gateway"]


def main(folder, *program):
    def written(found):
        if name := found[1]:
            lines = Profile(program, name).block()
            mark = f"profile {name}"
        else:
            lines = table(("profile", "panel", "stations", "baud", "parity", "stop bits", "functions (hex)",
                           "memory"), [profile.row() for profile in all_profiles(program)])
            mark = "profiles"
        return "\n".join([f"<!-- generated: {mark} -->", *lines, "<!-- end -->"])

    for page in sorted((pathlib.Path(folder) / "docs/panels").glob("*.md")):
        page.write_text(BLOCK.sub(written, page.read_text()))


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
