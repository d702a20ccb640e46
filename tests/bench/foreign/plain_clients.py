"""Foreign clients that are asked call by call, all in the same words.

A call is `read TABLE UNIT ADDRESS COUNT`, `set TABLE UNIT ADDRESS VALUE` (the client's own call for one
item) or `write TABLE UNIT ADDRESS VALUE...` (its call for several); TABLE is coils, discrete, inputs or
holding. What came of it is `ok [VALUE...]`, `exception CODE` or `error WORDS`. A program that speaks this
on its standard streams says `ready VERSION` first.
"""
import contextlib
import os
import pathlib
import re
import shutil
import subprocess
import sys

import harness
from harness import Helper

HERE = pathlib.Path(__file__).resolve().parent
BUILT = pathlib.Path(os.environ.get("FOREIGN_BUILT", harness.ROOT / "build/release"))
PYTHON = "/usr/bin/python3" if os.access("/usr/bin/python3", os.X_OK) else sys.executable
BITS = ("coils", "discrete")
EXCEPTIONS = {"illegal function": 1, "illegal data address": 2, "illegal data value": 3}


def quietly(*command, timeout=2 * harness.PATIENCE, **options):
    return subprocess.run([str(part) for part in command], capture_output=True, text=True, check=False,
                          stdin=subprocess.DEVNULL, timeout=timeout, **options)


def packaged(name):
    """Debian's version of it."""
    return quietly("dpkg-query", "-W", "-f", "${Version}", name).stdout.split("+")[0]


def told(values):
    return " ".join(["ok", *(str(int(value)) for value in values)])


def refusal(text):
    """`exception CODE` when these words name one, otherwise `error WORDS`."""
    for words, code in EXCEPTIONS.items():
        if words in text.lower():
            return f"exception {code}"
    return "error " + " ".join(text.split())[-200:]


class Client:
    """`polls`: it reads by itself, and a call shows what it has; then frames are not told by call.
    `insists`: it asks again when it is refused."""
    polls = False
    insists = False
    version = "?"

    def __init__(self, name):
        self.name = name

    def missing(self):
        """Why it cannot run here, or None."""
        return None

    def can(self, call):
        """Whether it has a call for this."""
        return True

    def survey(self, unit):
        """What it looks at by itself: for each thing "", or what is wrong."""
        return []

    def running(self, port, folder, calls):
        """A context that gives ask(verb, table, unit, address, values) -> what came of it. `calls`: what
        will be asked, for those who want to know before."""
        raise NotImplementedError


class Spoken(Client):
    """A program that speaks these words."""

    def __init__(self, name, command, probe=()):
        super().__init__(name)
        self._command = command
        self._probe = probe

    def missing(self):
        if not shutil.which(str(self._command[0])):
            return f"there is no {pathlib.Path(self._command[0]).name}"
        if self._probe and quietly(*self._probe).returncode != 0:
            return f"there is no {self.name}"
        return None

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        with Helper([*self._command, "127.0.0.1", port]) as program:
            self.version = program.out.wait_for("^ready (.*)").group(1)
            answers = 0

            def ask(verb, table, unit, address, values):
                nonlocal answers
                program.process.stdin.write(f"{verb} {table} {unit} {address} {' '.join(map(str, values))}\n")
                program.process.stdin.flush()
                answers += 1
                return program.out.wait_for("^(ok|exception|error).*", answers).group()
            yield ask


class H5Modbus(Spoken):
    insists = True  # retryOnException, three times


class Qt(Spoken):
    """Built when it is asked for: the tree's own build has no Qt."""

    def __init__(self, generation):
        super().__init__(f"Qt {generation}", [])
        self._package = f"Qt{generation}SerialBus"

    def missing(self):
        if quietly("pkg-config", "--exists", self._package).returncode != 0:
            return f"there is no {self._package}"
        return None

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        program = pathlib.Path(folder) / "qt_client"
        flags = quietly("pkg-config", "--cflags", "--libs", self._package).stdout.split()
        built = quietly("g++", "-std=c++17", "-fPIC", "-o", program, HERE / "qt_client.cpp", *flags)
        assert built.returncode == 0, built.stderr
        self._command = [program]
        with super().running(port, folder, calls) as ask:
            yield ask


class Mbpoll(Client):
    """One process a call; with one value it writes by 05 and 06, otherwise by 15 and 16."""
    TABLES = {"coils": 0, "discrete": 1, "inputs": 3, "holding": 4}

    def missing(self):
        return None if shutil.which("mbpoll") else "there is no mbpoll"

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.version = packaged("mbpoll")

        def ask(verb, table, unit, address, values):
            common = ["mbpoll", "-m", "tcp", "-p", port, "-1", "-0", "-a", unit, "-t", self.TABLES[table],
                      "-r", address]
            if verb == "read":
                done = quietly(*common, "-c", values[0], "127.0.0.1")
            else:
                done = quietly(*common, "127.0.0.1", *values)
            if done.returncode != 0:
                return refusal(done.stderr + done.stdout)
            read = re.findall(r"(?m)^\[\d+\]:\s+(\d+)", done.stdout)
            return told(read) if verb == "read" else "ok"
        yield ask


class Zabbix(Client):
    """zabbix_agent2 -t: its Modbus plugin reads one item; it has no writes."""
    FUNCTIONS = {"coils": 1, "discrete": 2, "holding": 3, "inputs": 4}

    def missing(self):
        return None if shutil.which("zabbix_agent2") else "there is no zabbix_agent2"

    def can(self, call):
        return call.verb == "read"

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.version = re.search(r"Zabbix\) (\S+)", quietly("zabbix_agent2", "-V").stdout).group(1)
        settings = pathlib.Path(folder) / "zabbix_agent2.conf"
        settings.write_text("Hostname=matrix\nServer=127.0.0.1\n")

        def ask(verb, table, unit, address, values):
            kind = "bit" if table in BITS else "uint16"
            key = (f"modbus.get[tcp://127.0.0.1:{port},{unit},{self.FUNCTIONS[table]},{address},"
                   f"{values[0]},{kind}]")
            text = quietly("zabbix_agent2", "-c", settings, "-t", key).stdout
            came = re.search(r"\[s\|\[?([\d, ]+)\]?\]\s*$", text)
            return told(came.group(1).replace(",", " ").split()) if came else refusal(text)
        yield ask


def everyone():
    node = ["node", HERE / "npm_client.js"]

    def library(name, kind=Spoken):
        return kind(name, [*node, name], ["node", "-e", f"require('{name}')"])

    return [Mbpoll("mbpoll"), Spoken("libmodbus", [BUILT / "libmodbus_client"]),
            Spoken("pymodbus", [PYTHON, "-B", HERE / "pymodbus_client.py"],
                   [PYTHON, "-c", "import pymodbus.client"]),
            Qt(5), Qt(6),
            library("modbus-serial"), library("jsmodbus"), library("modbus-stream"),
            library("h5.modbus", H5Modbus), Zabbix("zabbix-agent2")]
