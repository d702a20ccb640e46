#!/usr/bin/env python3
"""soak.py [SECONDS [SEED [alone | two]]]: a gateway with everything on under random faults of lines, panels, devices,
clients, broker, certificates and configuration; with `two`, of a second box at its line, too. Without either word each
kind has half the time. At the end each request has had one answer, sums agree, each confirmed write was on the wire once
and is in the audit, and memory and descriptors are flat. The seed is printed first.

PANELGATE=build/release/panelgate python3 -B tests/soak/soak.py 180
"""
import collections
import contextlib
import pathlib
import random
import re
import signal
import sys
import tempfile
import threading
import time

import plant
from plant import Client, harness

# pylint: disable=wrong-import-order
import config
import mqtt_side
import tls_plant
from test_points import until

POINT = "{name: level, at: '400008', every: 200ms, report: {deadband: 1}}"
VARIANTS = ("", ", {name: more, at: '400020', every: 1s}", ", {name: other, at: '400021', type: i16, every: 500ms}")


def stations_of(ids, more):
    return ", ".join(f"{{id: {i}, name: p{i}, points: [{POINT}{more}]}}" for i in ids)


class SecondBox:
    """The box of rank 1 at the same serial line."""

    def __init__(self, soak, stack):
        self.ends = soak.ends
        self.audit = soak.folder / "log2" / "audit.jsonl"
        self.audit.parent.mkdir()
        file = soak.folder / "second.yaml"
        file.write_text(config.gateway(soak.serial_line(soak.folder / "tty2", ""), modbus=config.MANY,
                                       http=config.ADMIN, audit=soak.audit_to(self.audit), standby="{rank: 1}"))
        self.program = stack.enter_context(harness.Program("run", "-c", str(file)))
        self.port = self.program.modbus_port()

    def client(self):
        return harness.Client(self.port)


