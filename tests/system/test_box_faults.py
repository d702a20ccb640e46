"""Faults of the box: the process is killed or stopped, the disk is full, the clock is set, noise on a wire, a crowd
of connections, a profile that is none. What other files have: tests/README.md."""
import contextlib
import json
import os
import pathlib
import random
import resource
import signal
import socket
import sqlite3
import subprocess
import tempfile
import threading
import time
import tty
import unittest

import config
import harness
from harness import read_registers, write_register
from rtu_bus import RtuBus, echo_address
from test_points import until

WRONG_CLOCK = os.environ.get("WRONG_CLOCK", str(harness.ROOT / "build/release/libwrong_clock.so"))
POINT = "points: [{name: level, at: '400008', every: 100ms, writable: true}]"
STATION = f"{{id: 1, name: mixer, {POINT}}}"
SEED = int(os.environ.get("PANELGATE_SEED", random.randrange(1 << 32)))


class Place:
    """A folder with a configuration, a line and its panel."""

    def __init__(self, stack, more="", stations=STATION, **keys):
        self.folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        self.audit = self.folder / "audit.jsonl"
        self.store = self.folder / "state.db"
        self.bus = stack.enter_context(RtuBus(self.folder / "tty", {1: echo_address}))
        self.file = self.folder / "panelgate.yaml"
        self.file.write_text(config.gateway(
            config.line(device=self.folder / "tty", baud=115200, stations=stations, **keys),
            config.STEADY_LINE, http=config.ADMIN,
            audit=f"{{file: {self.audit}}}", store=f"{{file: {self.store}}}") + more)

    def run(self, **options):
        return harness.Program("run", "-c", str(self.file), **options)


class Process(unittest.TestCase):
    def test_killed_at_any_moment_it_begins_again_and_knows_each_confirmed_write(self):
        chance = random.Random(SEED)
        with contextlib.ExitStack() as stack:
            place = Place(stack)
            confirmed = set()
            for i in range(12):
                with self.subTest(seed=SEED, kill=i), place.run() as program:
                    program.http_port()
                    end = threading.Timer(chance.uniform(0, 0.4), program.process.kill)
                    end.start()
                    confirmed |= self.write_until_the_end(program, i * 5000)
                    end.join()
                    program.process.wait()
                    program.ends_with = -signal.SIGKILL
            with place.run() as program, program.client() as client:
                until(lambda: client.ask(1, read_registers(7)) == bytes([3, 2, 0, 7]))
                self.assertEqual(program.get("/api/v1/journal")[0], 200)
            self.assertEqual(harness.run("audit", "verify", str(place.audit)).returncode, 0)
            self.assertGreater(len(confirmed), 0)
            with contextlib.closing(sqlite3.connect(place.store)) as database:
                self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))
            self.assertLessEqual(confirmed, self.sent(place))

    def sent(self, place):
        return {int.from_bytes(one.bytes[4:6], "big") for one in place.bus.frames() if one.bytes[1] == 6}

    def write_until_the_end(self, program, value):
        done = set()
        with contextlib.suppress(OSError, harness.Closed), program.client() as client:
            while True:
                value += 1
                if client.ask(1, write_register(20, value))[0] == 6:
                    done.add(value)
                if value % 7 == 0:
                    program.process.send_signal(signal.SIGHUP)
        return done

    def test_stopped_for_ten_seconds_it_goes_on_without_a_wrong_value(self):
        with contextlib.ExitStack() as stack:
            program = stack.enter_context(Place(stack).run())
            client = stack.enter_context(program.client())
            until(lambda: client.ask(1, read_registers(5)) == bytes([3, 2, 0, 5]))
            program.process.send_signal(signal.SIGSTOP)
            stopped = time.monotonic()
            sent = [client.send(1, read_registers(100 + i)) for i in range(10)]
            while time.monotonic() < stopped + 10:
                threading.Event().wait(1)
            program.process.send_signal(signal.SIGCONT)
            for i, number in enumerate(sent):
                transaction, _, reply = client.receive()
                self.assertEqual(transaction, number)
                self.assertIn(reply, (bytes([3, 2, 0, 100 + i]), bytes([0x83, 6]), bytes([0x83, 0x0B])))
            self.assertEqual(client.ask(1, read_registers(9)), bytes([3, 2, 0, 9]))
            until(lambda: program.get("/api/v1/stations/mixer/points/level")[1]["quality"] == "good")

    def test_little_memory_refuses_some_and_ends_nothing(self):
        """A limit of the address space stands for any limit that lets an allocation fail."""
        with contextlib.ExitStack() as stack:
            program = stack.enter_context(Place(stack).run())
            client = stack.enter_context(program.client())
            until(lambda: client.ask(1, read_registers(5))[0] == 3)
            pages = int(pathlib.Path(f"/proc/{program.process.pid}/statm").read_text().split()[0])
            room = pages * resource.getpagesize() + (32 << 20)
            resource.prlimit(program.process.pid, resource.RLIMIT_AS, (room, room))
            crowd = [stack.enter_context(program.client()) for _ in range(60)]
            for one in crowd:
                one.send_bytes(b"".join(harness.adu(i, 1, read_registers(i, 100)) for i in range(64)))
            for one in crowd:
                for _ in range(64):
                    self.assertIn(one.receive()[2][0], (3, 0x83))
            self.assertEqual(program.get("/api/v1/lines")[0], 200)
            self.assertEqual(client.ask(1, read_registers(5)), bytes([3, 2, 0, 5]))


