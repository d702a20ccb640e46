"""Who may see and do what on the dashboard, in headless Chromium; skipped where there is none."""
import pathlib
import signal
import tempfile
import unittest

import harness
from browser import VIEWS, Browser
from config import PRESS, gateway, line


TILE = '.tile[data-station="press"]'


class Roles(Browser):
    """Without a token everybody may look; a token is needed to write."""
    anonymous = "viewer"
    stations = PRESS
    more = {}

    @classmethod
    def gateway(cls):
        cls.folder = folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        (folder / "ops").write_text("let-me-write-please-4711\n")
        (folder / "eye").write_text("let-me-look-please-4711\n")
        tokens = ", ".join(f"{{name: {name}, role: {role}, file: {folder / name}}}"
                           for name, role in (("ops", "operator"), ("eye", "viewer")))
        config = folder / "panelgate.yaml"
        config.write_text(gateway(line(stations=cls.stations), **cls.more,
                                  http=f'listen: "127.0.0.1:0", anonymous: {cls.anonymous}, tokens: [{tokens}]'))
        return cls.enterClassContext(harness.Program("run", "-c", str(config)))

    def enter(self, token):
        self.find("#role").click()
        self.find("#token").send_keys(token)
        self.find("dialog button.primary").click()

    def test_who_looks_cannot_write_and_a_token_of_an_operator_lets_one(self):
        self.open("request/press")
        self.wait(lambda: self.all("#role-needed"))
        self.assertFalse(self.all("#write"))
        self.enter("wrong-and-long-enough")
        self.wait(lambda: self.all("dialog .refusal"))
        self.find("dialog button[type=button]").click()
        self.enter("let-me-look-please-4711")
        self.wait(lambda: not self.all("dialog"))
        self.assertFalse(self.all("#write"))
        self.enter("let-me-write-please-4711")
        self.wait(lambda: self.all("#write"))
        self.assertIn("operator", self.text("#role"))
        kept = self.script("return [JSON.stringify(localStorage), document.cookie, location.href]")
        self.assertNotIn("4711", "".join(kept))
        self.complaints()  # the refusals


class SignIn(Roles):
    """Without a token nobody may look: the page asks for one."""
    anonymous = "none"
    test_who_looks_cannot_write_and_a_token_of_an_operator_lets_one = None

    def sign_in(self, token):
        self.find("#token").clear()
        self.find("#token").send_keys(token)
        self.find("#sign-in button.primary").click()

    def opened(self, view=""):
        """As a new tab."""
        self.driver.get(f"{self.origin}/#/{view}")
        self.script("sessionStorage.clear()")
        self.driver.refresh()
        self.wait(lambda: self.all("#sign-in"))

    def tearDown(self):
        self.script("sessionStorage.clear()")
        self.complaints()  # the refusals

    def test_it_asks_for_a_token_until_the_gateway_knows_it(self):
        self.opened()
        self.assertIn("token", self.text("#sign-in"))
        self.assertEqual(self.nameless() + self.faint(), [])
        self.screenshot("sign-in-wide-light")
        self.sign_in("wrong-and-long-enough")
        self.wait(lambda: "does not know this token" in self.text("#sign-in .refusal"))
        self.assertFalse(self.all(".tile"))
        self.sign_in("let-me-look-please-4711")
        self.wait(lambda: self.all(TILE))
        self.assertIn("viewer", self.text("#role"))
        self.complaints()
        self.open()
        self.wait(lambda: self.all(TILE))
        self.assertEqual(self.complaints(), [], "the tab remembers it, and nothing is asked without it")

    def test_what_happens_is_told_by_events_and_files_are_taken_with_the_token(self):
        self.opened("scope")
        self.requested()
        self.sign_in("let-me-look-please-4711")
        self.wait(lambda: self.all("a[download='floor1.json']"))
        self.complaints()
        self.wait(lambda: any("/api/v1/events?" in url for url in self.requested()))
        self.find("a[download='floor1.json']").click()
        self.wait(lambda: any("last=500" in url for url in self.requested()))
        self.assertFalse(self.all("dialog"))
        self.assertEqual(self.complaints(), [])

    def test_who_signs_out_is_asked_again(self):
        self.opened("settings")
        self.sign_in("let-me-write-please-4711")
        self.wait(lambda: "operator" in self.text("#role"))
        self.find("#role").click()
        self.find("#sign-out").click()
        self.wait(lambda: self.all("#sign-in"))
        self.assertEqual(self.script("return sessionStorage.length"), 0)

    def test_a_token_that_is_taken_away_is_asked_for_again(self):
        self.opened()
        self.sign_in("let-me-look-please-4711")
        self.wait(lambda: self.all(TILE))
        eye = self.folder / "eye"
        eye.write_text("another-to-look-please-0815\n")
        try:
            self.program.process.send_signal(signal.SIGHUP)
            self.wait(lambda: self.all("#sign-in"))
            self.assertIn("does not know this token", self.text("#sign-in"))
            self.sign_in("another-to-look-please-0815")
            self.wait(lambda: self.all(TILE))
        finally:
            eye.write_text("let-me-look-please-4711\n")
            self.program.process.send_signal(signal.SIGHUP)
            self.program.log.wait_for("reload", 2)



class OneStation(SignIn):
    """A viewer whom a rule shows one station of two."""
    stations = """
      {id: 31, name: press, profile: autonics-gplp-s, points: [{name: warmth, at: UW200}, {name: mode, at: UW105, writable: true}]},
      {id: 20, name: oven, profile: panasonic-gt, points: [{name: heat, at: GDT100}]}""".strip()
    more = {"access": """{rules: [{name: eye-sees-press, allow: [read], tokens: [eye], stations: [press]},
      {name: eye-sees-no-more, deny: [read, write, broadcast, raw], tokens: [eye]}]}"""}
    test_it_asks_for_a_token_until_the_gateway_knows_it = None
    test_what_happens_is_told_by_events_and_files_are_taken_with_the_token = None
    test_who_signs_out_is_asked_again = None
    test_a_token_that_is_taken_away_is_asked_for_again = None

    def test_no_view_shows_the_other_nor_a_button_in_vain_and_nothing_is_refused(self):
        self.opened()
        self.sign_in("let-me-look-please-4711")
        self.wait(lambda: self.all(TILE))
        self.complaints()
        for view in VIEWS:
            with self.subTest(view=view):
                self.open(view)
                self.wait(lambda: self.script("return document.querySelector('main, #view').innerText.length") > 0)
                shown = self.script("return document.body.innerText").lower()
                for word in ("oven", "panasonic", "heat"):
                    self.assertNotIn(word, shown)
                self.assertFalse(self.all("#write"))
                self.assertFalse([one.text for one in self.all("main button") if one.text.lower() in ("write", "search", "start", "look for stations")])
                self.assertEqual(self.complaints(), [])


if __name__ == "__main__":
    unittest.main()