class Soak:
    def __init__(self, stack, seed, two):
        self.two = two
        self.chance = random.Random(seed)
        self.ends = threading.Event()
        self.folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        self.audit = self.folder / "log" / "audit.jsonl"
        self.audit.parent.mkdir()
        self.certificates = stack.enter_context(tls_plant.plant())
        self.broker = stack.enter_context(mqtt_side.Broker()) if mqtt_side.BROKER else None
        self.buses = contextlib.ExitStack()
        stack.enter_context(self.buses)
        self.bus = self.buses.enter_context(self.panels())
        self.written = collections.Counter()
        self.device = plant.Shaky(self.a_seed())
        self.device.__enter__()
        stack.callback(lambda: self.device.shut())
        self.file = self.folder / "panelgate.yaml"
        self.events = collections.Counter()
        self.write(VARIANTS[0])
        self.program = stack.enter_context(harness.Program("run", "-c", str(self.file)))
        self.http = self.program.http_port()
        self.port = self.program.modbus_port()
        self.boxes = [self, SecondBox(self, stack)] if two else [self]

    def panels(self):
        return plant.Panels(self.folder / "tty", self.folder / "tty2" if self.two else None, self.a_seed())

    @staticmethod
    def serial_line(device, more):
        return config.line(device=device, baud=115200, retries=1, stations=stations_of((1, 2, 3), more),
                           timing="{response_timeout: 100ms}", offline="{probe_min: 200ms, probe_max: 500ms}")

    @staticmethod
    def audit_to(file):
        return f"{{file: {file}, rotate: 100MiB, keep: 50}}"

    def a_seed(self):
        return random.Random(self.chance.randrange(1 << 32))

    def client(self):
        return harness.Client(self.port)

    def write(self, more):
        text = config.gateway(
            self.serial_line(self.folder / "tty", more),
            f"  - {{name: eth, device: 'modbus-tcp://127.0.0.1:{self.device.port}', in_flight: 8, "
            f"timing: {{response_timeout: 100ms}}, stations: [{stations_of((11,), more)}]}}\n",
            config.line("steady", stations="{id: 31, name: press, profile: autonics-gplp-s}"),
            modbus=f"{config.MANY}}}, {{listen: '127.0.0.2:0', {self.certificates.tls()}", http=config.ADMIN,
            audit=self.audit_to(self.audit), store=f"{{file: {self.folder}/state.db}}",
            images="[{name: plant, unit: 100, points: [p1/level, p2/level, p3/level, p11/level]}]",
            alarms="[{name: lost, station: p1, offline: true}, {name: bad, finding: any}]")
        if self.two:
            text += "standby: {rank: 0}\n"
        if self.broker:
            text += f"mqtt: {{broker: 'mqtt://127.0.0.1:{self.broker.port}', topic: soak, home_assistant: true}}\n"
        self.file.write_text(text)

    # What happens

    def reload(self):
        self.write(self.chance.choice(VARIANTS))
        verdict = self.program.rest("POST", "/api/v1/reload")[1]
        assert verdict["outcome"] in ("applied", "unchanged"), verdict

    def faulty_reload(self):
        good = self.file.read_text()
        self.file.write_text(good.replace("lines:", self.chance.choice(["line:", "lines: [", "lines: 5 #"]), 1))
        verdict = self.program.rest("POST", "/api/v1/reload")[1]
        assert verdict["outcome"] == "invalid", verdict
        self.file.write_text(good)

    def roll_back(self):
        self.program.rest("POST", "/api/v1/reload?rollback=true&weaker=true")

    def unplug(self):
        self.buses.close()
        self.written += self.bus.written
        self.ends.wait(self.chance.uniform(0.05, 1))
        self.bus = self.buses.enter_context(self.panels())

    def shut_device(self):
        port = self.device.port
        self.device.shut()
        self.ends.wait(self.chance.uniform(0.05, 1))
        self.device = plant.Shaky(self.a_seed(), port=port)
        self.device.__enter__()

    def noise(self):
        self.bus.inject(self.chance.randbytes(self.chance.randrange(1, 200)))

    def restart_broker(self):
        if self.broker:
            self.broker.stop()
            self.ends.wait(self.chance.uniform(0, 1))
            self.broker.start()

    def renew(self):
        self.certificates.cert("new-server", "localhost", "127.0.0.1", "--force")

    def stop(self):
        self.hold(self.program, self.chance.uniform(0.1, 1.5))

    def take_over(self):
        self.hold(self.program, self.chance.uniform(2, 4))

    def give_back(self):
        self.hold(self.boxes[1].program, self.chance.uniform(2, 4))

    def hold(self, program, seconds):
        program.process.send_signal(signal.SIGSTOP)
        self.ends.wait(seconds)
        program.process.send_signal(signal.SIGCONT)

    def live(self, seconds, clients):
        """Something happens each second or two, until the time is over or a client has seen a wrong answer."""
        kinds = [self.reload, self.faulty_reload, self.roll_back, self.unplug, self.shut_device, self.noise, self.noise,
                 self.restart_broker, self.renew, self.stop, *([self.take_over, self.give_back] if self.two else [])]
        end = time.monotonic() + seconds
        while time.monotonic() < end and not any(one.wrong for one in clients):
            self.ends.wait(self.chance.uniform(0.5, 2))
            kind = self.chance.choice(kinds)
            self.events[kind.__name__] += 1
            kind()


def judge_sums(box, clients, two):
    """What is wrong with what a gateway has counted, as text. A box that listens counts what it hears."""
    wrong = []
    lines = {"line": "eth"} if two else {}
    metrics = box.program.get("/metrics")[1]
    for what, kind, function in (("reads", plant.Reader, "4"), ("writes", plant.Writer, "6")):
        asked = sum(one.tally["answered"] for one in clients
                    if isinstance(one, kind) and one.plant is box and (not two or one.unit == 11))
        counted = plant.sum_of(metrics, "panelgate_requests_total", function=function, **lines)
        print(f"{what}: {asked} answered, {counted:.0f} counted by the gateway")
        if asked != counted:
            wrong.append(f"{what}: {asked} answered, but {counted:.0f} counted")
    return wrong


