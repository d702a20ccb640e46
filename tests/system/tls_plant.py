"""A plant with certificates, made by `panelgate cert`: its CA, a gateway, clients of all kinds."""
import contextlib
import datetime
import pathlib
import socket
import ssl
import tempfile

import harness
from config import FREE_PORT, gateway, line

ROLE = "1.3.6.1.4.1.50316.802.1"


def status_of(connection, path):
    """Of a GET over this http.client connection, which stays open."""
    connection.request("GET", path)
    answer = connection.getresponse()
    answer.read()
    return answer.status


class Plant:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.cert("new-ca")
        self.cert("new-server", "localhost", "127.0.0.1")
        self.cert("new-client", "scada", "--role", "operator")
        self.cert("new-client", "panel", "--role", "viewer")
        self.cert("new-client", "nobody")

    def cert(self, *arguments):
        """Its output; a failure is one of the test."""
        done = harness.run("cert", *arguments, "--dir", str(self.folder))
        assert done.returncode == 0, done.stderr
        return done.stdout

    def path(self, name):
        return str(self.folder / name)

    def tls(self, client="none", **more):
        keys = {"certificate": self.path("localhost.crt"), "key": self.path("localhost.key"),
                "client": client, **more}
        if client != "none":
            keys["ca"] = self.path("ca.crt")
        return "tls: {" + ", ".join(f"{key}: {value}" for key, value in keys.items()) + "}"

    def context(self, name=None):
        """A client that trusts the plant's CA; `name`: whose certificate it shows."""
        context = ssl.create_default_context(cafile=self.path("ca.crt"))
        if name:
            context.load_cert_chain(self.path(f"{name}.crt"), self.path(f"{name}.key"))
        return context

    def expired(self, name, seconds=-24 * 3600):
        """A client's certificate that ends so many seconds from now, by another program."""
        # pylint: disable=import-outside-toplevel
        from cryptography import x509
        from cryptography.hazmat.primitives import hashes, serialization
        from cryptography.hazmat.primitives.asymmetric import ec
        ca = x509.load_pem_x509_certificate((self.folder / "ca.crt").read_bytes())
        ca_key = serialization.load_pem_private_key((self.folder / "ca.key").read_bytes(), None)
        key = ec.generate_private_key(ec.SECP256R1())
        end = datetime.datetime.utcnow() + datetime.timedelta(seconds=seconds)
        made = (x509.CertificateBuilder()
                .subject_name(x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)]))
                .issuer_name(ca.subject).public_key(key.public_key())
                .serial_number(x509.random_serial_number())
                .not_valid_before(end - datetime.timedelta(days=9)).not_valid_after(end)
                .sign(ca_key, hashes.SHA256()))
        (self.folder / f"{name}.crt").write_bytes(
            made.public_bytes(serialization.Encoding.PEM))
        (self.folder / f"{name}.key").write_bytes(key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
            serialization.NoEncryption()))


class SecureClient(harness.Client):
    """Modbus/TCP Security."""

    def __init__(self, port, context, patience=harness.PATIENCE):
        super().__init__(port, patience)
        self.socket = context.wrap_socket(self.socket, server_hostname="localhost")


@contextlib.contextmanager
def plant():
    with tempfile.TemporaryDirectory() as folder:
        yield Plant(folder)


@contextlib.contextmanager
def served(made, modbus="", http="", anonymous="admin", **keys):
    """A gateway with these keys of `tls` at its listeners; "" is a plain one."""
    text = gateway(line(), modbus=FREE_PORT + (", " + modbus if modbus else ""),
                   http=f"{FREE_PORT}, anonymous: {anonymous}" + (", " + http if http else ""), **keys)
    (made.folder / "panelgate.yaml").write_text(text)
    with harness.Program("run", "-c", made.path("panelgate.yaml")) as program:
        program.http_port()
        yield program


def refused(port, context):
    """True if no reply comes: with TLS 1.3 a client learns it by its first read."""
    try:
        with socket.create_connection(("127.0.0.1", port), harness.PATIENCE) as raw, \
                context.wrap_socket(raw, server_hostname="localhost") as secure:
            secure.sendall(harness.adu(1, 31, harness.read_registers(0)))
            return secure.recv(1) == b""
    except (ssl.SSLError, ConnectionError):
        return True
