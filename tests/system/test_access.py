"""Who may do what: rules of access over all faces."""
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
ILLEGAL = b"\x01"


@contextlib.contextmanager
def plant(rules=RULES, roles=None, line=None, **more):
    with tempfile.TemporaryDirectory() as folder:
        door = config.ADMIN + f", tokens: {tokens(folder, roles or {'eye': 'viewer', 'lab': 'engineer'})}"
        text = config.gateway(config.line(stations=STATIONS.strip(), **(line or {})), http=door, access=rules, **more)
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


class Waiting(unittest.TestCase):
    """A right that goes while a request waits for its turn."""

    def answer_after(self, program, name, act, before, now):
        def asked(client):
            clients = program.get("/api/v1/lines/floor1")[1]["clients"]
            return sum(one["requests"] for one in clients if client in one["name"])

        said = []
        count = asked("modbus_tcp")
        self.blocker.send(31, read_registers(105))  # between two polls the line would be free
        until(lambda: asked("modbus_tcp") > count)
        count = asked(name)
        thread = threading.Thread(target=lambda: said.append(act()))
        thread.start()
        until(lambda: asked(name) > count)
        text = program.file.read_text()
        self.assertIn(before, text)
        program.file.write_text(text.replace(before, now))
        self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
        thread.join()
        program.file.write_text(text)
        self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
        return said[0]

    def test_nothing_is_sent_for_who_has_lost_it(self):
        slow = {"timing": "{response_timeout: 8s}", "queue": "{deadline: 30s}"}
        path = "/api/v1/stations/oven/devices/GDT150"
        with plant("{rules: []}", roles={"lab": "operator"}, line=slow) as program, program.client() as client, \
                program.client() as self.blocker:
            self.assertEqual(ask(program, "PUT", "/api/v1/simulator/press", None, {"slow_ms": 5000})[0], 200)
            write = lambda: ask(program, "PUT", path, "lab", {"values": [1]})
            read = lambda: ask(program, "GET", path, "lab")
            modbus = lambda: (client.ask(20, write_register(150, 1)), "{}")
            named = "{name: lab, role: operator"
            for name, act, before, now, expected, rule in (
                    ("token lab", write, named, "{name: lab, role: viewer", 403, "viewer"),
                    ("token lab", write, named, "{name: other, role: operator", 403, "token"),
                    ("token lab", read, named, "{name: lab, expires: 2020-01-01, role: operator", 403, "token"),
                    ("modbus_tcp", modbus, "modbus_tcp: [{", "modbus_tcp: [{access: read_only, ", b"\x86" + ILLEGAL, None)):
                status, text = self.answer_after(program, name, act, before, now)
                self.assertEqual((status, json.loads(text).get("rule")), (expected, rule), (now, text))
            sent = [one for one in frames(program) if one["station"] == 20 and one["reason"] == "write"]
            self.assertEqual(sent, [])


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


    def test_does_not_tell_of_a_line_of_which_it_may_read_nothing(self):
        hidden = config.line("floor2", stations="{id: 5, name: hidden, profile: generic}")
        rules = "\naccess: {rules: [{name: not-there, deny: [read], faces: [mqtt], stations: [hidden]}]}\n"
        with mqtt_side.Broker() as broker, mqtt_side.Listener(broker) as listener:
            text = mqtt_side.plant(broker)
            with harness.configured(text.replace("mqtt: {", hidden + "mqtt: {", 1) + rules) as program:
                listener.wait_for(f"{mqtt_side.TOPIC}/line/floor1/state")
                listener.wait_for(f"{mqtt_side.TOPIC}/press/level")
                self.assertTrue(program.get("/api/v1/lines/floor2")[1]["up"])
                self.assertEqual(listener.of(f"{mqtt_side.TOPIC}/line/floor2/state"), [])


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
                             (409, ["access/roles/caller: rights [read] -> [raw, read]", "access/roles/keeper: rights [read] -> [reload]"]))

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


