"""What a certificate's role lets its client do at each listener, and what the log says of it."""
import datetime
import http.client
import json
import re
import signal
import socket
import unittest

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec

import harness
from harness import read_registers, write_register
from test_tls import get
from tls_plant import ROLE, SecureClient, plant, refused, served, status_of

READ = read_registers(0)
WRITE = write_register(0x64, 7)
PLACE = "/api/v1/stations/press/holding-registers/100"


def signed_by(made, name, *extensions, by="ca", chain=""):
    """A client's certificate with these extensions alone."""
    signer = x509.load_pem_x509_certificate((made.folder / f"{by}.crt").read_bytes())
    signing = serialization.load_pem_private_key((made.folder / f"{by}.key").read_bytes(), None)
    key = ec.generate_private_key(ec.SECP256R1())
    now = datetime.datetime.utcnow()
    draft = (x509.CertificateBuilder()
             .subject_name(x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)]))
             .issuer_name(signer.subject).public_key(key.public_key())
             .serial_number(x509.random_serial_number())
             .not_valid_before(now - datetime.timedelta(days=1))
             .not_valid_after(now + datetime.timedelta(days=1)))
    for extension in extensions:
        draft = draft.add_extension(extension, critical=False)
    pem = draft.sign(signing, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)
    (made.folder / f"{name}.crt").write_bytes(pem + chain.encode())
    (made.folder / f"{name}.key").write_bytes(key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()))


def key_usage(**uses):
    names = ("digital_signature", "content_commitment", "key_encipherment", "data_encipherment",
             "key_agreement", "key_cert_sign", "crl_sign", "encipher_only", "decipher_only")
    return x509.KeyUsage(**{name: uses.get(name, False) for name in names})


CLIENT = x509.ExtendedKeyUsage([x509.ExtendedKeyUsageOID.CLIENT_AUTH])
NOT_TEXT = x509.UnrecognizedExtension(x509.ObjectIdentifier(ROLE), b"\x16\x08operator")


