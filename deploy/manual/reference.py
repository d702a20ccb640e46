#!/usr/bin/env python3
"""reference.py FOLDER PROGRAM...: what PROGRAM and the sources know, as documents, into FOLDER: the pages
docs/reference/*.md, each made by the module of that name here, and config/panelgate.example.yaml. Those of
keys are made here. PROGRAM may have words before it; demos of it run meanwhile, on ports that are free.
"""
import json
import pathlib
import subprocess
import sys
import textwrap

sys.dont_write_bytecode = True  # beside the sources
import alerts  # noqa: E402
import cli  # noqa: E402
import events  # noqa: E402
import findings  # noqa: E402
import metrics  # noqa: E402
import rest  # noqa: E402
import unit255  # noqa: E402
from tables import cell  # noqa: E402

WIDTH = 100
HEAD = """\
# Every key of this version. One behind '#' is not set: its value is what it is then, or an example; it
# can be taken in alone. What is behind '##' belongs to a block that is taken in as a whole; what is behind
# '###' needs a file, or another value of a neighbour.
# `panelgate check -c FILE` reports what is wrong with a file, and where.
# Durations are 250us, 20ms, 2s, 5min.
#
# Anywhere: ${NAME} and ${NAME:-default} from the environment ($$ is a dollar), YAML merge keys
# (`<<: *name`), and at the top keys that begin with x-, as a place for anchors.
x-fast: &fast {data_bits: 8, stop_bits: 1}    # serial: {<<: *fast, baud: 38400}

# What many stations share, by name: a station's keys but id and name. A station takes one with
# `template: meter`; its own keys win, timing key by key, lists whole.
##templates:
  ##meter:
    ##profile: generic
    ##timing: {response_timeout: 300ms}
"""
# What needs a file, or a neighbour that the example has not, or has otherwise.
NEEDY = {"profiles_dir", "lines.stations.points_file", "lines.tls", "access", "modbus_tcp.tls", "http.tls", "lines.stations.template", "lines.stations.points.bit", "http.tokens",
         *(f"alarms.{key}" for key in ("point", "station", "line", "stale", "offline", "down", "above", "below", "equals", "back")),
         "alarm_webhook.ca", "standby.token_file", "standby.ca", "mqtt.password_file", "mqtt.tls", "mqtt.ca", "mqtt.certificate", "mqtt.key"}
# What needs a device, a broker or a right that not every machine has, and a simulation.
OFF = {"serial_masters", "standby", "mqtt", "realtime", "audit", "alarms", "lines.simulate", "lines.stations.simulate"}
TITLES = {"": "Top level", "lines": "A line", "lines.stations": "A station",
          "lines.stations.points": "A point", "lines.stations.poll": "A block that is polled",
          "modbus_tcp": "A listener for Modbus/TCP", "serial_masters": "A serial master",
          "relays": "A relay", "http.tokens": "A token", "audit": "The audit"}

# Of keys that have neither a default nor an example in the program.
EXAMPLES = {"profiles_dir": "/etc/panelgate/profiles", "lines.serial.data_bits": "8",
            "serial_masters.serial.data_bits": "8", "lines.timing.adaptive_ceiling": "500ms",
            "lines.stations.template": "meter", "lines.stations.retries": "1",
            "lines.stations.crc_order": "low_first",
            "lines.stations.points.bit": "3", "lines.stations.points.length": "16",
            "lines.stations.points.min": "0", "lines.stations.points.max": "400",
            "modbus_tcp.broadcast": "reply", "modbus_tcp.retransmissions": "join",
            "serial_masters.response_timeout": "1s", "mqtt.group": "plant", "mqtt.node": "box17",
            "mqtt.client_id": "box17", "mqtt.username": "box17",
            "mqtt.password_file": "/run/secrets/broker", "mqtt.ca": "ca.pem",
            "mqtt.certificate": "box17.pem", "mqtt.key": "box17.key", "mqtt.tls.certificate": "/etc/panelgate/tls/box17.crt",
            "mqtt.tls.key": "/etc/panelgate/tls/box17.key",
            "http.tokens.expires": "2027-12-31"}
# Values that differ from the default, so that the example has a station with times of its own.
SHOWN = {"lines.stations.timing.response_timeout": "300ms"}
FIRST = ("name", "listen", "id")


