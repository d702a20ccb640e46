"""The dashboard tells what is so: outages, who has used a line, what is wrong in the reader's words;
in headless Chromium, skipped where there is none."""
import contextlib
import json
import re
import signal
import unittest

import harness
from browser import NARROW, WIDE, Browser
from config import ADMIN, PRESS, gateway, line
from rtu_bus import echo_address
from sound_line import DeviceServer


def tile(station):
    return f'.tile[data-station="{station}"]'


class Outage(Browser):
    """What fails is seen: a tick for each, a gap, and a time axis that goes on."""

    def setUp(self):
        self.program.rest("PUT", "/api/v1/simulator/oven", {})

    def tearDown(self):
        self.program.rest("PUT", "/api/v1/simulator/oven", {})

    def drawn(self, which):
        return self.script("return Number(document.querySelector('.plot[data-to]')?.dataset[arguments[0]] ?? 0)", which)

    def test_a_dead_panels_plot_has_ticks_and_goes_on_to_now(self):
        self.open("station/oven")
        self.wait(lambda: self.drawn("to"))
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        self.wait(lambda: self.drawn("failed") >= 2 and "failed" in self.text(".plot-values"))
        dead = self.drawn("to")
        self.wait(lambda: self.drawn("to") > dead + 3000)
        self.assertRegex(self.text(".plot-values"), r"wire –")
        self.screenshot("outage-wide-light")
        self.open("latency/floor1")
        self.wait(lambda: self.drawn("failed") >= 1)
        self.screenshot("outage-latency-wide-light")
        self.assertEqual(self.complaints(), [])

    def test_a_polled_block_is_no_longer_good_when_its_panel_is_dead(self):
        self.open("station/filler")
        self.wait(lambda: "good" in self.text("ul.plain"))
        self.program.rest("PUT", "/api/v1/simulator/filler", {"dead": 1})
        try:
            self.wait(lambda: re.search("stale|bad", self.text("ul.plain")))
        finally:
            self.program.rest("PUT", "/api/v1/simulator/filler", {})

    def test_its_tile_ticks_and_boasts_of_no_latency(self):
        self.open()
        self.wait(lambda: self.text(tile("oven") + " .figure").startswith("panel "))
        newest = "M120.0,20V28"
        def ticks():
            return self.find(tile("oven") + " .missing").get_attribute("d")
        self.wait(lambda: not ticks().endswith(newest))
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        self.wait(lambda: ticks().endswith(newest))
        self.wait(lambda: self.text(tile("oven") + " .figure") == "–")
        self.wait(lambda: self.driver.title.startswith("⚠ 1 · "))  # a tab in the background tells it, too

    def test_a_points_plot_ends_with_its_gap(self):
        row = 'tr[data-point="oven/temperature"]'
        self.open("points")
        self.wait(lambda: self.all(row + " td button"))
        self.find(row + " td button").click()
        self.wait(lambda: self.drawn("to"))
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        self.wait(lambda: "–" in self.text(".plot-values"))
        gap = self.drawn("to")
        self.wait(lambda: self.drawn("to") > gap + 1000)


class Clients(Browser):
    def row(self, name):
        return self.text(f'tr[data-client="{name}"]')

    def test_who_has_a_connection_a_request_is_in_the_list(self):
        for _ in range(3):
            self.program.values("/api/v1/stations/press/devices/UW0")
        self.open("clients")
        self.wait(lambda: "http 127.0.0.1" in self.row("http 127.0.0.1"))
        self.wait(lambda: "poll of oven" in self.row("poll of oven"))
        self.assertEqual(self.complaints(), [])

    def test_who_has_hung_up_says_since_when(self):
        with self.program.client() as client:
            client.ask(31, b"\x03\x00\x00\x00\x01")
        self.open("clients")
        self.wait(lambda: "left" in self.row("modbus_tcp 127.0.0.1"))


