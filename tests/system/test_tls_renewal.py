"""Certificates that live: what new files replace, what they must not, and who has to go."""
import contextlib
import http.client
import json
import os
import shutil
import ssl
import subprocess
import unittest

import harness
from harness import read_registers, write_register
from test_tls import get, metric
from tls_plant import SecureClient, plant, refused, served

READ = read_registers(0)
WRITE = write_register(0x64, 7)
DENIED = bytes([0x86, 1])


def shown(program):
    return ssl.get_server_certificate(("127.0.0.1", program.http_port())).split()


def replace(target, source):
    """In one step, as `panelgate cert` and ACME clients do."""
    shutil.copy(source, f"{target}.new")
    os.rename(f"{target}.new", target)


def reload(made, program):
    return harness.run("reload", "-c", made.path("panelgate.yaml"), "--http",
                       f"127.0.0.1:{program.http_port()}")


def edit(made, old, new):
    file = made.folder / "panelgate.yaml"
    text = file.read_text()
    assert old in text, old
    file.write_text(text.replace(old, new))


class Noticed(unittest.TestCase):
    """Files that change under a running gateway."""

    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.made = self.stack.enter_context(plant())
        self.other = self.stack.enter_context(plant())
        self.made.cert("new-client", "lost")
        self.made.cert("revoke", self.made.path("lost.crt"))
        self.program = self.stack.enter_context(
            served(self.made, http=self.made.tls("optional", crl=self.made.path("crl.pem"))))
        self.good = shown(self.program)

    def kept(self, why):
        self.program.log.wait_for("certificate not renewed listener=.*" + why)
        self.assertEqual(shown(self.program), self.good)
        self.assertEqual(get(self.program.http_port(), "/readyz", self.made.context("scada"))[0], 200)
        self.assertEqual(self.program.log.text().count("certificate not renewed"), 1)
        self.assertEqual(self.renewals("kept"), 1)
        self.assertEqual(self.renewals("replaced"), 0)

    def renewals(self, outcome):
        text = get(self.program.http_port(), "/metrics", self.made.context("scada"))[1]
        return metric(self.program, text, "panelgate_certificate_renewals_total", outcome=outcome)

    def put_pair(self, source, name="localhost"):
        for end in ("key", "crt"):
            replace(self.made.path(f"localhost.{end}"), source.path(f"{name}.{end}"))

    def test_a_key_of_another_certificate(self):
        replace(self.made.path("localhost.key"), self.made.path("scada.key"))
        self.kept("localhost.key does not belong to the certificate")

    def test_a_pair_of_another_name_and_ca_is_taken_and_open_connections_stay(self):
        with SecureClient(self.program.http_port(), self.made.context("scada")) as client:
            self.put_pair(self.other)
            self.program.log.wait_for("certificate renewed .*files=.certificate, key.")
            self.assertNotEqual(shown(self.program), self.good)
            client.socket.sendall(b"GET /readyz HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.assertTrue(client.socket.recv(100).startswith(b"HTTP/1.1 200"))

    def test_a_half_written_bundle(self):
        both = (self.made.folder / "ca.crt").read_text() + (self.other.folder / "ca.crt").read_text()
        shutil.copy(self.made.path("ca.crt"), self.made.path("first"))
        (self.made.folder / "half").write_text(both[:-200])
        replace(self.made.path("ca.crt"), self.made.path("half"))
        self.program.log.wait_for("certificate not renewed .*ca.crt is damaged or cut off")
        replace(self.made.path("ca.crt"), self.made.path("first"))
        self.assertEqual(get(self.program.http_port(), "/readyz", self.made.context("scada"))[0], 200)

    def test_a_list_that_is_none(self):
        (self.made.folder / "none").write_text("nothing\n")
        replace(self.made.path("crl.pem"), self.made.path("none"))
        self.kept("holds no list of revoked")

    def test_a_file_that_is_gone_is_announced_once(self):
        os.rename(self.made.path("localhost.crt"), self.made.path("away"))
        self.program.log.wait_for("certificate file missing .*localhost.crt")
        self.made.cert("new-client", "third")
        replace(self.made.path("crl.pem"), self.made.path("third.crt"))
        os.rename(self.made.path("away"), self.made.path("localhost.crt"))
        self.program.log.wait_for("certificate not renewed .*holds no list")
        self.assertEqual(self.program.log.text().count("certificate file missing"), 1)
        self.assertEqual(shown(self.program), self.good)

    def test_each_renewal_is_in_the_log_with_whose_certificate_it_is(self):
        for count in range(1, 8):
            self.made.cert("new-server", "localhost", "127.0.0.1", "--force")
            self.program.log.wait_for("certificate renewed .*files=\"certificate, key\" subject=.CN=localhost. "
                                      "issuer=.CN=Plant CA. serial=.* expires=", count)
        self.assertEqual((self.renewals("replaced"), self.renewals("kept")), (7, 0))


class EachForItself(unittest.TestCase):
    """A file that is kept back, or gone, holds back no other."""

    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.made = self.stack.enter_context(plant())
        self.made.cert("new-client", "lost", "--role", "operator")
        self.made.cert("new-client", "gone")
        self.made.cert("revoke", self.made.path("gone.crt"))
        self.program = self.stack.enter_context(
            served(self.made, self.made.tls("required", crl=self.made.path("crl.pem"))))

    def loses_its_place(self):
        with SecureClient(self.program.modbus_port(), self.made.context("lost")) as client:
            self.assertEqual(client.ask(31, READ)[0], 3)
            self.made.cert("revoke", self.made.path("lost.crt"))
            self.program.log.wait_for("certificate renewed .*files=crl")
            self.program.log.wait_for("connection closed .*CN=lost is revoked")
            self.assertTrue(client.is_closed_by_peer())

    def test_a_revocation_beside_a_pair_that_is_kept_back(self):
        replace(self.made.path("localhost.key"), self.made.path("scada.key"))
        self.program.log.wait_for("certificate not renewed .*does not belong to the certificate")
        self.loses_its_place()
        self.made.cert("new-server", "localhost", "127.0.0.1", "--force")
        self.program.log.wait_for("certificate renewed .*files=.certificate, key.")

    def test_a_revocation_beside_a_key_that_is_gone(self):
        os.rename(self.made.path("localhost.key"), self.made.path("away"))
        self.program.log.wait_for("certificate file missing")
        self.loses_its_place()


class TwoCas(unittest.TestCase):
    """Both named "Plant CA", as `panelgate cert new-ca` names them: a change of the CA, in order."""

    def reads(self, program, context):
        try:
            with SecureClient(program.modbus_port(), context) as client:
                return client.ask(31, READ)[0] == 3
        except (ssl.SSLError, ConnectionError):
            return False

    def test_each_list_is_of_the_ca_that_has_signed_it(self):
        with plant() as old, plant() as new:
            for one in (old, new):
                one.cert("new-client", "lost")
                one.cert("revoke", one.path("lost.crt"))
            both = (old.folder / "ca.crt").read_text() + (new.folder / "ca.crt").read_text()
            old_list, new_list = ((one.folder / "crl.pem").read_text() for one in (old, new))
            (old.folder / "cas.pem").write_text(both)
            contexts = []
            for name in ("scada", "lost"):
                for one in (old, new):
                    context = ssl.create_default_context(cafile=old.path("ca.crt"))
                    context.load_cert_chain(one.path(f"{name}.crt"), one.path(f"{name}.key"))
                    contexts.append(context)
            for lists, right in ((old_list + new_list, [True, True, False, False]),
                                 (new_list + old_list, [True, True, False, False]),
                                 (old_list, [True, False, False, False])):
                (old.folder / "lists.pem").write_text(lists)
                tls = old.tls("required", crl=old.path("lists.pem")).replace("ca.crt", "cas.pem")
                with served(old, tls) as program:
                    self.assertEqual([self.reads(program, one) for one in contexts], right)

    def test_a_second_list_is_taken_over_and_closes_nobody(self):
        with plant() as old, plant() as new:
            for one in (old, new):
                one.cert("new-client", "lost")
                one.cert("revoke", one.path("lost.crt"))
            old_list, new_list = ((one.folder / "crl.pem").read_text() for one in (old, new))
            authorities = (old.folder / "ca.crt").read_text() + (new.folder / "ca.crt").read_text()
            with served(old, old.tls("required", crl=old.path("crl.pem"))) as program, \
                    SecureClient(program.modbus_port(), old.context("scada")) as client:
                count = 0
                for file, text in (("ca.crt", authorities), ("crl.pem", old_list + new_list),
                                   ("crl.pem", new_list + old_list)):
                    (old.folder / "next").write_text(text)
                    replace(old.path(file), old.path("next"))
                    count += 1
                    program.log.wait_for("certificate renewed ", count)
                    self.assertEqual(client.ask(31, READ)[0], 3)
                self.assertNotIn("connection closed", program.log.text())

    def test_a_pair_that_ends_soon_is_taken_and_announced(self):
        with plant() as made, served(made, made.tls()) as program:
            made.cert("new-server", "localhost", "127.0.0.1", "--days", "2", "--force")
            program.log.wait_for("certificate renewed ")
            program.log.wait_for("warn certificate listener=.* warning=.*localhost.crt expires on .* in [12] days")


class Tightened(unittest.TestCase):
    """Rules that let fewer in reach connections that are open."""

    def test_a_certificate_that_is_revoked_now(self):
        with plant() as made:
            made.cert("new-client", "lost", "--role", "operator")
            made.cert("new-client", "gone")
            made.cert("revoke", made.path("gone.crt"))
            tls = made.tls("required", role_from="certificate", crl=made.path("crl.pem"))
            with served(made, tls, tls) as program:
                port = program.modbus_port()
                with SecureClient(port, made.context("lost")) as lost, \
                        SecureClient(port, made.context("scada")) as scada:
                    for client in (lost, scada):
                        self.assertEqual(client.ask(31, READ)[0], 3)
                    made.cert("revoke", made.path("lost.crt"))
                    program.log.wait_for("connection closed .*CN=lost is revoked")
                    self.assertTrue(lost.is_closed_by_peer())
                    self.assertEqual(scada.ask(31, WRITE), WRITE)
                    self.assertEqual(program.log.text().count("connection closed"), 1)

    def test_a_certificate_that_expires_ends_its_connections(self):
        with plant() as made, served(made, *[made.tls("required", role_from="certificate")] * 2) as program:
            context = made.context("scada")
            with SecureClient(program.modbus_port(), context) as scada:
                made.expired("brief", 4)
                with SecureClient(program.modbus_port(), made.context("brief")) as brief, \
                        contextlib.closing(http.client.HTTPSConnection(
                            "localhost", program.http_port(), context=made.context("brief"))) as web:
                    self.assertEqual(brief.ask(31, READ)[0], 3)
                    web.request("GET", "/api/v1/events")
                    stream = web.getresponse()
                    program.log.wait_for("connection closed .*CN=brief has expired", 2)
                    self.assertTrue(brief.is_closed_by_peer())
                    stream.read()  # until its end
                    self.assertTrue(refused(program.modbus_port(), made.context("brief")))
                self.assertEqual(scada.ask(31, WRITE), WRITE)

    def test_client_required_and_role_from_by_reload(self):
        with plant() as made, \
                served(made, made.tls("optional", role_from="certificate"), made.tls("optional")) as program:
            port = program.modbus_port()
            with SecureClient(port, made.context()) as nobody, \
                    SecureClient(port, made.context("scada")) as scada, \
                    SecureClient(port, made.context("panel")) as panel:
                self.assertEqual([one.ask(31, WRITE) for one in (nobody, panel, scada)],
                                 [DENIED, DENIED, WRITE])
                edit(made, "client: optional, role_from: certificate", "client: required, role_from: certificate")
                self.assertEqual(reload(made, program).returncode, 0)
                self.assertTrue(nobody.is_closed_by_peer())
                program.log.wait_for("connection closed .*shown no certificate, and now must")
                self.assertEqual([one.ask(31, WRITE) for one in (panel, scada)], [DENIED, WRITE])
                edit(made, "client: required, role_from: certificate", "client: required")
                self.assertEqual(reload(made, program).returncode, 0)
                self.assertTrue(panel.is_closed_by_peer(), "it may write now, and comes in anew")
                self.assertEqual(scada.ask(31, WRITE), WRITE)
                program.log.wait_for("connection closed .*role_from has changed")

    def test_a_reload_that_shuts_out_its_own_client_is_still_answered(self):
        with plant() as made, served(made, http=made.tls("optional")) as program:
            edit(made, "client: optional", "client: required")
            done = reload(made, program)
            self.assertEqual((done.returncode, "applied" in done.stdout), (0, True), done.stderr)
            with self.assertRaises((ssl.SSLError, ConnectionError)):
                get(program.http_port(), "/readyz", made.context())
            self.assertEqual(get(program.http_port(), "/readyz", made.context("scada"))[0], 200)


class TurnedOnAndOff(unittest.TestCase):
    """Of both kinds of listeners, and a pair with other paths, by reload: it is answered each time."""

    def test_by_reload(self):
        with plant() as made:
            text, ports = self.plain(made)
            file = made.folder / "panelgate.yaml"
            shutil.copy(made.path("localhost.crt"), made.path("second.crt"))
            shutil.copy(made.path("localhost.key"), made.path("second.key"))
            secure, second = made.tls(), made.tls().replace("localhost.", "second.")
            file.write_text(text)
            with harness.Program("run", "-c", str(file)) as program:
                program.http_port()
                for tls in (secure, second, "", secure):
                    file.write_text(text.replace("anonymous", tls + ", anonymous").replace(
                        f":{ports[0]}\"", f":{ports[0]}\", {tls}") if tls else text)
                    done = harness.run("reload", "-c", str(file))
                    self.assertEqual((done.returncode, "applied" in done.stdout), (0, True),
                                     (tls, done.stderr, done.stdout))
                    self.serves(made, ports, bool(tls))

    def test_the_door_that_asked_for_it_answers(self):
        with plant() as made:
            text, ports = self.plain(made)
            file = made.folder / "panelgate.yaml"
            file.write_text(text.replace("anonymous", made.tls() + ", anonymous"))
            with harness.Program("run", "-c", str(file)) as program:
                program.http_port()
                file.write_text(text)
                status, answer, _ = get(ports[1], "/api/v1/reload", made.context(), "POST")
                self.assertEqual((status, json.loads(answer)["outcome"]), (200, "applied"))

    def plain(self, made):
        """A configuration without `tls`, with ports that are free."""
        with served(made) as program:
            ports = program.modbus_port(), program.http_port()
        text = (made.folder / "panelgate.yaml").read_text()
        for key, port in zip(("modbus_tcp: [{", "http: {"), ports):
            text = text.replace(f'{key}listen: "127.0.0.1:0"', f'{key}listen: "127.0.0.1:{port}"')
        return text, ports

    def serves(self, made, ports, secure):
        at = ["-c", made.path("panelgate.yaml")]
        self.assertEqual(harness.run("health", *at).returncode, 0)
        client = SecureClient(ports[0], made.context()) if secure else harness.Client(ports[0])
        with client:
            self.assertEqual(client.ask(31, READ)[0], 3)


if __name__ == "__main__":
    unittest.main()
