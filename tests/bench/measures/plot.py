"""The figures as one SVG: a panel a measure, a group a case, a bar a program, a line where the bar is."""
import math
from xml.sax.saxutils import escape

from measures import figures, report

COLOURS = ("#1b6ca8", "#9aa5b1", "#e0a030", "#b04a5a", "#5a9a5a", "#7a5aa8")
WIDTH, LABELS, ROW, GROUP_GAP, TITLE = 900, 300, 14, 6, 34
SCALE = WIDTH - LABELS - 90


class Axis:
    """Values to pixels, by their logarithm where they differ by more than a factor of 30."""

    def __init__(self, values):
        positive = [value for value in values if value > 0]
        self._most = max(positive, default=1)
        least = min(positive, default=1)
        self.is_log = self._most / least > 30
        self._low = math.log10(least) - 0.3
        self._span = math.log10(self._most) - self._low

    def at(self, value):
        if not value > 0:  # also what is not a number
            return 0
        share = (math.log10(value) - self._low) / self._span if self.is_log else value / self._most
        return max(0, min(1, share)) * SCALE


def text(x, y, words, size=11, anchor="start", weight="normal"):
    return (f'<text x="{x:.0f}" y="{y:.0f}" font-size="{size}" text-anchor="{anchor}" '
            f'font-weight="{weight}">{escape(words)}</text>')


def panel(measure, rows, bars, colours, top):
    """(elements, the y below them)"""
    bounds = [figures.bar_of(bars, row) for row in rows]
    limits = [bar.least if bar.least is not None else bar.most for bar in bounds if bar]
    axis = Axis([row.value for row in rows] + limits)
    drawn = [text(10, top + 20, measure + (" (logarithmic)" if axis.is_log else ""), 13, weight="bold")]
    y = top + TITLE
    for case in report.in_order(row.case for row in rows):
        group = [row for row in rows if row.case == case]
        drawn.append(text(LABELS - 8, y + ROW * len(group) / 2 + 4, case, anchor="end"))
        for row in group:
            wide = axis.at(row.value)
            drawn.append(f'<rect x="{LABELS}" y="{y}" width="{wide:.1f}" height="{ROW - 3}" '
                         f'fill="{colours[row.subject]}"/>')
            drawn.append(text(LABELS + wide + 4, y + ROW - 4, report.number(row.value), 10))
            y += ROW
        bar = next((figures.bar_of(bars, row) for row in group if figures.bar_of(bars, row)), None)
        if bar:
            x = LABELS + axis.at(bar.least if bar.least is not None else bar.most)
            drawn.append(f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y - ROW * len(group) - 2}" '
                         f'y2="{y}" stroke="black" stroke-dasharray="3 2"/>')
        y += GROUP_GAP
    return drawn, y + 8


def svg(rows, bars, head):
    """Of measures that have a bar or several programs."""
    names = report.in_order(row.subject for row in rows)
    colours = {name: COLOURS[i % len(COLOURS)] for i, name in enumerate(names)}
    drawn, y = [text(10, 22, head, 12)], 36
    for i, name in enumerate(names):
        drawn.append(f'<rect x="{10 + 145 * i}" y="{y}" width="11" height="11" fill="{colours[name]}"/>')
        drawn.append(text(26 + 145 * i, y + 10, name))
    y += 20
    for measure in report.in_order(row.measure for row in rows):
        own = [row for row in rows if row.measure == measure]
        if any(figures.bar_of(bars, row) for row in own) or len({row.subject for row in own}) > 1:
            more, y = panel(measure, own, bars, colours, y)
            drawn += more
    wide = max(WIDTH, 20 + 145 * len(names))
    body = "\n".join(drawn)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{y:.0f}" '
            f'font-family="sans-serif">\n<rect width="100%" height="100%" fill="white"/>\n{body}\n</svg>\n')
