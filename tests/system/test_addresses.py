"""Where the gateway listens: addresses that come late, both kinds of them, ports without a right.

Addresses are added to a machine of the test's own (a network namespace), in which this file runs
again."""
import contextlib
import ctypes
import http.client
import os
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

import config
import harness
from harness import read_registers

LATE, LATE_SIX = "192.0.2.7", "2001:db8::7"  # of documentation: nobody has them
OWN_MACHINE = "PANELGATE_TEST_OWN_MACHINE"
PR_CAPBSET_DROP, CAP_NET_BIND_SERVICE = 24, 10


def ip(*words):
    subprocess.run(["ip", *words], check=True, capture_output=True)


def setUpModule():
    if OWN_MACHINE not in os.environ:
        raise unittest.SkipTest("no network of one's own here (unshare, iproute2)")
    ip("link", "set", "lo", "up")


def free_port():
    """Free for both kinds of addresses; in here nobody else takes it."""
    with socket.create_server(("::", 0), family=socket.AF_INET6, dualstack_ipv6=True) as server:
        return server.getsockname()[1]


def listening(address):
    return rf"listening modbus_tcp={address}:(\d+)$"


def connected(address, port):
    socket.create_connection((address, port), harness.PATIENCE).close()


class LateAddresses(unittest.TestCase):
    def test_P7_an_address_that_is_not_there_at_boot_is_listened_on_when_it_comes(self):
        text = config.gateway(config.line(), modbus=f'listen: "{LATE}:0"')
        with harness.configured(text) as program:
            program.log.wait_for(rf"warn listener waits modbus_tcp={LATE}:0 why=")
            status, body = program.get("/readyz")
            self.assertEqual(status, 503)
            self.assertIn(f"modbus_tcp {LATE}:0", body)
            self.assertEqual(program.get("/healthz")[0], 200)
            ip("address", "add", f"{LATE}/32", "dev", "lo")
            self.addCleanup(ip, "address", "del", f"{LATE}/32", "dev", "lo")
            port = int(program.log.wait_for(listening(LATE)).group(1))
            connected(LATE, port)
            self.assertEqual(program.get("/readyz")[0], 200)

    def test_P7_http_waits_as_well(self):
        text = config.gateway(config.line(), http=f'listen: "[{LATE_SIX}]:0"')
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(text)
            with harness.Program("run", "-c", str(file)) as program:
                program.log.wait_for(rf"listener waits http=\[{LATE_SIX}\]:0 ")
                with program.client() as client:
                    self.assertEqual(client.ask(31, read_registers(0))[0], 3)
                ip("-6", "address", "add", f"{LATE_SIX}/128", "dev", "lo")
                self.addCleanup(ip, "-6", "address", "del", f"{LATE_SIX}/128", "dev", "lo")
                connected(LATE_SIX, program.http_port())


class BothKinds(unittest.TestCase):
    def test_all_addresses_of_both_kinds_on_one_port(self):
        port = free_port()
        for first, second in (("0.0.0.0", "[::]"), ("[::]", "0.0.0.0")):
            with self.subTest(first=first):
                listeners = (f'listen: "{first}:{port}"}}, {{listen: "{second}:{port}"')
                with harness.configured(config.gateway(config.line(), modbus=listeners)) as program:
                    program.log.wait_for(rf"listening modbus_tcp=\[::\]:{port}$")
                    for address in ("127.0.0.1", "::1"):
                        connected(address, port)
                    self.assertRegex(program.get("/metrics")[1],
                                     rf'tcp_connections{{listener="\[::\]:{port}"}}')

    def test_all_addresses_of_ipv6_alone_are_those_of_ipv4_as_well(self):
        with harness.configured(config.gateway(config.line(), modbus='listen: "[::]:0"')) as program:
            for address in ("127.0.0.1", "::1"):
                connected(address, program.modbus_port())


class OneNetwork(unittest.TestCase):
    """A host has as many addresses of its /64 as it likes: they count as one."""
    NETWORK = [f"2001:db8:1:2::{host:x}" for host in range(1, 14)]
    OTHER = "2001:db8:1:3::1"

    def setUp(self):
        for address in (*self.NETWORK, self.OTHER):
            ip("-6", "address", "add", f"{address}/128", "dev", "lo", "nodad")
            self.addCleanup(ip, "-6", "address", "del", f"{address}/128", "dev", "lo")

    def test_wrong_tokens_of_a_network_bar_it_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("0123456789abcdef\n")
            token.chmod(0o600)
            http_ = f'listen: "[::]:0", anonymous: none, tokens: [{{name: ops, role: admin, file: {token}}}]'
            with harness.configured(config.gateway(config.line(), http=http_)) as program:
                def status(source, text):
                    connection = http.client.HTTPConnection("::1", program.http_port(), harness.PATIENCE, (source, 0))
                    with contextlib.closing(connection):
                        connection.request("GET", "/api/v1/lines", headers={"Authorization": f"Bearer {text}"})
                        return connection.getresponse().status
                tried = [status(address, "wrong") for address in self.NETWORK[:12]]
                self.assertEqual(tried, [401] * 10 + [429] * 2)
                self.assertEqual(status(self.NETWORK[12], "0123456789abcdef"), 429)
                self.assertEqual(status(self.OTHER, "0123456789abcdef"), 200)

    def test_places_are_a_networks(self):
        modbus = 'listen: "[::]:0", max_connections_per_address: 2'
        with harness.configured(config.gateway(config.line(), modbus=modbus)) as program:
            def client(source):
                one = socket.create_connection(("::1", program.modbus_port()), harness.PATIENCE, (source, 0))
                self.addCleanup(one.close)
                one.sendall(harness.adu(1, 31, read_registers(0)))
                self.assertNotEqual(one.recv(64), b"")
                return one
            first, second = client(self.NETWORK[0]), client(self.NETWORK[1])
            client(self.OTHER)
            client(self.NETWORK[2])
            self.assertEqual(first.recv(1), b"", "the longest idle one of its network gives way")
            second.sendall(harness.adu(2, 31, read_registers(0)))
            self.assertNotEqual(second.recv(64), b"")


class Refusals(unittest.TestCase):
    def refused(self, text, **options):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(text)
            ended = harness.run("run", "-c", str(file), **options)
        self.assertEqual(ended.returncode, 69, ended.stderr)
        return ended.stderr

    def test_port_502_without_a_right_is_told_with_what_helps(self):
        def without_the_right():
            ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_NET_BIND_SERVICE, 0, 0, 0)

        told = self.refused(config.gateway(config.line(), modbus="listen: 127.0.0.1:502"),
                            preexec_fn=without_the_right)
        for help_ in ("CAP_NET_BIND_SERVICE", "setcap", "ip_unprivileged_port_start=502"):
            self.assertIn(help_, told)

    def test_a_port_that_another_program_has_is_told_at_once(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            told = self.refused(config.gateway(config.line(), modbus=f"listen: 127.0.0.1:{port}"))
        self.assertIn(f"ss -ltnp 'sport = :{port}'", told)


def in_an_own_machine():
    """Runs this file once more where addresses may be added; comes back where that is not possible."""
    if OWN_MACHINE in os.environ or not shutil.which("unshare"):
        return
    mine = ["unshare", "--map-root-user", "--net"]
    tried = subprocess.run([*mine, "ip", "link", "set", "lo", "up"], check=False,
                           capture_output=True)
    if tried.returncode == 0:
        os.environ[OWN_MACHINE] = "1"
        os.execvp(mine[0], [*mine, sys.executable, "-B", *sys.argv])


if __name__ == "__main__":
    in_an_own_machine()
    unittest.main()
