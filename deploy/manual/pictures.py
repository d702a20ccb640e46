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
CURVES = "[...document.querySelectorAll('.tile polyline, .tile path')].filter((one) => (one.getAttribute('points') ?? one.getAttribute('d') ?? '').length > 200).length >= 5"


def put(gateway, station, faults):
    request = urllib.request.Request(f"{gateway.base()}/api/v1/simulator/{station}", json.dumps(faults).encode(), method="PUT")
    urllib.request.urlopen(request, timeout=running.PATIENCE).close()


class Album:
    def __init__(self, folder, gateway, chrome):
        self.folder, self.gateway, self.chrome = pathlib.Path(folder), gateway, chrome

    def take(self, name, view, *conditions, then=None, height=None):
        self.chrome.open(f"{self.gateway.base()}/#/{view}")
        for scheme in ("light", "dark"):
            self.chrome.prefer(scheme)
            for condition in (SHOWN, *conditions):
                self.chrome.wait(condition, patience=90)
            if then:
                then()
            (self.folder / f"{name}-{scheme}.png").write_bytes(self.chrome.picture(height))

    def frame(self):
        """A reply is picked and shown byte by byte."""
        self.chrome.wait("document.querySelector('canvas.scope').dataset.frames > 12")
        self.chrome.script("document.querySelector('button.primary[aria-pressed=true]') || document.querySelector('button.primary').click()")
        self.chrome.script("[...document.querySelectorAll('tbody button')].filter((one) => one.textContent.startsWith('1F 03')).at(-1)?.click()")
        self.chrome.wait("document.querySelector('.detail .meanings')")

    def all(self):
        self.take("overview", "", ALL_WELL, CURVES)
        self.take("station", "station/press", "document.querySelectorAll('[data-point] .badge.good').length >= 3",
                  "document.querySelector('.plot canvas')")
        self.take("scope", "scope", "document.querySelector('canvas.scope')", then=self.frame)
        put(self.gateway, "oven", {"dead": 1})
        self.take("findings", "", "document.querySelector('.tile.bad.offline') && document.querySelector('.finding')", CURVES)


def main(folder, *program):
    with running.demo(program) as gateway, Chrome() as chrome:
        chrome.resize(SIZE)
        Album(folder, gateway, chrome).all()


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
