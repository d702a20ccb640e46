"""A line that is a serial device server: RTU frames over TCP, with simulated panels at the far end."""
import contextlib
import pathlib
import re
import tempfile
import unittest

import config
import harness
from harness import read_registers

FAR = config.gateway(config.line("far"), http=None)


@contextlib.contextmanager
def device_server(port=0):
    """(program, port)"""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "far.yaml"
        file.write_text(FAR)
        with harness.Program("simulate", "-c", str(file), "--line",
                             f"far=tcp://127.0.0.1:{port}") as program:
            found = program.log.wait_for(r"rtu_over_tcp=127\.0\.0\.1:(\d+)")
            yield program, int(found.group(1))


class TcpLine(unittest.TestCase):
    def test_P7_a_device_server_that_goes_and_comes_back(self):
        with contextlib.ExitStack() as near:
            with device_server() as (_, port):
                program = near.enter_context(harness.configured(
                    config.gateway(config.line("near", f"tcp://127.0.0.1:{port}"))))
                program.log.wait_for("line up")
                client = near.enter_context(program.client())
                self.assertEqual(client.ask(31, read_registers(0))[2:], b"\x00\x0a")
            # A server that ends may take one more connection, and reset it.
            program.log.wait_for("line down .*refused")
            self.assertEqual(client.ask(31, read_registers(0)), b"\x83\x0a")
            self.assertRegex(program.get("/api/v1/lines/near")[1]["state"], "^down: ")
            with device_server(port):
                while (reply := client.ask(31, read_registers(0))) == b"\x83\x0a":
                    pass
                self.assertEqual(reply[2:], b"\x00\x0a")
                self.assertIsNotNone(re.search(r'line_reopens_total\{line="near"\} [1-9]',
                                               program.get("/metrics")[1]))

    def test_what_is_no_endpoint_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "far.yaml"
            file.write_text(FAR)
            ended = harness.run("simulate", "-c", str(file), "--line", "far=tcp://nowhere")
            self.assertEqual(ended.returncode, 64)
            self.assertIn("is not NAME=tcp://ADDR:PORT", ended.stderr)


if __name__ == "__main__":
    unittest.main()
