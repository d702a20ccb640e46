"""How long a reload holds those whom it is not about: a client asks one line without pause, while the
file of eight lines of 31 stations of 10 points is read again and again with something else in it."""
import http.client
import threading
import time

from measures import figures, rig
from measures.figures import Bar, Row

PAUSE = "longest answer of an unchanged line beside reloads, beyond the longest without, ms"
WAIT = "answer of an unchanged line, ms"
TOOK = "a reload, file to verdict, ms"
WRONG = "answers lost or wrong on the unchanged line"
CASE = "8 lines of 31 stations of 10 points"
BARS = [Bar(PAUSE, {CASE}, most=50), Bar(WRONG, {CASE}, most=0)]


class Asking(threading.Thread):
    """A client of one station, which answers what it always answers."""

    def __init__(self, port):
        super().__init__(daemon=True)
        self.client = rig.harness.Client(port)
        self.took, self.wrong = [], 0
        self.ending = threading.Event()
        self.first = self.client.ask(1, rig.harness.read_registers(1000))
        self.start()

    def run(self):
        while not self.ending.is_set():
            begun = time.monotonic()
            reply = self.client.ask(1, rig.harness.read_registers(1000))
            self.took.append(1000 * (time.monotonic() - begun))
            self.wrong += reply != self.first

    def end(self):
        self.ending.set()
        self.join()
        self.client.close()
        return self.took


def variants():
    """The same plant; on line 2 other retries, another rate of polls, another wire."""
    text = rig.config.wide(8, 31, 10).replace("http: {", "http: {anonymous: admin, ", 1)
    text += f"modbus_tcp: [{{{rig.config.FREE_PORT}, lines: [line1]}}]\n"
    yield text
    head, line2, rest = text.partition("  - name: line2\n")
    assert line2
    yield head + line2 + "    retries: 0\n" + rest
    yield head + line2 + rest.replace("every: 10s", "every: 11s", 3)
    yield head + line2 + "    echo: off\n" + rest


def reload(program):
    """How long until the verdict, in ms."""
    begun = time.monotonic()
    connection = http.client.HTTPConnection("127.0.0.1", program.http_port(), timeout=60)
    connection.request("POST", "/api/v1/reload")
    answer = connection.getresponse()
    verdict = answer.read()
    assert answer.status == 200 and b'"applied"' in verdict, verdict
    connection.close()
    return 1000 * (time.monotonic() - begun)


def measure(run):
    reloads = 20 if run.quick else 200
    texts = list(variants())
    for subject in run.gateways:
        with subject.running(texts[0]) as program:
            program.log.wait_for("line up", 8)
            asking = Asking(program.port)
            time.sleep(2 if run.quick else 10)
            alone = asking.end()
            asking, took = Asking(program.port), []
            for turn in range(1, reloads + 1):
                program.file.write_text(texts[turn % len(texts)])
                took.append(reload(program))
            beside = asking.end()
        more = {"asked": len(beside), "reloads": reloads}
        yield Row(PAUSE, CASE, subject.name, max(0, max(beside) - max(alone)), "ms", more)
        yield Row(WRONG, CASE, subject.name, asking.wrong, "", more)
        for when, waits in (("nobody reloads", alone), ("beside reloads", beside)):
            for word, share in (("p50", 0.5), ("p99", 0.99), ("longest", 1)):
                yield Row(f"{WAIT}, {word}", when, subject.name, figures.quantile(waits, share), "ms")
        for word, share in (("p50", 0.5), ("longest", 1)):
            yield Row(f"{TOOK}, {word}", CASE, subject.name, figures.quantile(took, share), "ms")
