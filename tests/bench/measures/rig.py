"""The programs that are measured, and what they are measured with: an independent bus and load."""
import contextlib
import os
import pathlib
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
import wire  # noqa: E402  (puts tests/system into the path)
import config  # noqa: E402
import harness  # noqa: E402
from measures import figures  # noqa: E402

STATIONS = range(1, 9)
UNPACED = 4_000_000  # what a line without pacing is told it has: 3.5 characters are 10 us
UNPACED_GAP = "10us"  # the shortest that the gateway takes on a tty with that rate


def build_tools(folder):
    """{name: program}; None when the sources of the bus and its load are not there."""
    tools = wire.build_tools(folder)
    bare = wire.TOOLS / "bare.cpp"
    if tools is None or not bare.exists():
        return None
    for name, source in (("bare", bare), ("probe", HERE / "probe.cpp"),
                         ("tcp_bus", HERE / "tcp_bus.cpp")):
        tools[name] = str(pathlib.Path(folder) / name)
        subprocess.run(["g++", "-O2", "-std=c++17", "-w", "-o", tools[name], str(source)], check=True)
    return tools


def cpu_seconds(pid):
    """What all threads of a process have used; the scheduler's figure, in nanoseconds."""
    used = 0
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        with contextlib.suppress(FileNotFoundError):  # a thread that has just ended
            used += int((task / "schedstat").read_text().split()[0])
    return used / 1e9


class Panelgate:
    """A build of the gateway. `core`: the only one that it may use; `http`: its listener, as YAML;
    `wrapper`: (program, arguments) that runs it; `environment`: more of it."""

    def __init__(self, name, program, **how):
        self.name, self.program, self._how = name, str(program), how

    def but(self, **how):
        """The same build, run in another way."""
        return Panelgate(self.name, self.program, **{**self._how, **how})

    def unavailable(self):
        return None if os.access(self.program, os.X_OK) else f"there is no {self.program}"

    def configuration(self, link, baud, stations=STATIONS, **more):
        """`more`: other parts of the file, as YAML."""
        gap = "0us" if link.startswith("tcp://") else UNPACED_GAP
        keys = {} if baud else {"timing": f"{{frame_gap: {gap}}}"}
        line = config.line("wire", link, config.station_ids(stations), baud=baud or UNPACED,
                           parity="even", **keys)
        return config.gateway(line, http=self._how.get("http"), **more)

    def takes(self, link, baud):
        """Whether this build accepts the configuration of such a line."""
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write(self.configuration(link, baud))
            file.flush()
            return subprocess.run([self.program, "check", "-c", file.name], capture_output=True,
                                  check=False).returncode == 0

    @contextlib.contextmanager
    def serving(self, link, baud, stations=STATIONS, **more):
        """A running gateway: its Modbus/TCP port is `port`, its process `pid`."""
        with self.running(self.configuration(link, baud, stations, **more)) as program:
            program.log.wait_for("line up")
            yield program

    @contextlib.contextmanager
    def running(self, text):
        core = self._how.get("core")
        pin = None if core is None else lambda: os.sched_setaffinity(0, {core})
        arguments, executable = [], self.program
        if "wrapper" in self._how:
            executable, options = self._how["wrapper"]
            arguments = [*options, self.program]
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(text)
            with harness.Program(*arguments, "run", "-c", str(file), executable=executable,
                                 env={**os.environ, **self._how.get("environment", {})},
                                 preexec_fn=pin) as program:
                program.port = program.modbus_port() if "modbus_tcp:" in text else None
                program.pid = program.process.pid
                program.file = file
                yield program


def without_gap(run, link="/dev/ttyS0"):
    """The gateways that may leave (nearly) no gap on such a line; builds that refuse it are told."""
    able = [subject for subject in run.gateways if subject.takes(link, 0)]
    for subject in run.gateways:
        if subject not in able:
            run.left_out.append(f"{subject.name} on an unpaced line ({link}): it asks for a gap")
    return able


class LoggedLine(wire.PacedLine):
    """A line whose frames can be read back, with their times on the wire. `baud` 0: without pacing,
    and its stations answer at once."""

    def __init__(self, tools, folder, baud, faults=(), stations="1-8"):
        self.log_path = pathlib.Path(folder) / f"log{id(self)}"
        self.baud = baud
        options = ["--log", str(self.log_path)] if baud else ["--turnaround", "0"]
        for fault in faults:
            options += ["--fault", fault]
        super().__init__(tools, folder, baud, options, stations=stations)

    def frames(self, begin, end):
        with open(self.log_path, encoding="ascii") as lines:
            complete = [line for line in lines if line.endswith("\n")]
        return figures.between(figures.parse_log(complete), begin, end)

    def __exit__(self, *_):
        super().__exit__()
        self.log_path.unlink(missing_ok=True)


