"""Values at a real broker, and writes by way of it: mosquitto, listened to by paho."""
import contextlib
import json
import pathlib
import re
import shutil
import signal
import sqlite3
import subprocess
import tempfile
import unittest

import config
import harness
from mqtt_side import (BROKER, Broker, Chatty, COUNTER, Listener, LOCKED, PRESS, Rude, TOPIC, Truth, changes,
                       first_told, flood, metric, paho, plant, Strict)
from test_points import until


def kept(folder):
    """How many changes the store keeps for the broker."""
    try:
        with contextlib.closing(sqlite3.connect(f"file:{folder}/state.db?mode=ro", uri=True)) as store:
            return store.execute("SELECT count(*) FROM kept WHERE key LIKE 'mqtt/%'").fetchone()[0]
    except sqlite3.OperationalError:  # the file is being made
        return 0


def refused_writes(program):
    said = program.get("/metrics")[1]
    return float(re.search(r'panelgate_mqtt_writes_total{outcome="refused"} (\S+)', said).group(1))


@unittest.skipUnless(BROKER and paho, "needs Debian's mosquitto and python3-paho-mqtt "
                                      "(deploy/install_packages.sh test)")
class Mqtt(unittest.TestCase):
    def test_a_broker_that_writes_all_the_time_hears_the_last_word(self):
        with Chatty() as broker, harness.configured(plant(broker)) as program:
            broker.take()
            program.log.wait_for("mqtt connected")
            program.process.send_signal(signal.SIGTERM)
            well, said = broker.write_until_it_ends()
            broker.close()
            program.wait()
        self.assertTrue(well)
        self.assertRegex(said, rb'"state":"offline","time":.*\xe0\x00$')  # DISCONNECT

    def test_a_broker_that_ends_each_connection_is_tried_ever_more_seldom(self):
        with Rude() as broker, harness.configured(plant(broker)) as program:
            first, _, third = broker.pauses(3)[:3]
            program.log.wait_for("mqtt sessions end at once .*is another client connected as gateway")
        self.assertGreater(third, 2 * first)

    def test_values_are_there_for_who_comes_later(self):
        with Broker() as broker, harness.configured(plant(broker)) as program:
            program.log.wait_for("mqtt connected")
            until(lambda: metric(program, "stored") == 0 and metric(program, "published_total") > 5)
            program.rest("PUT", "/api/v1/stations/press/points/level", {"value": 21.5})
            with Listener(broker) as listener:
                level = listener.wait_for(f"{TOPIC}/press/level", lambda body: (
                    (body["value"], body["quality"]) == (21.5, "good")))
                self.assertEqual(level["unit"], "celsius")
                self.assertRegex(level["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z$")
                mode = listener.wait_for(f"{TOPIC}/press/mode")
                self.assertEqual((mode["value"], mode["label"]), (0, "stopped"))
                self.assertEqual(listener.wait_for(f"{TOPIC}/status")["state"], "online")
                self.assertEqual(listener.wait_for(f"{TOPIC}/line/floor1/state")["state"], "up")
                listener.wait_for(f"{TOPIC}/station/press/state",
                                  lambda body: body["state"] == "online")
            self.assertEqual(metric(program, "connected"), 1)
            self.assertEqual(metric(program, "dropped_total"), 0)

    def test_the_broker_tells_of_a_death_and_the_gateway_of_its_end(self):
        with Broker() as broker, Listener(broker) as listener:
            status = f"{TOPIC}/status"
            with harness.configured(plant(broker)) as program:
                listener.wait_for(status, lambda body: body["state"] == "online")
                program.ends_with = -signal.SIGKILL
                program.stop(signal.SIGKILL)
            dead = listener.wait_for(status, lambda body: body["state"] == "offline")
            self.assertNotIn("time", dead)
            with harness.configured(plant(broker)):
                listener.wait_for(status, lambda body: body["state"] == "online", after=2)
            self.assertIn("time", listener.wait_for(
                status, lambda body: body["state"] == "offline", after=3))
            with Listener(broker) as later:
                self.assertEqual(later.wait_for(status)["state"], "offline")

    def test_a_panel_that_dies_turns_stale_and_bad(self):
        with Broker() as broker, Listener(broker) as listener, \
                harness.configured(plant(broker)) as program:
            ramp = f"{TOPIC}/press/ramp"
            listener.wait_for(ramp, lambda body: body["quality"] == "good")
            self.assertEqual(program.rest("PUT", "/api/v1/simulator/press", {"dead": True})[0], 200)
            stale = listener.wait_for(ramp, lambda body: body["quality"] == "stale")
            self.assertIsNotNone(stale["value"])
            listener.wait_for(f"{TOPIC}/station/press/state",
                              lambda body: body["state"] == "offline")
            bad = listener.wait_for(ramp, lambda body: body["quality"] == "bad" and body["time"] > stale["time"])
            self.assertIsNone(bad["value"])
            told = len(listener.of(ramp))
            self.assertEqual(program.rest("PUT", "/api/v1/simulator/press", {})[0], 200)
            listener.wait_for(ramp, lambda body: body["quality"] == "good", after=told)

    def test_writes_and_refused_writes(self):
        box = tempfile.TemporaryDirectory()
        self.addCleanup(box.cleanup)
        audit = pathlib.Path(box.name) / "audit.jsonl"
        with Broker() as broker, Listener(broker) as listener:
            text = plant(broker, PRESS, LOCKED, more=", write: points") + f"audit: {{file: {audit}}}\n"
            with harness.configured(text) as program:
                program.log.wait_for("mqtt connected")
                broker.log.wait_for(r"gateway 0 plant/hall/\+/\+/set")
                self.write(listener, "press/level", b"21.5", {"ok": True, "value": 21.5})
                listener.wait_for(f"{TOPIC}/press/level", lambda body: body["value"] == 21.5)
                self.write(listener, "press/mode", b'{"value": "running", "id": [7]}',
                           {"ok": True, "value": 1, "label": "running", "id": [7]})
                for place, payload, said in (
                        ("press/level", b"400.5", "level must be at most 400"),
                        ("press/level", b"21.55", "the nearest that it can be are 21.5 and 21.6"),
                        ("press/ramp", b"1", "ramp is not writable"),
                        ("locked/level", b"1", "station 'locked' is read-only"),
                        ("press/level", b"{", "not JSON"),
                        ("press/level", b'{"val": 1}', "the members are value and id, not val"),
                        ("press/nobody", b"1", "there is no such point")):
                    body = self.write(listener, place, payload, {"ok": False})
                    self.assertIn(said, body["detail"])
                self.assertEqual(program.values("/api/v1/stations/press/devices/UW100"), [215])
                metrics = program.get("/metrics")[1]
                self.assertIn('panelgate_mqtt_writes_total{outcome="ok"} 2\n', metrics)
                self.assertIn('panelgate_mqtt_writes_total{outcome="refused"} 7\n', metrics)
            kept = [json.loads(line) for line in audit.read_text().splitlines()]
            refused = [one for one in kept if one.get("outcome") == "refused" and one["kind"] != "repeats"]
            refused_again = sum(one["count"] for one in kept if one["kind"] == "repeats")
            self.assertEqual(len(refused) + refused_again, 7, kept)
            self.assertTrue(all(one["face"] == "mqtt" for one in refused))
            self.assertIn(("press", "UW100"), [(one.get("station"), one.get("at")) for one in refused])
            listener.publish(f"{TOPIC}/press/level/set", b"33", retain=True)
            with harness.configured(text) as program:
                said = listener.wait_for(f"{TOPIC}/press/level/set/result",
                                         lambda body: "retained" in body.get("detail", ""))
                self.assertFalse(said["ok"])

    def write(self, listener, place, payload, expected):
        result = f"{TOPIC}/{place}/set/result"
        before = len(listener.of(result))
        listener.publish(f"{TOPIC}/{place}/set", payload)
        body = listener.wait_for(result, after=before)
        self.assertEqual({name: body.get(name) for name in expected}, expected, body)
        return body

    def test_a_retained_message_of_100_MB_is_never_held(self):
        with Broker() as broker, Listener(broker, topic="nothing") as listener:
            listener.publish(f"{TOPIC}/x/y/set", bytes(100_000_000), retain=True)
            with harness.configured(plant(broker, more=", write: points")) as program:
                broker.log.wait_for("too large outgoing PUBLISH for gateway")
                with Listener(broker) as other:
                    self.write(other, "press/level", b"21.5", {"ok": True, "value": 21.5})
                    body = self.write(other, "press/level", b"1" * 5000, {"ok": False})
                    self.assertIn("a write has at most 4096 bytes", body["detail"])
                status = pathlib.Path(f"/proc/{program.process.pid}/status").read_text()
            peak = int(re.search(r"VmHWM:\s+(\d+) kB", status).group(1))
            if not harness.SANITIZED:
                self.assertLess(peak, 64_000, "kB")

    def test_messages_for_writes_have_a_rate_for_all(self):
        with Broker() as broker, Listener(broker) as listener, \
                harness.configured(plant(broker, more=", write: points")) as program:
            broker.log.wait_for(r"gateway 0 plant/hall/\+/\+/set")
            flood(broker, f"{TOPIC}/x/y/set", b"1", 5000)
            program.log.wait_for('warn mqtt messages left out .*why="more than 1000 a second"')
            until(lambda: refused_writes(program) >= 5000)
            results = f"{TOPIC}/x/y/set/result"
            self.assertLess(len(listener.of(results)), 4000)

            def is_written():
                listener.publish(f"{TOPIC}/press/level/set", b"21.5")
                return any(one["ok"] for one in listener.of(f"{TOPIC}/press/level/set/result"))
            until(is_written)  # in the next second

    def test_a_subscription_that_the_broker_refuses_is_told_and_why_it_ends_a_connection(self):
        for newest, version in ((5, "5"), (4, "3.1.1")):
            with Strict(newest) as broker, \
                    harness.configured(plant(broker, more=", write: points")) as program:
                program.log.wait_for(f"mqtt connected .*protocol={version}$")
                program.log.wait_for(r"warn mqtt subscription refused .*topic=plant/hall/\+/\+/set why=")
                if newest == 5:
                    program.log.wait_for("mqtt not connected .*the broker ends it: Session taken over")
                else:
                    program.log.wait_for("warn mqtt messages of any size .*message_size_limit")

    def test_nobody_writes_unless_the_configuration_says_so(self):
        with Broker() as broker, harness.configured(plant(broker)) as program:
            program.log.wait_for("mqtt connected")
            until(lambda: metric(program, "published_total") > 5)
            self.assertNotIn("SUBSCRIBE", broker.log.text())

    def test_a_broker_that_restarts_twenty_times_gets_everything_in_order(self):
        with Broker() as broker, Listener(broker, f"{TOPIC}/press/#", name="witness") as listener, \
                harness.configured(plant(broker)) as program:
            with Truth(program, "ramp") as truth:
                listener.wait_for(f"{TOPIC}/press/ramp", lambda body: body["quality"] == "good")
                for restart in range(20):
                    broker.restart()
                    until(lambda: metric(program, "reconnects_total") == restart + 1)
                last = truth.values[-1]
                listener.wait_for(f"{TOPIC}/press/ramp", lambda body: body["value"] == last)
                self.in_order(listener.of(f"{TOPIC}/press/ramp"), truth.values, last)
            self.assertEqual(metric(program, "reconnects_total"), 20)
            self.assertEqual(metric(program, "dropped_total"), 0)

    def in_order(self, messages, truth, last):
        """Each value that was read, in the order in which it was read."""
        told = changes([body["value"] for body in first_told(messages)
                        if body["value"] is not None])
        read = changes(truth)
        read = read[:len(read) - read[::-1].index(last)]
        told = told[:len(told) - told[::-1].index(last)]
        self.assertGreater(len(read), 50)
        self.assertEqual(told[-len(read):], read)

    def test_of_what_does_not_fit_the_oldest_goes_and_is_counted(self):
        with Broker() as broker, Listener(broker, f"{TOPIC}/press/ramp", name="witness") as listener, \
                harness.configured(plant(broker, COUNTER, more=", store: 100")) as program:
            with Truth(program, "ramp") as truth:
                ramp = f"{TOPIC}/press/ramp"
                listener.wait_for(ramp, lambda body: body["quality"] == "good")
                until(lambda: metric(program, "stored") == 0)
                broker.stop()
                until(lambda: metric(program, "dropped_total") > 20)
                broker.start()
                program.log.wait_for("mqtt connected", 2)
                until(lambda: metric(program, "stored") == 0)
                dropped = metric(program, "dropped_total")
                last = truth.values[-1]
                listener.wait_for(ramp, lambda body: body["value"] == last)
                told = changes([(body["value"], body["quality"])
                                for body in first_told(listener.of(ramp))])
                read = changes(truth.states)
                flips = truth.flips
            end = (last, "good")
            told, read = told[:told.index(end) + 1], read[:read.index(end) + 1]
            told = told[told.index(read[0]):]  # the events were listened to later
            # What is on its way to the broker stays when the store is full; what is next goes.
            rest = iter(read)
            self.assertTrue(all(state in rest for state in told), (told, read))
            self.assertEqual(told[-30:], read[-30:])
            # A panel that is late on a busy machine is suspect: its status waits in the store, too.
            missing = len(read) - len(told)
            self.assertTrue(missing <= dropped <= missing + flips, (missing, dropped, flips))


@unittest.skipUnless(BROKER and paho, "needs Debian's mosquitto and python3-paho-mqtt "
                                      "(deploy/install_packages.sh test)")
class Configuration(unittest.TestCase):
    def test_an_alarm_is_a_retained_message_and_outlives_a_restart(self):
        with Broker() as broker, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, PRESS) + f"store: {{file: {folder}/state.db}}\n"
                            "alarms: [{name: gone, station: press, offline: true, severity: low}]\n")
            topic = f"{TOPIC}/alarm/gone"
            with harness.Program("run", "-c", str(file)) as program, Listener(broker) as listener:
                self.assertIsNone(listener.wait_for(topic, lambda body: body["state"] == "normal")["since"])
                program.rest("PUT", "/api/v1/simulator/press", {"dead": 1})
                told = listener.wait_for(topic, lambda body: body["state"] == "active")
                self.assertEqual((told["severity"], told["text"], told["acknowledged_by"]), ("low", "gone", None))
                self.assertEqual(program.rest("POST", "/api/v1/alarms/gone/acknowledge")[0], 200)
                listener.wait_for(topic, lambda body: body["state"] == "acknowledged")
            with Listener(broker) as late:
                self.assertEqual(late.wait_for(topic)["state"], "acknowledged")
                with harness.Program("run", "-c", str(file)):
                    late.wait_for(topic, lambda body: body["state"] == "normal")
                    self.assertEqual({body["state"] for body in late.of(topic)}, {"acknowledged", "normal"})

    def test_what_waits_for_the_broker_outlives_the_program_and_is_sent_once(self):
        with Broker() as broker, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, COUNTER) + f"store: {{file: {folder}/state.db}}\n")
            with Listener(broker):  # it serves: it heeds a signal
                pass
            broker.stop()
            waited = 0
            for _ in range(2):  # the second program adds to what the first one has left
                with harness.Program("run", "-c", str(file)) as program:
                    until(lambda: kept(folder) > waited + 30)  # pylint: disable=cell-var-from-loop
                    waited = kept(folder)
                    program.ends_with = -signal.SIGKILL
                    program.stop(signal.SIGKILL)
            broker.start()
            with Listener(broker) as listener, harness.Program("run", "-c", str(file)) as program:
                listener.wait_for(f"{TOPIC}/press/ramp", after=waited)
                times = [body["time"] for body in listener.of(f"{TOPIC}/press/ramp") if body["quality"] == "good"]
                self.assertEqual(times, sorted(times))
                until(lambda: kept(folder) == 0)
                self.assertEqual(metric(program, "dropped_total"), 0)

    def test_home_assistant_finds_points_whose_topics_are_there_and_forgets_those_that_go(self):
        points = ["{name: level, at: UW200, unit: celsius}", "{name: valve, at: UB2100, writable: true}"]
        station = "{{id: 31, name: press, profile: autonics-gplp-s, points: [{}]}}"
        found = f"homeassistant/device/{TOPIC.replace('/', '_')}_press/config"
        more = ", write: points, home_assistant: true"
        with Broker() as broker, tempfile.TemporaryDirectory() as folder, Listener(broker, "#") as listener:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, station.format(", ".join(points)), more=more))
            with harness.Program("run", "-c", str(file)) as program:
                told = listener.wait_for(found)
                self.assertEqual({name: one["p"] for name, one in told["cmps"].items()},
                                 {"level": "sensor", "valve": "switch"})
                self.assertEqual(told["cmps"]["level"]["unit_of_measurement"], "°C")
                for one in told["cmps"].values():
                    for place in one["availability"] + [{"topic": one["state_topic"]}]:
                        listener.wait_for(place["topic"])
                valve = told["cmps"]["valve"]
                listener.publish(valve["command_topic"], valve["payload_on"])
                listener.wait_for(valve["state_topic"], lambda body: body["value"] is True)
                file.write_text(plant(broker, station.format(points[0]), more=more))
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                self.assertEqual(listener.wait_for(found, lambda body: body["cmps"].get("valve", {}) == {"p": "switch"})
                                 ["cmps"]["level"]["p"], "sensor")
                listener.wait_for(found, lambda body: list(body["cmps"]) == ["level"], after=1)

    def test_a_reload_keeps_the_connection_or_what_waits(self):
        with Broker() as broker, Listener(broker) as listener, tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(plant(broker, COUNTER))
            with harness.Program("run", "-c", str(file)) as program:
                listener.wait_for(f"{TOPIC}/press/ramp", lambda body: body["quality"] == "good")
                file.write_text(plant(broker, COUNTER.replace("100ms", "110ms")))
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                told = len(listener.of(f"{TOPIC}/press/ramp"))
                listener.wait_for(f"{TOPIC}/press/ramp", after=told + 5)
                self.assertEqual([body["state"] for body in listener.of(f"{TOPIC}/status")], ["online"])
                broker.stop()
                until(lambda: metric(program, "stored") > 10)
                file.write_text(plant(broker, PRESS))
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                self.assertGreater(metric(program, "stored"), 10)
                broker.start()
                with Listener(broker) as later:
                    later.wait_for(f"{TOPIC}/press/mode")
                file.write_text(config.gateway(config.line(), http=config.ADMIN, modbus=None))
                self.assertEqual(program.rest("POST", "/api/v1/reload")[0], 200)
                with Listener(broker) as later:
                    later.wait_for(f"{TOPIC}/status", lambda body: body["state"] == "offline")
                self.assertNotIn("panelgate_mqtt", program.get("/metrics")[1])

    @unittest.skipUnless(shutil.which("openssl") and shutil.which("mosquitto_passwd"), "needs openssl")
    def test_tls_and_a_password(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            for name in ("right", "wrong"):
                self.certify(here, name)
            (here / "password").write_text("open sesame\n")
            subprocess.run(["mosquitto_passwd", "-b", "-c", here / "users", "box", "open sesame"],
                           check=True, capture_output=True)
            secure = (f"certfile {here}/right.pem\nkeyfile {here}/right.key\n"
                      f"allow_anonymous false\npassword_file {here}/users\n")
            with Broker(secure) as broker:
                self.connects(broker, f", ca: {here}/right.pem, username: box, password_file: {here}/password",
                              "mqtt connected broker=mqtts://localhost")
                self.connects(broker, f", ca: {here}/wrong.pem, username: box, password_file: {here}/password",
                              "mqtt not connected .*TLS")
                self.connects(broker, f", ca: {here}/right.pem", "mqtt not connected .*the broker refuses")
                self.connects(broker, f", tls: {{ca: {here}/right.pem}}, username: box, password_file: "
                              f"{here}/password", "mqtt connected broker=mqtts://localhost")

    def mutual(self, here):
        """What a broker has that knows its clients by their certificates; makes a right and a wrong one."""
        for name in ("right", "wrong"):
            self.certify(here, name)
        return (f"certfile {here}/right.pem\nkeyfile {here}/right.key\ncafile {here}/right.pem\n"
                "require_certificate true\nallow_anonymous true\n")

    @unittest.skipUnless(shutil.which("openssl"), "needs openssl")
    def test_the_broker_knows_the_gateway_by_its_certificate(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            mutual = self.mutual(here)
            with Broker(mutual) as broker:
                for name, said in (("right", "mqtt connected"), ("wrong", "mqtt not connected")):
                    self.connects(broker, f", tls: {{ca: {here}/right.pem, certificate: {here}/{name}.pem, "
                                  f"key: {here}/{name}.key}}", said)

    def test_its_new_certificate_is_for_the_next_connection_and_a_bad_one_is_kept_back(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            mutual = self.mutual(here)
            for end in ("pem", "key"):
                shutil.copy(here / f"wrong.{end}", here / f"own.{end}")
            with Broker(mutual) as broker:
                text = plant(broker, more=f", tls: {{ca: {here}/right.pem, certificate: {here}/own.pem, "
                             f"key: {here}/own.key}}").replace(f"mqtt://127.0.0.1:{broker.port}",
                                                               f"mqtts://localhost:{broker.port}")
                with harness.configured(text) as program:
                    program.log.wait_for("mqtt not connected .*TLS: the broker ends it: ")
                    shutil.copy(here / "right.key", here / "own.key")
                    program.log.wait_for("certificate not renewed listener=.mqtt mqtts://localhost:.*"
                                         "does not belong to the certificate")
                    shutil.copy(here / "right.pem", here / "own.pem")
                    program.log.wait_for("certificate renewed listener=.mqtt mqtts://localhost:.* "
                                         "files=.certificate, key. subject=.CN=localhost.")
                    program.log.wait_for("mqtt connected broker=mqtts://localhost")
                    self.assertRegex(program.get("/metrics")[1],
                                     r'panelgate_certificate_expiry_timestamp_seconds\{listener="mqtts://localhost:')

    def test_the_log_says_what_is_wrong_with_the_brokers_certificate(self):
        with tempfile.TemporaryDirectory() as folder:
            here = pathlib.Path(folder)
            for name in ("right", "wrong"):
                self.certify(here, name)
            (here / "none.pem").write_text("nothing")
            with Broker(f"certfile {here}/right.pem\nkeyfile {here}/right.key\nallow_anonymous true\n") as broker:
                for ca, why in (("wrong", "its certificate CN=localhost is not signed by the CA of `ca`"),
                                ("none", "none.pem holds no certificate")):
                    self.connects(broker, f", tls: {{ca: {here}/{ca}.pem}}", f"mqtt not connected .*{why}")

    def connects(self, broker, more, said):
        text = plant(broker, more=more).replace(f"mqtt://127.0.0.1:{broker.port}",
                                                f"mqtts://localhost:{broker.port}")
        with harness.configured(text) as program:
            program.log.wait_for(said)

    def certify(self, folder, name):
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2",
                        "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
                        "-keyout", folder / f"{name}.key", "-out", folder / f"{name}.pem"],
                       check=True, capture_output=True)


if __name__ == "__main__":
    unittest.main()
