"""A gateway whose log nobody reads."""
import os
import re
import subprocess
import tempfile
import urllib.request

import harness


class Unread:
    """The program, whose stderr is a full pipe that nobody reads."""

    def __init__(self, text):
        self.folder = tempfile.TemporaryDirectory()
        self.file = os.path.join(self.folder.name, "panelgate.yaml")
        with open(self.file, "w") as file:
            file.write(text)
        self.reader, writer = os.pipe()
        self.process = subprocess.Popen([harness.PANELGATE, "run", "-c", self.file],
                                        stdin=subprocess.DEVNULL, stderr=writer)
        os.close(writer)
        self.ports = self._ports()

    def _ports(self):
        """Its lines are read until the last listener has told its port, and then no more."""
        said = ""
        while not (found := re.search(r"modbus_tcp=\S*:(\d+)\n(?:.*\n)*?.*http=\S*:(\d+)\n", said)):
            part = os.read(self.reader, 4096).decode()
            assert part, said
            said += part
        return int(found[1]), int(found[2])

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()
        os.close(self.reader)
        self.folder.cleanup()

    def metric(self, name):
        with urllib.request.urlopen(f"http://127.0.0.1:{self.ports[1]}/metrics",
                                    timeout=harness.PATIENCE) as response:
            text = response.read().decode()
        return float(re.search(rf"^{name} (\S+)$", text, re.M)[1])
