"""docs/reference/metrics.md: families and help from the sources, labels from gateways that run."""
import contextlib
import pathlib
import re
import time

import running
from tables import page, table

SOURCES = pathlib.Path(__file__).resolve().parents[2] / "src/metrics"
FAMILY = re.compile(r'(\w*)\s*[({]\s*(?:out, snapshot, |out, )?"((?:panelgate|process)_\w+)",\s*((?:"[^"]*"\s*)+)')
# Beside the demo: what only a gateway with these has.
FULL = """lines:
  - {name: floor1, device: "tcp://127.0.0.1:1", stations: [{id: 1, name: panel}]}
serial_masters: [{name: plc, device: /dev/panelgate-none, serial: {baud: 9600}, lines: [floor1]}]
mqtt: {broker: "mqtt://127.0.0.1:1"}
http: {listen: "127.0.0.1:0"}
audit: {file: /dev/shm/panelgate-manual-none/audit.jsonl}
access: {rules: [{name: no-writes, deny: [write]}]}
alarms: [{name: panel-lost, station: panel, offline: true}]
"""
# What neither has: its labels, and what it takes.
FINDING = "line, station, cause; of the gateway itself: cause, name"
OTHERS = {"panelgate_findings": FINDING, "panelgate_active": "line", "panelgate_framing_errors_total": "line",
          "panelgate_parity_errors_total": "line", "panelgate_overruns_total": "line",
          "panelgate_breaks_total": "line",
          "panelgate_token_last_use_timestamp_seconds": "token", "panelgate_tls_handshakes_total": "listener, outcome",
          "panelgate_certificate_expiry_timestamp_seconds": "listener",
          "panelgate_certificate_renewals_total": "listener, outcome"}
# What not every scrape has.
LABELS = {"panelgate_findings": FINDING, "panelgate_build_info": "version, commit, compiler"}
GROUPS = [("Requests", ("requests", "translated", "request_duration", "queue"),
           "`requests_total` begins with `ok` for the functions that a panel has. Of a function `exception` and "
           "`timeout` are there from its first use, other outcomes once they happened."),
          ("Stations", ("station", "turnaround", "bus_transaction", "exceptions", "retries", "late", "foreign",
                        "damaged", "echo", "discarded"), ""),
          ("Lines", ("line", "bus_busy", "broadcasts", "findings", "active"),
           "`panelgate_findings` is there while there is a finding, `panelgate_active` with `standby`."),
          ("Serial drivers", ("framing", "parity", "overruns", "breaks"),
           "Only of lines whose driver counts: a serial port of the machine, and some USB adapters."),
          ("Points", ("point",), "With `points`."), ("Relays", ("relay",), "With `relays`."),
          ("Rights", ("access",), "With rules of `access`."),
          ("Modbus/TCP", ("tcp",), "For each listener."), ("HTTP", ("http", "login", "token"), ""),
          ("TLS", ("tls", "certificate"), "For each listener with `tls`."),
          ("MQTT", ("mqtt",), "With `mqtt`."), ("Audit", ("audit",), "With `audit`."), ("Store and alarms", ("store", "alarm"), "Alarms with `alarms`."),
          ("Serial masters", ("serial_master",), "With `serial_masters`."),
          ("The gateway", ("config", "loop", "build", "log"), "")]


def families():
    """{name: help}, in the order of the sources."""
    found = {}
    for file in sorted(SOURCES.glob("*.cpp")):
        for _, name, text in FAMILY.findall(file.read_text()):
            found[name] = "".join(re.findall(r'"([^"]*)"', text))
    return found


class Scrape:
    def __init__(self, text):
        self.kind = dict(re.findall(r"(?m)^# TYPE (\S+) (\S+)$", text))
        self.help = dict(re.findall(r"(?m)^# HELP (\S+) (.*)$", text))
        self.labels = {}
        for name, labels in re.findall(r"(?m)^([a-z_]+?)(?:\{(.*)\})? \S+$", text):
            family = name if name in self.kind else re.sub(r"_(bucket|sum|count)$", "", name)
            known = self.labels.setdefault(family, [])
            known += [one for one in re.findall(r'(\w+)="', labels) if one not in known and one != "le"]


def scraped(program, names):
    """Scrapes of both gateways, once all is there that they can have."""
    with contextlib.ExitStack() as stack:
        gateways = [stack.enter_context(running.demo(program)),
                    stack.enter_context(running.configured(program, FULL))]
        end = time.monotonic() + running.PATIENCE
        while time.monotonic() < end:
            found = [Scrape(gateway.text("/metrics")) for gateway in gateways]
            there = {name for scrape in found for name in scrape.kind}
            if there >= set(names) - set(OTHERS):
                return found
            time.sleep(0.2)
    raise SystemExit(f"/metrics has no {sorted(set(names) - set(OTHERS) - there)}")


def row(name, text, scrapes):
    for scrape in scrapes:
        if name in scrape.kind:
            if scrape.help[name] != text:
                raise SystemExit(f"{name}: the program is of other sources")
            return f"`{name}`", scrape.kind[name], LABELS.get(name, ", ".join(scrape.labels[name])), text
    return f"`{name}`", "counter" if name.endswith("_total") else "gauge", OTHERS[name], text


def text(program):
    known = families()
    scrapes = scraped(program, known)
    lines = ["# Metrics", "",
             "Made from the program by `deploy/manual/reference.py`. `/metrics` has the text format of Prometheus.",
             "A scrape never touches a bus. Which to watch, and how to scrape, is in",
             "[Monitoring](../operate/monitoring.md); what alerts are made of is in [Alerts](alerts.md).", "",
             "Labels come from the configuration only. A value that could not be read is absent, never 0.",
             "A histogram has `_bucket`, `_sum` and `_count` behind its name. A scrape is packed (gzip) for clients",
             "that accept it, such as Prometheus.", "",
             "<!-- test: demo -->", "```sh", "curl -s http://127.0.0.1:8080/metrics | grep -c '^# HELP'", "```", ""]
    left = dict(known)
    for title, prefixes, when in GROUPS:
        names = [name for name in left if name.startswith(tuple("panelgate_" + one for one in prefixes))]
        lines += [f"## {title}", "", *([when, ""] if when else []),
                  *table(("metric", "type", "labels", "what it is"),
                         [row(name, left.pop(name), scrapes) for name in names])]
    process = [name for name in left if name.startswith("process_")]
    lines += ["## The process", "", "With the names that all programs have for them, as far as `/proc` tells.", "",
              *table(("metric", "type", "labels", "what it is"),
                     [row(name, left.pop(name), scrapes) for name in process])]
    if left:
        raise SystemExit(f"metrics: of which group are {sorted(left)}?")
    return page(lines)
