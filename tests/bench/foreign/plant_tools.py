"""Node-RED and FUXA, as npm packages them, without a screen: what a flow or a project does is asked for over
their own HTTP. The words are those of plain_clients.py."""
import contextlib
import json
import os
import pathlib
import subprocess
import time
import urllib.error
import urllib.request

import harness
from foreign import free_port, wait_for_listener
from harness import Helper
from plain_clients import BITS, Client, HERE, refusal, told

FUNCTIONS = {("read", "coils"): 1, ("read", "discrete"): 2, ("read", "holding"): 3, ("read", "inputs"): 4,
             ("set", "coils"): 5, ("set", "holding"): 6, ("write", "coils"): 15, ("write", "holding"): 16}


def installed(package):
    return pathlib.Path(os.environ["NODE_PATH"]) / package


def http(url, body=None, timeout=harness.PATIENCE):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=timeout) as response:
        return json.loads(response.read() or "null")


class FromNpm(Client):
    packages = ()

    def missing(self):
        absent = [p for p in self.packages if not (installed(p) / "package.json").exists()]
        return f"there is no {absent[0]}" if absent else None

    def find_version(self):
        self.version = " ".join(json.loads((installed(p) / "package.json").read_text())["version"]
                                for p in self.packages)


class NodeRed(FromNpm):
    """A flow with the flexible getter and the flexible write."""
    packages = ("node-red", "node-red-contrib-modbus")

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.find_version()
        own = free_port()
        settings = pathlib.Path(folder) / "settings.js"
        settings.write_text(f'module.exports = {{uiPort: {own}, uiHost: "127.0.0.1", httpAdminRoot: false, '
                            f'credentialSecret: false, editorTheme: {{tours: false}}}};\n')
        flow = pathlib.Path(folder) / "flow.json"
        flow.write_text((HERE / "node_red_flow.json").read_text())

        def asked(verb, table, unit, address, values, patience=harness.PATIENCE):
            new = [bool(value) for value in values] if table in BITS else values
            call = {"fc": FUNCTIONS[verb, table], "unitid": unit, "address": address,
                    "quantity": values[0] if verb == "read" else len(values),
                    "value": new[0] if verb == "set" else new}
            answer = http(f"http://127.0.0.1:{own}/call", call, patience)
            if "error" in answer:
                return refusal(answer["error"])
            return told(answer["data"][:values[0]]) if verb == "read" else "ok"

        with Helper(["node", installed("node-red") / "red.js", "--userDir", folder, "--settings", settings, flow],
                    stderr=subprocess.DEVNULL, env={**os.environ, "MODBUS_PORT": str(port)}) as program:
            program.out.wait_for("Started flows")
            self.wait_for_connection(asked, calls[0])
            yield asked

    @staticmethod
    def wait_for_connection(ask, call):
        """What comes before it has one is dropped by the flow."""
        end = time.monotonic() + harness.PATIENCE
        while True:
            try:
                return ask(*call[:5], patience=1)
            except (urllib.error.URLError, TimeoutError):
                assert time.monotonic() < end, "Node-RED does not answer"


class Fuxa(FromNpm):
    """A project with a device for each panel and a tag for each item. It reads tags that lie together in one
    request, and writes tag by tag: coils by 05, registers by 16."""
    polls = True
    packages = ("@frangoteam/fuxa",)
    MEMORY = {"coils": "000000", "discrete": "100000", "inputs": "300000", "holding": "400000"}

    def can(self, call):
        return call.expected is not None and not (call.verb == "read" and call.values[0] > 100)

    @staticmethod
    def tags(call):
        count = call.values[0] if call.verb == "read" else len(call.values)
        return [f"{call.table}-{call.unit}-{call.address + i}" for i in range(count)]

    def project(self, port, calls):
        devices = {}
        for call in calls:
            device = devices.setdefault(str(call.unit), {
                "id": f"d{call.unit}", "name": f"unit {call.unit}", "type": "ModbusTCP", "enabled": True,
                "polling": 500, "property": {"address": f"127.0.0.1:{port}", "slaveid": str(call.unit)}, "tags": {}})
            for name in self.tags(call):
                address = int(name.rsplit("-", 1)[1]) + 1
                device["tags"][name] = {"id": name, "name": name, "address": str(address),
                                        "memaddress": self.MEMORY[call.table],
                                        "type": "Bool" if call.table in BITS else "UInt16"}
        server = {"id": "0", "name": "FUXA", "type": "FuxaServer", "enabled": True, "property": {}, "tags": {}}
        return {"version": "1.01", "name": "matrix", "server": server, "devices": devices,
                "hmi": {"views": []}, "alarms": [], "scripts": [], "reports": [], "texts": [], "charts": []}

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.find_version()
        own = free_port()
        place = f"http://127.0.0.1:{own}"
        with Helper(["node", installed(self.packages[0]) / "main.js", "--userDir", folder, "--port", own],
                    stderr=subprocess.DEVNULL, cwd=folder):
            wait_for_listener(own)
            http(f"{place}/api/project", self.project(port, calls))

            def ask(*call):
                verb, names = call[0], self.tags(calls[0]._make([*call, None, None]))
                if verb == "read":
                    query = json.dumps(names).replace('"', "%22").replace(" ", "")
                    found = http(f"{place}/api/getTagValue?ids={query}")
                    values = [one.get("value") for one in found]
                    return "error not yet" if None in values else told(values)
                http(f"{place}/api/setTagValue", {"tags": [
                    {"id": name, "value": value} for name, value in zip(names, call[4])]})
                return "ok"
            yield ask


def everyone():
    return [NodeRed("Node-RED"), Fuxa("FUXA")]
