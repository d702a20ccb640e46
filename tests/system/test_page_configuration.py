"""The configuration file on the dashboard, in headless Chromium; skipped where there is none."""
import pathlib
import tempfile
import time
import unittest

import config
import harness
from browser import Browser, webdriver
from rest_plant import tokens
from test_configuration import TEXT, ask

MIXER = "{id: 5, name: mixer, profile: autonics-gp-2005}"
HEAD = "# The press of hall 1, do not touch\n"
TYPED = "const e = document.querySelector('.CodeMirror').CodeMirror; "


class Editing(Browser):
    """A line with one listed panel and one that is not; an admin who looks."""

    @classmethod
    def gateway(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        panels = folder / "panels.yaml"
        panels.write_text(config.gateway(config.line(stations=f"{config.PRESS}, {MIXER}"), modbus=None))
        bus = cls.enterClassContext(harness.Program("simulate", "-c", str(panels), "--line", "floor1=tcp://127.0.0.1:0"))
        port = bus.out.wait_for(r"^line floor1: tcp://127\.0\.0\.1:(\d+)").group(1)
        cls.content = HEAD + config.gateway(config.line(device=f"tcp://127.0.0.1:{port}"), http=config.ADMIN)
        cls.file = folder / "panelgate.yaml"
        cls.file.write_text(cls.content)
        return cls.enterClassContext(harness.Program("run", "-c", str(cls.file)))

    def setUp(self):
        if self.file.read_text() != self.content:
            self.assertEqual(ask(self.program, "PUT", TEXT, self.content, "*")[0], 200)
        self.open("text")
        self.wait(lambda: self.text("#counted") == "It can be applied.")

    def tearDown(self):
        self.script("onbeforeunload = null; " + TYPED + "e.setValue(arguments[0])", self.content)
        self.complaints()

    def value(self):
        return self.script(TYPED + "return e.getValue()")

    def change(self, before, after):
        self.script(TYPED + "e.setValue(e.getValue().replace(arguments[0], arguments[1]))", before, after)

    def press(self, keys):
        """Where the cursor is."""
        webdriver.ActionChains(self.driver).send_keys(keys).perform()

    def saved(self):
        self.wait(lambda: self.script("return !document.querySelector('#save').disabled"))
        self.find("#save").click()

    def test_a_fault_shows_at_its_line_within_a_second(self):
        row = next(i for i, line in enumerate(self.content.split("\n")) if "profile" in line)
        self.script(TYPED + "e.focus(); e.setCursor({line: arguments[0], ch: e.getLine(arguments[0]).indexOf('profile') + 7})", row)
        began = time.monotonic()
        self.press("s")
        self.wait(lambda: self.all(".CodeMirror-lint-marker-error"))
        took = time.monotonic() - began
        print(f"\n  a fault is marked {took:.2f} s after its key", end="")
        self.assertLess(took, 1)
        marked = self.script("const all = [...document.querySelectorAll('.CodeMirror-code > div')];"
                             "return all.findIndex((one) => one.querySelector('.CodeMirror-lint-marker-error'))")
        self.assertEqual(marked, row)
        self.assertIn("did you mean 'profile'", self.text("#problems"))
        self.assertRegex(self.text("#counted"), "Faults: [1-9]")
        self.assertFalse(self.find("#save").is_enabled())
        self.assertEqual(self.file.read_text(), self.content)

    def test_keys_are_offered_by_the_schema(self):
        self.script(TYPED + "e.focus(); e.setCursor(e.lastLine(), 0)")
        self.press("re")
        self.wait(lambda: self.all(".CodeMirror-hint"))
        self.assertIn("relays", self.text(".CodeMirror-hints"))

    def test_a_station_that_was_found_is_added_saved_and_polled(self):
        self.open("discovery")
        self.script("document.querySelector('#stations').value = '4-6'; document.querySelector('#share').value = 50")
        self.find("button.primary").click()
        self.wait(lambda: self.all("button.add"))
        self.find("button.add").click()
        self.wait(lambda: self.all(".CodeMirror") and "id: 5" in self.value())
        longer = self.value()
        self.assertTrue(longer.startswith(HEAD))
        added = next(i for i in range(len(longer)) if longer[i] != self.content[i])
        size = len(longer) - len(self.content)
        self.assertEqual(longer[:added] + longer[added + size:], self.content)
        self.wait(lambda: "floor1-5" in self.text("#changes"))
        self.screenshot("configuration-added")
        self.change("name: floor1-5", "name: floor1-5, points: [{name: speed, at: UW200, every: 100ms}]")
        self.saved()
        self.wait(lambda: self.all(".success"))
        self.wait(lambda: self.program.get("/api/v1/stations/floor1-5/points/speed")[1].get("quality") == "good")
        self.assertIn("id: 5", self.file.read_text())
        self.wait(lambda: len(self.all("[data-version]")) > 1)

    def test_what_was_read_becomes_a_point(self):
        self.open("request/press")
        self.find("#where").send_keys("UW200")
        self.find("#read").click()
        self.wait(lambda: self.all("#make-point"))
        self.find("#make-point").click()
        self.wait(lambda: self.all(".CodeMirror") and "points: [{name: uw200, at: UW200}]" in self.value())
        self.wait(lambda: "uw200" in self.text("#changes"))

    def test_of_two_who_save_the_second_sees_the_difference(self):
        self.change("hall 1", "hall 7")
        other = self.content + "# by somebody else\n"
        self.assertEqual(ask(self.program, "PUT", TEXT, other, "*")[0], 200)
        self.saved()
        self.wait(lambda: self.all("#conflict"))
        self.assertIn("by somebody else", self.text("#conflict .gone:last-of-type") + self.text("#conflict"))
        self.assertIn("hall 7", self.text("#conflict .come"))
        self.assertEqual(self.file.read_text(), other)
        self.screenshot("configuration-conflict")
        self.find("#keep-mine").click()
        self.wait(lambda: not self.all("#conflict"))
        self.assertIn("Nothing is written yet", self.text("#kept"))
        self.saved()
        self.wait(lambda: self.all(".success"))
        self.assertEqual(self.file.read_text(), self.content.replace("hall 1", "hall 7"))

    def test_there_is_a_way_back(self):
        self.change("hall 1", "hall 8")
        self.saved()
        self.wait(lambda: self.all(".success") and "hall 8" in self.file.read_text())
        self.wait(lambda: len(self.all("[data-version]")) > 1)
        self.script("document.querySelectorAll('[data-version] button')[1].click()")  # in one step: the list is drawn anew
        self.wait(lambda: self.all("dialog .difference"))
        self.assertIn("hall 1", self.text("dialog .come"))
        self.find("#roll-back").click()
        self.wait(lambda: self.all("dialog #confirm"))
        self.assertIn("The file becomes Version", self.text("dialog"))
        self.find("#confirm").click()
        self.wait(lambda: self.file.read_text() == self.content and self.value() == self.content)

    def test_what_will_be_interrupted_is_asked_for(self):
        self.change("tcp://127.0.0.1:", "tcp://127.0.0.2:")
        self.wait(lambda: "floor1" in self.text("#changes .warning"))
        self.saved()
        self.wait(lambda: self.all("dialog #confirm"))
        self.assertIn("floor1", self.text("dialog"))
        self.find("dialog button[autofocus]").click()
        self.assertEqual(self.file.read_text(), self.content)


class Barred(Browser):
    """A file under Git, and a client without a token who may only look."""

    @classmethod
    def gateway(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        (folder / ".git").mkdir()
        file = folder / "panelgate.yaml"
        door = config.FREE_PORT + f", anonymous: viewer, tokens: {tokens(folder, {'chief': 'admin'})}"
        file.write_text(config.gateway(config.line(), http=door))
        return cls.enterClassContext(harness.Program("run", "-c", str(file)))

    def test_a_viewer_sees_none_of_it_and_an_admin_why_it_cannot_be_saved(self):
        for view in ("", "discovery", "text"):
            self.open(view)
            self.wait(lambda: self.all("main h1"))
            self.assertFalse(self.all('#nav a[data-view="text"], .CodeMirror, #save, .add'), view)
        self.open("request/press")
        self.find("#where").send_keys("UW200")
        self.find("#read").click()
        self.wait(lambda: self.all("tr.value"))
        self.assertFalse(self.all("#make-point"))
        self.find("#role").click()
        self.find("#token").send_keys("token-of-chief-0123456789")
        self.find("dialog button.primary").click()
        self.wait(lambda: self.all('#nav a[data-view="text"]'))
        self.find('#nav a[data-view="text"]').click()
        self.wait(lambda: self.text("#counted") == "It can be applied.")
        self.assertIn("under Git", self.text("#read-only"))
        self.assertFalse(self.all("#save"))
        self.assertTrue(self.all("#copy"))
        self.complaints()


if __name__ == "__main__":
    unittest.main()