class Findings(Browser):
    """In the reader's language, with the numbers, by the station's name."""

    def tearDown(self):
        self.program.rest("PUT", "/api/v1/simulator/oven", {})
        self.script("localStorage.clear()")

    def test_they_are_said_in_every_language(self):
        self.open()
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        for language, wrong, advice, evidence in (
                ("de", "oven antwortet nicht", "Stecker", r"die letzten \d+ Anfragen"),
                ("ko", "oven: 응답하지", "커넥터", r"마지막 요청 \d+개"),
                ("ja", "oven:応答しません", "コネクター", r"直近の要求 \d+ 件"),
                ("en", "oven does not answer", "plug", r"the last \d+ requests")):
            with self.subTest(language=language):
                self.script("localStorage.setItem('panelgate.language', arguments[0])", language)
                self.open()
                def said():
                    return self.text('.finding[data-cause="station-silent"]')
                self.wait(said)
                self.assertIn(wrong, said())
                self.assertIn(advice, said())
                self.assertRegex(said(), evidence)
                self.assertNotRegex(said(), r"[{}]|\b20\b")
                if language != "en":
                    self.assertFalse(self.all('.finding[data-cause="station-silent"] [lang="en"]'))


class Silence(Browser):
    """The page never looks better than what it knows of the plant."""

    def tearDown(self):
        self.program.process.send_signal(signal.SIGCONT)

    @contextlib.contextmanager
    def stopped(self):
        self.program.process.send_signal(signal.SIGSTOP)
        try:
            self.wait(lambda: self.find("#banner").is_displayed())
            yield
        finally:
            self.program.process.send_signal(signal.SIGCONT)
        self.wait(lambda: not self.find("#banner").is_displayed())

    def age(self):
        return float(self.text('tr[data-point="oven/temperature"] td:nth-child(4)').split(" s")[0])

    def test_a_stopped_gateway_is_a_red_bar_a_title_and_grey_ages_that_go_on(self):
        self.open("points")
        self.wait(lambda: "good" in self.text('tr[data-point="oven/temperature"]'))
        with self.stopped():
            self.assertRegex(self.text("#banner"), r"has not answered since \d\d:\d\d:\d\d")
            self.assertTrue(self.driver.title.startswith("⚠ no answer · "))
            self.wait(lambda: " s" in self.text('tr[data-point="oven/temperature"] td:nth-child(4)'))
            self.assertNotIn("good", self.text("tbody"))
            self.assertIn("grayscale", self.find("main").value_of_css_property("filter"))
            before = self.age()
            self.wait(lambda: self.age() >= before + 2)
            self.screenshot("stopped-points")
        self.wait(lambda: "good" in self.text('tr[data-point="oven/temperature"]'))
        self.complaints()

    def test_no_tile_of_a_stopped_gateway_boasts(self):
        self.open()
        self.wait(lambda: "online" in self.text(tile("oven")))
        with self.stopped():
            self.wait(lambda: "not known" in self.text(tile("oven")))
            self.assertNotIn("online", self.text("main"))
            self.assertIn("without an answer ?", self.text(".counts"))
            self.assertEqual(self.text(tile("oven") + " .figure"), "–")
            self.assertRegex(self.text(tile("oven")), r"last answer \d\d:\d\d:\d\d, \d")
            self.assertEqual(self.faint(), [])
        self.complaints()

    def test_a_tab_that_nobody_looks_at_tells_it_in_its_title(self):
        self.open()
        self.wait(lambda: self.all(tile("oven")))
        page = self.driver.current_window_handle
        self.driver.switch_to.new_window("tab")
        try:
            targets = lambda: self.driver.execute_cdp_cmd("Target.getTargets", {})["targetInfos"]
            titles = lambda: [one["title"] for one in targets() if one["targetId"] == page]
            self.assertTrue(titles())
            self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
            self.wait(lambda: titles()[0].startswith("⚠ 1 · "))
        finally:
            self.program.rest("PUT", "/api/v1/simulator/oven", {})
            self.driver.close()
            self.driver.switch_to.window(page)


