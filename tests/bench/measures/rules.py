"""What 200 rules of access cost: CPU of a write with them, with them and the audit, and without either; the same process,
clients and line, in turn. All rules name items that are not asked for, but the last: none can be left out."""
import pathlib
import tempfile

from measures import audit, figures
import config  # noqa: E402  (rig puts tests/system into the path)
from measures.figures import Bar, Row

RULES = 200
SHARE = "CPU of 200 rules, share of a write"
WITH_AUDIT = "CPU of 200 rules and the audit, share of a write"
BARS = [Bar(SHARE, {audit.PACED}, most=0.03), Bar(WITH_AUDIT, {audit.PACED}, most=0.03)]


def rules():
    others = "".join(f"    - {{name: other-{i}, deny: [write], range: {{table: holding-registers, address: {1000 + 10 * i}, count: 10}}}}\n"
                     for i in range(RULES - 1))
    return f"\naccess:\n  default: deny\n  rules:\n{others}    - {{name: last, allow: [read, write]}}\n"


def measure_line(run, line, case, turns, seconds):
    for subject in run.gateways:
        costs = {"without": [], "200 rules": [], "200 rules and the audit": []}
        reloaded = subject.but(http=config.ADMIN)
        with tempfile.TemporaryDirectory() as folder, reloaded.serving(line.link, line.baud) as program:
            plain = program.file.read_text()
            audited = f"\naudit: {{file: {pathlib.Path(folder) / 'audit.jsonl'}}}\n"
            # What differs from what runs comes first.
            texts = {"200 rules": plain + rules(), "200 rules and the audit": plain + rules() + audited, "without": plain}
            load = audit.Load(program)
            for _ in range(turns):
                for words, text in texts.items():
                    audit.reload(program, text)
                    load.cpu_us(1)  # what the reload costs
                    cost, writes = load.cpu_us(seconds)
                    costs[words].append(cost)
                    yield Row(audit.CPU, f"{case}, {words}", subject.name, cost, "us", {"writes": writes})
            load.end()
        for share, words in ((SHARE, "200 rules"), (WITH_AUDIT, "200 rules and the audit")):
            # Neighbours in time are compared: a busy machine's other programs come and go.
            shares = [more / less - 1 for more, less in zip(costs[words], costs["without"])]
            yield Row(share, case, subject.name, figures.quantile(shares, 0.5), "", {"turns": turns})


def measure(run):
    yield from audit.on_both_lines(run, measure_line)
