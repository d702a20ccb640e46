#!/usr/bin/env python3
"""pictures.py FOLDER PROGRAM...: what the dashboard of PROGRAM's demo looks like, light and dark, into FOLDER.
docs/pictures.sh makes them small afterwards."""
import json
import pathlib
import sys
import urllib.request

sys.dont_write_bytecode = True  # beside the sources
import running  # noqa: E402
from chrome import Chrome  # noqa: E402

SIZE = (1200, 760)
SHOWN = "performance.getEntriesByName('shown').length === 1 && document.getAnimations().length === 0"
# What has to be there before a picture is taken.
ALL_WELL = "document.querySelectorAll('.tile.good').length === 5 && !document.querySelector('.finding')"
CURVES = "[...document.querySelectorAll('.tile .spark .value')].every((one) => one.getAttribute('d').length > 200)"
TREND = "document.querySelector('[data-point] .value')?.getAttribute('d').split('L').length > 5"


def put(gateway, station, faults):
    request = urllib.request.Request(f"{gateway.base()}/api/v1/simulator/{station}", json.dumps(faults).encode(), method="PUT")
    urllib.request.urlopen(request, timeout=running.PATIENCE).close()


class Album:
    def __init__(self, folder, gateway, chrome):
        self.folder, self.gateway, self.chrome = pathlib.Path(folder), gateway, chrome

    def take(self, name, view, *conditions, then=None, height=SIZE[1]):
        for scheme in ("light", "dark"):
            self.chrome.prefer(scheme)
            self.chrome.open(f"{self.gateway.base()}/#/{view}")
            for condition in (SHOWN, *conditions):
                self.chrome.wait(condition, patience=90)
            if then:
                then()
            (self.folder / f"{name}-{scheme}.png").write_bytes(self.chrome.picture(height))

    def frame(self):
        """What is shown stands still, and its longest reply is explained byte by byte."""
        self.chrome.script("document.querySelector('button.primary').click()")
        self.chrome.script("document.querySelector('button[aria-label=\"Zoom out\"]').click()")
        self.chrome.wait("document.querySelector('canvas.scope').dataset.frames > 10 && document.querySelectorAll('tbody button').length > 10")
        self.chrome.script("[...document.querySelectorAll('tbody button')].sort((a, b) => a.textContent.length - b.textContent.length)"
                           ".at(-1).click()")
        self.chrome.wait("document.querySelector('.detail .meanings dd')?.textContent.length > 0 && / = /.test(document.querySelector('.detail').textContent)")
        self.chrome.script("document.activeElement.blur(); scrollTo(0, 0)")

    def all(self):
        self.take("overview", "", ALL_WELL, CURVES, height=580)
        self.take("station", "station/press", TREND, "document.querySelector('.plot canvas')", height=720)
        self.take("scope", "scope", "document.querySelector('canvas.scope')?.dataset.frames > 4", then=self.frame)
        put(self.gateway, "oven", {"dead": 1})
        self.take("findings", "", "document.querySelector('.tile.bad.offline') && document.querySelector('.finding')", CURVES, height=660)


def main(folder, *program):
    with running.demo(program) as gateway, Chrome() as chrome:
        chrome.resize(SIZE)
        Album(folder, gateway, chrome).all()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