class Unplugged(Browser):
    """A line whose device server has gone, beside a sound one."""

    @classmethod
    def gateway(cls):
        cls.server = DeviceServer(lambda frame, age: echo_address(frame))
        far = line("far", cls.server.device, "{id: 7, name: pump, poll: [{read: 400001, count: 2, every: 100ms}]}")
        return cls.enterClassContext(harness.configured(gateway(line(stations=PRESS), far, http=ADMIN)))

    def test_it_is_red_counted_in_the_title_and_its_tiles_say_so(self):
        self.open()
        self.wait(lambda: "online" in self.text(tile("pump")))
        self.wait(lambda: "panel " in self.text(tile("pump") + " .figure"))
        self.server.__exit__()
        self.wait(lambda: "line is down" in self.text(tile("pump")))
        self.assertIn("bad", self.find(tile("pump")).get_attribute("class"))
        self.assertEqual(self.text(tile("pump") + " .figure"), "–")
        self.assertIn("without an answer 1 · lines down 1", self.text(".counts"))
        self.assertIn("bad", self.find(".counts").get_attribute("class"))
        self.assertTrue(self.driver.title.startswith("⚠ 1 · "))
        far = '.line[aria-label="Line far"] '
        self.assertEqual(self.text(far + ".badge"), "line is down")
        self.assertIn("down: ", self.text(far + ".refusal"))
        for size, name in ((NARROW, "narrow"), (WIDE, "wide")):
            self.resize(size)
            self.assertEqual(self.has_cut(), [])
            self.screenshot(f"unplugged-{name}")
        self.open("station/pump")
        self.wait(lambda: "line is down" in self.text("h1"))
        self.assertEqual(self.complaints(), [])


class Entry(Browser):
    """What is typed is what is written, or is refused."""
    POINTS = """[{name: pump, at: UB200, writable: true}, {name: dose, at: UW300, type: f32, unit: g, min: 0, max: 5000, writable: true},
      {name: mode, at: UW105, labels: {0: manual, 1: auto, 2: "off"}, writable: true}]"""

    @classmethod
    def gateway(cls):
        press = f"{{id: 31, name: press, profile: autonics-gplp-s, points: {cls.POINTS}}}"
        return cls.enterClassContext(harness.configured(gateway(line(stations=press), http=ADMIN)))

    def tearDown(self):
        self.script("localStorage.clear()")

    def value(self, name):
        return self.program.get(f"/api/v1/stations/press/points/{name}")[1]["value"]

    def begin(self, name, language="en"):
        self.open()
        self.script("localStorage.setItem('panelgate.language', arguments[0])", language)
        self.open("points")
        row = f'tr[data-point="press/{name}"]'
        self.wait(lambda: self.all(row + " .badge.good"))
        self.find(row + " td:last-child button").click()

    def ask(self, typed):
        field = self.find("#new-value")
        field.clear()
        field.send_keys(typed)
        self.find("dialog button.primary").click()

    def write(self):
        self.wait(lambda: self.all("#confirm"))
        said = self.text("dialog .change")
        self.assertTrue(self.all("dialog .bytes"))
        self.find("#confirm").click()
        self.wait(lambda: self.all("dialog .success"))
        return said

    def test_a_bool_has_two_buttons_in_every_language(self):
        self.begin("pump", "de")
        self.assertFalse(self.all("#new-value"))
        button = self.find('dialog button[data-value="true"]')
        self.assertEqual(button.text, "ein")
        button.click()
        self.assertEqual(self.write(), "aus → ein")
        self.assertIs(self.value("pump"), True)
        self.assertIn("Wert: ein", self.text("dialog"))

    def test_a_number_that_may_mean_two_is_refused(self):
        self.program.rest("PUT", "/api/v1/stations/press/points/dose", {"value": 1200})
        for language, wrong, right, said in (("en", "1,250", "1250.5", "1200 g → 1250.5 g"), ("de", "1.250", "1251,5", "1250,5 g → 1251,5 g")):
            with self.subTest(language=language):
                self.begin("dose", language)
                for typed in (wrong, "yes", "0x10", "1 250"):
                    self.ask(typed)
                    self.wait(lambda: self.all("dialog .refusal"))
                    self.assertFalse(self.all("#confirm"))
                self.ask("5001")
                self.wait(lambda: "0 … 5000 g" in self.text("dialog .refusal"))
                self.ask(right)
                self.assertEqual(self.write(), said)
                self.assertEqual(self.value("dose"), float(right.replace(",", ".")))
        self.assertEqual(self.complaints(), [])

    def test_labels_are_a_list(self):
        self.begin("mode")
        self.assertEqual([one.text for one in self.all("#new-value option")], ["manual", "auto", "off"])
        self.script("document.querySelector('#new-value').value = 'auto'")
        self.find("dialog button.primary").click()
        self.assertEqual(self.write(), "manual (0) → auto")
        self.assertEqual(self.value("mode"), 1)
        self.assertIn("auto (1)", self.text("dialog .muted"))

    def test_a_dialog_ends_with_its_view(self):
        self.open()
        self.begin("dose")
        self.ask("7")
        self.wait(lambda: self.all("#confirm"))
        self.driver.back()
        self.wait(lambda: self.all(".tile"))
        self.assertFalse(self.all("dialog"))
        self.assertNotEqual(self.value("dose"), 7)

    def test_the_request_box_takes_no_number_that_may_be_two(self):
        self.open("request/press")
        self.find("#where").send_keys("UW110")
        self.find("#values").send_keys("1,250")
        self.find("#write").click()
        self.wait(lambda: "215 216" in self.text(".answer .refusal"))
        self.assertFalse(self.all("dialog"))


