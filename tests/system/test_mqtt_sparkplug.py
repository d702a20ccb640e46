"""A Sparkplug host that others have written sees births, values, deaths and rebirths right.

Its parts are npm's: `npm install sparkplug-client` in a folder outside of the tree, and
SPARKPLUG_NPM=that folder. Without it the test is skipped; the bytes are held by unit_mqtt anyway.
"""
import json
import os
import pathlib
import shutil
import signal
import unittest

import harness
from mqtt_side import BROKER, Broker, Truth, changes, metric, plant
from test_points import until

NPM = os.environ.get("SPARKPLUG_NPM", "")
MODULES = pathlib.Path(NPM).resolve() / "node_modules"
HOST = pathlib.Path(__file__).with_name("sparkplug_host.js")
SPARKPLUG = ", format: sparkplug, group: hall, node: box, write: points"


class Host(harness.Helper):
    def __init__(self, broker):
        super().__init__([shutil.which("node"), HOST, str(broker.port)],
                         env={**os.environ, "NODE_PATH": str(MODULES)})

    def __enter__(self):
        self.out.wait_for('"ready"')
        return self

    def told(self, kind=None, device=None):
        """All messages, or those of a kind and a device, as the npm library reads them."""
        all_told = [json.loads(line) for line in self.out.text().splitlines()]
        return [one for one in all_told if "kind" in one
                and (kind is None or one["kind"] == kind) and (device is None or one.get("device") == device)]

    def wait_for(self, kind, device=None, count=1):
        until(lambda: len(self.told(kind, device)) >= count)
        return self.told(kind, device)[count - 1]

    def command(self, topic, **one):
        self.process.stdin.write(json.dumps({"topic": topic, "metrics": [one]}) + "\n")
        self.process.stdin.flush()


class View:
    """What a host knows after these messages; every rule of the sequence holds."""

    def __init__(self, test, messages):
        self.test, self.seq, self.death = test, None, None
        self.aliases, self.alive, self.values, self.history = {}, set(), {}, {}
        for one in messages:
            self.take(one)

    def take(self, one):
        kind, device = one["kind"], one.get("device")
        metrics = one.get("metrics", [])
        if kind == "NDEATH":
            self.alive.clear()
            self.test.assertNotIn("seq", one)
            self.test.assertEqual(metrics[0]["name"], "bdSeq")
            self.death = metrics[0]["value"]
            return
        if kind == "NBIRTH":
            self.seq, self.alive, self.aliases = -1, {None}, {}
            self.born = next(m["value"] for m in metrics if m["name"] == "bdSeq")
        self.test.assertIn(None, self.alive, one)
        self.seq = (self.seq + 1) % 256
        self.test.assertEqual(one["seq"], self.seq, one)
        if kind == "DDEATH":
            self.alive.remove(device)
            return
        if kind == "DBIRTH":
            self.alive.add(device)
        self.test.assertIn(device, self.alive, one)
        for told in metrics:
            self.take_metric(kind, device, told)

    def take_metric(self, kind, device, told):
        if kind.endswith("BIRTH"):
            self.test.assertTrue(told["name"])
            if told.get("alias") is not None:
                self.test.assertNotIn(told["alias"], [a for a, m in self.aliases.items() if m[0] != device])
                self.aliases[told["alias"]] = (device, told["name"])
            name = (device, told["name"])
        else:
            name = self.aliases[told["alias"]]
            self.test.assertEqual(name[0], device)
        values = self.history if told.get("isHistorical") else self.values
        values.setdefault(name, []).append((told.get("value"), told.get("timestamp"), told))


@unittest.skipUnless(BROKER and NPM and MODULES.is_dir() and shutil.which("node"),
                     "needs SPARKPLUG_NPM, a folder with npm's sparkplug-client, node and mosquitto")
