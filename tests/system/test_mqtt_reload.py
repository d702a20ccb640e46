"""What becomes of writes and of retained messages at a broker while the configuration changes."""
import pathlib
import tempfile
import time
import unittest

import harness
from mqtt_side import (BROKER, Broker, COUNTER, FAST, Listener, LOCKED, metric, paho, plant, PRESS,
                       TOPIC)
from test_points import until


@unittest.skipUnless(BROKER and paho, "needs Debian's mosquitto and python3-paho-mqtt "
                                      "(deploy/install_packages.sh test)")
class Reload(unittest.TestCase):
    def test_P3_a_write_under_way_is_answered_once_whatever_is_reloaded(self):
        slow = {**FAST, "timing": "{response_timeout: 4s}", "queue": "{deadline: 9s}"}
        with Broker() as broker:
            self.overtaken(broker, slow, plant(broker, PRESS, LOCKED, more=", write: points", line=slow))
            self.overtaken(broker, slow, plant(broker, more=", write: points", line={**slow, "name": "hall"}))

    def overtaken(self, broker, slow, later):
        """A write that a reload of this text overtakes, and one behind it."""
        result = f"{TOPIC}/press/level/set/result"
        with Listener(broker) as listener, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, more=", write: points", line=slow))
            with harness.Program("run", "-c", str(file)) as program:
                listener.wait_for(f"{TOPIC}/press/level", lambda body: body["quality"] == "good")
                program.rest("PUT", "/api/v1/simulator/press", {"late": 1, "late_by_ms": 1000})
                listener.publish(f"{TOPIC}/press/level/set", b'{"value": 21.5, "id": 1}')
                until(lambda: "mqtt" in [one["name"] for one in
                                         program.get("/api/v1/lines/floor1")[1]["clients"]])
                file.write_text(later)
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                listener.wait_for(result)
                program.rest("PUT", "/api/v1/simulator/press", {})
                program.log.wait_for("mqtt connected", 2)
                listener.publish(f"{TOPIC}/press/level/set", b'{"value": 22, "id": 2}')
                listener.wait_for(result, lambda body: body["id"] == 2)
                self.assertEqual([body["id"] for body in listener.of(result)], [1, 2])

    def test_P10_what_is_configured_no_more_does_not_stay_at_the_broker(self):
        with Broker() as broker, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, PRESS))
            with harness.Program("run", "-c", str(file)) as program:
                self.assertEqual(self.kept(broker, f"{TOPIC}/press/ramp"),
                                 {"line/floor1/state", "press/level", "press/mode", "press/ramp",
                                  "station/press/state", "status"})
                file.write_text(plant(broker, COUNTER.replace("press", "mill")))
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                self.assertEqual(self.kept(broker, f"{TOPIC}/mill/ramp"),
                                 {"line/floor1/state", "mill/ramp", "station/mill/state", "status"})
                file.write_text(plant(broker, COUNTER).replace(TOPIC, "yard"))
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                self.assertEqual(self.kept(broker, "yard/press/ramp"), set())

    def test_another_order_of_points_and_stations_keeps_the_session(self):
        swapped = PRESS.replace("{name: level", "{name: ramp, at: UW201, every: 20ms},\n      {name: level", 1)
        swapped = swapped.replace(",\n      {name: ramp, at: UW201, every: 20ms}]", "]")
        with Broker() as broker, Listener(broker) as listener, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, PRESS, LOCKED))
            with harness.Program("run", "-c", str(file)) as program:
                ramps = lambda: listener.of(f"{TOPIC}/press/ramp")
                until(lambda: len(ramps()) > 3)
                program.rest("PUT", "/api/v1/simulator/press", {"late": 1, "late_by_ms": 1})
                file.write_text(plant(broker, LOCKED, swapped) + "log: {level: debug}\n")
                self.assertEqual(program.rest("POST", "/api/v1/reload")[1]["changes"], ["log: level info -> debug"])
                before = len(ramps())
                until(lambda: len(ramps()) > before + 3)  # its values still go to its topic
                self.assertEqual(program.log.text().count(" mqtt connected"), 1)
                self.assertEqual(program.get("/api/v1/simulator/press")[1]["faults"]["late"], 1, "another panel")
                self.assertEqual(listener.of(f"{TOPIC}/press/level")[-1]["value"],
                                 program.get("/api/v1/stations/press/points/level")[1]["value"])

    def kept(self, broker, known):
        """What is retained below TOPIC once this is known there."""
        with Listener(broker) as listener:
            listener.wait_for(known, lambda body: body["quality"] == "good")
        with Listener(broker) as later:
            later.publish("end", b"0")
            later.wait_for("end")
            return {name[len(TOPIC) + 1:] for name, _, retained in later.received
                    if retained and name.startswith(TOPIC + "/")}

    def test_rebirths_that_come_together_are_one(self):
        sparkplug = ", format: sparkplug, group: hall, node: box"
        command = b"\x12\x1a\x0a\x14Node Control/Rebirth\x20\x0b\x70\x01"
        with Broker() as broker, Listener(broker) as listener, \
                harness.configured(plant(broker, more=sparkplug)) as program:
            broker.log.wait_for(r"gateway 0 spBv1.0/hall/NCMD/box")
            births = lambda: sum("/NBIRTH/" in name for name, _, _ in listener.received)
            until(lambda: births() == 1)
            begun = time.monotonic()
            for _ in range(500):
                listener.publish("spBv1.0/hall/NCMD/box", command)
            until(lambda: births() >= 3)  # the first, and one of those that joined
            listener.publish("end", b"0")
            listener.wait_for("end")
            self.assertLessEqual(births(), 3 + (time.monotonic() - begun))
            self.assertEqual(metric(program, "connected"), 1)


if __name__ == "__main__":
    unittest.main()
