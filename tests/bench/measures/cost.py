"""What 200 rules of access and the audit cost together: CPU of a transaction and the line's utilisation with them and
without, in one process with the same clients and line; a reload switches. Many short windows in the order A B B A, so
that what a machine does besides meets both alike; neighbours are compared, and the median of all pairs has an interval.
All rules name items that are not asked for, but the last: none can be left out."""
import pathlib
import random
import statistics
import tempfile
import threading
import time

from measures import figures, rig
import config  # noqa: E402  (rig puts tests/system into the path)
from measures.figures import Bar, Row

CPU = "CPU us a transaction"
SHARE = "CPU of 200 rules and the audit, share"
USED = "utilisation that 200 rules and the audit cost"
BAUD, RULES, IN_FLIGHT, READS = 115200, 200, 2, 10
PLACES = 5  # that are written: each reload makes anew what is kept of a place, and here there is one each second
MIX, WRITES = "1 write to 9 reads", "writes alone"
CASES = {MIX: 10, WRITES: 1}  # of so many requests one is a write
MOST_CPU, MOST_USED = 0.03, 0.002
BARS = [Bar(SHARE, set(CASES), most=MOST_CPU), Bar(USED, set(CASES), most=MOST_USED)]
BARE, LADEN = "without", "with 200 rules and the audit"
PAIRS, MOST_PAIRS, WINDOW, SETTLED = 60, 300, 1.0, 0.5


class Asking(threading.Thread):
    """Asks one station without pause, always with some in flight, until it is told to end."""

    def __init__(self, port, unit, every, ending):
        super().__init__(daemon=True)
        self.client, self.unit, self.every, self.ending = rig.harness.Client(port), unit, every, ending
        self.start()

    def request(self, number):
        if number % self.every == 0:
            return rig.harness.write_register(number // self.every % PLACES, number % 65536)
        return rig.harness.read_registers(number * 37 % 900, READS)

    def run(self):
        sent = done = 0
        while not self.ending.is_set() or sent > done:
            while sent - done < IN_FLIGHT and not self.ending.is_set():
                self.client.send(self.unit, self.request(sent))
                sent += 1
            reply = self.client.receive()[2]
            assert reply[0] < 0x80, reply
            done += 1
        self.client.close()


class FrameLog:
    """What has come to the bus' log since it was asked last."""

    def __init__(self, path):
        self._lines, self._rest = open(path, encoding="ascii"), ""

    def frames(self, begin, end):
        *lines, self._rest = (self._rest + self._lines.read()).split("\n")
        return figures.between(figures.parse_log(lines), begin, end)

    def close(self):
        self._lines.close()


def laden(folder):
    """200 rules and the audit, as YAML."""
    others = "".join(f"    - {{name: other-{i}, deny: [read, write], range: {{table: holding-registers, "
                     f"address: {1000 + 10 * i}, count: 10}}}}\n" for i in range(RULES - 1))
    return (f"\naccess:\n  default: deny\n  rules:\n{others}    - {{name: last, allow: [read, write]}}\n"
            f"\naudit: {{file: {pathlib.Path(folder) / 'audit.jsonl'}}}\n")


def utilisation(frames):
    """The share of the time in which the line does not wait for its master: from the first request to the last, what is
    not later than the standard lets it be."""
    requests = [frame.start for frame in frames if frame.kind == "REQ"]
    late = sum(figures.lateness(frames, figures.standard_gap(BAUD)))
    return 1 - late / (requests[-1] - requests[0])


class Turns:
    """Windows with and without in one running gateway."""

    def __init__(self, program, log, folder):
        plain = program.file.read_text()
        self._program, self._log = program, log
        self._texts = {BARE: plain, LADEN: plain + laden(folder)}
        self._now = BARE

    def switch(self, words):
        """Another configuration for the same process: so nothing else differs."""
        if words == self._now:
            return
        self._now = words
        self._program.file.write_text(self._texts[words])
        status, verdict = self._program.rest("POST", "/api/v1/reload")
        assert (status, verdict["outcome"]) == (200, "applied"), verdict
        time.sleep(SETTLED)  # what the reload costs

    def window(self):
        """(CPU us of a transaction, utilisation)"""
        begin, used = time.monotonic(), rig.cpu_seconds(self._program.pid)
        time.sleep(WINDOW)
        used, end = rig.cpu_seconds(self._program.pid) - used, time.monotonic()
        frames = self._log.frames(begin, end)
        return 1e6 * used / sum(frame.kind == "REQ" for frame in frames), utilisation(frames)

    def pair(self, number):
        """{words: (CPU us, utilisation)}"""
        order = (BARE, LADEN) if number % 2 == 0 else (LADEN, BARE)
        seen = {}
        for words in order:
            self.switch(words)
            seen[words] = self.window()
        return seen


def interval(values, share=0.95, draws=2000):
    """Of the median, by the bootstrap: always the same for the same values."""
    chance = random.Random(len(values))
    medians = [statistics.median(chance.choices(values, k=len(values))) for _ in range(draws)]
    return figures.quantile(medians, (1 - share) / 2), figures.quantile(medians, (1 + share) / 2)


def judged(pairs):
    """[(measure, median, interval, what it may cost)] of pairs."""
    shares = [seen[LADEN][0] / seen[BARE][0] - 1 for seen in pairs]
    lost = [seen[BARE][1] - seen[LADEN][1] for seen in pairs]
    return [(measure, statistics.median(values), interval(values), most)
            for measure, values, most in ((SHARE, shares, MOST_CPU), (USED, lost, MOST_USED))]


def is_narrow(pairs):
    """Whether the intervals are narrower than the bars."""
    return all(high - low < most for _, _, (low, high), most in judged(pairs))


def all_pairs(turns, quick):
    """As many as it takes to tell."""
    pairs = []
    while len(pairs) < (6 if quick else MOST_PAIRS):
        pairs.append(turns.pair(len(pairs)))
        if len(pairs) >= PAIRS and len(pairs) % 10 == 0 and is_narrow(pairs):
            break
    return pairs


def measure_case(run, subject, case):
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, BAUD) as line, \
            subject.but(http=config.ADMIN).serving(line.link, line.baud) as program:
        log, ending = FrameLog(line.log_path), threading.Event()
        clients = [Asking(program.port, unit, CASES[case], ending) for unit in rig.STATIONS]
        time.sleep(1)
        pairs = all_pairs(Turns(program, log, folder), run.quick)
        ending.set()
        for client in clients:
            client.join()
        log.close()
    for words in (BARE, LADEN):
        yield Row(CPU, f"{case}, {words}", subject.name, statistics.median(seen[words][0] for seen in pairs), "us")
    for measure, median, (low, high), _ in judged(pairs):
        yield Row(measure, case, subject.name, median, "", {"interval": [low, high], "pairs": len(pairs)})
        for end, value in (("lower", low), ("upper", high)):
            yield Row(measure, f"{case}, {end} end of 95 %", subject.name, value, "")


def measure(run):
    for subject in run.gateways:
        for case in CASES:
            yield from measure_case(run, subject, case)
