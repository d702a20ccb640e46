"""Many clients that read one block: answers a second, as a multiple of what the wire can carry."""
import json
import subprocess
import tempfile

from measures import rig
from measures.figures import Bar, Row

TIMES = "answers as a multiple of the wire's rate"
ANSWERS = "answers a second, one block"
CLIENTS = (1, 8, 64, 512)
RATES = (9600, 38400, 115200)


def case_of(clients, baud):
    return f"{clients} clients, {baud}"


BARS = [Bar(TIMES, {case_of(64, baud) for baud in RATES}, least=60)]


def answered(tools, port, clients, seconds):
    """What the load generator saw of clients that read one block of station 1."""
    done = subprocess.run([tools["mbload"], "--port", str(port), "--conns", str(clients), "--units", "1",
                           "--addr", "100", "--time", str(seconds), "--warm", "1.5"],
                          capture_output=True, text=True, check=True)
    return json.loads(done.stdout)["all"]


def measure(run):
    turns, seconds = (1, 3) if run.quick else (2, 5)
    for baud in (115200,) if run.quick else RATES:
        with tempfile.TemporaryDirectory() as folder, rig.LoggedLine(run.tools, folder, baud) as line:
            for clients in CLIENTS:
                rivals = run.rivals if (clients, baud) == (64, 115200) else []
                for subject in (run.gateways + rivals) * turns:
                    with subject.serving(line.link, baud) as gateway:
                        seen = answered(run.tools, gateway.port, clients, seconds)
                    errors = {what: seen[what] for what in ("exc", "timeouts") if seen[what]}
                    detail = {"errors": errors} if errors else None
                    rate = seen["tps"]
                    yield Row(TIMES, case_of(clients, baud), subject.name,
                              rate / rig.wire.wire_limit(baud), "", detail)
                    yield Row(ANSWERS, case_of(clients, baud), subject.name, rate, "/s", detail)
