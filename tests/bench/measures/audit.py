"""What the audit costs: CPU of a write with it and without, the same process, clients and line, in turn.
Unpaced the difference is measured best; what share it is on a paced line follows from CPU a transaction
there."""
import pathlib
import tempfile
import threading
import time

from measures import figures, rig
import config  # noqa: E402  (rig puts tests/system into the path)
from measures.figures import Bar, Row

CPU = "CPU us a write"
SHARE = "CPU of the audit, share of a write"
UNPACED, PACED = "unpaced tcp://", "115200"
BARS = [Bar(SHARE, {PACED}, most=0.03)]
CLIENTS, IN_FLIGHT = 4, 16


class Writing(threading.Thread):
    """Writes register after register, always with some in flight, until it is told to end."""

    def __init__(self, port, unit, ending):
        super().__init__(daemon=True)
        self.client, self.unit, self.ending, self.done = rig.harness.Client(port), unit, ending, 0
        self.start()

    def run(self):
        sent = 0
        while not self.ending.is_set() or sent > self.done:
            while sent - self.done < IN_FLIGHT and not self.ending.is_set():
                self.client.send(self.unit, rig.harness.write_register(sent % 100, sent % 65536))
                sent += 1
            reply = self.client.receive()[2]
            assert reply[0] == 6, reply
            self.done += 1
        self.client.close()


class Load:
    """Clients that write without pause; what a write costs the program is asked for again and again."""

    def __init__(self, program):
        self._pid, self._ending = program.pid, threading.Event()
        self._clients = [Writing(program.port, 1 + i, self._ending) for i in range(CLIENTS)]

    def cpu_us(self, seconds):
        """CPU of a write, in us, and how many there were."""
        before, used = sum(client.done for client in self._clients), rig.cpu_seconds(self._pid)
        time.sleep(seconds)
        done = sum(client.done for client in self._clients) - before
        return 1e6 * (rig.cpu_seconds(self._pid) - used) / done, done

    def end(self):
        self._ending.set()
        for client in self._clients:
            client.join()


def reload(program, text):
    """Another configuration for the same process: so nothing but the audit differs."""
    program.file.write_text(text)
    status, verdict = program.rest("POST", "/api/v1/reload")
    assert (status, verdict["outcome"]) == (200, "applied"), verdict


def measure_line(run, line, case, turns, seconds):
    for subject in run.gateways:
        costs = {False: [], True: []}
        reloaded = subject.but(http=config.ADMIN)
        with tempfile.TemporaryDirectory() as folder, reloaded.serving(line.link, line.baud) as program:
            texts = [program.file.read_text()]
            texts.append(f"{texts[0]}\naudit: {{file: {pathlib.Path(folder) / 'audit.jsonl'}}}\n")
            load = Load(program)
            for turn in range(2 * turns):
                audited = turn % 2 == 0  # the first reload switches it on
                reload(program, texts[audited])
                load.cpu_us(1)  # what the reload costs
                cost, writes = load.cpu_us(seconds)
                costs[audited].append(cost)
                words = "with the audit" if audited else "without"
                yield Row(CPU, f"{case}, {words}", subject.name, cost, "us", {"writes": writes})
            load.end()
        # Neighbours in time are compared: a busy machine's other programs come and go.
        shares = [with_it / without - 1 for with_it, without in zip(costs[True], costs[False])]
        yield Row(SHARE, case, subject.name, figures.quantile(shares, 0.5), "", {"turns": turns})


def on_both_lines(run, measure_line):
    turns, seconds = (4, 2) if run.quick else (12, 4)
    with rig.TcpLine(run.tools) as line:
        yield from measure_line(run, line, UNPACED, turns, seconds)
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, 115200) as line:
        yield from measure_line(run, line, PACED, turns, 2 * seconds)


def measure(run):
    yield from on_both_lines(run, measure_line)
