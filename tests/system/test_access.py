"""Who may do what: rules of access over all faces, and what a viewer of one station sees."""
import contextlib
import json
import pathlib
import subprocess
import tempfile
import threading
import unittest

import config
import harness
import mqtt_side
from harness import read_registers, write_register
from openapi import Document
from rest_plant import ask, tokens
from test_points import until

STATIONS = """
      {id: 31, name: press, profile: autonics-gplp-s, points: [
        {name: warmth, at: UW200, every: 50ms}, {name: mode, at: UW105, writable: true, every: 50ms}]},
      {id: 20, name: oven, profile: panasonic-gt, points: [
        {name: secret-heat, at: GDT100, every: 50ms}, {name: hidden-mode, at: GDT101, writable: true, every: 50ms}]}"""
RULES = """{default: allow, rules: [
  {name: eye-sees-press, allow: [read], tokens: [eye], stations: [press]},
  {name: eye-sees-no-more, deny: [read, write, broadcast, raw], tokens: [eye]},
  {name: setpoints, allow: [write], faces: [modbus_tcp], stations: [press], range: UW100-UW109},
  {name: no-modbus-writes, deny: [write, broadcast], faces: [modbus_tcp]},
  {name: nobody-broadcasts, deny: [broadcast], roles: [engineer]}]}"""
# Names, ids and places of what the viewer may not see.
OTHERS = ("oven", "secret-heat", "hidden-mode", "GDT", "panasonic")
ILLEGAL = b"\x01"


@contextlib.contextmanager
def plant(rules=RULES, roles=None, **more):
    with tempfile.TemporaryDirectory() as folder:
        door = config.ADMIN + f", tokens: {tokens(folder, roles or {'eye': 'viewer', 'lab': 'engineer'})}"
        text = config.gateway(config.line(stations=STATIONS.strip()), http=door, access=rules, **more)
        file = pathlib.Path(folder) / "panelgate.yaml"
        file.write_text(text)
        with harness.Program("run", "-c", str(file)) as program:
            program.file = file
            program.http_port()  # the last that it opens
            until(lambda: ask(program, "GET", "/api/v1/stations/oven/points/secret-heat")[1].find('"good"') > 0)
            yield program


def frames(program):
    """What has been sent for clients."""
    transactions = program.get("/api/v1/lines/floor1/trace?last=500")[1]["transactions"]
    return [one for one in transactions if one["reason"] in ("write", "broadcast", "read")]


class Rules(unittest.TestCase):
    def test_a_refused_request_is_01_or_403_with_the_rule_counted_logged_and_never_sent(self):
        with plant() as program, program.client() as client:
            before = len(frames(program))
            refused = (write_register(110, 7), bytes.fromhex("10 0069 0006 0C") + bytes(12),
                       bytes.fromhex("17 0000 0001 006E 0001 02 0001"), bytes.fromhex("05 06E0 FF00"))
            for pdu in refused:
                self.assertEqual(client.ask(31, pdu), bytes([pdu[0] | 0x80]) + ILLEGAL, pdu.hex())
            self.assertEqual(client.ask(20, write_register(100, 1)), b"\x86" + ILLEGAL, "another station")
            self.assertEqual(client.ask(0, write_register(105, 1)), b"\x86" + ILLEGAL, "a broadcast")
            self.assertEqual(len(frames(program)), before, "nothing of it was sent")
            status, text = ask(program, "POST", "/api/v1/lines/floor1/broadcast", "lab",
                               {"table": "holding-registers", "address": 100, "values": [1]})
            self.assertEqual((status, json.loads(text)["rule"]), (403, "nobody-broadcasts"))
            self.assertFalse(json.loads(text)["transmitted"])
            self.assertEqual(len(frames(program)), before)
            metrics = ask(program, "GET", "/metrics")[1]
            self.assertIn('panelgate_access_denied_total{rule="no-modbus-writes"} 6', metrics)
            self.assertIn('panelgate_access_denied_total{rule="nobody-broadcasts"} 1', metrics)
            self.assertIn('panelgate_access_denied_total{rule="default"} 0', metrics)
        self.assertIn("rule=no-modbus-writes", program.log.text())

    def test_what_is_allowed_passes_by_the_same_rules(self):
        with plant() as program, program.client() as client:
            self.assertEqual(client.ask(31, write_register(105, 7))[0], 6)
            self.assertEqual(client.ask(20, read_registers(100))[0], 3)
            self.assertEqual(ask(program, "PUT", "/api/v1/stations/press/points/mode", "lab", {"value": 3})[0], 200)
            self.assertEqual(ask(program, "PUT", "/api/v1/stations/oven/points/hidden-mode", None, {"value": 3})[0], 200)

    def test_nobody_is_answered_from_anothers_read(self):
        with plant() as program:
            def read(token, statuses):
                for _ in range(30):
                    statuses.append(ask(program, "GET", "/api/v1/stations/oven/devices/GDT100", token)[0])
            may, may_not = [], []
            threads = [threading.Thread(target=read, args=("lab", may)), threading.Thread(target=read, args=("eye", may_not))]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual((set(may), set(may_not)), ({200}, {403}))
            items = {"items": [{"point": "press/warmth"}, {"station": "oven", "device": "GDT100"}, {"point": "oven/secret-heat"}]}
            answer = json.loads(ask(program, "POST", "/api/v1/read", "eye", items)[1])
            self.assertEqual([one["status"] for one in answer["results"]], [200, 403, 403], answer)


