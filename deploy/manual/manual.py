#!/usr/bin/env python3
"""manual.py FOLDER PROGRAM...: panelgate.1, panelgate.yaml.5 and the completions, into FOLDER.

Made of what stands in one place already: commands and options are what `PROGRAM help` prints, keys
are those of docs/reference/configuration.md, the example is config/minimal.yaml. PROGRAM may have words
before it (an emulator). The date is SOURCE_DATE_EPOCH, or today.
"""
import os
import pathlib
import re
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent
EXAMPLE = HERE.parents[1] / "config/minimal.yaml"
REFERENCE = HERE.parents[1] / "docs/reference/configuration.md"
ENTRY = re.compile(r"^  (\S.*?)(?:\s{2,}(\S.*))?$")
COLUMN = " " * 30
COMMAND_COLUMN = " " * 14
OF_FILES = ("-c", "--config", "--profiles", "--diff", "--token-file", "-o", "--output", "--check")  # their value


class Command:
    """What `help COMMAND` prints: what it does, its usage, [(option or word, what it is)], examples, notes."""

    def __init__(self, name, text):
        self.name = name
        lines = text.splitlines()
        at = next(i for i, line in enumerate(lines) if line.startswith("Usage: "))
        self.about = " ".join(lines[:at]).strip()
        self.usage = lines[at].split()[3:]
        self.entries, self.examples, self.notes = [], [], []
        inside = shown = False
        for line in lines[at + 1:]:
            if re.match(r"\w+:$", line):
                shown = line.startswith("Example")
                inside = not shown
            elif shown and line.startswith("  "):
                self.examples.append(line.strip())
            elif inside and line.startswith(COLUMN) and self.entries:
                left, right = self.entries[-1]
                self.entries[-1] = (left, f"{right} {line.strip()}".strip())
            elif inside and (found := ENTRY.match(line)):
                self.entries.append((found[1], found[2] or ""))
            elif line.strip():
                inside = False
                self.notes.append(line.strip())

    def options(self):
        """[(names, values)]: what begins with a dash; values None where it takes none."""
        for left, _ in self.entries:
            if left.startswith("-"):
                names, *rest = left.split()
                words = re.search(r"\{(.*)\}", left)
                yield names.split(","), (words[1].split(",") if words else []) if rest else None


def listed(program):
    """What `help` prints, a command a line."""
    text = subprocess.run([*program, "help"], check=True, capture_output=True, text=True).stdout
    return re.sub(rf"\n{COMMAND_COLUMN}(?=\S)", " ", text)


def asked(program):
    def run(*words):
        return subprocess.run([*program, "help", *words], check=True, capture_output=True,
                              text=True).stdout
    commands = listed(program).split("\nExamples:")[0].split("\nOptions:")[1].split("\n\n", 1)[1]
    names = re.findall(r"(?m)^  (\S+)", commands)
    about = {name: re.search(rf"(?m)^  {name}\s+(.*)$", commands)[1] for name in names}
    return [Command(name, run(name)) for name in names if name not in ("help", "version")], about


def mdoc(text):
    """Text that mdoc takes for nothing else."""
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return re.sub(r"(?m)^([.'])", r"\\&\1", text)


def prose(text):
    """The same, each sentence on a line of its own."""
    return mdoc(re.sub(r"([.:]) (?=[A-Z])", r"\1\n", text))


def left_side(left):
    """An option as `help` writes it, as mdoc's macros."""
    if not left.startswith("-"):
        return "Ar " + left.split()[0]
    names, *value = left.split(None, 1)
    macros = " , ".join("Fl " + name[1:].replace("-", r"\-") for name in names.split(","))
    if not value:
        return macros
    words = re.search(r"\{(.*)\}", value[0])
    many = " Ar ..." if value[0].endswith("...") else ""
    return f"{macros} Ar {words[1].replace(',', '|') if words else 'value'}{many}"


def section(command):
    lines = [f".Ss {command.name}", prose(command.about[0].upper() + command.about[1:] + ".")]
    entries = [(left, right) for left, right in command.entries if "--help" not in left]
    if entries:
        lines.append(".Bl -tag -width Ds")
        for left, right in entries:
            default = re.search(r"=(\S+)", left)
            right += f" (default: {default[1]})" if default else ""
            lines.append(".It " + left_side(re.sub(r"=\S+", "", left)))
            lines += [prose(right)] if right else []
        lines.append(".El")
    if command.notes:
        lines += [".Pp", prose(" ".join(command.notes))]
    if command.examples:
        lines += [".Bd -literal -offset indent", *map(mdoc, command.examples), ".Ed"]
    return lines


