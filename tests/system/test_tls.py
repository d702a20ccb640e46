"""TLS: who gets in with which certificate, what is spoken, what broken handshakes cost, and
certificates that are replaced under load."""
import asyncio
import contextlib
import http.client
import importlib.util
import itertools
import os
import pathlib
import re
import signal
import socket
import ssl
import struct
import subprocess
import tempfile
import threading
import time
import unittest

import harness
from harness import read_registers, write_register
from tls_plant import SecureClient, plant, refused, served

READ = read_registers(0)
WRITE = write_register(0x64, 7)
DENIED = bytes([0x86, 1])


def get(port, path, context, method="GET", body=None, headers=None):
    """(status, text, headers) by HTTPS."""
    connection = http.client.HTTPSConnection("localhost", port, timeout=harness.PATIENCE,
                                             context=context)
    try:
        connection.request(method, path, body=body, headers=headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read().decode(), dict(answer.getheaders())
    finally:
        connection.close()


def metric(program, text, name, **labels):
    for line in text.splitlines():
        if line.startswith(name + "{") and all(f'{k}="{v}"' in line for k, v in labels.items()):
            return float(line.rsplit(" ", 1)[1])
    return None


class Tls(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = cls.enterClassContext(plant()) if hasattr(cls, "enterClassContext") else None
        if cls.made is None:
            context = plant()
            cls.made = context.__enter__()  # pylint: disable=unnecessary-dunder-call
            cls.addClassCleanup(context.__exit__, None, None, None)


class ByCertificate(Tls):
    """Modbus/TCP Security: roles, and refusals at the handshake."""

    def test_the_role_decides_who_writes(self):
        tls = self.made.tls("required", role_from="certificate")
        with served(self.made, tls) as program:
            port = program.modbus_port()
            for name, may in (("scada", True), ("panel", False), ("nobody", False)):
                with SecureClient(port, self.made.context(name)) as client:
                    self.assertEqual(client.ask(31, READ)[0], 3, name)
                    self.assertEqual(client.ask(31, WRITE), WRITE if may else DENIED, name)

    def test_without_role_from_any_certificate_writes(self):
        with served(self.made, self.made.tls("required")) as program:
            with SecureClient(program.modbus_port(), self.made.context("nobody")) as client:
                self.assertEqual(client.ask(31, WRITE), WRITE)

    def test_bad_certificates_are_refused_at_the_handshake_with_one_line_each(self):
        self.made.expired("late")
        self.made.cert("new-client", "lost", "--role", "operator")
        self.made.cert("revoke", self.made.path("lost.crt"))
        tls = self.made.tls("required", role_from="certificate", crl=self.made.path("crl.pem"))
        with plant() as stranger, served(self.made, tls) as program:
            port = program.modbus_port()
            foreign = self.made.context()
            foreign.load_cert_chain(stranger.path("scada.crt"), stranger.path("scada.key"))
            wrong_kind = self.made.context("localhost")
            cases = [(self.made.context(), "no_certificate", "shows no certificate"),
                     (self.made.context("late"), "expired", "CN=late has expired"),
                     (self.made.context("lost"), "revoked", "CN=lost is revoked"),
                     (foreign, "untrusted", "CN=scada is not signed by the CA"),
                     (wrong_kind, "untrusted", "CN=localhost is not one of a client")]
            for context, outcome, why in cases:
                before = program.log.text().count("tls handshake failed")
                self.assertTrue(refused(port, context), outcome)
                program.log.wait_for(f"tls handshake failed .*outcome={outcome} .*{why}")
                self.assertEqual(program.log.text().count("tls handshake failed"), before + 1)
            with SecureClient(port, self.made.context("scada")) as client:
                self.assertEqual(client.ask(31, WRITE), WRITE)
            text = program.get("/metrics")[1]
            for outcome, count in (("done", 1), ("revoked", 1), ("untrusted", 2), ("expired", 1)):
                self.assertEqual(
                    metric(program, text, "panelgate_tls_handshakes_total", outcome=outcome), count)

    def test_a_client_that_expects_another_name_or_ca_goes_and_the_log_says_why(self):
        with served(self.made, self.made.tls()) as program:
            port = program.modbus_port()
            unknowing = ssl.create_default_context()
            self.assertTrue(refused(port, unknowing))
            program.log.wait_for("outcome=refused .*does not take the gateway's certificate")
            with socket.create_connection(("127.0.0.1", port)) as raw:
                with self.assertRaises(ssl.SSLCertVerificationError):
                    self.made.context().wrap_socket(raw, server_hostname="other.plant")
            program.log.wait_for("outcome=refused", 2)

    def test_plain_bytes_and_hellos_at_the_wrong_port_are_named(self):
        with served(self.made, self.made.tls(), self.made.tls()) as program:
            with harness.Client(program.modbus_port()) as client:
                client.send(31, READ)
                self.assertTrue(client.is_closed_by_peer())
            program.log.wait_for("outcome=plain .*speaks Modbus/TCP without TLS")
            with socket.create_connection(("127.0.0.1", program.http_port())) as raw:
                raw.sendall(b"GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n")
                self.assertEqual(raw.recv(1), b"")
            program.log.wait_for("outcome=plain .*speaks HTTP without TLS")
        with served(self.made) as program:
            self.assertTrue(refused(program.modbus_port(), self.made.context()))
            program.log.wait_for("connection closed .*speaks TLS and needs a listener with tls")
            self.assertTrue(refused(program.http_port(), self.made.context()))
            program.log.wait_for("connection closed .*it speaks TLS; write http://")


@unittest.skipUnless(importlib.util.find_spec("pymodbus"), "no pymodbus here")
class Pymodbus(Tls):
    def test_its_tls_client_reads_and_writes_by_its_role(self):
        with served(self.made, self.made.tls("required", role_from="certificate")) as program:
            for name, may in (("scada", True), ("panel", False)):
                asyncio.run(self.ask(program.modbus_port(), name, may))

    async def ask(self, port, name, may):
        """By its asynchronous client: the other one waits for a socket whose bytes OpenSSL has."""
        from pymodbus.client import AsyncModbusTlsClient  # pylint: disable=import-outside-toplevel
        client = AsyncModbusTlsClient("127.0.0.1", port=port, sslctx=self.made.context(name),
                                      server_hostname="localhost", framer=self.framer())
        await client.connect()
        self.assertEqual(len((await client.read_holding_registers(0, 2, slave=31)).registers), 2)
        self.assertEqual((await client.write_register(100, 5, slave=31)).isError(), not may)
        await client.close()

    @staticmethod
    def framer():
        """Modbus/TCP Security keeps the MBAP header; pymodbus' own framer for TLS leaves it out."""
        from pymodbus.framer.socket_framer import ModbusSocketFramer
        return ModbusSocketFramer


class Https(Tls):
    def test_rest_page_events_and_hsts(self):
        with served(self.made, http=self.made.tls()) as program:
            port = program.http_port()
            context = self.made.context()
            for path in ("/", "/readyz", "/metrics", "/api/v1/stations", "/docs/"):
                status, _, headers = get(port, path, context)
                self.assertEqual(status, 200, path)
                self.assertIn("max-age", headers["Strict-Transport-Security"])
            body = '{"values":[5]}'
            path = "/api/v1/stations/press/holding-registers/100"
            self.assertEqual(get(port, path, context, "PUT", body,
                                 {"Content-Type": "application/json"})[0], 200)
            with socket.create_connection(("127.0.0.1", port), harness.PATIENCE) as raw, \
                    context.wrap_socket(raw, server_hostname="localhost") as secure:
                secure.sendall(b"GET /api/v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n")
                text = b""
                while b": panelgate" not in text:
                    text += secure.recv(4096)
                self.assertIn(b"Strict-Transport-Security", text)

    def test_expect_continue_and_large_bodies(self):
        with served(self.made, http=self.made.tls()) as program:
            with socket.create_connection(("127.0.0.1", program.http_port()), 30) as raw, \
                    self.made.context().wrap_socket(raw, server_hostname="localhost") as secure:
                body = b'{"values":[5]}'
                secure.sendall(b"PUT /api/v1/stations/press/holding-registers/100 HTTP/1.1\r\n"
                               b"Host: localhost\r\nContent-Type: application/json\r\n"
                               b"Expect: 100-continue\r\n"
                               b"Content-Length: %d\r\n\r\n" % len(body))
                self.assertTrue(secure.recv(100).startswith(b"HTTP/1.1 100 Continue"))
                secure.sendall(body)
                self.assertTrue(secure.recv(4096).startswith(b"HTTP/1.1 200"))
            self.assertGreater(len(get(program.http_port(), "/openapi.json",
                                       self.made.context())[1]), 100_000)

    def test_commands_ask_by_https_and_trust_the_gateways_own_certificate(self):
        with served(self.made, http=self.made.tls()) as program:
            at = ["-c", self.made.path("panelgate.yaml"), "--http",
                  f"127.0.0.1:{program.http_port()}"]
            for command in (["health"], ["status"], ["read", "press", "UW0"], ["reload"]):
                done = harness.run(*command, *at)
                self.assertEqual(done.returncode, 0, (command, done.stderr))
            with plant() as stranger:
                with served(stranger, http=stranger.tls()) as other:
                    at[-1] = f"127.0.0.1:{other.http_port()}"
                    done = harness.run("health", *at)
            self.assertEqual(done.returncode, 1)
            self.assertIn("cannot be trusted", done.stderr)

    def test_the_role_in_a_certificate_is_as_a_tokens(self):
        tls = self.made.tls("optional", role_from="certificate")
        path = "/api/v1/stations/press/holding-registers/100"
        with served(self.made, http=tls, anonymous="none") as program:
            def put(name):
                return get(program.http_port(), path, self.made.context(name), "PUT",
                           '{"values":[5]}', {"Content-Type": "application/json"})[0]

            def read(name):
                return get(program.http_port(), "/api/v1/stations", self.made.context(name))[0]
            self.assertEqual([read("scada"), read("panel"), read("nobody"), read(None)],
                             [200, 200, 401, 401])
            self.assertEqual([put("scada"), put("panel"), put("nobody")], [200, 403, 401])

    def test_curl_and_openssl_are_served(self):
        with served(self.made, http=self.made.tls("optional")) as program:
            url = f"https://localhost:{program.http_port()}/readyz"
            for more in ([], ["--cert", self.made.path("scada.crt"), "--key",
                              self.made.path("scada.key")], ["--tls-max", "1.2"]):
                done = subprocess.run(["curl", "-sS", "--cacert", self.made.path("ca.crt"), *more,
                                       url], capture_output=True, text=True, check=False)
                self.assertEqual(done.returncode, 0, done.stderr)


class Versions(Tls):
    def connects(self, port, *arguments):
        done = subprocess.run(
            ["openssl", "s_client", "-connect", f"127.0.0.1:{port}", "-CAfile",
             self.made.path("ca.crt"), *arguments], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, check=False, timeout=harness.PATIENCE)
        found = re.search(r"Cipher is (\S+)", done.stdout)
        return found.group(1) if found and found.group(1) != "(NONE)" else None

    def test_only_what_is_meant_is_spoken(self):
        listed = subprocess.run(["openssl", "ciphers", "-s", "-tls1_2", "ALL:@SECLEVEL=0"],
                                capture_output=True, text=True, check=True).stdout.strip()
        with served(self.made, self.made.tls()) as program:
            port = program.modbus_port()
            for version in ("-tls1", "-tls1_1"):
                self.assertIsNone(self.connects(port, version, "-cipher", "ALL:@SECLEVEL=0"))
            taken = {name for name in listed.split(":")
                     if self.connects(port, "-tls1_2", "-cipher", f"{name}:@SECLEVEL=0")}
            self.assertEqual(taken, {"ECDHE-ECDSA-AES128-GCM-SHA256",
                                     "ECDHE-ECDSA-AES256-GCM-SHA384",
                                     "ECDHE-ECDSA-CHACHA20-POLY1305"})
            self.assertTrue(self.connects(port, "-tls1_3"))

    def test_min_version_1_3_refuses_1_2(self):
        with served(self.made, self.made.tls(min_version="TLSv1.3")) as program:
            self.assertIsNone(self.connects(program.modbus_port(), "-tls1_2"))
            self.assertTrue(self.connects(program.modbus_port(), "-tls1_3"))
            program.log.wait_for("outcome=version .*no version that is allowed")

    def test_no_renegotiation_and_no_resumption(self):
        with served(self.made, self.made.tls()) as program:
            where = ["openssl", "s_client", "-connect", f"127.0.0.1:{program.modbus_port()}"]
            done = subprocess.run([*where, "-tls1_2"], input="R\n", capture_output=True, text=True,
                                  check=False, timeout=harness.PATIENCE)
            self.assertIn("RENEGOTIATING", done.stdout + done.stderr)
            self.assertIn("no renegotiation", done.stdout + done.stderr)
            done = subprocess.run([*where, "-reconnect", "-tls1_2"], stdin=subprocess.DEVNULL,
                                  capture_output=True, text=True, check=False)
            self.assertNotIn("Reused", done.stdout)

    def test_no_early_data(self):
        with served(self.made, self.made.tls()) as program, tempfile.TemporaryDirectory() as folder:
            session, early = f"{folder}/session", pathlib.Path(folder) / "early"
            early.write_bytes(harness.adu(1, 31, WRITE))
            where = ["openssl", "s_client", "-connect", f"127.0.0.1:{program.modbus_port()}", "-tls1_3"]
            told = ""
            for more in (["-sess_out", session], ["-sess_in", session, "-early_data", str(early)]):
                done = subprocess.run([*where, *more], stdin=subprocess.DEVNULL, capture_output=True,
                                      text=True, check=False, timeout=harness.PATIENCE)
                told += done.stdout + done.stderr
            self.assertNotIn("Early data was accepted", told)
            self.assertNotIn("Reused", told)
            self.assertNotIn("info write ", program.log.text())


class Abuse(Tls):
    """Whoever breaks handshakes gives the places back, and costs others nothing."""

    def test_broken_handshakes(self):
        with served(self.made, self.made.tls("required")) as program:
            port = program.modbus_port()
            hello = self.hello()
            for i in range(int(os.environ.get("TLS_BROKEN", "300"))):
                with socket.create_connection(("127.0.0.1", port)) as raw:
                    cut = i % len(hello)
                    raw.sendall(hello[:cut] + bytes([hello[cut] ^ (1 + i % 255)]) + hello[cut + 1:])
                    if i % 3 == 0:
                        raw.shutdown(socket.SHUT_WR)
                    if i % 3 == 1:
                        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            with SecureClient(port, self.made.context("scada")) as client:
                self.assertEqual(client.ask(31, READ)[0], 3)
            while metric(program, program.get("/metrics")[1], "panelgate_tcp_connections") != 0:
                time.sleep(0.01)

    def hello(self):
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        secure = self.made.context("scada").wrap_bio(incoming, outgoing, server_hostname="localhost")
        with self.assertRaises(ssl.SSLWantReadError):
            secure.do_handshake()
        return outgoing.read()

    def test_half_open_handshakes_of_one_address_keep_nobody_out(self):
        with served(self.made, self.made.tls("required")) as program:
            port = program.modbus_port()
            held = []
            for _ in range(200):
                raw = socket.create_connection(("127.0.0.1", port))
                raw.sendall(b"\x16\x03\x01\x02\x00")
                held.append(raw)
            with SecureClient(port, self.made.context("scada")) as client:
                self.assertEqual(client.ask(31, READ)[0], 3)
            for raw in held:
                raw.close()

    def test_a_byte_at_a_time_and_an_end_without_close_notify(self):
        with served(self.made, self.made.tls("required")) as program:
            incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
            secure = self.made.context("scada").wrap_bio(incoming, outgoing,
                                                         server_hostname="localhost")
            with socket.create_connection(("127.0.0.1", program.modbus_port()), 30) as raw:
                raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

                def pump(step):
                    while True:
                        try:
                            return step()
                        except ssl.SSLWantReadError:
                            for byte in outgoing.read():
                                raw.sendall(bytes([byte]))
                            incoming.write(raw.recv(4096))
                pump(secure.do_handshake)
                for byte in harness.adu(1, 31, READ):  # a record a byte
                    secure.write(bytes([byte]))
                reply = pump(lambda: secure.read(100))
                self.assertEqual(reply[:2], b"\0\1")
                secure.write(harness.adu(2, 31, READ))
                raw.sendall(outgoing.read())
                raw.shutdown(socket.SHUT_WR)  # it still reads
                self.assertEqual(pump(lambda: secure.read(100))[:2], b"\0\2")


class Replaced(Tls):
    def test_certificates_are_replaced_under_load_without_a_failed_request(self):
        times = int(os.environ.get("TLS_REPLACED", "5"))
        with served(self.made, self.made.tls("required"), self.made.tls()) as program:
            ports = program.modbus_port(), program.http_port()
            stop = threading.Event()
            failed = []
            held = SecureClient(ports[0], self.made.context("scada"))

            def ask():
                for _ in itertools.count():
                    if stop.is_set():
                        return
                    try:
                        with SecureClient(ports[0], self.made.context("scada")) as client:
                            assert client.ask(31, READ)[0] == 3
                        assert get(ports[1], "/readyz", self.made.context())[0] == 200
                        assert held.ask(31, READ)[0] == 3
                    except Exception as error:  # pylint: disable=broad-except
                        failed.append(error)
            thread = threading.Thread(target=ask)
            thread.start()
            shown = set()
            for _ in range(times):
                self.made.cert("new-server", "localhost", "127.0.0.1", "--force")
                wanted = (self.made.folder / "localhost.crt").read_text()
                for port in ports:
                    while ssl.get_server_certificate(("127.0.0.1", port)).split() != wanted.split():
                        time.sleep(0.02)
                shown.add(wanted)
            stop.set()
            thread.join()
            held.close()
            self.assertEqual(failed, [])
            self.assertEqual(len(shown), times)

    def test_a_reload_turns_tls_on_and_off(self):
        with plant() as own, served(own) as program:
            file = own.folder / "panelgate.yaml"
            plain = file.read_text()
            ports = program.modbus_port(), program.http_port()
            plain = plain.replace('modbus_tcp: [{listen: "127.0.0.1:0"',
                                  f'modbus_tcp: [{{listen: "127.0.0.1:{ports[0]}"')
            plain = plain.replace('http: {listen: "127.0.0.1:0"',
                                  f'http: {{listen: "127.0.0.1:{ports[1]}"')
        with plant() as own:
            file = own.folder / "panelgate.yaml"
            file.write_text(plain)
            with harness.Program("run", "-c", str(file)) as program:
                program.http_port()
                for count, tls in enumerate((own.tls(), "", own.tls()), 1):
                    file.write_text(plain.replace("anonymous", tls + ", anonymous") if tls
                                    else plain)
                    program.process.send_signal(signal.SIGHUP)
                    program.log.wait_for("reload outcome=applied", count)
                    context = own.context() if tls else None
                    connection = (http.client.HTTPSConnection("localhost", ports[1], timeout=30,
                                                              context=context) if tls else
                                  http.client.HTTPConnection("localhost", ports[1], timeout=30))
                    connection.request("GET", "/readyz")
                    self.assertEqual(connection.getresponse().status, 200)
                    connection.close()

    def test_a_bad_new_one_keeps_the_old_one_and_says_so(self):
        with plant() as own, served(own, http=own.tls()) as program:
            before = ssl.get_server_certificate(("127.0.0.1", program.http_port()))
            (own.folder / "localhost.key").write_text((own.folder / "ca.key").read_text())
            program.log.wait_for("certificate not renewed .*does not belong to the certificate")
            self.assertEqual(ssl.get_server_certificate(("127.0.0.1", program.http_port())), before)
            done = harness.run("reload", "-c", own.path("panelgate.yaml"), "--http",
                               f"https://127.0.0.1:{program.http_port()}")
            self.assertNotEqual(done.returncode, 0)
            # Commands still know that it has TLS, and whose certificate it is.
            done = harness.run("health", "-c", own.path("panelgate.yaml"), "--http",
                               f"127.0.0.1:{program.http_port()}")
            self.assertEqual(done.returncode, 0, done.stderr)
            text = get(program.http_port(), "/metrics", own.context())[1]
            expiry = metric(program, text, "panelgate_certificate_expiry_timestamp_seconds")
            self.assertGreater(expiry, time.time() + 800 * 24 * 3600)


class Checked(Tls):
    def check(self, made, tls):
        (made.folder / "checked.yaml").write_text(
            "lines: [{name: floor1, device: sim}]\n"
            f"http: {{listen: \"127.0.0.1:0\", hosts: [localhost], {tls}}}\n")
        return harness.run("check", "-c", made.path("checked.yaml"))

    def test_check_judges_mode_match_dates_names_and_extension(self):
        with plant() as own:
            self.assertEqual(self.check(own, own.tls()).returncode, 0)
            self.assertIn("shuts out probes", self.check(own, own.tls("required")).stderr)
            os.chmod(own.path("localhost.key"), 0o644)
            self.assertIn("every user of this machine can read the key",
                          self.check(own, own.tls()).stderr)
            own.cert("new-server", "other.plant", "--days", "5")
            tls = own.tls().replace("localhost.", "other.plant.")
            text = self.check(own, tls).stderr
            self.assertIn("is not for localhost", text)
            self.assertRegex(text, "expires on .* in [45] days")
            text = self.check(own, own.tls().replace("localhost.", "scada.")).stderr
            self.assertIn("is not one of a server", text)
            done = self.check(own, own.tls().replace("localhost.key", "scada.key"))
            self.assertEqual(done.returncode, 78)
            self.assertIn("does not belong to the certificate", done.stderr)

    def test_cert_says_where_files_go_and_overwrites_nothing(self):
        with plant() as own:
            self.assertIn("role_from: certificate", own.cert("new-client", "third", "--role-word", "x"))
            self.assertIn("client: required", own.cert("new-server", "a.plant", "10.0.0.7"))
            again = harness.run("cert", "new-ca", "--dir", str(own.folder))
            self.assertEqual(again.returncode, 69)
            self.assertIn("--force", again.stderr)
            self.assertEqual(os.stat(own.path("ca.key")).st_mode & 0o777, 0o600)
            text = subprocess.run(["openssl", "x509", "-in", own.path("third.crt"), "-noout",
                                   "-text"], capture_output=True, text=True, check=True).stdout
            self.assertIn("1.3.6.1.4.1.50316.802.1", text)
            self.assertIn("prime256v1", text)


if __name__ == "__main__":
    unittest.main()
