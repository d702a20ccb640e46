"""What a viewer of one station sees of a plant, over each path, in events and metrics."""
import contextlib
import json
import pathlib
import subprocess
import tempfile
import time
import unittest
import urllib.request

import config
import harness
from harness import read_registers
from openapi import Document
from rest_plant import ask
from test_access import plant
from test_points import until

# Names, ids and places of what the viewer may not see.
OTHERS = ("oven", "secret-heat", "hidden-mode", "GDT", "panasonic")


@contextlib.contextmanager
def stream(program, token, query=""):
    request = urllib.request.Request(program.url("/api/v1/events" + query),
                                     headers={"Authorization": f"Bearer token-of-{token}-0123456789"})
    with urllib.request.urlopen(request, timeout=harness.PATIENCE) as heard:
        yield heard


def read_until(heard, word):
    text, part = "", True
    while word not in text and part:
        part = heard.read1(65536).decode()
        text += part
    return text


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

    def test_lists_and_metrics_have_the_one(self):
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
            self.assertEqual(json.loads(ask(program, "GET", "/api/v1/lines/floor1", "eye")[1])["clients"], [])
            self.assertTrue(json.loads(ask(program, "GET", "/api/v1/lines/floor1", "lab")[1])["clients"])
            self.assertIn('token="lab"', ask(program, "GET", "/metrics", "lab")[1])
            self.assertNotIn("token=", metrics)

    def test_denials_of_reads_count_by_the_rule_that_decides_and_are_not_shown_to_him(self):
        with plant() as program:
            status, text = ask(program, "GET", "/api/v1/lines/floor1/discover", "eye")
            self.assertEqual((status, json.loads(text)["rule"]), (403, "eye-sees-no-more"))
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 403)
            self.assertIn('panelgate_access_denied_total{rule="eye-sees-no-more"} 2', ask(program, "GET", "/metrics")[1])
            self.assertNotIn("rule=", ask(program, "GET", "/metrics", "eye")[1])

    def test_the_own_registers_hide_what_may_not_be_read(self):
        hidden = """{rules: [{name: not-the-oven, deny: [read], faces: [modbus_tcp], stations: [oven]}]}"""
        with plant(hidden, modbus=config.FREE_PORT + ", diagnostics_unit: 255") as program, \
                program.client() as client:
            registers = lambda unit: client.ask(255, read_registers(1000 + 16 * unit, 4))[2:]
            self.assertEqual(registers(31)[:6], bytes.fromhex("0002 0001 001F"), "online, on the first line, 31")
            self.assertEqual(registers(20), bytes(8))
            self.assertEqual(client.ask(255, bytes.fromhex("02 0014 0001")), bytes.fromhex("02 01 00"))

    def test_what_is_about_all_stations_of_a_line_is_for_those_who_may_read_them_all(self):
        with plant() as program:
            incidents = "/api/v1/lines/floor1/incidents"
            self.assertEqual(ask(program, "PUT", "/api/v1/simulator/press", "lab", {"dead": 1})[0], 200)
            until(lambda: json.loads(ask(program, "GET", incidents)[1])["incidents"])
            for part in ("trace", "trace?since=0", "trace.pcapng", "incidents", "incidents/1", "incidents/1.pcapng", "history"):
                status, text = ask(program, "GET", "/api/v1/lines/floor1/" + part, "eye")
                self.assertEqual((status, json.loads(text)["rule"]), (403, "eye-sees-no-more"), part)
            for read in (False, True):
                self.assertEqual(json.loads(ask(program, "GET", incidents, "lab")[1])["incidents"][0]["read"], read)
                self.assertEqual(ask(program, "GET", incidents + "/1", "lab")[0], 200)
            for part in ("trace", "history"):
                self.assertEqual(ask(program, "GET", "/api/v1/lines/floor1/" + part, "lab")[0], 200)

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

    def test_a_finding_about_another_station_is_no_event_for_him(self):
        with plant() as program, contextlib.ExitStack() as streams:
            heard = {token: streams.enter_context(stream(program, token, "?types=line")) for token in ("eye", "lab")}
            self.assertEqual(ask(program, "PUT", "/api/v1/simulator/oven", "lab", {"dead": True})[0], 200)
            self.assertIn("station oven", read_until(heard["lab"], "station oven"))
            file = program.file
            file.write_text(file.read_text().replace("tokens: [eye], stations: [press]", "tokens: [eye], stations: [press, oven]"))
            self.assertEqual(ask(program, "PUT", "/api/v1/simulator/oven", "lab", {"dead": False})[0], 200)
            read_until(heard["lab"], "finding gone")
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            self.assertEqual(ask(program, "PUT", "/api/v1/simulator/oven", "lab", {"dead": True})[0], 200)
            self.assertEqual(read_until(heard["eye"], "station oven").count("oven"), 1, "the one since he may read it")

    def test_a_stream_ends_with_its_token(self):
        with tempfile.TemporaryDirectory() as folder, plant(audit=f"{{file: {folder}/audit.jsonl}}") as program:
            file = program.file
            end = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(time.time() + 3))
            file.write_text(file.read_text().replace("name: eye, role: viewer", f'name: eye, role: viewer, expires: "{end}"'))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            with stream(program, "eye") as heard:
                while heard.read1(65536):
                    pass
            self.assertEqual(ask(program, "GET", "/api/v1/stations", "eye")[0], 401)
            records = lambda: map(json.loads, pathlib.Path(folder, "audit.jsonl").read_text().splitlines())
            until(lambda: any((one.get("token"), one.get("event")) == ("eye", "expired") for one in records()))

    def test_another_file_changes_what_is_seen_and_nobody_loses_a_stream(self):
        with plant() as program:
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 403)
            file = program.file
            file.write_text(file.read_text().replace("tokens: [eye], stations: [press]", "tokens: [eye]"))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 200)
            status, text = ask(program, "POST", "/api/v1/reload", None, {"rollback": True})
            self.assertEqual((status, json.loads(text)["weaker"]), (409, ["access/rules/eye-sees-press: stations not set -> [floor1/31]"]))
            self.assertEqual(ask(program, "POST", "/api/v1/reload", None, {"rollback": True, "weaker": True})[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/stations/oven", "eye")[0], 403)

    def test_a_refused_rollback_tells_tokens_beside_the_rest(self):
        with plant() as program:
            file = program.file
            text = file.read_text()
            file.write_text(text.replace("role: viewer, file", "role: viewer, expires: 2090-01-01, file")
                            .replace("tokens: [eye], stations: [press]", "tokens: [eye]"))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            status, text = ask(program, "POST", "/api/v1/reload", None, {"rollback": True})
            self.assertEqual((status, sorted(json.loads(text)["weaker"])),
                             (409, ["access/rules/eye-sees-press: stations not set -> [floor1/31]",
                                    "http/tokens/eye: expires 2090-01-01 -> not set"]))

    def test_a_rollback_over_which_only_a_token_changed_says_so(self):
        with plant() as program:
            self.assertEqual(ask(program, "GET", "/api/v1/lines", "eye")[0], 200)
            file = program.file
            file.write_text(file.read_text().replace("role: viewer, file", "role: viewer, expires: 2020-01-01, file"))
            self.assertEqual(ask(program, "POST", "/api/v1/reload")[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/lines", "eye")[0], 401)
            status, text = ask(program, "POST", "/api/v1/reload", None, {"rollback": True})
            self.assertEqual((status, json.loads(text)["weaker"]), (409, ["http/tokens/eye: expires 2020-01-01 -> not set"]))
            self.assertEqual(ask(program, "POST", "/api/v1/reload", None, {"rollback": True, "weaker": True})[0], 200)
            self.assertEqual(ask(program, "GET", "/api/v1/lines", "eye")[0], 200)


if __name__ == "__main__":
    unittest.main()