class TcpLine:
    """Stations behind a TCP server, without pacing: what a line is to a gateway that may leave no gap."""

    baud = 0

    def __init__(self, tools):
        self.tools = tools
        self._bus = subprocess.Popen([tools["tcp_bus"]], stdin=subprocess.PIPE,
                                     stdout=subprocess.PIPE, text=True)
        self.link = f"tcp://127.0.0.1:{self._bus.stdout.readline().split()[1]}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._bus.communicate()

    def stats(self):
        self._bus.stdin.write("stats\n")
        self._bus.stdin.flush()
        return {"gap_violations": 0, **wire.json.loads(self._bus.stdout.readline())}


class Plant(wire.PacedLine):
    """Many lines in one bus program: the gateway is told that line n has the station n. Each reply
    comes in one piece, at its end: the machine is not what is measured."""

    def __init__(self, tools, folder, baud, lines):
        self.baud = baud
        more = [f"{folder}/line{n}-{id(self)}" for n in range(2, lines + 1)]
        everybody = f"1-{lines}"
        options = ["--chunk", "256"]
        for link in more:
            options += ["--bus", f"{link}={everybody}"]
        super().__init__(tools, folder, baud, options, stations=everybody)
        self.links = [self.link, *more]

    def configuration(self):
        return config.gateway(*(config.line(f"line{n}", link, config.station_ids([n]), baud=self.baud,
                                            parity="even")
                                for n, link in enumerate(self.links, 1)))

    def replies(self):
        return [bus["replies"] for bus in self.all_stats()]


class Window:
    """What a load did on the wire between two instants after its warm-up."""

    def __init__(self, line, seconds, pid=None):
        before, begin = line.stats(), time.monotonic()
        cpu = cpu_seconds(pid) if pid else 0.0
        time.sleep(seconds)
        self.cpu = cpu_seconds(pid) - cpu if pid else 0.0
        end, after = time.monotonic(), line.stats()
        self.replies = after["replies"] - before["replies"]
        self.violations = after["gap_violations"] - before["gap_violations"]
        self.frames = line.frames(begin, end) if line.baud else []
        self.rate = figures.rate(self.frames) if line.baud else self.replies / (end - begin)

    def cpu_us(self):
        return 1e6 * self.cpu / self.replies if self.replies else float("nan")

    def lateness(self, baud):
        return figures.lateness(self.frames, figures.standard_gap(baud))


def warm_time(baud, registers):
    """Long enough for some transactions on a slow line."""
    return 1.0 if baud == 0 else max(0.7, 4 / wire.wire_limit(baud, registers))


def bare(line, baud, registers, seconds):
    """The ideal master alone on the line."""
    warm = warm_time(baud, registers)
    command = [line.tools["bare"], line.link, str(baud), str(len(STATIONS)), str(registers),
               f"{warm + seconds + 0.2:.1f}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as master:
        time.sleep(warm)
        seen = Window(line, seconds)
        master.communicate()
    return seen


def until_replies(line, count):
    """Until the stations have answered so many requests."""
    wanted = line.stats()["replies"] + count
    end = time.monotonic() + harness.PATIENCE
    while line.stats()["replies"] < wanted:
        assert time.monotonic() < end, "the line is silent"
        time.sleep(0.01)


def saturate(line, port, pid, registers, seconds, *, clients=8, warm=None, units="1-8"):
    """Clients that always want something: (Window, what the load generator saw)."""
    warm = warm or warm_time(line.baud, registers)
    command = [line.tools["mbload"], "--port", str(port), "--conns", str(clients),
               "--units", units, "--regs", str(registers),
               "--time", f"{seconds + 0.2:.1f}", "--warm", f"{warm:.1f}"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as load:
        time.sleep(warm)
        window = Window(line, seconds, pid)
        seen = wire.json.loads(load.communicate()[0])
    return window, seen


@contextlib.contextmanager
def busy_cores():
    """Every core has niced work that never ends."""
    command = "import os, sys\nos.nice(19)\nos.sched_setaffinity(0, {int(sys.argv[1])})\nwhile True: pass"
    workers = [subprocess.Popen([sys.executable, "-c", command, str(core)])
               for core in sorted(os.sched_getaffinity(0))]
    try:
        yield
    finally:
        for worker in workers:
            worker.terminate()
            worker.wait()


@contextlib.contextmanager
def in_background(work):
    """work(ended) in a thread of its own; it ends soon after the event."""
    ended = threading.Event()
    thread = threading.Thread(target=work, args=(ended,))
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
