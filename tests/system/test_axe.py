"""Barriers that axe-core finds in the dashboard, the manual and REST's page, light and dark, wide and narrow.

Skipped without chromium and axe-core: see tests/page/README.md. `test_axe.py PAGE ...` looks at these pages only.
"""
import collections
import os
import pathlib
import re
import sys
import unittest

import harness
from browser import VIEWS
from harness import ROOT

sys.path.append(str(ROOT / "deploy/manual"))
import chrome  # noqa: E402

AXE = pathlib.Path(os.environ.get("AXE", ROOT / "node_modules/axe-core/axe.min.js"))
MANUAL = [f"/docs/{path.relative_to(ROOT / 'docs').with_suffix('.html')}" for path in sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [word for word in sys.argv[1:] if word.startswith("/")] or [*(f"/#/{view}" for view in VIEWS), "/docs", *MANUAL]
LOOK = """axe.run(document, {resultTypes: ['violations']}).then((found) => found.violations.flatMap((one) =>
    one.nodes.map((node) => `${one.id}: ${node.target.join(' ')}: ${node.failureSummary.split('\\n').slice(1, 2).join('').trim()}`)))"""
READY = "document.readyState === 'complete' && (!document.querySelector('#nav') || performance.getEntriesByName('shown').length === 1) " \
    "&& document.getAnimations().length === 0"


@unittest.skipUnless(chrome.PROGRAM and AXE.is_file(), "no chromium or no axe-core: tests/page/README.md")
class Barriers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(harness.demo())
        cls.chrome = cls.enterClassContext(chrome.Chrome())
        cls.axe = AXE.read_text()

    def faults(self, path):
        found = []
        for size in (chrome.WIDE, chrome.NARROW):
            self.chrome.resize(size)
            self.chrome.open(self.program.url(path))
            self.chrome.wait(READY)
            self.chrome.script(self.axe + "\n0")
            for scheme in ("light", "dark"):
                self.chrome.prefer(scheme)
                self.chrome.wait(READY)
                found += [f"{size[0]} {scheme}: {one}" for one in self.chrome.script(LOOK)]
        return found

    def test_there_are_none(self):
        kinds = collections.Counter()
        for path in PAGES:
            with self.subTest(page=path):
                found = self.faults(path)
                kinds.update(re.match(r"\d+ \w+: ([\w-]+)", one)[1] for one in found)
                self.assertEqual(found, [])
        print(f"\n  {len(PAGES)} pages, two widths, two themes: {sum(kinds.values())} faults {dict(kinds)}", end="")

    def test_what_is_planted_is_found(self):
        self.chrome.prefer("light")
        self.chrome.open(self.program.url("/docs/glossary.html"))
        self.chrome.script(self.axe + "\n0")
        self.chrome.script("{ const grey = document.createElement('p'); grey.textContent = 'faint'; "
                           "grey.style.color = '#aaa'; "
                           "document.querySelector('main').append(grey, document.createElement('button')); }")
        kinds = {one.split(":")[0] for one in self.chrome.script(LOOK)}
        self.assertLessEqual({"button-name", "color-contrast"}, kinds)


if __name__ == "__main__":
    sys.argv = [word for word in sys.argv if not word.startswith("/")]
    unittest.main()
