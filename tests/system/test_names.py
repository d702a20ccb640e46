"""P7: a name server that says nothing holds nobody up."""
import os
import pathlib
import socket
import unittest

import config
import harness

SILENT_NAMES = os.environ.get("SILENT_NAMES", str(harness.ROOT / "build/release/libsilent_names.so"))


@unittest.skipIf(harness.SANITIZED, "a sanitizer wants to be loaded first")
@unittest.skipUnless(pathlib.Path(SILENT_NAMES).exists(), "no library in front of the system's")
class Names(unittest.TestCase):
    def test_P7_a_silent_name_server_delays_no_other_line_and_no_stop(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
            text = config.gateway(config.line("mute", "tcp://moxa.invalid:4001", "{id: 1}"),
                                  config.line("known", f"tcp://moxa.plant:{port}", "{id: 2}"),
                                  modbus=f"{config.FREE_PORT}, lines: [known]")
            environment = dict(os.environ, LD_PRELOAD=SILENT_NAMES)
            with harness.configured(text, env=environment) as program:
                program.log.wait_for("line up .*line=known")
                self.assertNotIn("line down", program.log.text())  # that comes after 5 s
                self.assertEqual(program.get("/readyz")[0], 200)
                self.assertEqual(program.stop(), 0)  # the thread that asks is not waited for


if __name__ == "__main__":
    unittest.main()
