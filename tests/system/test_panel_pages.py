#!/usr/bin/env python3
"""docs/panels/*.md: what the program knows of a panel stands there as it says it; the frames have their
CRC and are answered so by the simulated panels of the page's configuration; a scan of them prints what
the page shows."""
import contextlib
import pathlib
import re
import shutil
import socket
import subprocess
import tempfile
import unittest

import harness
from harness import PATIENCE, ROOT, crc

PAGES = {page.stem: page.read_text() for page in sorted((ROOT / "docs/panels").glob("*.md"))}
PANELS = [name for name, text in PAGES.items() if "## Example frames" in text]
PROFILE = r"(?m)^<!-- generated: profile (\S+) -->$"
CONFIG = r"(?ms)^<!-- test: config -->\n```yaml\n(.*?)^```$"
SCAN = r"(?ms)^panelgate scan (/dev/\S+) (--.*?)\n```\n\n```text\n(.*?)^```$"
FRAME = r"(?m)^\| [^|]* \| `([0-9A-F ]+)` \| (`[0-9A-F ]+`|`\.\.\.`|silence) \|$"
QUIET = 0.5  # seconds for a reply that should not come


@contextlib.contextmanager
def simulated(page, link):
    """The panels of the page's configuration behind this link or address, and what was said of it."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "panelgate.yaml"
        file.write_text(re.search(CONFIG, PAGES[page])[1])
        link = link.replace("FOLDER", folder)
        with harness.Program("simulate", "-c", str(file), "--line", f"floor1={link}") as program:
            yield link, program.out.wait_for(r"^line floor1: ([^\s,]+)")[1]


def heard(connection):
    """A whole reply."""
    reply = b""
    while len(reply) < 5 or crc(reply[:-2]) != reply[-2:]:
        more = connection.recv(512)
        assert more, reply.hex(" ")
        reply += more
    return reply


def is_silent(connection):
    connection.settimeout(QUIET)
    try:
        return not connection.recv(512)
    except TimeoutError:
        return True
    finally:
        connection.settimeout(PATIENCE)


class PanelPages(unittest.TestCase):
    def test_they_are_what_the_script_writes(self):
        with tempfile.TemporaryDirectory() as folder:
            copy = shutil.copytree(ROOT / "docs/panels", pathlib.Path(folder) / "docs/panels")
            subprocess.run([ROOT / "deploy/manual/panels.py", folder, harness.PANELGATE], check=True)
            for name, text in PAGES.items():
                self.assertEqual((copy / f"{name}.md").read_text(), text,
                                 f"{name}.md: run deploy/manual/panels.py . build/release/panelgate")

    def test_each_profile_has_its_page(self):
        shown = [profile for text in PAGES.values() for profile in re.findall(PROFILE, text)]
        listed = [line.split()[0] for line in harness.run("profiles").stdout.splitlines()]
        self.assertCountEqual([*shown, "gateway"], listed)

    def test_frames_have_their_crc_and_are_answered_so(self):
        for page in PANELS:
            frames = [(bytes.fromhex(request), reply.strip("`"))
                      for request, reply in re.findall(FRAME, PAGES[page])]
            self.assertGreaterEqual(len(frames), 3, page)
            with simulated(page, "tcp://127.0.0.1:0") as (_, address):
                host, port = address.removeprefix("tcp://").split(":")
                with socket.create_connection((host, int(port)), PATIENCE) as connection:
                    for request, reply in frames:
                        with self.subTest(page=page, request=request.hex(" ")):
                            self.assertEqual(crc(request[:-2]), request[-2:])
                            connection.sendall(request)
                            if reply == "silence":
                                self.assertTrue(is_silent(connection))
                                continue
                            answer = heard(connection)
                            if reply != "...":
                                self.assertEqual(answer.hex(" ").upper(), reply)

    def test_a_scan_prints_what_the_page_shows(self):
        for page in PANELS:
            if not (shown := re.search(SCAN, PAGES[page])):
                continue
            device, options, expected = shown.groups()
            with self.subTest(page=page), simulated(page, "FOLDER/line") as (link, _):
                found = harness.run("scan", link, *options.split())
                self.assertEqual(found.stdout.replace(link, device), expected)


if __name__ == "__main__":
    unittest.main()
