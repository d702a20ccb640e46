"""What the audit costs: CPU of a write with it and without, the same clients on the same line, in turn.
Unpaced the difference is measured best; what share it is on a paced line follows from CPU a transaction
there."""
import pathlib
import tempfile
import threading
import time

from measures import figures, rig
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


def cpu_us(program, seconds):
    """CPU of a write, in us, and how many there were."""
    ending = threading.Event()
    clients = [Writing(program.port, 1 + i, ending) for i in range(CLIENTS)]
    time.sleep(0.5)
    before, used = sum(client.done for client in clients), rig.cpu_seconds(program.pid)
    time.sleep(seconds)
    done, used = sum(client.done for client in clients) - before, rig.cpu_seconds(program.pid) - used
    ending.set()
    for client in clients:
        client.join()
    return 1e6 * used / done, done


def measure_line(run, line, case, turns, seconds):
    for subject in run.gateways:
        costs = {False: [], True: []}
        for _ in range(turns):
            for audited in (False, True):
                with tempfile.TemporaryDirectory() as folder:
                    more = {"audit": f"{{file: {pathlib.Path(folder) / 'audit.jsonl'}}}"} if audited else {}
                    with subject.serving(line.link, line.baud, **more) as program:
                        cost, writes = cpu_us(program, seconds)
                costs[audited].append(cost)
                words = "with the audit" if audited else "without"
                yield Row(CPU, f"{case}, {words}", subject.name, cost, "us", {"writes": writes})
        without, with_it = (figures.quantile(costs[audited], 0.5) for audited in (False, True))
        yield Row(SHARE, case, subject.name, with_it / without - 1, "")


def measure(run):
    turns, seconds = (2, 3) if run.quick else (5, 5)
    with rig.TcpLine(run.tools) as line:
        yield from measure_line(run, line, UNPACED, turns, seconds)
    with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, 115200) as line:
        yield from measure_line(run, line, PACED, turns, 3 * seconds)
