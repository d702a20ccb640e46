"""docs/reference/unit-255.md: the gateway's own unit, of what `PROGRAM profiles gateway` prints."""
import re
import subprocess

from tables import page, table

ENTRY = re.compile(r"^  (\S.*?)\s{2,}(\S.*)$")


def entries(lines):
    """[(what stands on the left, what on the right)]; a line without a left side goes on."""
    found = []
    for line in lines:
        if match := ENTRY.match(line):
            found.append(match.groups())
        else:
            found[-1] = (found[-1][0], f"{found[-1][1]} {line.strip()}")
    return found


def text(program):
    out = subprocess.run([*program, "profiles", "gateway"], check=True, capture_output=True, text=True).stdout
    parts = [part.split("\n") for part in out.strip().split("\n\n")]
    lines = ["# Unit 255: the gateway itself", "",
             "Made from the program by `deploy/manual/reference.py`; `panelgate profiles gateway` prints the same.",
             "A SCADA sees by it how lines and panels are, without anything besides Modbus.", "",
             f"It is {parts[0][0].split(': ', 1)[1]}.", ""]
    titles = iter([("register", "what it is"), ("function (hex)", "what it answers")])
    for part in parts[1:]:
        if part[0].startswith("  "):
            lines += table(next(titles), [(f"`{left}`", right) for left, right in entries(part)])
        else:
            lines += [*part, ""]
        if part[0].startswith("Input and"):
            lines += ["## Registers", ""]
        elif part[0].startswith("Discrete"):
            lines += ["## Functions", ""]
    lines += ["## Try it", "", "Lines of the listener, and whether the first one is up:", "",
              "<!-- test: demo -->", "```sh", "mbpoll -m tcp -p 1502 -a 255 -t 4 -0 -r 1 -c 4 -1 127.0.0.1", "```"]
    return page(lines)