class Viewer(unittest.TestCase):
    """Of one station of two."""

    def test_no_path_of_the_document_shows_another_station(self):
        with plant() as program:
            document = Document(json.loads(ask(program, "GET", "/openapi.json")[1]))
            values = {"line": "floor1", "station": "oven", "point": "secret-heat", "table": "holding-registers",
                      "address": "100", "notation": "GDT100", "incident": "1", "id": "1"}
            asked = 0
            for (verb, pattern), operation in document.operations().items():
                if pattern.startswith(("/docs", "/page", "/openapi.json")) or pattern in ("/", "/api/v1/events"):
                    continue  # they hold no data; events have a test of their own
                path = "/".join(values.get(part[1:-1], "1") if part.startswith("{") else part for part in pattern.split("/"))
                for suffix in ("", "?last=500") if pattern.endswith("trace") else ("",):
                    status, text = ask(program, verb, path + suffix, "eye", {} if verb in ("PUT", "POST") else None)
                    asked += 1
                    if "{station}" in pattern or "{point}" in pattern:
                        self.assertIn(status, (403, 400, 404, 409), (verb, path, text))
                        text = text.replace("'oven'", "").replace("no point", "")  # what it has said itself
                    for word in OTHERS:
                        self.assertNotIn(word, text.replace(path, ""), f"{verb} {path} -> {status}")
            self.assertGreater(asked, 30)

    def test_what_is_wrong_with_a_request_to_a_hidden_station_is_not_told(self):
        entries = ({"point": "oven/hidden-mode", "value": 1e9}, {"point": "oven/secret-heat", "value": 1},
                   {"station": "oven", "device": "UW100", "value": 1}, {"station": "floor1:20", "device": "XY1", "value": 1})
        with plant(roles={"eye": "operator"}) as program:
            asked = [("PUT", f"/api/v1/stations/{one}/{rest}", body) for one in ("oven", "floor1:20")
                     for rest, body in (("points/hidden-mode", {"value": 1e9}), ("points/secret-heat", {"value": 1}),
                                        ("devices/UW100", {"values": [1]}), ("holding-registers/9999", {"values": [1] * 200}))]
            asked += [("GET", f"/api/v1/stations/floor1:20/{rest}", None) for rest in ("devices/UW100", "coils/9?count=9999")]
            asked += [("POST", "/api/v1/write", {"items": [one]}) for one in entries]
            asked += [("POST", "/api/v1/read", {"items": [{"station": "floor1:20", "device": "XY1"}]})]
            for verb, path, body in asked:
                status, text = ask(program, verb, path, "eye", body)
                said = json.loads(text)
                status, said = (said["results"][0]["status"], said["results"][0]) if "results" in said else (status, said)
                self.assertEqual((status, said.get("rule")), (403, "eye-sees-no-more"), (verb, path, body, text))
                said.pop("item", None)
                for word in OTHERS:
                    self.assertNotIn(word, json.dumps(said), (verb, path, body))

    def test_a_relay_is_there_but_not_what_it_writes_to(self):
        with plant(relays="[{from: press/UW100, to: oven/GDT200, every: 50ms}]") as program:
            path = "/api/v1/lines/floor1/trace?last=500"
            def clients(token):
                return {one["client"] for one in json.loads(ask(program, "GET", path, token)[1])["transactions"]}
            until(lambda: any("relay press/UW100 to oven/GDT200" in str(one) for one in clients(None)))
            self.assertTrue(any(str(one).endswith("relay") for one in clients("eye")), clients("eye"))
            seen = ask(program, "GET", path, "eye")[1]
            self.assertIn("relay to station 31", seen)
            self.assertNotIn("oven", seen)

    def test_lists_metrics_and_trace_have_the_one(self):
        with plant() as program:
            names = [one["name"] for one in json.loads(ask(program, "GET", "/api/v1/stations", "eye")[1])["stations"]]
            self.assertEqual(names, ["press"])
            points = json.loads(ask(program, "GET", "/api/v1/points", "eye")[1])["points"]
            self.assertEqual({one["station"] for one in points}, {"press"})
            metrics = ask(program, "GET", "/metrics", "eye")[1]
            self.assertIn('station="press"', metrics)
            self.assertNotIn("oven", metrics)
            self.assertIn("oven", ask(program, "GET", "/metrics")[1])
            settings = json.loads(ask(program, "GET", "/api/v1/configuration", "eye")[1])
            self.assertEqual([one["name"] for one in settings["configuration"]["lines"][0]["stations"]], ["press"])
            self.assertEqual(settings["role"], "viewer")
            self.assertNotIn("oven", json.dumps(settings), "nor its polls")
            trace = json.loads(ask(program, "GET", "/api/v1/lines/floor1/trace?last=200", "eye")[1])
            self.assertEqual({one["station"] for one in trace["transactions"]}, {31, 0})
            for one in trace["transactions"]:
                self.assertEqual(one["request"] == "", one["station"] == 0, "that something was there, not what")
            self.assertLessEqual({one["station"] for one in trace["frames"]}, {31, None})

    def test_denials_of_reads_count_by_the_rule_that_decides_and_are_not_shown_to_him(self):
        with plant() as program:
            status, text = ask(program, "GET", "/api/v1/lines/floor1/discover", "eye")
            self.assertEqual((status, json.loads(text)["rule"]), (403, "eye-sees-no-more"))
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 403)
            self.assertIn('panelgate_access_denied_total{rule="eye-sees-no-more"} 2', ask(program, "GET", "/metrics")[1])
            self.assertNotIn("rule=", ask(program, "GET", "/metrics", "eye")[1])

    def test_the_own_registers_hide_what_may_not_be_read(self):
        hidden = """{rules: [{name: not-the-oven, deny: [read], faces: [modbus_tcp], stations: [oven]}]}"""
        with plant(hidden) as program, program.client() as client:
            registers = lambda unit: client.ask(255, read_registers(1000 + 16 * unit, 4))[2:]
            self.assertEqual(registers(31)[:6], bytes.fromhex("0002 0001 001F"), "online, on the first line, 31")
            self.assertEqual(registers(20), bytes(8))
            self.assertEqual(client.ask(255, bytes.fromhex("02 0014 0001")), bytes.fromhex("02 01 00"))

    def test_an_incident_that_he_sees_in_part_stays_unread(self):
        with plant() as program:
            incidents = "/api/v1/lines/floor1/incidents"
            self.assertEqual(ask(program, "PUT", "/api/v1/simulator/press", "lab", {"dead": 1})[0], 200)
            until(lambda: json.loads(ask(program, "GET", incidents)[1])["incidents"])
            for token, read in (("eye", False), ("lab", True)):
                self.assertEqual(ask(program, "GET", incidents + "/1", token)[0], 200)
                self.assertEqual(json.loads(ask(program, "GET", incidents)[1])["incidents"][0]["read"], read, token)

    def test_events_are_of_the_one(self):
        with plant() as program:
            seen = {}
            for token in ("eye", "lab"):
                command = ["curl", "-sN", "--max-time", "3", "-H", f"Authorization: Bearer token-of-{token}-0123456789",
                           program.url("/api/v1/events")]
                seen[token] = subprocess.run(command, capture_output=True, check=False).stdout.decode()
            self.assertIn("oven", seen["lab"])
            self.assertIn("press", seen["eye"])
            self.assertNotIn("oven", seen["eye"])

    def test_another_file_changes_what_is_seen_and_nobody_loses_a_stream(self):
        with plant() as program:
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 403)
            file = program.file
            file.write_text(file.read_text().replace("tokens: [eye], stations: [press]", "tokens: [eye]"))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 200)
            status, text = ask(program, "POST", "/api/v1/reload", None, {"rollback": True})
            self.assertEqual((status, json.loads(text)["weaker"]), (409, ["access: rule eye-sees-press is another"]))
            self.assertEqual(ask(program, "POST", "/api/v1/reload", None, {"rollback": True, "weaker": True})[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 403)

    def test_a_rollback_over_which_only_a_token_changed_says_so(self):
        with plant() as program:
            self.assertEqual(ask(program, "GET", "/api/v1/lines", "eye")[0], 200)
            file = program.file
            file.write_text(file.read_text().replace("role: viewer, file", "role: viewer, expires: 2020-01-01, file"))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/lines", "eye")[0], 401)
            status, text = ask(program, "POST", "/api/v1/reload", None, {"rollback": True})
            self.assertEqual((status, json.loads(text)["weaker"]), (409, ["http: token eye: expires later"]))
            self.assertEqual(ask(program, "POST", "/api/v1/reload", None, {"rollback": True, "weaker": True})[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/lines", "eye")[0], 200)


@unittest.skipUnless(mqtt_side.BROKER and mqtt_side.paho, "needs mosquitto and python3-paho-mqtt")
class Mqtt(unittest.TestCase):
    def test_publishes_what_a_rule_lets_it_read_and_answers_what_it_denies(self):
        rules = """\naccess: {rules: [
          {name: ramp-is-secret, deny: [read], faces: [mqtt], range: UW201},
          {name: mode-is-fixed, deny: [write], faces: [mqtt], range: UW105}]}\n"""
        with mqtt_side.Broker() as broker, mqtt_side.Listener(broker) as listener:
            with harness.configured(mqtt_side.plant(broker, more=", write: points") + rules) as program:
                topic = f"{mqtt_side.TOPIC}/press"
                listener.wait_for(f"{topic}/level")
                listener.wait_for(f"{topic}/mode")
                listener.publish(f"{topic}/mode/set", b"1")
                said = listener.wait_for(f"{topic}/mode/set/result")
                self.assertEqual((said["ok"], said["status"], said["rule"]), (False, 403, "mode-is-fixed"))
                listener.publish(f"{topic}/level/set", b"33")
                self.assertTrue(listener.wait_for(f"{topic}/level/set/result")["ok"])
                self.assertEqual(listener.of(f"{topic}/ramp"), [])
                self.assertIn('rule="mode-is-fixed"} 1', program.get("/metrics")[1])


OWN_ROLES = """{roles: [{name: setter, rights: [read, write]}, {name: caller, rights: [read, raw]}, {name: keeper, rights: [reload]},
    {name: finder, rights: [discover]}, {name: faker, rights: [simulator]}],
  rules: [{name: setters-leave-the-oven, deny: [write], roles: [setter], stations: [oven]},
    {name: fakers-leave-the-oven, deny: [read], roles: [faker], stations: [oven]}]}"""


class OwnRoles(unittest.TestCase):
    def test_has_what_it_lists_and_no_more(self):
        broadcast = {"table": "holding-registers", "address": 100, "values": [1]}
        asked = (("GET", "/api/v1/stations/press/devices/UW100", None, "setter caller"),
                 ("PUT", "/api/v1/stations/press/devices/UW100", {"values": [1]}, "setter"),
                 ("PUT", "/api/v1/stations/oven/devices/GDT100", {"values": [1]}, ""),
                 ("POST", "/api/v1/lines/floor1/raw", {"station": 31, "pdu": "0300640001"}, "caller"),
                 ("POST", "/api/v1/lines/floor1/raw", {"station": 31, "pdu": "1000640001020001"}, ""),
                 ("POST", "/api/v1/lines/floor1/broadcast", broadcast, ""),
                 ("POST", "/api/v1/lines/floor1/discover", {}, ""),
                 ("PUT", "/api/v1/simulator/press", {"dead": 0}, ""),
                 ("POST", "/api/v1/reload", None, "keeper"))
        with plant(OWN_ROLES, roles={"setter": "setter", "caller": "caller", "keeper": "keeper"}) as program:
            for verb, path, body, who in asked:
                for token in ("setter", "caller", "keeper"):
                    status, text = ask(program, verb, path, token, body)
                    self.assertEqual(status, 200 if token in who.split() else 403, (verb, path, token, text))
            status, text = ask(program, "PUT", "/api/v1/stations/oven/devices/GDT100", "setter", {"values": [1]})
            self.assertEqual(json.loads(text)["rule"], "setters-leave-the-oven")
            status, text = ask(program, "POST", "/api/v1/lines/floor1/raw", "caller", {"station": 31, "pdu": "1000640001020001"})
            self.assertEqual(json.loads(text)["rule"], "caller")
            self.assertIn("the role 'caller' does not have the right write", json.loads(text)["detail"])
            self.assertIn('panelgate_access_denied_total{rule="caller"} 2', ask(program, "GET", "/metrics")[1])
            status, text = ask(program, "POST", "/api/v1/lines/floor1/broadcast", "setter", broadcast)
            self.assertEqual(json.loads(text)["detail"], "this needs the right broadcast, which the role 'setter' does not have")
            said = json.loads(ask(program, "GET", "/api/v1/configuration", "setter")[1])
            self.assertEqual((said["role"], said["rights"]), ("setter", ["read", "write"]))

    def test_a_right_is_enough_for_what_it_names_and_shows_no_more(self):
        rows = (("finder", "POST", "/api/v1/lines/floor1/discover", {"stations": "31"}, 202),
                ("finder", "GET", "/api/v1/lines/floor1/discover", None, 200),
                ("finder", "DELETE", "/api/v1/lines/floor1/discover", None, 200),
                ("finder", "GET", "/api/v1/simulator/press", None, 403),
                ("faker", "PUT", "/api/v1/simulator/press", {"dead": 0}, 200),
                ("faker", "GET", "/api/v1/simulator/press", None, 200),
                ("faker", "PUT", "/api/v1/simulator/oven", {"dead": 0}, 403),
                ("faker", "DELETE", "/api/v1/lines/floor1/discover", None, 403),
                ("keeper", "GET", "/api/v1/reload", None, 200))
        with plant(OWN_ROLES, roles={"finder": "finder", "faker": "faker", "keeper": "keeper"}) as program:
            for token, verb, path, body, wanted in rows:
                status, text = ask(program, verb, path, token, body)
                self.assertEqual(status, wanted, (token, verb, path, text))
            for token in ("finder", "faker", "keeper"):
                for path in ("/metrics", "/api/v1/stations", "/api/v1/stations/press", "/api/v1/configuration", "/api/v1/events"):
                    self.assertEqual(ask(program, "GET", path, token)[0], 403, (token, path))

    def test_who_may_only_reload_hears_whether_it_was_applied(self):
        with plant(OWN_ROLES, roles={"keeper": "keeper"}) as program:
            text = program.file.read_text()
            program.file.write_text(text.replace("UW105", "UW107"))
            status, said = ask(program, "POST", "/api/v1/reload", "keeper")
            self.assertEqual((status, json.loads(said)["outcome"], json.loads(said)["changes"]), (200, "applied", []))
            self.assertNotEqual(json.loads(ask(program, "GET", "/api/v1/reload")[1])["changes"], [])
            program.file.write_text(text.replace("UW105", "WU105"))
            for verb, wanted in (("POST", 422), ("GET", 200)):
                status, said = ask(program, verb, "/api/v1/reload", "keeper")
                self.assertEqual((status, json.loads(said)["outcome"]), (wanted, "invalid"))
                self.assertNotIn("WU105", said)
            self.assertIn("WU105", ask(program, "GET", "/api/v1/reload")[1])

    def test_a_stream_ends_when_its_role_may_no_longer_read(self):
        with plant(OWN_ROLES, roles={"caller": "caller"}) as program:
            url = program.url("/api/v1/events")
            command = ["curl", "-sN", "--max-time", str(harness.PATIENCE), "-H", "Authorization: Bearer token-of-caller-0123456789", url]
            with subprocess.Popen(command, stdout=subprocess.PIPE) as stream:
                self.assertTrue(stream.stdout.readline())
                # The least default role that has all its rights is the same.
                program.file.write_text(program.file.read_text().replace("rights: [read, raw]", "rights: [raw]"))
                self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
                stream.stdout.read()
                self.assertNotEqual(stream.wait(harness.PATIENCE), 28, "it was not ended, but its time was over")

    def test_a_rollback_says_that_a_role_of_the_same_name_has_more_rights(self):
        with plant(OWN_ROLES, roles={"keeper": "keeper"}) as program:
            text = program.file.read_text()
            program.file.write_text(text.replace("rights: [read, raw]", "rights: [read]").replace("rights: [reload]", "rights: [read]"))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            status, said = ask(program, "POST", "/api/v1/reload", None, {"rollback": True})
            self.assertEqual((status, sorted(json.loads(said)["weaker"])),
                             (409, ["access: role caller has more rights", "access: role keeper has more rights"]))

    def test_check_names_what_is_wrong_and_explains(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            def check(access, *more, http=config.FREE_PORT):
                file.write_text(config.gateway(config.line(stations=STATIONS.strip()), access=access, http=http))
                return harness.run("check", "-c", file, *more)
            for access, said in (("{roles: [{name: setter, rights: [red]}]}", "there is no right 'red'; did you mean 'read'?"),
                                 ("{roles: [{name: setter}]}", "a role needs rights, such as rights: [read, write]"),
                                 ("{roles: [{name: viewer, rights: [read]}]}", "the role 'viewer' is there already"),
                                 ("{roles: [{name: a, rights: [read]}, {name: a, rights: [read]}]}", "there are two roles 'a'"),
                                 ("{roles: [{name: a, rights: [read]}], rules: [{name: a, deny: [read]}]}", "cannot be called as a role")):
                done = check(access)
                self.assertEqual((done.returncode, said in done.stderr), (78, True), (access, done.stderr))
            done = check("{roles: [{name: setter, rights: [read]}]}", http=config.FREE_PORT + ", anonymous: seter")
            self.assertIn("anonymous must be none, viewer, operator, engineer, admin or setter, not 'seter'; did you mean 'setter'?",
                          done.stderr)
            for question, code in (("role=setter read press/UW102", 0), ("role=setter write press/UW102", 1),
                                   ("role=setter face=modbus_tcp broadcast press/UW102", 1)):
                done = check("{roles: [{name: setter, rights: [read]}]}", "--explain", question)
                self.assertEqual(done.returncode, code, (question, done.stdout, done.stderr))


class Explain(unittest.TestCase):
    def test_names_the_rule_with_file_and_line(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            file.write_text(config.gateway(config.line(stations=STATIONS.strip()), access="""
  default: allow
  rules:
    - {name: near-setpoints, allow: [write], from: [10.0.0.0/24], range: UW100-UW109}
    - {name: no-writes, deny: [write], roles: [operator]}
"""))
            rows = (("from=10.0.0.7 role=operator write press/UW102", 0, "allowed: rule 'near-setpoints'"),
                    ("from=10.0.0.7 role=operator write press/UW110", 1, "denied: rule 'no-writes'"),
                    ("from=10.0.0.7 count=3 write press/UW108", 1, "denied: rule 'no-writes'"),
                    ("from=10.0.1.7 write press/mode", 1, "denied: rule 'no-writes'"),
                    ("read oven/GDT100", 0, "allowed: no rule matches, and the default is allow"),
                    ("role=viewer write oven/GDT100", 1, "denied: over http this needs the role operator"),
                    ("role=nothing read press/UW102", 0, "allowed"),
                    ("role=nothing write press/UW102", 1, "denied: the role 'nothing' of a certificate is no role"),
                    ("role=engineer raw press/UW200", 0, "allowed: no rule matches"),
                    ("role=engineer face=modbus_tcp raw read press/UW200", 0, "allowed: no rule matches"),
                    ("role=operator raw read press/UW200", 1, "denied: over http this needs the role engineer"),
                    ("write nobody/UW1", 64, ""), ("role=operator press/UW102", 64, ""))
            for question, code, text in rows:
                done = harness.run("check", "-c", file, "--explain", question)
                self.assertEqual(done.returncode, code, (question, done.stdout, done.stderr))
                self.assertIn(text, done.stdout, question)
                if "rule '" in text:
                    self.assertRegex(done.stdout, r"panelgate\.yaml:\d+:\d+\)")
            text = harness.run("check", "-c", file).stdout
            self.assertIn("who may write, by 2 rule(s) of access and else allowed:", text)

    def test_judges_the_door_as_well(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            token = pathlib.Path(folder) / "old"
            token.write_text("j" * 40)
            token.chmod(0o600)
            file.write_text(DOORS.format(token=token))
            door = "listener=127.0.0.1:18099"
            rows = ((f"from=127.0.0.1 {door} write aaa/400001", 1, "has access: read_only"),
                    (f"from=127.0.0.1 {door} read aaa/400001", 0, "allowed"),
                    (f"from=192.168.1.1 {door} read aaa/400001", 1, "does not let 192.168.1.1 in"),
                    (f"{door} read ccc/400001", 1, "does not serve line 'l2'"),
                    ("listener=127.0.0.1:18098 write aaa/400001", 1, "needs the role operator"),
                    ("token=old write aaa/400001", 1, "the token 'old' ended on 2020-01-01"),
                    ("broadcast aaa/400001", 1, "reaches station 'ro', which is read_only"),
                    ("raw aaa/400001", 1, "needs the role engineer"),
                    ("role=engineer raw aaa/400011", 1, "rule 'r1'"))
            for question, code, text in rows:
                done = harness.run("check", "-c", file, "--explain", question)
                self.assertEqual(done.returncode, code, (question, done.stdout, done.stderr))
                self.assertIn(text, done.stdout, question)
            for question in ("listener=9.9.9.9:1 write aaa/400001", "from=10.0.0.777 write aaa/400001",
                             "from=10.0.0.0/8 write aaa/400001", "write aaa/400011 write aaa/400001",
                             "write aaa/400011 aaa/400001", f"face=http {door} read aaa/400001"):
                done = harness.run("check", "-c", file, "--explain", question)
                self.assertEqual(done.returncode, 64, (question, done.stdout, done.stderr))

    def test_check_names_rules_that_can_never_match_and_what_has_ended(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            token = pathlib.Path(folder) / "old"
            token.write_text("j" * 40)
            token.chmod(0o600)
            text = DOORS.format(token=token).replace("    - {name: r1", VAIN + "    - {name: r1")
            file.write_text(text + f"audit: {{file: {folder}/no/audit.jsonl}}\n")
            said = harness.run("check", "-c", file).stderr
            for name, why in (("n1", "one of its faces"), ("n2", "none of its faces"), ("n3", "one of its roles"),
                              ("n4", "write nothing"), ("n5", "nothing can write to its range"),
                              ("n6", "rule 'b3' in line")):
                self.assertRegex(said, f"rule '{name}'.* never decides anything: .*{why}")
            self.assertEqual(said.count("never decides anything"), 6, said)
            self.assertIn("the token 'old' ended on 2020-01-01", said)
            self.assertIn(f"audit: there is no folder {folder}/no", said)

    def test_tokens_name_own_roles_and_are_neither_over_nor_a_hash_in_capitals(self):
        for more, code in ((["--role", "setter"], 0), (["--role", "no role"], 64), (["--expires", "2020-01-01"], 64)):
            done = harness.run("token", "new", "--name", "h", *more)
            self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "panelgate.yaml"
            token = pathlib.Path(folder) / "old"
            token.write_text("SHA256:" + "AB" * 32)
            token.chmod(0o600)
            file.write_text(DOORS.format(token=token))
            done = harness.run("check", "-c", file)
            self.assertEqual(done.returncode, 78, done.stderr)
            self.assertIn("64 hex digits in lower case", done.stderr)


DOORS = """lines:
  - {{name: floor1, device: sim, stations: [{{id: 1, name: aaa, profile: generic}}, {{id: 2, name: ro, profile: generic, access: read_only}}]}}
  - {{name: l2, device: sim, stations: [{{id: 1, name: ccc, profile: generic}}]}}
modbus_tcp: [{{listen: "127.0.0.1:18099", lines: [floor1], access: read_only, allow: [127.0.0.1/32]}}]
http: {{listen: "127.0.0.1:18098", allow: [127.0.0.1/32], tokens: [{{name: old, role: admin, file: {token}, expires: 2020-01-01}}]}}
access:
  rules:
    - {{name: r1, deny: [write], stations: [aaa], range: holding-registers/10-19}}
"""
VAIN = """    - {name: n1, deny: [write], stations: [aaa], faces: [mqtt]}
    - {name: n2, deny: [write], stations: [aaa], faces: [http], listeners: ["127.0.0.1:18099"]}
    - {name: n3, deny: [write], stations: [aaa], roles: [viewer], tokens: [old]}
    - {name: n4, deny: [write], stations: [aaa], functions: [3]}
    - {name: n5, deny: [write], stations: [aaa], range: input-registers/1-5}
    - {name: b3, deny: [read, write], stations: [ccc], range: holding-registers/0-99}
    - {name: n6, deny: [read, write], stations: [ccc], range: holding-registers/50-60}
"""


if __name__ == "__main__":
    unittest.main()
