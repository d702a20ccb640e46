"""Chromium without a window, spoken to through a pipe (the DevTools protocol): it wants the package chromium
and nothing else. Looks at pages for docs/pictures.sh and for the tests."""
import base64
import contextlib
import json
import os
import shutil
import subprocess
import tempfile
import time

WIDE, NARROW = (1280, 900), (390, 844)
PATIENCE = 30  # seconds
PROGRAM = shutil.which("chromium")
KEYS = {"Tab": 9, "Enter": 13, "Escape": 27, "ArrowUp": 38, "ArrowDown": 40, "/": 191}


class Refused(Exception):
    """Chromium has not done a command."""


class Chrome:
    """One tab; a context manager. `requests` are the addresses that were asked for, `complaints` what the
    console has said of errors and warnings."""

    def __enter__(self):
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        theirs_in, self._out = os.pipe()
        self._in, theirs_out = os.pipe()
        options = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--lang=en-US",
                   "--disable-background-networking", "--no-first-run", "--hide-scrollbars", "--font-render-hinting=none",
                   "--remote-debugging-pipe", f"--user-data-dir={self._folder.name}"]
        self._process = subprocess.Popen(
            ["bash", "-c", f'exec "$0" "$@" 3<&{theirs_in} 4>&{theirs_out}', PROGRAM, *options],
            pass_fds=(theirs_in, theirs_out), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(theirs_in)
        os.close(theirs_out)
        self._rest, self._number, self._session = b"", 0, None
        self._events, self.requests, self.complaints = [], [], []
        target = self.command("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.command("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.command(f"{domain}.enable")
        self.resize(WIDE)
        return self

    def __exit__(self, *_):
        os.close(self._out)
        try:
            self._process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._in)
        self._folder.cleanup()

    def _message(self):
        while b"\0" not in self._rest:
            more = os.read(self._in, 1 << 16)
            if not more:
                raise EOFError("chromium has ended")
            self._rest += more
        text, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(text)
        self._note(message.get("method"), message.get("params", {}))
        return message

    def _note(self, method, params):
        self._events.append(method)
        if method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(json.dumps(params["exceptionDetails"]))
        elif method == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.complaints.append(f"{params['entry']['text']} {params['entry'].get('url', '')}")

    def command(self, method, **params):
        self._number += 1
        number = self._number
        asked = {"id": number, "method": method, "params": params}
        if self._session:
            asked["sessionId"] = self._session
        os.write(self._out, json.dumps(asked).encode() + b"\0")
        while (message := self._message()).get("id") != number:
            pass
        if "error" in message:
            raise Refused(f"{method}: {message['error']}")
        return message["result"]

    def resize(self, size):
        self.command("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1], deviceScaleFactor=1,
                     mobile=size[0] < 500)

    def prefer(self, scheme):
        self.command("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def open(self, url):
        """Ends when all of the page is there, whatever was open before."""
        for address in ("about:blank", url):
            self._events.clear()
            self.command("Page.navigate", url=address)
            while "Page.loadEventFired" not in self._events:
                self._message()

    def arrived(self, path):
        """Waits until a link has led there."""
        self.wait(f"location.pathname === {json.dumps(path)} && document.readyState === 'complete'")

    def script(self, text):
        """What an expression is, or what its promise gives."""
        done = self.command("Runtime.evaluate", expression=text, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in done:
            raise AssertionError(f"{text}\n{done['exceptionDetails']}")
        return done["result"].get("value")

    def wait(self, condition, patience=PATIENCE):
        """Until an expression of the page is true, and of the next one where a link leads away meanwhile."""
        look = f"new Promise((done) => {{ const end = Date.now() + 500; const look = () => {{ if ({condition}) done(true); " \
               "else if (Date.now() > end) done(false); else setTimeout(look, 20); }; look(); })"
        end = time.monotonic() + patience
        while time.monotonic() < end:
            with contextlib.suppress(Refused):
                if self.script(look):
                    return
        raise AssertionError(f"never true: {condition}")

    def key(self, name):
        """A key by its name, or a text that is typed."""
        if name not in KEYS:
            self.command("Input.insertText", text=name)
            return
        key = {"key": name, "code": name, "windowsVirtualKeyCode": KEYS[name]}
        typed = {"text": "\r"} if name == "Enter" else {"text": name} if len(name) == 1 else {}
        self.command("Input.dispatchKeyEvent", type="keyDown" if typed else "rawKeyDown", **key, **typed)
        self.command("Input.dispatchKeyEvent", type="keyUp", **key)

    def picture(self, height=None):
        """PNG of what is in view, or of the page down to a height."""
        clip = {}
        if height:
            clip = {"clip": {"x": 0, "y": 0, "width": self.script("innerWidth"), "height": height, "scale": 1},
                    "captureBeyondViewport": True}
        return base64.b64decode(self.command("Page.captureScreenshot", **clip)["data"])