def page_1(commands):
    synopsis = []
    for command in commands:
        words = [f"Oo Ar {word.strip('[]').lower()} Oc" if word.startswith("[") else f"Ar {word}"
                 for word in command.usage]
        synopsis += [".Nm", f".Cm {command.name} {' '.join(words)}".rstrip()]
    parts = [line for command in commands for line in section(command)]
    return {"SYNOPSIS": "\n".join(synopsis), "COMMANDS": "\n".join(parts)}


def keys():
    """[(title, path of the map or "", [(key, values, default, what it is, a change)])] of the reference."""
    for part in REFERENCE.read_text().split("\n## ")[1:]:
        title, _, text = part.partition("\n")
        found = re.search(r"(?m)^`([\w.]+)`$", text)
        rows = [[cell.strip().replace("\\|", "|").replace("`", "") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
                for line in text.splitlines() if line.startswith("| `")]
        yield title.strip("`"), found[1] if found else "", rows


def page_5():
    lines = []
    for title, path, rows in keys():
        lines += [f".Ss {mdoc(title)}{': ' + path if path else ''}", ".Bl -tag -width Ds"]
        for key, values, default, text, change in rows:
            facts = [values, "required" if default == "required" else f"default {default}" if default else ""]
            lines += [f".It Ic {mdoc(key)} No : {mdoc(', '.join(filter(None, facts)))}", prose(text)]
            lines += [prose(f"A change: {change}.")] if change else []
        lines.append(".El")
    return {"KEYS": "\n".join(lines), "EXAMPLE": mdoc(EXAMPLE.read_text().rstrip("\n"))}


def completion(commands, about):
    """What the completions of all shells are filled with."""
    def case(pattern, words):
        return f"        {pattern}) list='{words}' ;;"
    values = [case("|".join(f"{command.name}:{name}" for name in names), " ".join(words))
              for command in commands for names, words in command.options() if words]
    options = [case(f"{command.name}:*", " ".join(name for names, _ in command.options()
                                                  for name in names)) for command in commands]
    values += [case(f"{command.name}:{command.name}", " ".join(
        left for left, _ in command.entries if not left.startswith("-")))
        for command in commands if command.usage[-1] == "SUBCOMMAND"]
    helped = case("help:*", " ".join(command.name for command in commands))
    asking = [command.name for command in commands if "STATION" in command.usage]
    described = [f"            {quoted(f'{name}:{what}')}" for name, what in about.items()]
    return {"NAMES": " ".join(about), "DESCRIBED": "\n".join(described), "VALUES": "\n".join(values),
            "OPTIONS": "\n".join([*options, helped]),
            "FILES": "        " + " | ".join(f"*:{name}" for name in OF_FILES) + ")",
            "ASKING": "        " + " | ".join(f"{name}:*" for name in asking) + ")"}


def fish_completion(commands, about):
    lines = [f"complete -c panelgate -n __fish_use_subcommand -f -a {name} -d {quoted(what)}"
             for name, what in about.items()]
    lines.append("complete -c panelgate -n '__fish_seen_subcommand_from help' -f -a " +
                 quoted(" ".join(command.name for command in commands)))
    for command in commands:
        for names, words in command.options():
            flags = " ".join(f"-l {name[2:]}" if name.startswith("--") else f"-s {name[1:]}" for name in names)
            takes = "-f" if words is None else f"-x -a {quoted(' '.join(words))}" if words \
                else "-r -F" if set(names) & set(OF_FILES) else "-x"
            lines.append(f"complete -c panelgate -n '__fish_seen_subcommand_from {command.name}' {flags} {takes}")
    asking = " ".join(command.name for command in commands if "STATION" in command.usage)
    return {"COMPLETE": "\n".join(lines), "ASKING": asking}


def quoted(text):
    """A word of a shell, without what would end it."""
    return "'" + text.replace("'", "") + "'"


def filled(name, values):
    moment = int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))
    day = time.gmtime(moment)
    values["DATE"] = f"{time.strftime('%B', day)} {day.tm_mday}, {day.tm_year}"
    return re.sub(r"@([A-Z]+)@", lambda found: values[found[1]], (HERE / f"{name}.in").read_text())


def main(folder, *program):
    commands, about = asked(program)
    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "panelgate.1").write_text(filled("panelgate.1", page_1(commands)))
    (folder / "panelgate.yaml.5").write_text(filled("panelgate.yaml.5", page_5()))
    words = completion(commands, about)
    for shell in ("bash", "zsh"):
        (folder / f"panelgate.{shell}").write_text(filled(f"panelgate.{shell}", words))
    (folder / "panelgate.fish").write_text(filled("panelgate.fish", fish_completion(commands, about)))


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
