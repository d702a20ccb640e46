"""The dashboard as people see it, in headless Chromium; skipped where there is none."""
import os
import pathlib
import unittest

import harness
from browser import NARROW, VIEWS, WIDE, Browser
from config import gateway, line


def tile(station):
    return f'.tile[data-station="{station}"]'


class Overview(Browser):
    def setUp(self):
        self.open()
        self.wait(lambda: "good" in self.classes("oven"))

    def tearDown(self):
        self.program.rest("PUT", "/api/v1/simulator/oven", {})

    def classes(self, station):
        return self.script("return document.querySelector(arguments[0])?.className ?? ''", tile(station))

    def test_each_station_has_a_tile_and_each_line_its_load(self):
        self.assertEqual(len(self.all(".tile")), 5)
        self.assertIn("%", self.text(".load .figure"))
        self.wait(lambda: " ms" in self.text(tile("oven") + " .figure"))

    def test_it_is_there_at_once(self):
        times = []
        for _ in range(5):
            self.open()
            times.append(self.script("return performance.getEntriesByName('shown')[0].startTime"))
        print(f"\n  stations are shown {min(times):.0f} to {max(times):.0f} ms after the page is asked for", end="")

    def test_a_tile_turns_red_within_two_seconds_of_a_panels_death_and_back(self):
        times = []
        for _ in range(3):
            self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
            red = self.seconds_until(lambda: "bad" in self.classes("oven"))
            self.assertIn("good", self.classes("press"), "the others stay as they are")
            self.program.rest("PUT", "/api/v1/simulator/oven", {})
            back = self.seconds_until(lambda: "good" in self.classes("oven"))
            times.append((red, back))
        print(f"\n  red after {[f'{red:.2f}' for red, _ in times]} s, back after "
              f"{[f'{back:.2f}' for _, back in times]} s", end="")
        self.assertLess(min(red for red, _ in times), 2)
        self.assertLess(min(back for _, back in times), 6)  # the next probe, and the poll behind it

    def test_a_dead_panels_findings_are_told_and_readable(self):
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        self.wait(lambda: "check this panel" in self.text(".line .findings"))
        for scheme in ("light", "dark"):
            self.prefer(scheme)
            self.assertEqual(self.faint(), [])
            self.screenshot(f"dead-wide-{scheme}")
        self.prefer("light")

    def test_a_gateway_that_is_gone_is_told(self):
        self.driver.execute_cdp_cmd("Network.enable", {})
        offline = {"offline": True, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
        try:
            self.driver.execute_cdp_cmd("Network.emulateNetworkConditions", offline)
            self.wait(lambda: self.find("#banner").is_displayed())
        finally:
            self.driver.execute_cdp_cmd("Network.emulateNetworkConditions", {**offline, "offline": False})
        self.wait(lambda: not self.find("#banner").is_displayed())
        self.complaints()


class Scope(Browser):
    def shown(self):
        return self.script("const {frames, first, last} = document.querySelector('canvas.scope').dataset;"
                           "return [Number(frames), Number(first), Number(last)]")

    def pause(self):
        self.find("button.primary").click()
        self.wait(lambda: self.find("button.primary").get_attribute("aria-pressed") == "true")

    def test_it_draws_the_frames_that_the_trace_has(self):
        self.open("scope")
        self.wait(lambda: self.shown()[0] > 6)
        self.pause()
        for _ in range(4):
            self.find('button[aria-label="Zoom out"]').click()
        self.wait(lambda: self.shown()[0] > 20)
        frames, first, last = self.shown()
        status, body = self.program.get("/api/v1/lines/floor1/trace?last=500")
        self.assertEqual(status, 200)
        told = [frame for frame in body["frames"] if first <= frame["sequence"] <= last]
        self.assertEqual(frames, len(told))

    def test_a_frame_is_explained_with_the_panels_notation(self):
        self.program.values("/api/v1/stations/press/devices/UW100?count=3")
        self.open("scope")
        self.wait(lambda: self.shown()[0] > 2)
        self.pause()
        for _ in range(5):
            self.find('button[aria-label="Zoom out"]').click()
        asked = "1F 03 00 64 00 03"
        self.wait(lambda: asked in self.text("tbody"))
        self.script("[...document.querySelectorAll('tbody button')].find((b) => b.textContent.startsWith(arguments[0])).click()", asked)
        self.wait(lambda: "UW100" in self.text(".detail"))
        self.assertIn("read holding registers", self.text(".detail"))
        self.assertEqual(self.text(".detail .bytes").replace(" ", "")[:12], "1F0300640003")

    def test_a_dead_panel_shows_as_silence_and_what_was_decided(self):
        self.open("scope")
        self.program.rest("PUT", "/api/v1/simulator/oven", {"damage": 1})
        try:
            self.wait(lambda: "damaged" in self.text("tbody"))
        finally:
            self.program.rest("PUT", "/api/v1/simulator/oven", {})

    def test_a_link_names_a_frame(self):
        frame = self.program.get("/api/v1/lines/floor1/trace?last=4")[1]["frames"][0]
        self.open(f"scope/floor1/{frame['sequence']}")
        self.wait(lambda: f"#{frame['sequence']} " in self.text(".detail h2"))
        self.wait(lambda: self.shown()[0] and self.shown()[1] <= frame["sequence"] <= self.shown()[2])

    def test_keys_move_and_stop_it(self):
        self.open("scope")
        self.wait(lambda: self.shown()[0] > 2)
        canvas = self.find("canvas.scope")
        canvas.send_keys(" ")
        self.wait(lambda: self.find("button.primary").get_attribute("aria-pressed") == "true")
        canvas.send_keys(",")
        self.wait(lambda: "#" in self.text(".detail h2"))


BUSY = line(baud=115200, stations=", ".join(
    f"{{id: {i}, name: p{i}, profile: omron-cp2e, poll: [{{read: D0, count: 10, every: 20ms}}]}}"
    for i in range(1, 4)))


class Cost(Browser):
    """Of a line that is never idle."""

    @classmethod
    def gateway(cls):
        return cls.enterClassContext(harness.configured(gateway(BUSY)))

    def share(self):
        """Of a core, while this many frames went by."""
        def now():
            fields = pathlib.Path(f"/proc/{self.program.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
            status, trace = self.program.get("/api/v1/lines/floor1/trace?last=1")
            self.assertEqual(status, 200)
            return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), trace["frames"][0]
        cpu, frame = now()
        self.wait(lambda: now()[1]["sequence"] > frame["sequence"] + 1500)
        later, last = now()
        return (later - cpu) / (last["at"] - frame["at"])

    def test_an_open_scope_costs_less_than_a_twentieth_of_a_core(self):
        self.driver.get("about:blank")
        without = self.share()
        self.open("scope")
        self.wait(lambda: self.all("canvas.scope[data-frames]"))
        with_scope = self.share()
        print(f"\n  {with_scope:.1%} of a core with an open scope, {without:.1%} without", end="")
        self.assertLess(with_scope - without, 0.05)


class Request(Browser):
    def ask(self, notation, count):
        self.open("request/press")
        self.find("#where").send_keys(notation)
        self.script("const c = document.getElementById('count'); c.value = arguments[0]; c.dispatchEvent(new Event('input'))", count)

    def test_it_shows_the_frame_before_it_goes_and_explains_the_answer(self):
        self.program.rest("PUT", "/api/v1/stations/press/devices/UW100", {"values": [215, 65535]})
        self.ask("UW100", 2)
        self.wait(lambda: "1F030064" in self.text(".plan .bytes").replace(" ", ""))
        self.assertIn("UW100", self.text(".plan"))
        self.find("#read").click()
        self.wait(lambda: len(self.all(".answer tr.value")) == 2)
        rows = [row.text for row in self.all(".answer tr.value")]
        self.assertRegex(rows[0], r"UW100\s+100\s+215")
        self.assertRegex(rows[1], r"UW101\s+101\s+65535\s+-1\s+FFFF")
        self.find(".answer button:not(#make-point)").click()
        self.wait(lambda: "i32" in self.text(".answer"))

    def test_an_answer_leads_to_its_frames_in_the_scope(self):
        self.ask("UW100", 2)
        self.find("#read").click()
        self.wait(lambda: self.all(".answer a"))
        self.assertRegex(self.text(".answer a"), r"^on the wire: #\d+$")
        self.find(".answer a").click()
        self.wait(lambda: self.all(".detail .bytes"))
        self.assertEqual(self.text(".detail .bytes").replace(" ", "")[:12], "1F0300640002")

    def test_what_the_panel_does_not_have_is_told_in_words(self):
        self.ask("XY7", 1)
        self.wait(lambda: "XY7" in self.text(".plan .refusal"))
        self.complaints()  # a 404 is written to the console, too

    def test_a_write_is_done_only_when_it_is_confirmed(self):
        self.program.rest("PUT", "/api/v1/stations/press/devices/UW110", {"values": [1]})
        self.ask("UW110", 1)
        for action, value in (("button[autofocus]", 1), ("#confirm", 77)):
            self.script("document.getElementById('values').value = '77'")
            self.find("#write").click()
            self.wait(lambda: self.all("dialog .bytes"))
            self.assertIn("1F10006E000102004D", self.text("dialog .bytes").replace(" ", ""))
            self.assertEqual(self.nameless() + self.faint(), [])
            self.screenshot("confirm-wide-light")
            self.find(f"dialog {action}").click()
            self.wait(lambda: not self.all("dialog"))
            if value == 77:
                self.wait(lambda: self.all(".answer .success"))
            self.assertEqual(self.program.values("/api/v1/stations/press/devices/UW110"), [value])


class Points(Browser):
    ROW = 'tr[data-point="press/setpoint"]'

    def test_a_point_shows_its_value_and_is_written_when_that_is_confirmed(self):
        self.open("points")
        self.wait(lambda: "°C" in self.text(self.ROW))
        self.assertIn("good", self.text(self.ROW))
        self.script("document.querySelector(arguments[0]).click()", self.ROW + " td:last-child button")
        self.find("#new-value").send_keys("41.5")
        self.find("dialog button.primary").click()
        self.wait(lambda: self.all("#confirm"))
        self.assertEqual(self.program.get("/api/v1/stations/press/points/setpoint")[1]["value"], 40)
        self.assertEqual(self.text("dialog .change"), "40 °C → 41.5 °C")
        self.assertIn("1F100078000102019F", self.text("dialog .bytes").replace(" ", ""), "the frame is shown first")
        self.find("#confirm").click()
        self.wait(lambda: self.all("dialog .success"))
        self.assertIn("Value: 41.5 °C", self.text("dialog"))
        self.find("dialog .close").click()
        self.wait(lambda: "41.5" in self.text(self.ROW))
        self.assertEqual(self.complaints(), [])

    def test_a_plot_begins_with_what_the_gateway_remembers(self):
        history = "/api/v1/stations/press/points/setpoint/history"
        self.program.rest("PUT", "/api/v1/stations/press/points/setpoint", {"value": 40})
        self.wait(lambda: len(self.program.get(history)[1]["samples"]) > 3)
        self.open("points")
        self.requested()
        self.wait(lambda: self.all(self.ROW + " td button"))
        self.find(self.ROW + " td button").click()
        self.wait(lambda: self.all(".plot canvas"))  # one value would be no plot
        self.assertTrue(any(url.endswith(history) for url in self.requested()))

    def test_a_point_whose_panel_is_dead_is_stale_and_never_zero(self):
        row = 'tr[data-point="oven/temperature"]'
        self.open("points")
        self.wait(lambda: "good" in self.text(row))
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        try:
            self.wait(lambda: "stale" in self.text(row) or "bad" in self.text(row))
            self.assertNotRegex(self.text(row + " .strong"), r"^0")
            self.assertRegex(self.text(row), r"\(\d\d:\d\d:\d\d\)")
            self.assertTrue(self.all(row + " .strong.muted"))
        finally:
            self.program.rest("PUT", "/api/v1/simulator/oven", {})


class Discovery(Browser):
    def look(self, stations):
        self.open("discovery")
        self.script("document.querySelector('#stations').value = arguments[0];"
                    "document.querySelector('#share').value = 50", stations)
        self.find("button.primary").click()

    def test_it_looks_beside_everybody_else_and_says_how_far_it_is(self):
        self.look("20-24")
        self.wait(lambda: "4 of 4" in self.text('[role="status"].muted'))  # 20 is listed
        self.wait(lambda: self.text(".addresses") == "Asked: 21-24 · No answer: 21-24")
        self.wait(lambda: self.text(".empty") == "No unlisted station has answered.")
        self.open("discovery")
        self.wait(lambda: self.text(".empty") == "No unlisted station has answered.")
        self.assertEqual(self.complaints(), [])

    def test_a_list_that_is_none_is_told_in_words(self):
        self.look("300")
        self.wait(lambda: "1 to 247" in self.text(".refusal"))
        self.complaints()  # a 400 is written to the console, too


class Looks(Browser):
    """Every view, light and dark, wide and narrow; the pictures are kept to be looked at."""

    def settle(self, view):
        self.open(view)
        ready = {"scope": "canvas.scope[data-frames]", "latency": ".plot canvas", "points": "tr[data-point='oven/temperature'] .spark",
                 "relays": "tbody tr", "text": "#plan li", "clients": "tbody tr", "station/press": ".plot canvas"}
        self.wait(lambda: self.all(ready.get(view, "h1")))
        if view == "points":
            self.find('tr[data-point="oven/temperature"] button').click()
            self.wait(lambda: self.all(".plot canvas"))
        if view == "request":
            self.find("#where").send_keys("UW100")
            self.wait(lambda: self.all(".plan .bytes"))
            self.find("#read").click()
            self.wait(lambda: self.all("tr.value"))
        if view == "scope":
            self.wait(lambda: self.all("tbody button"))
            self.find("tbody button").click()
            self.wait(lambda: self.all(".detail .bytes"))

    def test_every_view_says_its_names_is_readable_and_asks_nobody_else(self):
        for size, width in ((WIDE, "wide"), (NARROW, "narrow")):
            for scheme in ("light", "dark"):
                self.resize(size)
                self.prefer(scheme)
                for view in VIEWS:
                    with self.subTest(view=view, width=width, scheme=scheme):
                        self.settle(view)
                        name = f"{view.split('/')[0] or 'overview'}-{width}-{scheme}"
                        self.screenshot(name)
                        scroll, seen = self.script("return [document.documentElement.scrollWidth, innerWidth]")
                        self.assertLessEqual(scroll, seen, "no horizontal scroll")
                        self.assertEqual(self.has_cut(), [])
                        self.assertEqual(self.nameless(), [])
                        self.assertEqual(self.faint(), [])
                        self.assertEqual(self.complaints(), [])
                        self.assertEqual(self.foreign(), [])
        self.resize(WIDE)

    def test_every_language_is_spoken_everywhere(self):
        for language, word in (("de", "Übersicht"), ("ko", "개요"), ("ja", "概要"), ("en", "Overview")):
            self.open()
            self.script("localStorage.setItem('panelgate.language', arguments[0])", language)
            for view in VIEWS:
                self.open(view)
                self.assertEqual(self.script("return document.documentElement.lang"), language)
                self.assertEqual(self.find("#nav a").get_attribute("textContent"), word)
                raw = self.script("return document.body.innerText.match(/\\b(?:nav|state|fn|field|kind|about|key)\\.[a-z0-9]+\\b/g)")
                self.assertIsNone(raw, "a key that the table does not have")
            self.open()
            self.wait(lambda: " ms" in self.text(tile("oven") + " .figure"))
            self.screenshot(f"overview-{language}")

    def test_a_chosen_theme_stays(self):
        self.open()
        self.script("localStorage.setItem('panelgate.theme', 'dark')")
        self.open("scope")
        self.assertEqual(self.script("return document.documentElement.dataset.theme"), "dark")
        self.script("localStorage.removeItem('panelgate.theme')")

    def test_everything_is_reached_by_keyboard(self):
        self.open()
        self.wait(lambda: self.all(".tile"))
        reached = set()
        self.script("document.activeElement.blur()")
        for _ in range(40):
            self.driver.switch_to.active_element.send_keys("\ue004")
            reached.add(self.script("const a = document.activeElement; return a.dataset.station ?? a.dataset.view ?? a.id"))
        self.assertLessEqual({"press", "oven", "scope", "role", "skip"}, reached)


if __name__ == "__main__":
    unittest.main()
