"""Gateways of others, as packages bring them, and `$MBUSD` when it names one."""
import contextlib
import os
import pathlib
import shutil
import subprocess

from measures import rig
from foreign import Helper, PYTHON, free_port, wait_for_listener

SOURCES = pathlib.Path(__file__).resolve().parents[1] / "rivals"
UNPACED_BAUD = 115200  # they keep no silence, or one of their own


class Rival:
    """A program that is given a tty and a rate, and prints "listening PORT"."""

    def __init__(self, name, command, environment=None):
        self.name = name
        self._command = command
        self._environment = environment or {}

    @contextlib.contextmanager
    def serving(self, link, baud):
        command = [*self._command, link, baud or UNPACED_BAUD]
        with Helper(command, env={**os.environ, **self._environment},
                    stderr=subprocess.DEVNULL) as program:
            program.port = int(program.out.wait_for(r"^listening (\d+)$").group(1))
            program.pid = program.process.pid
            yield program


class Mbusd:
    """3cky/mbusd with its pauses off, which it needs to be near the wire."""

    name = "mbusd"

    def __init__(self, program):
        self._program = program

    @contextlib.contextmanager
    def serving(self, link, baud):
        port = free_port()
        command = [self._program, "-d", "-v", "0", "-L", "-", "-p", link, "-s",
                   baud or UNPACED_BAUD, "-m", "8n1", "-A", "127.0.0.1", "-P", port, "-C", 128,
                   "-N", 0, "-R", 2]
        with Helper(command, stderr=subprocess.DEVNULL) as program:
            wait_for_listener(port)
            program.port, program.pid = port, program.process.pid
            yield program


def libmodbus_bridge(folder):
    built = pathlib.Path(folder) / "libmodbus_bridge"
    done = subprocess.run(["gcc", "-O2", "-I/usr/include/modbus", "-o", built,
                           SOURCES / "libmodbus_bridge.c", "-lmodbus"],
                          capture_output=True, check=False)
    if done.returncode != 0:
        return None, "libmodbus bridge (gcc and libmodbus-dev are needed)"
    return Rival("libmodbus bridge", [built]), None


def pymodbus_forwarder(_):
    probe = [PYTHON, "-c", "import pymodbus.datastore.remote, serial"]
    if subprocess.run(probe, capture_output=True, check=False).returncode != 0:
        return None, "pymodbus forwarder (python3-pymodbus is needed)"
    return Rival("pymodbus", [PYTHON, "-B", SOURCES / "pymodbus_forwarder.py"]), None


def modbus_serial(_):
    """Installed once into the build folder."""
    folder = rig.harness.ROOT / "build/bench/npm"
    if not (folder / "node_modules/modbus-serial").exists():
        if not shutil.which("npm"):
            return None, "modbus-serial (npm is needed)"
        folder.mkdir(parents=True, exist_ok=True)
        done = subprocess.run(["npm", "install", "--silent", "--prefix", folder, "modbus-serial"],
                              capture_output=True, check=False, timeout=300)
        if done.returncode != 0:
            return None, "modbus-serial (npm could not install it)"
    return Rival("modbus-serial", ["node", SOURCES / "modbus_serial_gateway.js"],
                 {"NODE_PATH": str(folder / "node_modules")}), None


def mbusd(_):
    program = os.environ.get("MBUSD")
    if not program or not os.access(program, os.X_OK):
        return None, "mbusd ($MBUSD does not name it)"
    return Mbusd(program), None


def all_there_are(folder):
    """([rivals], [what is left out, and why])."""
    made = [make(folder) for make in (libmodbus_bridge, mbusd, pymodbus_forwarder, modbus_serial)]
    return [rival for rival, _ in made if rival], [reason for _, reason in made if reason]
