"""deploy/demo.sh from another directory: builds (or finds it built), serves, ends with Ctrl-C.

Run by tests/run.sh after the release build, not by ctest: it builds by itself.
"""
import signal
import tempfile

import harness

harness.PANELGATE = str(harness.ROOT / "deploy/demo.sh")
with tempfile.TemporaryDirectory() as folder:
    program = harness.Program("--http", "127.0.0.1:0", "--modbus", "127.0.0.1:0", cwd=folder)
    try:
        program.out.wait_for("Ctrl-C")
        with program.client() as client:
            assert client.ask(31, harness.read_registers(0))[:2] == b"\x03\x02"
    finally:
        code = program.stop(signal.SIGINT)
assert code == 0, program.log.text()
