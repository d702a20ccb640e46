"""Rows as a table for people, and as JSON."""
import json
import math

from measures import figures


def number(value):
    """Four digits, and no exponent."""
    if math.isnan(value):
        return "-"
    size = abs(value)
    if size >= 1000 or value == 0:
        return f"{value:.0f}"
    return f"{value:.{4 if size < 1 else 3 - math.floor(math.log10(size))}f}"


def asked(bar):
    if bar is None:
        return ""
    return f">= {bar.least:g}" if bar.least is not None else f"<= {bar.most:g}"


def verdict(bar, row):
    if bar is None or row is None:
        return ""
    return "yes" if figures.holds(bar, row.value) else "**no**"


def in_order(values):
    return list(dict.fromkeys(values))


def measure_table(measure, rows, bars, judged):
    """One line a case, one column a program; `judged`: the program that the bars are for."""
    rows = [row for row in rows if row.measure == measure]
    names = sorted(in_order(row.subject for row in rows), key=lambda name: name != judged)
    found = {(row.case, row.subject): row for row in rows}
    text = f"### {measure}\n\n| case | {' | '.join(names)} | asked | holds |\n"
    text += "|---" * (len(names) + 3) + "|\n"
    for case in in_order(row.case for row in rows):
        cells = []
        for name in names:
            row = found.get((case, name))
            errors = row and row.detail and row.detail.get("errors")
            cells.append((number(row.value) if row else "") + (" (!)" if errors else ""))
        own = found.get((case, judged))
        bar = figures.bar_of(bars, own) if own else None
        text += f"| {case} | {' | '.join(cells)} | {asked(bar)} | {verdict(bar, own)} |\n"
    return text


def bars_table(rows, bars, judged):
    """Each bar with the worst figure that it is for, and how many of its cases hold."""
    text = "| measure | cases | asked | worst | holds |\n|---|---|---|---|---|\n"
    for bar in bars:
        own = [row for row in rows if row.subject == judged and figures.bar_of([bar], row)]
        if not own:
            where = next(iter(bar.asked)) if len(bar.asked) == 1 else f"{len(bar.asked)} cases"
            text += f"| {bar.measure} | {where} | {asked(bar)} | not measured | |\n"
            continue
        worst = max(own, key=lambda row: math.inf if math.isnan(row.value) else
                    row.value if bar.least is None else -row.value)
        held = sum(figures.holds(bar, row.value) for row in own)
        where = f"{worst.case}" if len(own) == 1 else f"{held} of {len(own)} hold; worst {worst.case}"
        text += (f"| {bar.measure} | {where} | {asked(bar)} | {number(worst.value)} | "
                 f"{'yes' if held == len(own) else '**no**'} |\n")
    return text


def table(rows, bars, judged, head, left_out=()):
    text = f"# Bench\n\n{head}\n\n{bars_table(rows, bars, judged)}\n"
    for measure in in_order(row.measure for row in rows):
        text += measure_table(measure, rows, bars, judged) + "\n"
    if any(row.detail and row.detail.get("errors") for row in rows):
        text += "(!) with wrong, missing or refused answers, or gaps cut short: see results.json.\n"
    for what in left_out:
        text += f"Left out: {what}.\n"
    return text


def as_json(rows, bars, head, left_out=()):
    def entry(row):
        bar = figures.bar_of(bars, row)
        judged = {"asked": asked(bar), "holds": figures.holds(bar, row.value)} if bar else {}
        return {"measure": row.measure, "case": row.case, "program": row.subject,
                "value": None if math.isnan(row.value) else row.value, "unit": row.unit, **judged,
                "detail": row.detail}
    return json.dumps({"head": head, "left_out": list(left_out),
                       "figures": [entry(row) for row in rows]}, indent=1) + "\n"


def from_json(text):
    """The rows of as_json()."""
    return [figures.Row(one["measure"], one["case"], one["program"],
                        math.nan if one["value"] is None else one["value"], one["unit"], one["detail"])
            for one in json.loads(text)["figures"]]


def updated(old, new):
    """`old` rows with those of `new` in their place, and the others of `new` behind them."""
    def key(row):
        return row.measure, row.case, row.subject
    fresh = {key(row): row for row in new}
    return [fresh.pop(key(row), row) for row in old] + list(fresh.values())