class Sparkplug(unittest.TestCase):
    def test_births_values_deaths_and_rebirth(self):
        with Broker() as broker, Host(broker) as host:
            with harness.configured(plant(broker, more=SPARKPLUG)) as program:
                born = host.wait_for("DBIRTH", "press")
                self.assertEqual({m["name"]: m["type"] for m in born["metrics"]},
                                 {"level": "Double", "mode": "UInt16", "ramp": "UInt16"})
                level = next(m for m in born["metrics"] if m["name"] == "level")
                self.assertEqual(level["properties"]["engUnit"], {"type": "String", "value": "celsius"})
                self.follow(program, host)
                self.dies(program, host)
                count = len(host.told("NBIRTH"))
                host.command("spBv1.0/hall/NCMD/box", name="Node Control/Rebirth", type="Boolean", value=True)
                host.wait_for("NBIRTH", count=count + 1)
                host.wait_for("DBIRTH", "press", 3)
                program.ends_with = -signal.SIGKILL
                program.stop(signal.SIGKILL)
            death = host.wait_for("NDEATH")
            view = View(self, host.told())
            self.assertEqual(view.death, view.born)
            self.assertEqual(death["qos"], 1)
            self.assertEqual({one["qos"] for one in host.told() if one["kind"] != "NDEATH"}, {0})

    def follow(self, program, host):
        """A write of the host, and what is read of a value that moves."""
        host.command("spBv1.0/hall/DCMD/box/press", name="level", type="Double", value=21.5)
        latest = lambda name: View(self, host.told()).values[("press", name)][-1]
        until(lambda: latest("level")[0] == 21.5
              and latest("level")[2]["properties"]["Quality"]["value"] == 192)
        self.assertEqual(program.values("/api/v1/stations/press/devices/UW100"), [215])
        host.command("spBv1.0/hall/DCMD/box/press", name="level", type="Double", value=500.0)
        until(lambda: 'panelgate_mqtt_writes_total{outcome="refused"} 1\n' in program.get("/metrics")[1])
        with Truth(program, "ramp") as truth:
            until(lambda: len(changes(truth.values)) > 20)
        last = truth.values[-1]
        until(lambda: last in [one[0] for one in View(self, host.told()).values[("press", "ramp")]])
        seen = changes([one[0] for one in View(self, host.told()).values[("press", "ramp")] if one[0] is not None])
        read = changes(truth.values)
        end = len(seen) - seen[::-1].index(last)
        self.assertEqual(seen[end - len(read):end], read)

    def dies(self, program, host):
        self.assertEqual(program.rest("PUT", "/api/v1/simulator/press", {"dead": True})[0], 200)
        host.wait_for("DDEATH", "press")
        self.assertNotIn("press", View(self, host.told()).alive)
        self.assertEqual(program.rest("PUT", "/api/v1/simulator/press", {})[0], 200)
        host.wait_for("DBIRTH", "press", 2)

    def test_what_waited_while_the_broker_was_away_is_history(self):
        with Broker() as broker, Host(broker) as host, \
                harness.configured(plant(broker, more=SPARKPLUG)) as program:
            host.wait_for("DBIRTH", "press")
            with Truth(program, "ramp") as truth:
                for restart in range(3):
                    broker.stop()
                    stored = metric(program, "stored")
                    until(lambda: metric(program, "stored") > stored + 10)
                    broker.start()
                    until(lambda: metric(program, "reconnects_total") == restart + 1)
                    host.out.wait_for('"ready"', restart + 2)
            last = truth.values[-1]
            key = ("press", "ramp")
            until(lambda: last in [one[0] for one in View(self, host.told()).values.get(key, [])])
            view = View(self, host.told())
            by_time = sorted({(time, value) for value, time, _ in view.values[key] + view.history[key]
                              if value is not None})
            told = changes([value for _, value in by_time])
            read = changes(truth.values)
            read, told = read[:read.index(last) + 1], told[:told.index(last) + 1]
            self.assertGreater(len(view.history[key]), 20)
            self.assertEqual(told[-len(read):], read)
            self.assertEqual(metric(program, "dropped_total"), 0)
            times = [time for _, time, _ in view.history[key]]
            self.assertEqual(times, sorted(times))


if __name__ == "__main__":
    unittest.main()