class OfTheGateway(Browser):
    """Findings that are of no panel, as GET /api/v1/findings tells them."""
    FOUND = [{"cause": "overload", "line": "floor1", "station": None, "name": "floor1", "text": "Line floor1 is overloaded.",
              "advice": "Ask less often.", "evidence": "1 of 9 requests; most is asked by 10.0.0.7 (87 %)",
              "figures": {"load_percent": 99, "no_turn": 1, "requests": 9}, "clients": [{"name": "10.0.0.7", "percent": 87}]},
             {"cause": "broker-away", "line": None, "station": None, "name": "mqtt://b:1883", "text": "The MQTT broker is away.",
              "advice": "See whether it runs.", "evidence": "", "figures": {}, "clients": []}]
    STUB = """const before = fetch, found = %s, route = {method: 'GET', path: '/api/v1/findings', role: 'viewer'};
        window.fetch = async (path, options) => {
            if (path === route.path) return Response.json({findings: found});
            const answer = await before(path, options);
            if (path !== '/api/v1/configuration') return answer;
            const told = await answer.json();
            return Response.json({...told, rest: [...told.rest, route]});
        };"""

    def test_an_overload_is_told_with_its_clients_and_the_line_says_it(self):
        stub = self.driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": self.STUB % json.dumps(self.FOUND)})
        try:
            for language, word in (("de", "überlastet"), ("en", "overloaded")):
                self.open()
                self.script("localStorage.setItem('panelgate.language', arguments[0])", language)
                self.open()
                self.wait(lambda: self.text(".line .head .badge") == word)
                self.assertIn("10.0.0.7 (87 %)", self.text('.line .finding[data-cause="overload"]'))
                self.assertIn("broker", self.text("#gateway").lower())
                self.wait(lambda: self.driver.title.startswith("⚠ 2 · "))
                self.screenshot(f"overload-{language}")
        finally:
            self.driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", stub)
            self.script("localStorage.clear()")


class SameWords(Browser):
    def tearDown(self):
        self.driver.execute_cdp_cmd("Emulation.setTimezoneOverride", {"timezoneId": ""})

    def test_queue_wire_and_panel_are_the_words_of_every_view(self):
        self.open()
        self.wait(lambda: self.text(tile("oven") + " .figure").startswith("panel "))
        self.open("station/oven")
        self.wait(lambda: self.all(".plot canvas"))
        three = r"queue [\d.]+ ms, wire [\d.]+ ms, panel [\d.]+ ms"
        self.wait(lambda: re.search(three, self.text("figure + .muted")))
        self.assertRegex(self.text(".plot-values"), r"queue .*wire .*panel ")
        self.open("latency")
        self.assertRegex(self.text("thead"), "queuewirepanel")

    def test_a_time_has_its_date_unless_it_is_today_and_the_zone_is_said(self):
        self.driver.execute_cdp_cmd("Emulation.setTimezoneOverride", {"timezoneId": "Asia/Seoul"})
        self.open("scope")
        self.assertIn("UTC+9", self.text("#foot"))
        self.wait(lambda: self.all("tbody tr"))
        self.assertIn("UTC+9", self.text("thead"))
        told = self.driver.execute_async_script("""const done = arguments[arguments.length - 1];
            import(new URL('page/language.js', location.origin)).then(({time}) => done([0, 86400, 1e9].map((ago) => time(Date.now() / 1000 - ago))))""")
        self.assertRegex(told[0], r"^\d\d:\d\d:\d\d\.\d{3}$")
        for one in told[1:]:
            self.assertRegex(one, r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{3}$")


if __name__ == "__main__":
    unittest.main()
