"""What the commands say of certificates: `cert`, and those that ask by HTTPS."""
import datetime
import pathlib
import resource
import shutil
import subprocess
import tempfile
import unittest

import harness
from config import gateway, line
from tls_plant import plant, served


class Cert(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.assertEqual(self.cert("new-ca").returncode, 0)

    def cert(self, *arguments, **more):
        return subprocess.run([harness.PANELGATE, "cert", *arguments, "--dir", str(self.folder)],
                              stderr=subprocess.PIPE, text=True, check=False,
                              **({"stdout": subprocess.PIPE} | more))

    def files(self):
        return sorted(path.name for path in self.folder.iterdir())

    def text(self, name):
        return subprocess.run(["openssl", "x509", "-in", str(self.folder / name), "-noout", "-text"],
                              capture_output=True, text=True, check=True).stdout

    def test_names_that_are_none_are_wrong_usage_that_says_what_is_right(self):
        for names in (["gw:8443"], ["https://10.0.0.5/"], ["[fd00::1]:802"], ["fe80::1%eth0"], ["300.1.1.1"],
                      ["a b"], ["*"], ["a..b"], [""], ["gw", "a,DNS:b"], ["x" * 64 + ".a"]):
            done = self.cert("new-server", *names)
            self.assertEqual(done.returncode, 64, (names, done.stderr))
            self.assertIn(f"'{names[-1]}' is no host name or IP address, such as gateway", done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(self.files(), ["ca.crt", "ca.key"])

    def test_long_names_are_alternatives_and_the_subject_is_short(self):
        name = ".".join(["a" * 50, "b" * 50, "plant.example"])
        self.assertEqual(self.cert("new-server", name, "10.0.0.5").returncode, 0)
        text = self.text(name + ".crt")
        self.assertIn("Subject: CN = 10.0.0.5", text)
        self.assertIn(f"DNS:{name}, IP Address:10.0.0.5", text)
        longest = ".".join(["c" * 60] * 4)
        self.assertEqual(self.cert("new-server", longest).returncode, 0)
        self.assertTrue(any(name.startswith("c" * 60) for name in self.files()))
        for name in ("y" * 65, "", "a\nb"):
            done = self.cert("new-client", name)
            self.assertEqual(done.returncode, 64, done.stderr)
            self.assertIn("a name has 1 to 64 characters", done.stderr)

    def test_a_role_that_is_none_is_wrong_usage_that_lists_them(self):
        done = self.cert("new-client", "scada", "--role", "Operator")
        self.assertEqual(done.returncode, 64)
        self.assertIn("viewer, operator, engineer or admin, not 'Operator'", done.stderr)
        self.assertEqual(self.cert("new-client", "scada", "--role-word", "shift").returncode, 0)
        self.assertIn("shift", self.text("scada.crt"))
        for word in ("x" * 65, b"\xff", "a\nb"):
            done = self.cert("new-client", "other", "--role-word", word)
            self.assertEqual(done.returncode, 64, word)
            self.assertIn("a role is a word of 1 to 64 bytes of UTF-8", done.stderr)
        self.assertNotIn("other.crt", self.files())

    def test_its_end_is_no_later_than_the_cas(self):
        self.cert("new-ca", "--days", "30", "--force")
        said = self.cert("new-client", "scada").stdout
        until = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(days=30)
        self.assertIn(f"wrote {self.folder}/scada.crt and {self.folder}/scada.key, valid until ", said)
        self.assertLess(abs((datetime.date.fromisoformat(said.split("until ")[1][:10]) - until.date()).days), 2)

    def test_nothing_is_said_to_be_written_where_a_folder_is_in_the_way(self):
        (self.folder / "scada.key").mkdir()
        done = self.cert("new-client", "scada", "--force")
        self.assertEqual((done.returncode, done.stdout), (69, ""))
        self.assertIn("scada.key: Is a directory", done.stderr)

    def test_files_of_a_wildcard_are_no_options(self):
        self.assertIn("_.plant.example.crt", self.cert("new-server", "*.plant.example").stdout)
        self.assertIn("__1.crt", self.cert("new-server", "::1").stdout)

    def test_a_list_that_cannot_be_read_is_not_made_anew(self):
        for name in ("one", "two"):
            self.cert("new-client", name)
        self.assertEqual(self.cert("revoke", str(self.folder / "one.crt")).returncode, 0)
        former = (self.folder / "crl.pem").read_bytes()
        (self.folder / "crl.pem").write_bytes(b"")
        done = self.cert("revoke", str(self.folder / "two.crt"))
        self.assertEqual(done.returncode, 69)
        self.assertIn("is empty, though it should name who is revoked already", done.stderr)
        (self.folder / "crl.pem").write_bytes(former)
        self.assertEqual(self.cert("revoke").returncode, 0, "without a file: the same list, a later end")
        text = subprocess.run(["openssl", "crl", "-in", str(self.folder / "crl.pem"), "-noout", "-text"],
                              capture_output=True, text=True, check=True).stdout
        self.assertEqual(text.count("Serial Number"), 1)
        self.assertIn("X509v3 Authority Key Identifier", text)
        self.assertRegex(text, r"X509v3 CRL Number:\s+2\n")

    def test_a_key_of_the_ca_that_all_may_read_is_told(self):
        said = f"every user of this machine can read {self.folder}/ca.key"
        self.assertNotIn(said, self.cert("new-client", "one").stderr)
        (self.folder / "ca.key").chmod(0o644)
        done = self.cert("new-client", "two")
        self.assertEqual(done.returncode, 0)
        self.assertIn(said, done.stderr)
        self.assertIn(f"`chmod 600 {self.folder}/ca.key`", done.stderr)

    def test_revoke_refuses_another_cas_certificate_and_list(self):
        with plant() as other:
            done = self.cert("revoke", other.path("scada.crt"))
            self.assertEqual(done.returncode, 64)
            self.assertIn("holds no certificate that this CA has signed", done.stderr)
            other.cert("revoke", other.path("scada.crt"))
            self.cert("new-client", "own")
            shutil.copy(other.path("crl.pem"), self.folder / "crl.pem")
            done = self.cert("revoke", str(self.folder / "own.crt"))
            self.assertEqual(done.returncode, 69)
            self.assertIn("the former list of revoked certificates is another CA's", done.stderr)

    def test_a_full_disk_leaves_all_as_it_was(self):
        self.cert("new-server", "gw")
        before = {name: (self.folder / name).read_bytes() for name in self.files()}
        done = self.cert("new-server", "gw", "--force", restore_signals=False,
                         preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100)))
        self.assertEqual(done.returncode, 69)
        self.assertRegex(done.stderr, "cannot write .*gw.key")
        self.assertEqual({name: (self.folder / name).read_bytes() for name in self.files()}, before)


