"""The commands that ask a running gateway, of the demo."""
import json
import pathlib
import signal
import socket
import subprocess
import tempfile
import unittest

import config
import harness

REFUSED, USAGE, NO_INPUT, UNAVAILABLE, INTERNAL = 1, 64, 66, 69, 70


class Asking(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.gateway = cls.enterClassContext(harness.demo())
        cls.http = f"127.0.0.1:{cls.gateway.http_port()}"

    def ask(self, code, *arguments):
        ended = harness.run(*arguments, "--http", self.http)
        self.assertEqual(ended.returncode, code, ended.stdout + ended.stderr)
        self.assertEqual(ended.stderr.count("\n"), 1 if code else 0, ended.stderr)
        return ended.stderr if code else ended.stdout

    def test_a_place_is_a_notation_a_table_or_a_point(self):
        self.assertEqual(self.ask(0, "read", "press", "UW1"), "UW1  20\n")
        self.assertEqual(self.ask(0, "read", "31", "holding-registers/4"), "UW4  50\n")
        self.assertEqual(self.ask(0, "read", "floor1/31", "UW0", "--count", "2"),
                         "UW0  10\nUW1  20\n")
        self.http = self.http.replace("127.0.0.1", "localhost")
        self.assertEqual(self.ask(0, "read", "press", "UW1"), "UW1  20\n")
        self.assertEqual(json.loads(self.ask(0, "read", "press/UW0", "--format", "json"))["values"], [10])
        self.gateway.values("/api/v1/stations/oven/devices/GDT300")
        self.assertRegex(self.ask(0, "read", "oven/temperature"),
                         r"^oven/temperature  [\d.]+ celsius, read [\d.]+ s ago\n$")

    def test_what_is_written_is_confirmed(self):
        self.assertEqual(self.ask(0, "write", "oven/mode", "manual"), "oven/mode = 1 (manual), confirmed\n")
        self.assertEqual(self.ask(0, "write", "oven", "GDT120", "7", "-2"), "oven GDT120 = 7 -2, confirmed\n")
        self.assertEqual(self.gateway.values("/api/v1/stations/oven/devices/GDT120?count=2"), [7, 65534])
        self.ask(0, "write", "oven", "GDT130", "-1.5", "--type", "f32", "--order", "CDAB")
        self.assertEqual(self.ask(0, "read", "oven", "GDT130", "--type", "f32", "--order", "CDAB"),
                         "GDT130  -1.5\n")

    def test_a_refusal_is_a_sentence_with_what_would_be_right(self):
        for words, told in (
                ("read pres UW0", "no station 'pres'; did you mean 'press'?"),
                ("read press temprature", "no point 'temprature'; did you mean 'temperature'?"),
                ("read press FOO1", "its points are temperature, setpoint, running"),
                ("read press UW0 --type q16", "there are bool, u8h"),
                ("write press UW0 5", "UW15 to UW6047; nothing was sent"),
                ("write press/setpoint 99", "from 0 to 60, not 99"),
                ("watch press FOO1", "is no notation"),
                ("write press/setpoint 21.55", "are 21.5 and 21.6\n"),
                ("write press UW100 1e400 --type f64", "not written: 1e400 is beyond what")):
            with self.subTest(words):
                self.assertIn(told, self.ask(REFUSED, *words.split()))
        for words, told in (
                ("read oven", "a place is missing after 'oven'"),
                ("read oven/mode press/UW0", "read takes one place"),
                ("read coils/4", "a station is missing before 'coils/4'"),
                ("read oven/mode --type u16", "leave out --type"),
                ("read oven GDT1 --count x", "--count: it is a whole number from 1 to 65536, not 'x'"),
                ("write oven/mode", "VALUE is missing"),
                ("write press/setpoint 30 31", "press/setpoint is a point, which takes one value, not 2"),
                ("read press holdings/4", "there is no table 'holdings'; there are coils, "),
                ("read press holding-registers/", "an address is missing after 'holding-registers/'"),
                ("watch oven/mode --type f32", "oven/mode is a point, which has its type"),
                ("watch press UW0 oven", "a place is missing after 'oven'"),
                ("read press temperature extra", "read does not take 'extra'; `panelgate help read`"),
                ("write press/setpoint 21,5", "such as 21.5")):
            with self.subTest(words):
                self.assertIn(told, self.ask(USAGE, *words.split()))

    def test_an_empty_text_is_a_value(self):
        told = harness.run("write", "press", "UW400", "", "--type", "string", "--http", self.http)
        self.assertNotIn("VALUE is missing", told.stderr)
        self.assertIn("a place is missing after 'press'", self.ask(USAGE, "read", "press", ""))

    def test_what_is_written_is_told_where_stdout_takes_nothing(self):
        with open("/dev/full", "w") as full:
            ask = lambda *words: subprocess.run([harness.PANELGATE, *words, "--http", self.http], stdout=full, text=True,
                                                stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, check=False,
                                                timeout=harness.PATIENCE)
            told = ask("write", "press/setpoint", "30")
            self.assertEqual((told.returncode, told.stderr),
                             (0, "panelgate: stdout takes nothing; this is done: press/setpoint = 30, confirmed\n"))
            for command in ("read", "watch"):
                told = ask(command, "press/UW0")
                self.assertEqual(told.returncode, INTERNAL, told.stderr)
                self.assertIn("stdout takes nothing", told.stderr)

    def test_a_write_without_an_answer_says_what_has_left(self):
        self.gateway.rest("PUT", "/api/v1/simulator/mixer", {"dead": 1})
        try:
            told = self.ask(REFUSED, "write", "mixer", "UW100", "5")
            self.assertRegex(told, "it was transmitted, so it may be in effect|nothing was sent")
        finally:
            self.gateway.rest("PUT", "/api/v1/simulator/mixer", {"dead": 0})

    def test_points_are_watched_by_events_and_other_places_by_reading(self):
        text = self.ask(0, "watch", "oven/temperature", "io", "door", "parts", "--count", "5")
        self.assertEqual(text.count("\n"), 5)
        for line in text.splitlines():
            self.assertRegex(line, r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ  (oven/temperature|io/door|io/parts)  \S")
        text = self.ask(0, "watch", "press", "UW0", "holding-registers/1", "--count", "2")
        self.assertEqual([line.split("  ")[1:] for line in text.splitlines()],
                         [["press UW0", "10"], ["press holding-registers/1", "20"]])

    def test_places_of_several_stations_are_watched(self):
        text = self.ask(0, "watch", "press", "UW0", "UW1", "oven", "GDT0", "--count", "3")
        self.assertEqual([line.split("  ")[1] for line in text.splitlines()],
                         ["press UW0", "press UW1", "oven GDT0"])

    def test_a_signal_ends_watching_with_0(self):
        with harness.Program("watch", "press/UW0", "--http", self.http) as watching:
            watching.out.wait_for("press UW0  10")
            self.assertEqual(watching.stop(signal.SIGINT), 0)


class NoGateway(unittest.TestCase):
    def test_where_nobody_answers_the_address_is_told(self):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            http = "127.0.0.1:" + str(taken.getsockname()[1])
            for command in ("read", "watch"):
                ended = harness.run(command, "oven/mode", "--http", http)
                self.assertEqual(ended.returncode, UNAVAILABLE)
                self.assertIn(f"no gateway answers at http://{http}: Connection refused", ended.stderr)
        ended = harness.run("read", "oven/mode", "--http", "nowhere")
        self.assertEqual((ended.returncode, ended.stderr.count("\n")), (USAGE, 1))

    def test_a_gateway_that_is_started_anew_is_waited_for(self):
        with harness.demo() as gateway:
            http = f"127.0.0.1:{gateway.http_port()}"
            with harness.Program("watch", "oven/mode", "--http", http) as watching:
                watching.out.wait_for("oven/mode  0 .off.")
                self.assertEqual(gateway.stop(), 0)
                watching.log.wait_for("no gateway answers at .*; waiting for it")
                with harness.Program("demo", "--http", http, "--modbus", "127.0.0.1:0") as anew:
                    anew.rest("PUT", "/api/v1/stations/oven/points/mode", {"value": 2})
                    watching.out.wait_for("oven/mode  2 .automatic.")
                    self.assertEqual(watching.stop(signal.SIGINT), 0)

    def test_a_token_is_asked_for(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("0123456789abcdef\r\n")
            token.chmod(0o600)
            http = f"{config.FREE_PORT}, anonymous: none, tokens: [{{name: ops, role: admin, file: {token}}}]"
            with harness.configured(config.gateway(config.line(), http=http)) as gateway:
                at = ("--http", f"127.0.0.1:{gateway.http_port()}")
                told = harness.run("read", "31", "UW0", *at)
                self.assertEqual(told.returncode, REFUSED)
                self.assertIn("wants a token: --token-file FILE", told.stderr)
                wrong = pathlib.Path(folder) / "wrong"
                wrong.write_text("fedcba9876543210\n")
                told = harness.run("read", "31", "UW0", *at, "--token-file", str(wrong))
                self.assertIn(f"does not take the token in {wrong}", told.stderr)
                wrong.write_bytes(b"\0\xff\xfe\n")
                told = harness.run("read", "31", "UW0", *at, "--token-file", str(wrong))
                self.assertEqual(told.returncode, NO_INPUT, told.stderr)
                self.assertIn(f"no token can be read from {wrong}", told.stderr)
                gone = harness.run("read", "31", "UW0", *at, "--token-file", folder + "/gone")
                self.assertEqual(gone.returncode, NO_INPUT)
                told = harness.run("read", "nobody", "UW0", *at, "--token-file", str(token))
                self.assertIn("no station 'nobody'", told.stderr)


if __name__ == "__main__":
    unittest.main()