class Disk(unittest.TestCase):
    def test_a_full_disk_of_the_store_is_told_and_costs_no_request(self):
        with contextlib.ExitStack() as stack:
            place = Place(stack)
            place.file.write_text(place.file.read_text().replace(f"audit: {{file: {place.audit}}}\n", ""))

            def fill():
                signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
                resource.setrlimit(resource.RLIMIT_FSIZE, (120_000, resource.RLIM_INFINITY))
            program = stack.enter_context(place.run(preexec_fn=fill))
            client = stack.enter_context(program.client())

            def is_told():
                for i in range(50):
                    self.assertEqual(client.ask(1, write_register(7, i))[0], 6)
                return "panelgate_store_up 0" in program.get("/metrics")[1]
            until(is_told)
            program.log.wait_for("warn store fails")
            unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
            resource.prlimit(program.process.pid, resource.RLIMIT_FSIZE, unlimited)
            until(lambda: "panelgate_store_up 1" in program.get("/metrics")[1])
            client.ask(1, write_register(7, 4711))
            until(lambda: any("4711" in one["text"] for one in
                              program.get("/api/v1/journal?kind=write")[1]["entries"]))

    def test_a_log_that_takes_nothing_stops_nothing(self):
        with contextlib.ExitStack() as stack:
            place = Place(stack)
            port = socket.create_server(("127.0.0.1", 0))
            number = port.getsockname()[1]
            port.close()
            place.file.write_text(place.file.read_text().replace(
                f"modbus_tcp: [{{{config.FREE_PORT}}}]", f'modbus_tcp: [{{listen: "127.0.0.1:{number}"}}]'))
            with open("/dev/full", "w", encoding="utf-8") as full:
                process = subprocess.Popen([harness.PANELGATE, "run", "-c", str(place.file)], stdout=full, stderr=full)
            try:
                def is_answered():
                    with contextlib.suppress(OSError, harness.Closed), harness.Client(number) as client:
                        return client.ask(1, read_registers(5)) == bytes([3, 2, 0, 5])
                    return False
                until(is_answered)
            finally:
                process.terminate()
                self.assertEqual(process.wait(harness.PATIENCE), 0)


class Clock(unittest.TestCase):
    def test_a_clock_that_steps_either_way_changes_no_value_and_no_age(self):
        with contextlib.ExitStack() as stack:
            place = Place(stack)
            step = place.folder / "step"
            step.write_text("0")
            env = {**os.environ, "LD_PRELOAD": WRONG_CLOCK, "WRONG_CLOCK_STEP": str(step)}
            program = stack.enter_context(place.run(env=env))
            client = stack.enter_context(program.client())

            def point():
                return program.get("/api/v1/stations/mixer/points/level")[1]
            until(lambda: point()["quality"] == "good")
            for seconds in (86400, -86400, 400 * 86400, 0):
                step.write_text(str(seconds))
                until(lambda year=time.gmtime(time.time() + seconds).tm_year: point()["time"].startswith(str(year)))
                for _ in range(20):
                    seen = point()
                    self.assertEqual((seen["quality"], seen["value"]), ("good", 7))
                    self.assertLess(seen["age_ms"], 10_000)
                    self.assertEqual(client.ask(1, read_registers(5)), bytes([3, 2, 0, 5]))
                program.rest("PUT", "/api/v1/stations/mixer/points/level", {"value": 7})
                self.assertEqual(program.get("/api/v1/journal")[0], 200)
                self.assertEqual(program.get("/api/v1/stations/mixer/points/level/history")[0], 200)
        self.assertNotIn("error", program.log.text().replace("errors", ""))