class Asking(unittest.TestCase):
    def test_ca_is_enough_where_the_configuration_is_not_at_hand(self):
        with plant() as made, plant() as other, served(made, http=made.tls()) as program:
            at = ["-c", "/nowhere.yaml", "--http", f"https://127.0.0.1:{program.http_port()}"]
            for command in (["health"], ["status"], ["reload"]):
                done = harness.run(*command, *at, "--ca", made.path("ca.crt"))
                self.assertEqual(done.returncode, 0, (command, done.stderr))
                done = harness.run(*command, *at, "--ca", other.path("ca.crt"))
                self.assertNotEqual(done.returncode, 0)
            done = harness.run("health", *at)
            self.assertIn("cannot be trusted", done.stderr)
            self.assertIn("--ca FILE", done.stderr)
            done = harness.run("health", *at, "--ca", "/nowhere.crt")
            self.assertIn("cannot read --ca /nowhere.crt", done.stderr)

    def test_a_name_is_looked_up_and_must_be_the_certificates(self):
        with plant() as made:
            made.cert("new-server", "127.0.0.1")
            by_address = made.tls().replace("localhost.", "127.0.0.1.")
            for tls, address, name in ((made.tls(), 0, 0), (by_address, 0, 1)):
                with served(made, http=tls) as program:
                    for host, code in (("127.0.0.1", address), ("localhost", name)):
                        done = harness.run("health", "-c", "/nowhere.yaml", "--http",
                                           f"https://{host}:{program.http_port()}",
                                           "--ca", made.path("ca.crt"))
                        self.assertEqual(done.returncode, code, (host, done.stderr))
                        if code:
                            self.assertRegex(done.stderr, "(?i)hostname mismatch")

    def test_who_is_shut_out_by_tls_is_told_of_tls(self):
        with plant() as made, served(made, http=made.tls("required")) as program:
            at = ["-c", made.path("panelgate.yaml"), "--http", f"127.0.0.1:{program.http_port()}"]
            for command in ("health", "status"):
                done = harness.run(command, *at)
                self.assertEqual(done.returncode, 1 if command == "health" else 69)
                self.assertIn("client: required", done.stderr)
                self.assertNotIn("allow", done.stderr)
            done = harness.run("health", "-c", "/nowhere.yaml", "--http",
                               f"http://127.0.0.1:{program.http_port()}")
            self.assertIn("https://", done.stderr)


