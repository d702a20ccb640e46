"""docs/reference/alerts.md: the alerts and the series that they are made of, from deploy/prometheus/rules."""
import pathlib
import re

import yaml
from tables import one_line, page, table

RULES = pathlib.Path(__file__).resolve().parents[2] / "deploy/prometheus/rules"


def rules(name):
    groups = yaml.safe_load((RULES / name).read_text())["groups"]
    return [rule for group in groups for rule in group["rules"]]


def plain(text):
    """Without the template's words: what stands there is a label, or the value."""
    text = re.sub(r"\{\{ \$labels\.(\w+) \}\}", lambda label: label[1].upper(), text)
    return one_line(re.sub(r"\{\{ \$value[^}]*\}\}", "VALUE", text))


def text():
    alerts = rules("alerts.yml")
    lines = ["# Alerts", "",
             "Made from `deploy/prometheus/rules` by `deploy/manual/reference.py`. How they get into Prometheus",
             "is in [Monitoring](../operate/monitoring.md). *critical*: look now, also at night. *warning*: today.",
             "", *table(("alert", "severity", "after"),
                        [(f"[`{rule['alert']}`](#{rule['alert'].lower()})", rule["labels"]["severity"],
                          rule.get("for", "at once")) for rule in alerts])]
    for rule in alerts:
        notes = rule["annotations"]
        lines += [f"## {rule['alert']}", "", f"*{plain(notes['summary'])}.*", "", plain(notes["description"]), "",
                  f"**What to do.** {plain(notes['runbook'])}", "", "```text", rule["expr"].strip(), "```", ""]
    lines += ["## Series that the rules record", "",
              *table(("series", "of"), [(f"`{rule['record']}`", f"`{one_line(str(rule['expr']))}`")
                                        for rule in rules("recording.yml")])]
    return page(lines)