class Wires(unittest.TestCase):
    SIZE, SECONDS = 20_000, 4  # 50 pieces a second: 1 MB/s

    def shower(self, send, ends):
        chance = random.Random(SEED)
        while not ends.is_set():
            with contextlib.suppress(OSError):
                send(chance.randbytes(self.SIZE))
            ends.wait(self.SIZE / 1e6)

    def rate(self, program, unit):
        count, begun = 0, time.monotonic()
        with program.client() as client:
            while time.monotonic() < begun + self.SECONDS:
                self.assertEqual(client.ask(unit, read_registers(100))[0], 3)
                count += 1
        return count

    def check_noise(self, noisy, send):
        """Beside the noise another line keeps its rate; each request to the noisy line has one answer, and none is
        of the noise."""
        with harness.configured(config.gateway(noisy, config.STEADY_LINE)) as program:
            program.log.wait_for("line up line=noisy")
            before = self.rate(program, 31)
            ends = threading.Event()
            noise = threading.Thread(target=self.shower, args=(send, ends))
            noise.start()
            try:
                with program.client() as client:
                    client.send_bytes(b"".join(harness.adu(i, 1, read_registers(i)) for i in range(20)))
                    replies = [client.receive() for _ in range(20)]
                    beside = self.rate(program, 31)
                self.assertEqual([one[0] for one in replies], list(range(20)))
                for number, _, reply in replies:
                    if reply[0] == 3:
                        self.assertEqual(reply, bytes([3, 2, 0, number]))
                self.assertGreater(beside, 0.8 * before)
                self.assertLess(len(program.log.text()), 100_000)
            finally:
                ends.set()
                noise.join()

    def test_noise_on_a_tty(self):
        with tempfile.TemporaryDirectory() as folder:
            master, slave = os.openpty()
            self.addCleanup(os.close, master)
            self.addCleanup(os.close, slave)
            tty.setraw(slave)
            os.set_blocking(master, False)
            link = pathlib.Path(folder) / "tty"
            link.symlink_to(os.ttyname(slave))
            self.check_noise(config.line("noisy", link, "{id: 1, name: mixer}", baud=115200),
                             lambda data: os.write(master, data))

    def test_noise_of_a_device_server(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            peers = []

            def accept():
                with contextlib.suppress(OSError):
                    while True:
                        peers.append(server.accept()[0])
            threading.Thread(target=accept, daemon=True).start()
            device = f"tcp://127.0.0.1:{server.getsockname()[1]}"
            self.check_noise(config.line("noisy", device, "{id: 1, name: mixer}", baud=115200),
                             lambda data: peers[-1].sendall(data))
            server.shutdown(socket.SHUT_RDWR)


class Clients(unittest.TestCase):
    def test_ten_thousand_connections_that_come_and_go_leave_a_busy_client_its_answers(self):
        with harness.configured(config.gateway(config.STEADY_LINE, modbus=config.MANY)) as program, \
                program.client() as client:
            ended = threading.Event()

            def come_and_go():
                try:
                    for _ in range(10_000):
                        with contextlib.suppress(OSError):
                            socket.create_connection(("127.0.0.1", program.modbus_port())).close()
                finally:
                    ended.set()
            crowd = threading.Thread(target=come_and_go)
            crowd.start()
            answers = 0
            while not ended.is_set():
                self.assertEqual(client.ask(31, read_registers(100))[0], 3)
                answers += 1
            crowd.join()
            self.assertGreater(answers, 20)
            until(lambda: len(os.listdir(f"/proc/{program.process.pid}/fd")) < 60)

    def test_a_client_that_is_gone_without_a_word_leaves_its_place_to_others(self):
        """Its system is silent, so that only the number of places ends it."""
        few = config.FREE_PORT + ", max_connections: 4, max_connections_per_address: 4"
        with harness.configured(config.gateway(config.STEADY_LINE, modbus=few)) as program, \
                contextlib.ExitStack() as stack:
            for _ in range(4):
                stack.enter_context(program.client())
            for _ in range(3):
                with program.client() as client:
                    self.assertEqual(client.ask(31, read_registers(100))[0], 3)


class Files(unittest.TestCase):
    def test_a_profile_that_is_none_is_a_reload_that_changes_nothing(self):
        with contextlib.ExitStack() as stack:
            place = Place(stack, more="profiles_dir: profiles\n")
            profiles = place.folder / "profiles"
            profiles.mkdir()
            program = stack.enter_context(place.run())
            client = stack.enter_context(program.client())
            until(lambda: client.ask(1, read_registers(5))[0] == 3)
            for content in (b"\x00\xff\xfe" * 100, b"name: x\nfunctions: [", b"[" * 10_000, b""):
                (profiles / "x.yaml").write_bytes(content)
                with self.subTest(content=content[:20]):
                    verdict = program.rest("POST", "/api/v1/reload")[1]
                    self.assertEqual(verdict["outcome"], "invalid")
                    self.assertIn("x.yaml", json.dumps(verdict))
                    self.assertEqual(client.ask(1, read_registers(5)), bytes([3, 2, 0, 5]))
            (profiles / "x.yaml").unlink()
            self.assertEqual(program.rest("POST", "/api/v1/reload")[1]["outcome"], "unchanged")


if __name__ == "__main__":
    unittest.main()
