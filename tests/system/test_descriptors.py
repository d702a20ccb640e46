"""P7, P9: clients cannot take the descriptors that devices and probes need."""
import contextlib
import pathlib
import resource
import tempfile
import unittest

import config
import harness
from harness import read_registers
from rtu_bus import RtuBus, echo_address
from test_points import until

CROWD = 1030
USUAL = 1024  # the limit of a shell, or of a service, that nobody has raised
OWN = CROWD + 200


def limited(soft, hard):
    return lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def setUpModule():
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < OWN:
        raise unittest.SkipTest(f"{OWN} descriptors are needed here, {hard} may be had")
    resource.setrlimit(resource.RLIMIT_NOFILE, (OWN, hard))


def a_crowd(stack, port):
    return [stack.enter_context(harness.Client(port)) for _ in range(CROWD)]


class Descriptors(unittest.TestCase):
    def test_P7_a_crowd_of_clients_leaves_devices_and_probes_their_descriptors(self):
        with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as stack:
            link = pathlib.Path(folder) / "tty"
            bus = stack.enter_context(contextlib.ExitStack())
            bus.enter_context(RtuBus(link, {1: echo_address}))
            text = config.gateway(config.line("shaky", link, "{id: 1, name: one}", baud=115200))
            program = stack.enter_context(
                harness.configured(text, preexec_fn=limited(USUAL, USUAL)))
            program.log.wait_for(r"warn max_connections lowered .*127\.0\.0\.1:0 .*1024 files")
            client = stack.enter_context(program.client())
            self.assertEqual(client.ask(1, read_registers(5))[0], 3)
            a_crowd(stack, program.modbus_port())
            program.log.wait_for("connection gives way .*longest idle")
            self.assertEqual(program.get("/healthz")[0], 200)
            self.assertNotIn("cannot accept", program.log.text())
            bus.close()
            program.log.wait_for("line down")
            with RtuBus(link, {1: echo_address}):
                newcomer = stack.enter_context(program.client())
                until(lambda: newcomer.ask(1, read_registers(5))[0] == 3)
                self.assertEqual(program.get("/readyz")[0], 200)

    def test_P9_the_usual_soft_limit_is_raised(self):
        _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        text = config.gateway(config.line())
        with contextlib.ExitStack() as stack:
            program = stack.enter_context(
                harness.configured(text, preexec_fn=limited(USUAL, hard)))
            a_crowd(stack, program.modbus_port())
            self.assertEqual(program.get("/healthz")[0], 200)
            self.assertNotIn("cannot accept", program.log.text())


if __name__ == "__main__":
    unittest.main()