class Keys:
    def __init__(self, program):
        out = subprocess.run([*program, "config", "keys", "--format", "json"], check=True,
                             capture_output=True, text=True).stdout
        self.all = json.loads(out)["keys"]

    def below(self, path):
        start = path + "." if path else ""
        found = [key for key in self.all if key["path"].startswith(start)
                 and "." not in key["path"][len(start):] and key["path"] != path]
        return sorted(found, key=lambda key: (name(key) not in FIRST, key["order"] == 0, key["order"]))

    def value(self, key):
        """Its example, or what it is when it is left out; a station's timing is by default its line's."""
        for path in (key["path"], key["path"].replace("lines.stations.timing", "lines.timing")):
            one = next(other for other in self.all if other["path"] == path)
            if found := SHOWN.get(path) or one.get("example") or one.get("default") or EXAMPLES.get(path):
                return scalar(found, key["kind"])
        raise SystemExit(f"{key['path']} has neither a default nor an example")

    def is_needy(self, key):
        """Beside the values of its neighbours in the example it would be refused."""
        if key["path"] in NEEDY:
            return True
        if "condition" not in key:
            return False
        way, _, condition = key["condition"].partition(" with ")
        other, words = condition.split(": ")
        path = key["path"].rsplit(".", 1)[0] + "." + other
        beside = next((one for one in self.all if one["path"] == path), None)
        return beside is None or (self.value(beside) in words.split(" or ")) != (way == "only")

    def maps(self, path=""):
        """The paths of maps with keys of their own, each before those inside it."""
        if self.below(path):
            yield path
            for key in self.below(path):
                yield from self.maps(key["path"])


def name(key):
    return key["path"].rsplit(".", 1)[-1]


def scalar(text, kind):
    plain = kind in ("list", "map", "integer", "number", "boolean", "duration", "word")
    odd = any(c in text for c in ":#{}[],&*!|>'\"%@`") and not text.startswith(("/", "tcp://"))
    return f'"{text}"' if not plain and odd else text


def remarks(key):
    facts = []
    if key.get("values") and key["kind"] != "boolean":
        facts.append(key["values"])
    if key.get("default") and key.get("example", key["default"]) != key["default"]:
        facts.append(f"default {key['default']}")
    if condition := key.get("condition"):
        facts.append(condition)
    return key.get("text", "") + (f" ({'; '.join(facts)})" if facts else "")


class Example:
    def __init__(self, keys):
        self.keys = keys
        self.lines = [HEAD]

    def comment(self, indent, text):
        self.lines += textwrap.wrap(text, WIDTH, initial_indent=indent + "# ",
                                    subsequent_indent=indent + "# ", break_long_words=False,
                                    break_on_hyphens=False)

    def put(self, indent, off, text):
        self.lines.append(indent + off * "#" + text)

    def map(self, path, indent, off, item):
        for key in self.keys.below(path):
            if key["path"] == "templates":  # they are in HEAD
                continue
            # A single '#' taken out of a block that is off would put its key into the map before it.
            inner = 3 if off == 3 or self.keys.is_needy(key) else 2 if off or key["path"] in OFF else 0
            # The first key of a list's entry stands behind the dash.
            place, shown = (indent[:-2], "- " + name(key)) if item else (indent, name(key))
            inside = bool(self.keys.below(key["path"]))
            absent = not inside and "example" not in key and key["path"] not in SHOWN
            if not item:
                self.comment(indent, remarks(key))
            if inside:
                self.put(place, inner, shown + ":")
                deeper = "    " if key["kind"] == "list" else "  "
                self.map(key["path"], indent + deeper, inner, key["kind"] == "list")
            else:
                self.put(place, inner or int(absent), f"{shown}: {self.keys.value(key)}")
            if item:
                # A comment before its dash would belong to the list.
                self.lines[-1] += "    # " + remarks(key)
            item = False
            if not path:
                self.lines.append("")

    def text(self):
        self.map("", "", 0, False)
        return "\n".join(self.lines).rstrip("\n") + "\n"


def said(key):
    condition = key.get("condition", "")
    return key.get("text", "") + (f" {condition[0].upper()}{condition[1:]}." if condition else "")


def page(keys):
    out = ["# Configuration: every key", "",
           "Made from the program by `deploy/manual/reference.py`; the program says the same with",
           "`panelgate config keys`. A key of a list's entry is written in each entry. *A change* says",
           "what a reload does beside taking the value over.", ""]
    for path in keys.maps():
        out += [f"## {TITLES.get(path, '`' + path + '`')}", ""]
        if path in TITLES and path:
            out += [f"`{path}`", ""]
        out += ["| key | values | default | what it is | a change |", "|---|---|---|---|---|"]
        for key in keys.below(path):
            default = "required" if key["required"] else f"`{key['default']}`" if "default" in key else ""
            kind = key.get("values") or {"map": "a map", "list": "a list"}.get(key["kind"], key["kind"])
            out.append("| " + " | ".join(cell(text) for text in (
                f"`{name(key)}`", kind, default, said(key), key.get("change", ""))) + " |")
        out.append("")
    return "\n".join(out).rstrip("\n") + "\n"


def documents(program):
    """{path: text}"""
    keys = Keys(program)
    pages = {"cli": cli.text(program), "rest": rest.text(program), "metrics": metrics.text(program),
             "alerts": alerts.text(), "findings": findings.text(), "log": events.text(),
             "unit-255": unit255.text(program), "configuration": page(keys)}
    return {"config/panelgate.example.yaml": Example(keys).text(),
            **{f"docs/reference/{name}.md": text for name, text in pages.items()}}


def main(folder, *program):
    for path, text in documents(program).items():
        target = pathlib.Path(folder) / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(text)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
