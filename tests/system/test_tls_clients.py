"""Other people's TLS: Node.js, and a browser with a client's certificate."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import harness
from harness import read_registers, write_register
from test_tls import Tls
from tls_plant import plant, served

NODE = shutil.which("node")
# Asks one after the other, and prints what comes for each: its PDU in hex, or why there is none.
ASK = """
const [port, ca, cert, key, ...pdus] = process.argv.slice(1);
const file = name => name && require("fs").readFileSync(name);
const socket = require("tls").connect({host: "localhost", port, ca: file(ca), cert: file(cert), key: file(key)});
const replies = [];
let input = Buffer.alloc(0);
function ask() {
  if (replies.length === pdus.length) return socket.end();
  const pdu = Buffer.from(pdus[replies.length], "hex");
  const head = Buffer.from([0, replies.length, 0, 0, 0, pdu.length + 1, 31]);
  socket.write(Buffer.concat([head, pdu]));
}
function finish(why) {
  console.log(JSON.stringify({replies, why, protocol}));
  process.exit();
}
let protocol = null;
socket.on("secureConnect", () => { protocol = socket.getProtocol(); ask(); });
socket.on("data", bytes => {
  input = Buffer.concat([input, bytes]);
  if (input.length < 6 || input.length < 6 + input.readUInt16BE(4)) return;
  replies.push(input.subarray(7, 6 + input.readUInt16BE(4)).toString("hex"));
  input = Buffer.alloc(0);
  ask();
});
socket.on("error", error => finish(error.code || error.message));
socket.on("close", () => finish(""));
"""
READ = read_registers(0)
WRITE = write_register(0x64, 7)


@unittest.skipUnless(NODE, "no node here")
class Node(Tls):
    """As a function node of Node-RED, or jsmodbus, speaks through Node's `tls`."""

    def ask(self, program, ca, name, *pdus):
        files = [self.made.path(f"{name}.{end}") for end in ("crt", "key")] if name else ["", ""]
        done = subprocess.run([NODE, "-e", ASK, "--", str(program.modbus_port()), ca, *files,
                               *(pdu.hex() for pdu in pdus)],
                              capture_output=True, text=True, timeout=harness.PATIENCE, check=True)
        return json.loads(done.stdout)

    def test_it_reads_and_writes_by_its_role(self):
        with served(self.made, self.made.tls("required", role_from="certificate")) as program:
            ca = self.made.path("ca.crt")
            for name, answer in (("scada", WRITE), ("panel", bytes([0x86, 1])), ("nobody", bytes([0x86, 1]))):
                got = self.ask(program, ca, name, READ, WRITE, READ)
                self.assertEqual(got["why"], "", got)
                self.assertEqual(got["protocol"], "TLSv1.3")
                self.assertEqual([reply[:2] for reply in got["replies"]][::2], ["03", "03"], got)
                self.assertEqual(got["replies"][1], answer.hex(), name)

    def test_without_a_certificate_or_with_another_ca_it_gets_no_reply(self):
        with plant() as stranger, served(self.made, self.made.tls("required")) as program:
            got = self.ask(program, self.made.path("ca.crt"), None, READ)
            self.assertEqual(got["replies"], [])
            self.assertIn("CERTIFICATE_REQUIRED", got["why"])
            program.log.wait_for("outcome=no_certificate")
            got = self.ask(program, stranger.path("ca.crt"), "scada", READ)
            self.assertEqual((got["replies"], got["why"] != ""), ([], True), got)
            # It looks at the certificate when the handshake is over, and sends no alert.
            program.log.wait_for("tls handshake failed .*outcome=(refused|broken)")


def can_have_a_policy():
    """A browser asks its user which certificate to show, unless a policy says it, which stands in
    /etc: a mount of one's own puts it there for the one process."""
    if not all(map(shutil.which, ("chromium", "certutil", "pk12util", "unshare"))):
        return False
    if not pathlib.Path("/etc/chromium").is_dir():
        return False
    done = subprocess.run(["unshare", "-rm", "mount", "--bind", "/tmp", "/etc/chromium"],
                          capture_output=True, check=False)
    return done.returncode == 0


@unittest.skipUnless(can_have_a_policy(), "needs chromium, certutil, pk12util, and mounts of one's own")
class Browser(Tls):
    """Chromium, with the plant's CA and a client's certificate in its store."""

    def run_quietly(self, *command):
        subprocess.run(command, check=True, capture_output=True, timeout=harness.PATIENCE)

    def set_up(self, home, name):
        database = f"sql:{home}/.pki/nssdb"
        for folder in (".pki/nssdb", "etc/policies/managed"):
            (home / folder).mkdir(parents=True)
        policy = {"AutoSelectCertificateForUrls": [json.dumps({"pattern": "https://localhost", "filter": {}})]}
        (home / "etc/policies/managed/certificate.json").write_text(json.dumps(policy))
        self.run_quietly("certutil", "-N", "-d", database, "--empty-password")
        self.run_quietly("certutil", "-A", "-d", database, "-n", "plant", "-t", "CT,,",
                         "-i", self.made.path("ca.crt"))
        if name is None:
            return
        # As docs/operate/tls.md says.
        self.run_quietly("openssl", "pkcs12", "-export", "-in", self.made.path(f"{name}.crt"), "-inkey",
                         self.made.path(f"{name}.key"), "-out", str(home / "it.p12"), "-passout", "pass:")
        self.run_quietly("pk12util", "-i", str(home / "it.p12"), "-d", database, "-W", "", "-K", "")

    def shown(self, url, name):
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            home = pathlib.Path(folder)
            self.set_up(home, name)
            command = (f"mount --bind {home}/etc /etc/chromium && exec chromium --headless=new --no-sandbox "
                       f"--disable-gpu --disable-dev-shm-usage --user-data-dir={home}/user --dump-dom {url}")
            done = subprocess.run(["unshare", "-rm", "sh", "-c", command], env={**os.environ, "HOME": folder},
                                  capture_output=True, text=True, timeout=60, check=False)
            return done.stdout

    def test_it_gets_in_with_a_certificate_of_the_plant_and_not_without(self):
        tls = self.made.tls("required", role_from="certificate")
        with served(self.made, http=tls, anonymous="none") as program:
            url = f"https://localhost:{program.http_port()}/api/v1/stations"
            self.assertIn('"press"', self.shown(url, "panel"))
            self.assertIn('"status":401', self.shown(url, "nobody"), "no role, so it may nothing here")
            self.assertNotIn("outcome=no_certificate", program.log.text())
            self.assertNotIn('"press"', self.shown(url, None))
            program.log.wait_for("outcome=no_certificate")


if __name__ == "__main__":
    unittest.main()
