"""The arithmetic of the bench, without any program: rows, bars, quantiles, growth."""
import collections
import math
import statistics

Row = collections.namedtuple("Row", "measure case subject value unit detail", defaults=[None])
Row.__doc__ = """One figure: of `subject` (a program) in `case`. `detail`: what else was seen, for the JSON."""

Bar = collections.namedtuple("Bar", "measure asked least most", defaults=[None, None])
Bar.__doc__ = """What the figures of `measure` in the cases of `asked` must reach: {case: words} with one
bound for all of them, `least` or `most`."""

Frame = collections.namedtuple("Frame", "start end kind")
Frame.__doc__ = "Of the bus' log: seconds of CLOCK_MONOTONIC on the wire; kind REQ, RSP, ..."


def quantile(values, share):
    """The value that `share` of all do not exceed, between two of them where it must be."""
    ordered = sorted(values)
    if not ordered:
        return math.nan
    at = share * (len(ordered) - 1)
    low = int(at)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (at - low) * (ordered[high] - ordered[low])


def parse_log(lines):
    """[Frame] of rtubus' --log: START END BUS KIND hex..."""
    frames = []
    for line in lines:
        words = line.split(maxsplit=4)
        frames.append(Frame(float(words[0]), float(words[1]), words[3]))
    return frames


def between(frames, begin, end):
    """Those that started in this time."""
    return [f for f in frames if begin <= f.start < end]


def rate(frames):
    """Transactions a second from the first request to the last: whole periods, so that a slow line
    is measured as exactly as a fast one."""
    starts = [f.start for f in frames if f.kind == "REQ"]
    if len(starts) < 2:
        return math.nan
    return (len(starts) - 1) / (starts[-1] - starts[0])


def lateness(frames, gap):
    """Seconds by which each request started later than `gap` seconds after the reply before it."""
    late = []
    for before, frame in zip(frames, frames[1:]):
        if (before.kind, frame.kind) == ("RSP", "REQ"):
            late.append(frame.start - before.end - gap)
    return late


def standard_gap(baud, bits=11):
    """t3.5 in seconds; 0: the line is not paced."""
    if baud == 0:
        return 0.0
    return 3.5 * bits / baud if baud <= 19200 else 1.75e-3


def growth(sizes, costs):
    """The exponent k of cost ~ size^k, by least squares of the logarithms: 1 is linear."""
    x = [math.log(size) for size in sizes]
    y = [math.log(cost) for cost in costs]
    return statistics.linear_regression(x, y).slope


def holds(bar, value):
    """Whether a figure reaches the bar; a figure that could not be taken does not."""
    if math.isnan(value):
        return False
    return (bar.least is None or value >= bar.least) and (bar.most is None or value <= bar.most)


def bar_of(bars, row):
    for bar in bars:
        if bar.measure == row.measure and row.case in bar.asked:
            return bar
    return None


def medians(rows):
    """One row for all turns of one case: the median, and in `detail` what it is the median of."""
    groups = collections.defaultdict(list)
    for row in rows:
        groups[row.measure, row.case, row.subject, row.unit].append(row)
    result = []
    for key, turns in groups.items():
        values = [row.value for row in turns]
        if len(turns) == 1:
            result.append(turns[0])
            continue
        detail = {"turns": values}
        for row in turns:
            detail.update(row.detail or {})
        result.append(Row(*key[:3], statistics.median(values), key[3], detail))
    return result
