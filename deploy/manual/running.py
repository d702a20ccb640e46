"""Programs that run while a page is made of what they say."""
import contextlib
import json
import pathlib
import re
import subprocess
import tempfile
import time
import urllib.request

PATIENCE = 30


class Gateway:
    """Its HTTP side is asked; it listens on ports that are free."""

    def __init__(self, log):
        self.log = log

    def base(self):
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if found := re.search(r"listening http=(\S+)", self.log.read_text()):
                return "http://" + found[1]
            time.sleep(0.05)
        raise SystemExit(f"it does not listen:\n{self.log.read_text()}")

    def text(self, path):
        with urllib.request.urlopen(self.base() + path, timeout=PATIENCE) as answer:
            return answer.read().decode()

    def json(self, path):
        return json.loads(self.text(path))


@contextlib.contextmanager
def _running(*command):
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder) / "log"
        with log.open("wb") as out:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        try:
            yield Gateway(log)
        finally:
            process.terminate()
            process.wait(PATIENCE)


def demo(program):
    return _running(*program, "demo", "--http", "127.0.0.1:0", "--modbus", "127.0.0.1:0")


@contextlib.contextmanager
def configured(program, text):
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "panelgate.yaml"
        file.write_text(text)
        with _running(*program, "run", "-c", str(file)) as gateway:
            yield gateway