class Roles(unittest.TestCase):
    def setUp(self):
        context = plant()
        self.made = context.__enter__()  # pylint: disable=unnecessary-dunder-call
        self.addCleanup(context.__exit__, None, None, None)
        self.made.cert("new-client", "odd", "--role-word", "janitor")
        self.tls = self.made.tls("optional", role_from="certificate")

    def put(self, program, name, **more):
        return get(program.http_port(), PLACE, self.made.context(name), "PUT", '{"values": [5]}',
                   {"Content-Type": "application/json", **more})[:2]

    def test_it_counts_more_than_anonymous_over_https(self):
        with served(self.made, self.tls, self.tls, anonymous="operator") as program:
            self.assertEqual(self.put(program, "scada")[0], 200)
            for name, status, why in (("panel", 403, "the client's certificate has viewer"),
                                      ("odd", 403, "has janitor, which no role here is called"),
                                      ("nobody", 401, "this needs a token")):
                refusal = self.put(program, name)
                self.assertEqual(refusal[0], status, (name, refusal))
                self.assertIn(why, refusal[1])
                self.assertEqual(get(program.http_port(), PLACE, self.made.context(name))[0], 200)
            self.assertEqual(self.put(program, None)[0], 200, "nobody in particular is an operator")

    def test_an_idempotency_key_is_that_of_one_certificate(self):
        key = {"Idempotency-Key": "one"}
        with served(self.made, self.tls, self.tls, anonymous="viewer") as program:
            self.assertEqual(self.put(program, "scada", **key)[0], 200)
            self.assertEqual(self.put(program, "panel", **key)[0], 403, "scada's answer is for scada")
            self.made.cert("new-client", "scada-2", "--role", "operator")
            self.assertNotIn("Replayed", str(get(
                program.http_port(), PLACE, self.made.context("scada-2"), "PUT", '{"values": [5]}',
                {"Content-Type": "application/json", **key})))

    def test_without_a_role_and_a_token_it_is_a_refusal_and_no_login(self):
        audit = self.made.path("audit.jsonl")
        with served(self.made, self.tls, self.tls, anonymous="viewer", audit=f"{{file: {audit}}}") as program:
            self.assertEqual(self.put(program, "nobody")[0], 401)
            program.log.wait_for("http request refused .*certificate=.CN=nobody. ")
        with open(audit, encoding="utf-8") as file:
            records = [json.loads(one) for one in file]
        self.assertEqual([one["certificate"] for one in records if one["kind"] == "refusal"], ["CN=nobody"])
        self.assertNotIn("login", [one["kind"] for one in records])

    def test_writes_and_refusals_are_logged_with_the_certificate(self):
        self.made.cert("new-client", "chief", "--role", "admin")
        with served(self.made, self.tls, self.tls, anonymous="viewer") as program:
            for name in ("scada", "chief"):
                self.assertEqual(self.put(program, name)[0], 200)
                program.log.wait_for(f" write .*client=.http 127.0.0.1. certificate=.CN={name}. ")
            self.put(program, "panel")
            program.log.wait_for("http request refused .*certificate=.CN=panel. ")
            with SecureClient(program.modbus_port(), self.made.context("scada")) as client:
                self.assertEqual(client.ask(31, WRITE), WRITE)
            program.log.wait_for(" write .*client=.modbus_tcp 127.0.0.1:[0-9]+. certificate=.CN=scada. ")

    def test_a_role_that_does_not_count_is_logged_at_both_kinds_of_listeners(self):
        signed_by(self.made, "badrole", CLIENT, NOT_TEXT)
        with served(self.made, self.tls, self.tls, anonymous="viewer") as program:
            for name, why in (("badrole", "is not one UTF8String"), ("odd", "its role is janitor, and no role")):
                get(program.http_port(), "/readyz", self.made.context(name))
                program.log.wait_for(f"certificate without a role .*subject=.CN={name}. .*{why}")
                with SecureClient(program.modbus_port(), self.made.context(name)) as client:
                    self.assertEqual(client.ask(31, READ)[0], 3)
                program.log.wait_for(f"certificate without a role .*subject=.CN={name}. .*{why}", 2)
            self.assertNotIn("CN=nobody", program.log.text())

    def test_a_role_that_only_rules_name_counts(self):
        rules = "{default: deny, rules: [{name: all, allow: [read], roles: [janitor]}]}"
        with served(self.made, self.tls, access=rules) as program:
            with SecureClient(program.modbus_port(), self.made.context("odd")) as client:
                self.assertEqual(client.ask(31, READ)[0], 3)
            self.assertNotIn("certificate without a role", program.log.text())

    def test_a_refusal_names_the_certificate_that_is_to_blame_and_what_lacks(self):
        signed_by(self.made, "cipher", CLIENT, key_usage(key_encipherment=True))
        signed_by(self.made, "leaf", CLIENT, by="scada", chain=(self.made.folder / "scada.crt").read_text())
        with served(self.made, self.tls) as program:
            for name, why in (("cipher", "CN=cipher is not one of a client; .*digitalSignature"),
                              ("leaf", "the CA CN=scada of the client's certificate CN=leaf cannot be trusted")):
                self.assertTrue(refused(program.modbus_port(), self.made.context(name)))
                program.log.wait_for("outcome=untrusted .*" + why)

    def test_bytes_that_were_changed_on_the_way_are_counted_and_logged(self):
        with served(self.made, self.tls, self.tls) as program:
            with SecureClient(program.modbus_port(), self.made.context("scada")) as client:
                self.assertEqual(client.ask(31, READ)[0], 3)
                raw = socket.socket(fileno=client.socket.detach())
                with raw:
                    raw.sendall(b"GET / HTTP/1.1\r\n\r\n")
                    raw.settimeout(harness.PATIENCE)
                    while raw.recv(4096):
                        pass
            program.log.wait_for("connection closed .*are no TLS, or were changed on the way")
            text = get(program.http_port(), "/metrics", self.made.context())[1]
            self.assertRegex(text, r'panelgate_tcp_protocol_errors_total\{[^}]*\} 1\b')

    def test_who_may_do_the_same_as_before_stays(self):
        with served(self.made, http=self.tls, anonymous="viewer") as program:
            connection = http.client.HTTPSConnection(
                "localhost", program.http_port(), timeout=harness.PATIENCE,
                context=self.made.context("panel"))
            self.addCleanup(connection.close)
            self.assertEqual(status_of(connection, "/readyz"), 200)
            file = self.made.folder / "panelgate.yaml"
            file.write_text(re.sub(", role_from: certificate", "", file.read_text()))
            program.process.send_signal(signal.SIGHUP)
            program.log.wait_for(" reload .*applied")
            own = connection.sock.getsockname()
            self.assertEqual(status_of(connection, "/readyz"), 200)
            self.assertEqual(connection.sock.getsockname(), own)
            self.assertNotIn("connection closed", program.log.text())


if __name__ == "__main__":
    unittest.main()
