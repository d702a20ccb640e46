"""docs/reference/cli.md: the commands, of what `PROGRAM help` prints."""
import pathlib
import re

import manual
from tables import page, table

PAGE_1 = pathlib.Path(__file__).resolve().parent / "panelgate.1.in"


def groups(program):
    """[(title, [(command, what it does)])], and the examples, as `help` lists them."""
    text = manual.listed(program)
    found, examples = [], []
    for part in text.strip().split("\nOptions:")[1].split("\n\n")[1:]:
        title, *lines = part.strip("\n").split("\n")
        entries = [re.match(r"  (\S.*?)\s{2,}(.*)$", line).groups() for line in lines]
        if title == "Examples:":
            examples = entries
        else:
            found.append((title.rstrip(":"), entries))
    return found, examples


def entries_of(section):
    """Of a list of the manual page: [(what stands on the left, its text)]."""
    part = PAGE_1.read_text().split(f".Sh {section}\n")[1].split(".El")[0]
    for entry in part.split(".It ")[1:]:
        left, *lines = entry.strip().split("\n")
        words = []
        for line in lines:
            if line.startswith((".Cm ", ".Ql ")):
                line = ", ".join(f"`{name}`" for name in re.split(r" , ", re.sub(r" [,:;]$", "", line[4:]))) + \
                    "".join(re.findall(r" ([,:;])$", line))
            words.append(line)
        yield re.sub(r"^Dv | ,", lambda found: "," * ("," in found[0]), left), " ".join(words)


def about(command):
    lines = [f"### {command.name}", "", command.about[0].upper() + command.about[1:] + ".", "",
             "```text", f"panelgate {' '.join([command.name, *command.usage])}", "```", ""]
    entries = [(left, right) for left, right in command.entries if "--help" not in left]
    if entries:
        lines += table(("option or word", "what it is"), [(f"`{left}`", right) for left, right in entries])
    lines += [" ".join(command.notes), ""] if command.notes else []
    return lines + (["```text", *command.examples, "```", ""] if command.examples else [])


def text(program):
    commands = {command.name: command for command in manual.asked(program)[0]}
    listed, examples = groups(program)
    lines = ["# The command line", "",
             "Made from the program by `deploy/manual/reference.py`. `panelgate help COMMAND` prints the same.",
             "", "```text", *(f"{words:<49}# {what}" for words, what in examples), "```", "",
             "A line of it is `panelgate COMMAND [OPTIONS]`. Options that end in `=VALUE` have that default.",
             ""]
    for title, entries in listed:
        lines += [f"## {title.rstrip(':')}", "",
                  *table(("command", "what it does"),
                         [(f"[`{name}`](#{name})" if name in commands else f"`{name}`", what)
                          for name, what in entries])]
        for name, _ in entries:
            lines += about(commands[name]) if name in commands else []
    lines += ["## Exit codes", "", *table(("code", "meaning"), entries_of("EXIT STATUS")),
              "## Signals", "", *table(("signal", "what it does"), entries_of("SIGNALS"))]
    return page(lines)
