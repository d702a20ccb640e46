"""What the program writes to stderr: that nobody waits for its reader, and what stands in it."""
import contextlib
import http.client
import itertools
import json
import os
import re
import signal
import socket
import subprocess
import tempfile
import unittest

import config
import harness
from harness import read_registers, write_register
from unread import Unread

FAST = config.line(baud=1000000, stations="{id: 31, name: press}")
FOREIGN = bytes.fromhex("00000000ffffff00")  # a length that closes the connection: a line at info


class Log(unittest.TestCase):
    def test_P3_P5_a_reader_of_stderr_that_stalls_stops_nobody(self):
        text = config.gateway(FAST, log="{level: trace}")
        with Unread(text) as program:
            modbus, _ = program.ports
            with harness.Client(modbus) as client:
                for n in itertools.count():
                    self.assertEqual(len(client.ask(31, read_registers(0, 5))), 12)
                    if n % 100 == 99 and program.metric("panelgate_log_lines_dropped_total") > 0:
                        break
            program.process.send_signal(signal.SIGTERM)
            self.assertEqual(program.process.wait(harness.PATIENCE), 0)

    def test_who_repeats_himself_is_quoted_now_and_then(self):
        with harness.configured(config.gateway(config.line())) as program:
            for _ in range(100):
                with program.client() as client:
                    client.send_bytes(FOREIGN)
                    self.assertTrue(client.is_closed_by_peer())
            self.assertLess(program.log.text().count("connection closed"), 10)

    def test_each_write_of_a_client_leaves_a_line_with_who_and_what(self):
        with harness.configured(config.gateway(FAST, http=config.ADMIN)) as program:
            with program.client() as client:
                client.ask(31, write_register(1000, 7))
                port = client.socket.getsockname()[1]
            program.log.wait_for(
                r"info write line=floor1 station=press client=\"modbus_tcp 127.0.0.1:%d\" "
                r"at=holding-registers/1000 pdu=0603e80007 outcome=\w+" % port)
            program.rest("PUT", "/api/v1/stations/press/holding-registers/1001", {"values": [8]})
            program.log.wait_for(r"info write .*at=holding-registers/1001 .*outcome=ok")
            program.rest("POST", "/api/v1/lines/floor1/raw",
                         {"station": 31, "pdu": "0603EA0009"})
            program.log.wait_for(r"info write .*at=holding-registers/1002 .*outcome=ok")
            program.rest("POST", "/api/v1/lines/floor1/broadcast",
                         {"table": "holding-registers", "address": 1003, "values": [1]})
            program.log.wait_for(r"info write .*station=broadcast .*at=holding-registers/1003 ")

    def test_a_write_that_is_refused_here_leaves_a_line_and_a_count_too(self):
        stations = "{id: 31, name: press, access: read_only}"
        text = config.gateway(config.line(stations=stations), http=config.ADMIN)
        with harness.configured(text) as program:
            with program.client() as client:
                self.assertEqual(client.ask(31, write_register(1000, 7)), b"\x86\x01")
            program.log.wait_for(r"info write .*client=\"modbus_tcp .*/1000 .*outcome=refused")
            for path, body in (("/api/v1/stations/press/holding-registers/1001", {"values": [8]}),
                               ("/api/v1/stations/press/holding-registers/1002", {"values": ["x"]})):
                self.assertEqual(program.rest("PUT", path, body)[0], 403, path)
            program.log.wait_for(r"info write .*client=\"http .*/1001 .*outcome=refused")
            everybody = {"table": "holding-registers", "address": 1003}
            for values, status in ((["x"], 400), ([7], 403)):
                self.assertEqual(program.rest("POST", "/api/v1/lines/floor1/broadcast",
                                              {**everybody, "values": values})[0], status)
            program.rest("POST", "/api/v1/lines/floor1/raw", {"station": 0, "pdu": "0603EC0007"})
            for place in (1003, 1004):
                program.log.wait_for(r"info write .*station=broadcast .*at=holding-registers/%d "
                                     r".*outcome=refused" % place)
            self.assertNotIn('at=""', program.log.text())
            self.assertEqual(program.rest("POST", "/api/v1/lines/floor1/raw",
                                          {"station": 31, "pdu": "0603EA0009"})[0], 403)
            program.log.wait_for(r"info write .*/1002 .*outcome=refused")
            self.assertEqual(program.rest("POST", "/api/v1/lines/floor1/raw",
                                          {"station": 31, "pdu": "0F03EA"})[0], 403)
            program.log.wait_for(r"info write .*pdu=0f03ea outcome=refused")
            self.assertEqual(program.rest(
                "POST", "/api/v1/lines/floor1/broadcast",
                {"table": "holding-registers", "address": 1003, "values": [1]})[0], 403)
            program.log.wait_for(r"info write .*station=broadcast .*/1003 .*outcome=refused")
            self.assertRegex(program.get("/metrics")[1],
                             r'requests_total\{.*function="6",outcome="refused"\} 3')

    def test_a_broadcast_that_is_refused_on_one_of_several_lines_leaves_a_line_there(self):
        lines = (config.line("a", stations="{id: 1, name: one}"),
                 config.line("b", stations="{id: 2, name: two, access: read_only}"))
        with harness.configured(config.gateway(*lines, http=config.ADMIN)) as program:
            with program.client() as client:
                self.assertEqual(client.ask(0, write_register(1000, 7)), b"\x86\x01")
                self.assertEqual(client.ask(2, b"\x06\x00"), b"\x86\x01")
                self.assertEqual(client.ask(1, b"\x06\x01"), b"\x86\x03")
            program.log.wait_for(r"info write line=b station=broadcast .*outcome=refused")
            program.log.wait_for(r"info write line=b station=two .*pdu=0600 outcome=refused")
            program.log.wait_for(r"info write line=a station=one .*pdu=0601 outcome=refused")
            metrics = program.get("/metrics")[1]
            self.assertRegex(metrics, r'line="b",station="other",.*outcome="refused"\} 1')
            self.assertRegex(metrics, r'line="b",station="two",.*outcome="refused"\} 1')

    def test_a_simulated_line_has_any_parity_and_no_warning(self):
        with harness.configured(config.gateway(config.line(
                parity="even", stations="{id: 1, name: one}"))) as program:
            program.log.wait_for("line up")
            self.assertNotIn(" warn ", program.log.text())

    def test_a_relay_whose_source_comes_and_goes_is_quoted_now_and_then(self):
        stations = ("{id: 31, name: press, simulate: {drop: 0.5}}, {id: 20, name: oven}")
        text = config.gateway(
            config.line(baud=1000000, stations=stations, retries=0,
                        timing="{response_timeout: 5ms}", offline="{after: 100}"),
            relays="[{from: press/400001, to: oven/400001, every: 20ms}]", http=config.ADMIN)
        with harness.configured(text) as program:
            def changes():
                [relay] = program.get("/api/v1/relays")[1]["relays"]
                return min(relay["read_failures"], relay["writes"])
            while changes() < 30:
                pass
            self.assertLess(program.log.text().count(" relay relay="), 10)
            program.stop()
            self.assertRegex(program.log.finished_text(), r" relay relay=.* left_out=\d+")

    def test_each_accepted_write_of_another_value_is_there(self):
        with harness.configured(config.gateway(FAST)) as program:
            with program.client() as client:
                for n in range(100):
                    client.ask(31, write_register(1000, n))
            program.stop()
            written = re.findall(r" info write .*pdu=0603e8(\w{4}) outcome=ok",
                                 program.log.finished_text())
            self.assertEqual(written, [f"{n:04x}" for n in range(100)])

    def test_a_heartbeat_is_gathered_and_does_not_hide_who_else_writes(self):
        with harness.configured(config.gateway(FAST)) as program:
            with program.client() as client:
                for _ in range(100):
                    client.ask(31, write_register(1000, 1))
                client.ask(31, write_register(1000, 2))
            program.stop()
            lines = [line for line in program.log.finished_text().splitlines()
                     if " info write " in line]
            self.assertIn("pdu=0603e80002 outcome=ok", lines[-1])
            gathered = [int(count) for line in lines
                        for count in re.findall(r" repeated=(\d+) first=\S+Z last=\S+Z", line)]
            self.assertEqual(len(lines) - len(gathered) + sum(gathered), 101)
            self.assertLess(len(lines), 20)

    def test_what_is_refused_before_it_is_a_write_and_who_plays_with_the_plant_is_there(self):
        point = ("{id: 31, name: press, points: [{name: setpoint, at: '400001', type: u16, "
                 "writable: true, max: 10}]}")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "eye")
            with open(path, "w") as file:
                file.write("0123456789abcdef")
            text = config.gateway(
                config.line(stations=point),
                http=f"{config.ADMIN}, tokens: [{{name: eye, role: viewer, file: {path}}}]")
            with harness.configured(text) as program:
                place = "/api/v1/stations/press/points/setpoint"
                self.assertEqual(program.rest("PUT", place, {"value": 11})[0], 422)
                program.log.wait_for(r"info write refused client=\S*http 127.0.0.1\S* "
                                     r"at=press/points/setpoint status=422 why=")
                with contextlib.closing(http.client.HTTPConnection(
                        "127.0.0.1", program.http_port(), timeout=harness.PATIENCE)) as connection:
                    connection.request("PUT", place, '{"value": 1}',
                                       {"Authorization": "Bearer 0123456789abcdef"})
                    self.assertEqual(connection.getresponse().status, 403)
                program.log.wait_for(r'info http request refused client="http 127.0.0.1 token eye" '
                                     rf"path={place} method=PUT")
                self.assertEqual(program.rest("PUT", "/api/v1/simulator/press", {"drop": 1})[0],
                                 200)
                program.log.wait_for(r'simulator faults set client="http 127.0.0.1" station=press')
                program.rest("POST", "/api/v1/lines/floor1/discover", {"stations": "1-2"})
                program.log.wait_for(r'discovery started client="http 127.0.0.1" line=floor1')

    def test_refused_writes_to_changing_addresses_do_not_fill_the_disk(self):
        read_only = config.line(stations="{id: 31, name: press, access: read_only}")
        with harness.configured(config.gateway(read_only)) as program:
            with program.client() as client:
                for n in range(1000):
                    client.ask(31, write_register(n, 1))
            program.stop()
            text = program.log.finished_text()
            lines = text.count(" info write ")
            self.assertLess(lines, 300)
            left_out = re.findall(r'log lines left out of=write client="modbus_tcp 127\S+" '
                                  r"count=(\d+)", text)
            self.assertEqual(lines + sum(map(int, left_out)), 1000)

    def test_a_json_log_has_nothing_but_json_also_when_the_program_cannot_start(self):
        with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as taken:
            listen = f'listen: "127.0.0.1:{taken.getsockname()[1]}"'
            with tempfile.TemporaryDirectory() as folder:
                path = os.path.join(folder, "panelgate.yaml")
                with open(path, "w") as file:
                    file.write(config.gateway(config.line(), modbus=listen, log="{format: json}"))
                done = subprocess.run([harness.PANELGATE, "run", "-c", path], text=True,
                                      capture_output=True, timeout=harness.PATIENCE)
        self.assertEqual(done.returncode, 69)
        lines = [json.loads(line) for line in done.stderr.splitlines()]
        self.assertEqual({*lines[-1]} >= {"time", "level", "event", "reason"}, True, lines)
        self.assertEqual(lines[-1]["level"], "error")


if __name__ == "__main__":
    unittest.main()
