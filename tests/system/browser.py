"""A headless Chromium that looks at the dashboard, and notes what it should not have to."""
import base64
import json
import pathlib
import shutil
import time
import unittest
import urllib.parse

import harness

try:
    from selenium import webdriver
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait
except ImportError:
    webdriver = None

SCREENSHOTS = harness.ROOT / "build/screenshots"
WIDE, NARROW = (1280, 900), (390, 844)
VIEWS = ("", "scope", "latency", "points", "relays", "clients", "request", "discovery", "text", "settings", "station/press")


def missing():
    """What is not there, or ''."""
    if webdriver is None:
        return "no python3-selenium"
    for program in ("chromium", "chromedriver"):
        if not shutil.which(program):
            return f"no {program}"
    return ""


@unittest.skipIf(missing(), f"{missing()}: deploy/install_packages.sh browser")
class Browser(unittest.TestCase):
    """One browser a class, on a gateway that `gateway()` starts."""
    size = WIDE
    scheme = "light"

    @classmethod
    def gateway(cls):
        return cls.enterClassContext(harness.demo())

    @classmethod
    def setUpClass(cls):
        cls.program = cls.gateway()
        cls.origin = cls.program.url("")
        options = webdriver.ChromeOptions()
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                         "--lang=en-US", "--disable-background-networking", "--no-first-run"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        options.binary_location = shutil.which("chromium")
        cls.driver = webdriver.Chrome(options=options)
        cls.addClassCleanup(cls.driver.quit)
        cls.resize(cls.size)

    @classmethod
    def resize(cls, size):
        """Of the page itself: a window has a least width."""
        cls.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
            "width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size == NARROW})

    @classmethod
    def prefer(cls, scheme):
        cls.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "features": [{"name": "prefers-color-scheme", "value": scheme}]})

    def open(self, view=""):
        self.driver.get(f"{self.origin}/#/{view}")
        self.driver.refresh()
        self.wait(lambda: self.script("return performance.getEntriesByName('shown').length") == 1)
        return self

    def script(self, text, *arguments):
        return self.driver.execute_script(text, *arguments)

    def find(self, selector):
        return self.driver.find_element(By.CSS_SELECTOR, selector)

    def all(self, selector):
        return self.driver.find_elements(By.CSS_SELECTOR, selector)

    def text(self, selector):
        """With ordinary blanks for those that no line ends at."""
        return self.script("return document.querySelector(arguments[0])?.textContent ?? ''", selector).replace("\xa0", " ")

    def has_cut(self):
        """What does not show all that it has, and gives no sign of it."""
        return self.script("""return [...document.querySelectorAll('main *, header *, dialog *')].filter((node) => {
            const style = getComputedStyle(node);
            return node.clientWidth > 0 && node.scrollWidth > node.clientWidth + 1 && style.display !== 'inline' && !node.closest('.plot, .yaml, .CodeMirror')
                && style.textOverflow !== 'ellipsis' && !node.matches('select, input, .unseen, .stack');
        }).map((node) => `${node.tagName}.${node.className}: ${node.textContent.slice(0, 60)}`)""")

    def wait(self, condition, patience=harness.PATIENCE):
        WebDriverWait(self.driver, patience, 0.02).until(lambda _: condition())

    def seconds_until(self, condition):
        start = time.monotonic()
        self.wait(condition)
        return time.monotonic() - start

    def complaints(self):
        """Errors and warnings of the console since the last look."""
        return [entry["message"] for entry in self.driver.get_log("browser")
                if entry["level"] in ("SEVERE", "WARNING")]

    def requested(self):
        """URLs that were asked for since the last look."""
        urls = []
        for entry in self.driver.get_log("performance"):
            message = json.loads(entry["message"])["message"]
            if message["method"] == "Network.requestWillBeSent":
                urls.append(message["params"]["request"]["url"])
        return urls

    def foreign(self):
        origin = urllib.parse.urlsplit(self.origin).netloc
        return [url for url in self.requested()
                if urllib.parse.urlsplit(url).netloc not in (origin, "") and not url.startswith("chrome")]

    def screenshot(self, name):
        SCREENSHOTS.mkdir(parents=True, exist_ok=True)
        height = self.script("return document.documentElement.scrollHeight")
        width = self.script("return innerWidth")
        taken = self.driver.execute_cdp_cmd("Page.captureScreenshot", {
            "captureBeyondViewport": True,
            "clip": {"x": 0, "y": 0, "width": width, "height": min(height, 2600), "scale": 1}})
        pathlib.Path(SCREENSHOTS / f"{name}.png").write_bytes(base64.b64decode(taken["data"]))

    def nameless(self):
        """What can be used and says nothing to a screen reader."""
        roles = {"button", "link", "textbox", "combobox", "spinbutton", "meter", "image", "checkbox",
                 "searchbox", "dialog", "img", "navigation"}
        tree = self.driver.execute_cdp_cmd("Accessibility.getFullAXTree", {})["nodes"]
        return [(node["role"]["value"], node.get("backendDOMNodeId")) for node in tree
                if not node.get("ignored") and node.get("role", {}).get("value") in roles
                and not node.get("name", {}).get("value", "").strip()]

    def faint(self):
        """Texts whose contrast is below what WCAG 2.1 AA asks (4.5, or 3 where they are large)."""
        self.wait(lambda: self.script("return document.getAnimations().length") == 0)
        return self.script((pathlib.Path(__file__).parent / "contrast.js").read_text())
