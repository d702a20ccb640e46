"""A real Prometheus with the configuration and the rules of deploy/prometheus; for tests with a clock
in which a minute is a second and an hour a minute."""
import json
import pathlib
import re
import subprocess
import tempfile
import time
import urllib.parse
import urllib.request

import harness
from harness import PATIENCE, ROOT

DEPLOYED = ROOT / "deploy/prometheus"
QUICK = {"scrape_interval: 5s": "scrape_interval: 500ms",
         "evaluation_interval: 15s": "evaluation_interval: 250ms"}


def sooner(rules):
    """The same rules with windows and `for` a sixtieth as long."""
    def scaled(found):
        return found[1] + found[2] + {"m": "s", "h": "m"}[found[3]]
    return re.sub(r"(\[|for: |offset )(\d+)([mh])\b", scaled, rules)


class Prometheus(harness.Helper):
    """Runs with the block, on a free port, with its storage in a folder of its own."""

    def __init__(self, targets, quick=True):
        self.folder = tempfile.TemporaryDirectory()
        place = pathlib.Path(self.folder.name)
        changed = {'["panelgate:8080"]': json.dumps(targets), **(QUICK if quick else {})}
        config = (DEPLOYED / "prometheus.yml").read_text()
        for deployed, own in changed.items():
            assert deployed in config, deployed
            config = config.replace(deployed, own)
        (place / "prometheus.yml").write_text(config)
        (place / "rules").mkdir()
        for file in (DEPLOYED / "rules").glob("*.yml"):
            rules = file.read_text()
            (place / "rules" / file.name).write_text(sooner(rules) if quick else rules)
        super().__init__(["prometheus", f"--config.file={place}/prometheus.yml",
                          f"--storage.tsdb.path={place}/data", "--web.listen-address=127.0.0.1:0"],
                         stderr=subprocess.STDOUT)
        listening = self.out.wait_for(r'msg="Listening on".* address=127\.0\.0\.1:(\d+)')
        self.port = int(listening[1])
        self.out.wait_for("Server is ready to receive web requests")

    def __exit__(self, *error):
        super().__exit__(*error)
        self.folder.cleanup()

    def api(self, path, **parameters):
        url = f"http://127.0.0.1:{self.port}/api/v1/{path}?{urllib.parse.urlencode(parameters)}"
        with urllib.request.urlopen(url, timeout=PATIENCE) as response:
            return json.load(response)["data"]

    def query(self, expression):
        """[(labels, value)] now, without what is no number."""
        answer = self.api("query", query=expression)
        if answer["resultType"] == "scalar":
            return [({}, float(answer["result"][1]))]
        found = [(s["metric"], float(s["value"][1])) for s in answer["result"]]
        return [(labels, value) for labels, value in found if value == value]

    def until(self, condition, meanwhile=lambda: None, told=lambda: "that never was"):
        """What condition() gives as soon as it is true; `meanwhile` is done between two looks."""
        end = time.monotonic() + 5 * PATIENCE  # an alert looks back over windows of its own
        while not (found := condition()):
            assert time.monotonic() < end, told()
            meanwhile()
            time.sleep(0.1)  # a look is a query: no more than ten a second
        return found