def judge_writes(box, written, writer):
    """The gateway has ended, so its audit is whole."""
    audited = {value for one in plant.records_of(box.audit) if one.get("kind") == "write" for value in one["values"]}
    rounds = -(-writer.tally["asked"] // writer.VALUES)
    own = {value: count for value, count in written.items() if value % 2 == writer.value % 2}
    wrong = []
    for what, values in (
            ("confirmed, but not on the wire", [one for one in writer.confirmed if written[one] == 0]),
            ("on the wire twice", [one for one, count in own.items() if count > rounds]),
            ("confirmed, but not in the audit", [one for one in writer.confirmed if one not in audited])):
        print(f"writes {what}: {len(values)}")
        if values:
            wrong.append(f"writes {what}: {values[:10]}")
    verified = harness.run("audit", "verify", str(box.audit))
    return wrong if verified.returncode == 0 else [*wrong, "audit: " + verified.stdout + verified.stderr]


def judge_memory(memory, seconds):
    settled = min(600, seconds / 3)
    late = [one for one in memory.samples if one[0] >= settled]
    print(f"memory: {late[0][1]} KiB after {settled:.0f} s, {late[-1][1]} KiB at the end, "
          f"{memory.slope(settled):.0f} kB an hour; descriptors {late[0][2]} and {late[-1][2]}, "
          f"{max(one[2] for one in late)} at most")
    most = 4 if settled >= 600 else 16  # MiB: rings and caches fill in the first minutes
    return [f"memory grows by more than {most} MiB"] if late[-1][1] > late[0][1] + 1024 * most else []


def clients_of(soak):
    clients: list[Client] = [plant.Reader(soak, unit, soak.a_seed()) for unit in (1, 2, 3, 11, 11)]
    clients += [plant.Reader(box, unit, soak.a_seed()) for box in soak.boxes[1:] for unit in (1, 2)]
    clients += [plant.Writer(box, i, soak.a_seed()) for i, box in enumerate(soak.boxes)]
    clients += [plant.Images(soak, "images", soak.a_seed())]
    clients += [plant.Rest(soak, f"rest {i}", soak.a_seed()) for i in range(2)]
    return clients + [plant.Crowd(soak, f"crowd {i}", soak.a_seed()) for i in range(3)]


def judge_box(soak, box, clients):
    """Ends the gateway."""
    writer = next(one for one in clients if isinstance(one, plant.Writer) and one.plant is box)
    if soak.two:
        times = len(re.findall("standby line=floor1 role=active", box.program.log.text()))
        print(f"rank {soak.boxes.index(box)}: {times} times the line's master")
    wrong = judge_sums(box, clients, soak.two)
    if box.program.stop() != 0:
        wrong.append("a gateway did not end in order: " + box.program.log.text()[-2000:])
    return wrong + judge_writes(box, soak.written, writer)


def run(seconds, seed, two):
    print(f"soak of {seconds} s, seed {seed}, {'two boxes' if two else 'alone'}", flush=True)
    with contextlib.ExitStack() as stack:
        soak = Soak(stack, seed, two)
        until(lambda: soak.program.get("/readyz")[0] == 200)
        clients = clients_of(soak)
        memory = plant.Memory(soak.program.process.pid, soak.ends)
        for one in [memory, *clients]:
            one.start()
        try:
            soak.live(seconds, clients)
        finally:
            soak.ends.set()
        for one in clients:
            one.join(harness.PATIENCE)
        soak.written += soak.bus.written
        hanging = [one.name for one in clients if one.is_alive()]
        print("events:", dict(soak.events))
        for one in clients:
            print(f"{one.name}:", dict(one.tally))
        wrong = [f"{name} waits for an answer" for name in hanging]
        wrong += [why for one in clients for why in one.wrong] + judge_memory(memory, seconds)
        for box in soak.boxes:
            wrong += judge_box(soak, box, clients)
    for why in wrong:
        print("WRONG", why)
    return bool(wrong)


def main(seconds=180, seed=None, how=None):
    seed = random.randrange(1 << 32) if seed is None else int(seed)
    kinds = [how == "two"] if how else [False, True]
    failed = [run(int(seconds) / len(kinds), seed, two) for two in kinds]
    return 1 if any(failed) else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
