"""P7: a name server, or a share, that says nothing holds nobody up."""
import os
import pathlib
import socket
import tempfile
import unittest

import config
import harness

SILENT_NAMES = os.environ.get("SILENT_NAMES", str(harness.ROOT / "build/release/libsilent_names.so"))
ENVIRONMENT = dict(os.environ, LD_PRELOAD=SILENT_NAMES)


@unittest.skipIf(harness.SANITIZED, "a sanitizer wants to be loaded first")
@unittest.skipUnless(pathlib.Path(SILENT_NAMES).exists(), "no library in front of the system's")
class Names(unittest.TestCase):
    def test_P7_a_silent_name_server_delays_no_other_line_and_no_stop(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
            text = config.gateway(config.line("mute", "tcp://moxa.invalid:4001", "{id: 1}"),
                                  config.line("known", f"tcp://moxa.plant:{port}", "{id: 2}"),
                                  modbus=f"{config.FREE_PORT}, lines: [known]")
            with harness.configured(text, env=ENVIRONMENT) as program:
                program.log.wait_for("line up .*line=known")
                self.assertNotIn("line down", program.log.text())  # that comes after 5 s
                self.assertEqual(program.get("/readyz")[0], 200)
                self.assertEqual(program.stop(), 0)  # the thread that asks is not waited for

    def test_a_silent_share_is_a_reload_that_is_refused_and_delays_no_stop(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(config.gateway(config.line(), http=config.ADMIN))
            with harness.Program("run", "-c", str(file), env=ENVIRONMENT) as program:
                program.http_port()
                file.with_suffix(".yaml.silent").touch()
                status, problem = program.rest("POST", "/api/v1/reload")
                self.assertEqual((status, problem["outcome"]), (409, "failed"))
                self.assertIn("it takes longer than 10 s to read", problem["detail"])
                self.assertEqual(program.get("/readyz")[0], 200)
                self.assertEqual(program.stop(), 0)
                self.assertIn('error stopped without waiting why="a disk or a share does not answer',
                              program.log.finished_text())


if __name__ == "__main__":
    unittest.main()
