"""The views of the day: alarms, events and history; in headless Chromium, skipped where there is none."""
import config
import harness
from browser import NARROW, WIDE, Browser

PRESS = """{id: 31, name: press, profile: autonics-gplp-s,
      points: [{name: setpoint, at: UW120, unit: celsius, writable: true, every: 100ms, overview: true},
               {name: speed, at: UW130, unit: rpm, every: 100ms}, {name: mode, at: UW131, every: 100ms, overview: true}]}"""
ALARMS = """[{name: press-hot, point: press/setpoint, above: 40, back: 30, severity: urgent, text: The press is too hot},
  {name: press-lost, station: press, offline: true}]"""
SETPOINT = "/api/v1/stations/press/points/setpoint"


class Day(Browser):
    @classmethod
    def gateway(cls):
        text = config.gateway(config.line(stations=PRESS), http=config.ADMIN, alarms=ALARMS)
        return cls.enterClassContext(harness.configured(text, "--simulate"))

    def set_point(self, value):
        self.assertEqual(self.program.rest("PUT", SETPOINT, {"value": value})[0], 200)

    def looks(self, name):
        for size in (WIDE, NARROW):
            self.resize(size)
            for scheme in ("light", "dark"):
                self.prefer(scheme)
                self.assertEqual(self.faint(), [], (name, size, scheme))
                self.screenshot(f"{name}-{size[0]}-{scheme}")
            self.assertFalse(self.script("return document.documentElement.scrollWidth > innerWidth"), (name, size))
        self.resize(WIDE)
        self.prefer("light")
        self.assertEqual(self.nameless(), [])
        self.assertEqual(self.complaints(), [])

    def test_an_alarm_is_in_title_and_menu_until_somebody_acknowledges(self):
        self.set_point(20)
        self.program.rest("POST", "/api/v1/alarms/press-hot/acknowledge", {})  # of the simulated panel's first value
        self.open("alarms")
        row = 'tr[data-alarm="press-hot"]'
        self.wait(lambda: "normal" in self.text(row))
        self.set_point(50)
        self.wait(lambda: "The press is too hot press-hot · press/setpointactive" in self.text(row))
        self.wait(lambda: self.driver.title.startswith("⚠ 1 · Alarms"))
        self.assertEqual(self.text('#nav a[data-view="alarms"]'), "Alarms (1)")
        self.looks("alarms")
        self.find(f"{row} button").click()
        self.wait(lambda: "acknowledged" in self.text(row) and "http 127.0.0.1" in self.text(row))
        self.wait(lambda: not self.driver.title.startswith("⚠"))

    def test_events_by_kind_and_as_a_file(self):
        self.set_point(21)
        self.open("journal")
        self.wait(lambda: "setpoint = 21" in self.text("tbody"))
        self.assertIn("start", self.text("tbody"))
        self.looks("journal")
        self.open("journal/writes/press")
        self.wait(lambda: "setpoint = 21" in self.text("tbody"))
        self.assertNotIn("panelgate ", self.text("tbody"))

    def test_history_opens_with_the_span_that_has_values(self):
        self.wait(lambda: len(self.program.get(SETPOINT + "/history?step=10s")[1]["samples"]) > 1)
        self.open("history/press/setpoint")
        self.wait(lambda: self.script("return document.querySelector('.bar select').value") == "1")

    def test_a_tile_has_the_values_that_were_chosen_and_trouble_comes_first(self):
        self.set_point(20)
        self.program.rest("POST", "/api/v1/alarms/press-hot/acknowledge", {})
        self.open("")
        self.wait(lambda: "setpoint 20" in self.text(".tile-values"))
        self.assertIn("mode", self.text(".tile-values"))
        self.assertNotIn("speed", self.text(".tile-values"))
        self.wait(lambda: "all is well" in self.text(".counts"))
        self.program.rest("PUT", "/api/v1/simulator/press", {"dead": 1})
        self.wait(lambda: "(stale)" in self.text(".tile-values") or "(bad)" in self.text(".tile-values"))
        self.assertNotIn("all is well", self.text(".counts"))
        self.program.rest("PUT", "/api/v1/simulator/press", {})
        self.wait(lambda: "all is well" in self.text(".counts"))

    def test_a_view_that_is_not_there_is_told(self):
        self.open("hystory")
        self.wait(lambda: "There is no such view" in self.text("#no-view"))
        self.open("history")
        self.wait(lambda: not self.all("#no-view"))

    def test_history_has_a_plot_of_the_points_that_are_chosen(self):
        self.set_point(22)
        self.wait(lambda: len(self.program.get(SETPOINT + "/history?step=10s")[1]["samples"]) > 1)
        self.open("history/press/setpoint")
        self.script("const s = document.querySelector('.bar select'); s.value = '1'; s.dispatchEvent(new Event('change'))")
        self.wait(lambda: self.script("return Number(document.querySelector('.plot.tall').dataset.rows ?? 0)") >= 2)
        self.assertRegex(self.text(".plot-values"), r"press/setpoint [\d.]+ °C")
        self.assertEqual(self.text(".dygraph-ylabel"), "°C")
        self.assertFalse(self.all(".dygraph-y2label"))
        self.find('.picks label:nth-of-type(2) input').click()
        self.wait(lambda: self.all(".dygraph-y2label"))
        self.assertIn("rpm", self.text(".dygraph-y2label"))
        self.looks("history")


if __name__ == "__main__":
    import unittest
    unittest.main()