@contextlib.contextmanager
def configured_by():
    """(file for a configuration, file that holds a token)"""
    with tempfile.TemporaryDirectory() as folder:
        token = pathlib.Path(folder) / "old"
        token.write_text("j" * 40)
        token.chmod(0o600)
        yield pathlib.Path(folder) / "panelgate.yaml", token


class Explain(unittest.TestCase):
    def explain(self, file, question, code, text=""):
        done = harness.run("check", "-c", file, "--explain", question)
        self.assertEqual(done.returncode, code, (question, done.stdout, done.stderr))
        self.assertIn(text, done.stdout, question)
        return done

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
                done = self.explain(file, question, code, text)
                if "rule '" in text:
                    self.assertRegex(done.stdout, r"panelgate\.yaml:\d+:\d+\)")
            text = harness.run("check", "-c", file).stdout
            self.assertIn("who may write, by 2 rule(s) of access and else allowed:", text)

    def test_a_listener_reaches_its_own_lines_only(self):
        with configured_by() as (file, token):
            file.write_text(DOORS.format(token=token).replace("access: read_only, allow", "allow"))
            self.assertIn("modbus_tcp 127.0.0.1:18099: some of aaa; nothing of ro, ccc\n",
                          harness.run("check", "-c", file).stdout)

    def test_judges_the_door_as_well(self):
        with configured_by() as (file, token):
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
                self.explain(file, question, code, text)
            for question in ("listener=9.9.9.9:1 write aaa/400001", "from=10.0.0.777 write aaa/400001",
                             "from=10.0.0.0/8 write aaa/400001", "write aaa/400011 write aaa/400001",
                             "write aaa/400011 aaa/400001", f"face=http {door} read aaa/400001"):
                self.explain(file, question, 64)

    def test_a_broadcast_through_a_listener_goes_to_all_its_lines(self):
        with configured_by() as (file, token):
            file.write_text("""
lines:
  - {name: l1, device: sim, stations: [{id: 1, name: aaa}]}
  - {name: l2, device: sim, stations: [{id: 2, name: bbb}]}
modbus_tcp:
  - {listen: "127.0.0.1:18098"}
  - {listen: "127.0.0.1:18099", lines: [l2]}
http: {listen: "127.0.0.1:0", anonymous: none, tokens: [{name: va, role: viewer, file: %s}]}
access:
  rules:
    - {name: not-one, deny: [broadcast], faces: [modbus_tcp], stations: [aaa]}
""" % token)
            for question, code, text in (
                    ("listener=127.0.0.1:18098 broadcast bbb/400001", 1, "rule 'not-one'"),
                    ("listener=127.0.0.1:18099 broadcast bbb/400001", 0, "allowed"),
                    ("face=modbus_tcp broadcast bbb/400001", 0, "allowed"),
                    ("token=va role=admin read bbb/400001", 64, ""), ("token=va role=viewer read bbb/400001", 0, "")):
                self.explain(file, question, code, text)

    def test_check_names_rules_that_can_never_match_and_what_has_ended(self):
        with configured_by() as (file, token):
            text = DOORS.format(token=token).replace("    - {name: r1", VAIN + "    - {name: r1")
            file.write_text(text + f"audit: {{file: {file.parent}/no/audit.jsonl}}\n")
            said = harness.run("check", "-c", file).stderr
            for name, why in (("n1", "one of its faces"), ("n2", "none of its faces"), ("n3", "one of its roles"),
                              ("n4", "write nothing"), ("n5", "nothing can write to its range"),
                              ("n6", "rule 'b3' in line")):
                self.assertRegex(said, f"rule '{name}'.* never decides anything: .*{why}")
            self.assertEqual(said.count("never decides anything"), 6, said)
            self.assertIn("the token 'old' ended on 2020-01-01", said)
            self.assertIn(f"audit: there is no folder {file.parent}/no", said)

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
