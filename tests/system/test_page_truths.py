"""The dashboard tells what is so: outages, who has used a line, what is wrong in the reader's words;
in headless Chromium, skipped where there is none."""
import unittest

from browser import Browser


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

    def test_its_tile_ticks_and_boasts_of_no_latency(self):
        self.open()
        self.wait(lambda: self.text(tile("oven") + " .figure").startswith("answers in "))
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


if __name__ == "__main__":
    unittest.main()