class AtHome(unittest.TestCase):
    """Commands beside the gateway, which know all that they need by its configuration."""

    def setUp(self):
        context = plant()
        self.made = context.__enter__()  # pylint: disable=unnecessary-dunder-call
        self.addCleanup(context.__exit__, None, None, None)

    def run_here(self, program, *command):
        """Where the file says the port."""
        file = pathlib.Path(self.made.path("panelgate.yaml"))
        text = file.read_text()
        file.write_text(text.replace('http: {listen: "127.0.0.1:0"',
                                     f'http: {{listen: "127.0.0.1:{program.http_port()}"'))
        return harness.run(*command, "-c", str(file))

    def test_health_of_a_gateway_that_keeps_its_former_certificate(self):
        pair = [pathlib.Path(self.made.path(name)) for name in ("localhost.crt", "localhost.key")]
        with served(self.made, http=self.made.tls()) as program:
            self.assertEqual(self.run_here(program, "health").returncode, 0)
            pair[0].write_text("junk")
            program.log.wait_for("certificate not renewed")
            for change in (lambda: None, pair[0].unlink):
                change()
                done = self.run_here(program, "health")
                self.assertEqual(done.returncode, 0, done.stderr)

    def test_what_holds_a_secret_wants_the_cas_signature(self):
        with plant() as other:
            with served(self.made, http=self.made.tls(ca=self.made.path("ca.crt"))) as program:
                self.made.cert("new-server", "localhost", "--force")
                done = self.run_here(program, "status")
                self.assertEqual(done.returncode, 0, done.stderr)
                pathlib.Path(self.made.path("ca.crt")).write_bytes(
                    pathlib.Path(other.path("ca.crt")).read_bytes())
                done = self.run_here(program, "status")
                self.assertEqual(done.returncode, 69)
                self.assertIn("cannot be trusted", done.stderr)

    def test_a_reload_that_cannot_be_asked_what_came_of_it(self):
        with served(self.made, http=self.made.tls("required")) as program:
            file = pathlib.Path(self.made.path("panelgate.yaml"))
            file.write_text(file.read_text().replace("anonymous: admin", "anonymous: viewer"))
            done = self.run_here(program, "reload")
            self.assertEqual((done.returncode, done.stdout), (75, ""), done.stderr)
            self.assertIn("its log says", done.stderr)
            program.log.wait_for("reload outcome=(applied|failed)")


class Says(unittest.TestCase):
    def test_check_says_who_writes_by_a_certificate(self):
        rules = "{rules: [{name: no, deny: [write], roles: [viewer]}]}"
        with plant() as made:
            text = gateway(line(), modbus='listen: "127.0.0.1:1802", ' +
                           made.tls("required", role_from="certificate"), access=rules)
            (made.folder / "p.yaml").write_text(text)
            done = harness.run("check", "-c", made.path("p.yaml"))
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("read, and write where the role in the client's certificate may, "
                          "for everybody with a certificate", done.stdout)
            self.assertNotIn("any client", done.stdout + done.stderr)
            self.assertIn("modbus_tcp 127.0.0.1:1802 with a certificate of an operator: everywhere",
                          done.stdout)
            (made.folder / "p.yaml").write_text(text.replace("client: required", "client: optional"))
            done = harness.run("check", "-c", made.path("p.yaml"))
            self.assertIn("certificate may, for everybody", done.stdout)
            self.assertNotIn("everybody with", done.stdout)

    def test_check_knows_that_certificates_open_http(self):
        rules = "{rules: [{name: no, deny: [write], roles: [viewer]}]}"
        with plant() as made:
            file = made.folder / "p.yaml"
            file.write_text(gateway(line(), modbus="listen: 127.0.0.1:0, access: read_only",
                                    http='listen: "127.0.0.1:8443", anonymous: none, ' +
                                    made.tls("optional", role_from="certificate"), access=rules))
            done = harness.run("check", "-c", str(file))
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("http 127.0.0.1:8443: without a token nothing, with a certificate what its role may, "
                          "for everybody", done.stdout)
            self.assertIn("http 127.0.0.1:8443 with a certificate of an operator: everywhere", done.stdout)
            file.write_text(file.read_text().replace(", role_from: certificate", ""))
            self.assertIn("clients can use only /healthz and /readyz", harness.run("check", "-c", str(file)).stderr)


class Port(unittest.TestCase):
    def test_802_where_a_listener_with_tls_names_none(self):
        with plant() as made:
            file = made.folder / "port.yaml"
            for listen, shown in (("127.0.0.2", "127.0.0.2:802"), ("\"[::1]\"", "[::1]:802"),
                                  ("127.0.0.2:1802", "127.0.0.2:1802")):
                file.write_text("lines: [{name: floor1, device: sim}]\n"
                                f"modbus_tcp: [{{listen: {listen}, {made.tls()}}}]\n")
                done = harness.run("check", "-c", str(file))
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertIn(f"modbus_tcp {shown}", done.stdout)
            file.write_text("lines: [{name: floor1, device: sim}]\nmodbus_tcp: [{listen: 127.0.0.2}]\n")
            self.assertIn("listen must be ADDR:PORT", harness.run("check", "-c", str(file)).stderr)


if __name__ == "__main__":
    unittest.main()
