"""/metrics and the other views of everything, on the real program: whole, true, and at nobody's
expense."""
import gzip
import http.client
import re
import threading
import time
import unittest

import config
import harness
from test_points import until

# What Prometheus asks; no device is there, so that nothing else keeps the gateway busy.
WIDE = config.wide(32, 31, 10, device="/nonexistent/line{}")


def fetch(program, path, coding="identity"):
    """(headers, body) over a connection of its own."""
    client = http.client.HTTPConnection("127.0.0.1", program.http_port(), timeout=harness.PATIENCE)
    client.request("GET", path, headers={"Accept-Encoding": coding})
    answer = client.getresponse()
    assert answer.status == 200, (path, answer.status)
    body = answer.read()
    client.close()
    return answer.headers, body


def families(text):
    """The family of each run of samples, in their order."""
    found = []
    for line in text.splitlines():
        if line.startswith("# TYPE "):
            found.append(line.split()[2])
        elif not line.startswith("#"):
            name = re.match(r"[a-zA-Z_:][a-zA-Z0-9_:]*", line).group()
            assert name.startswith(found[-1]), (name, "stands in", found[-1])
    return found


class Metrics(unittest.TestCase):
    def test_the_text_is_whole_and_the_same_when_it_is_packed(self):
        with harness.demo() as program:
            fetch(program, "/healthz")  # requests are counted by status from the first on
            # Some families are there only when stations were asked and points read.
            until(lambda: {"panelgate_station_up", "panelgate_point_value"} <=
                  set(families(fetch(program, "/metrics")[1].decode())))
            headers, plain = fetch(program, "/metrics")
            self.assertNotIn("Content-Encoding", headers)
            packed_headers, packed = fetch(program, "/metrics", "gzip")
            self.assertEqual(packed_headers["Content-Encoding"], "gzip")
            self.assertEqual(packed_headers["Content-Type"], headers["Content-Type"])
            self.assertLess(len(packed), len(plain) / 5)
            text = gzip.decompress(packed).decode()
            self.assertTrue(text.endswith("\n"))
            names = families(plain.decode())
            self.assertEqual(len(names), len(set(names)))
            self.assertEqual(set(families(text)), set(names))
            self.assertIn("panelgate_loop_lag_seconds", names)
            samples = [line.rsplit(" ", 1)[0] for line in text.splitlines() if line[0] != "#"]
            self.assertEqual(len(samples), len(set(samples)))

    def test_a_station_has_few_series_before_it_is_asked(self):
        silent = config.line(device="/nonexistent/panelgate")
        with harness.configured(config.gateway(silent)) as program:
            text = program.get("/metrics")[1]
            found = re.findall(r'^panelgate_requests_total\{.*station="press".*$', text, re.M)
            self.assertTrue(found)
            self.assertLessEqual(len(found), 12, found)
            for line in found:
                self.assertTrue(line.endswith(' 0'), line)

    def test_a_scrape_of_a_thousand_stations_holds_nobody_up(self):
        with harness.configured(WIDE) as program:
            # A loop that makes the text itself is away for nearly all of it, each time.
            shares = []
            until(lambda: shares.append(self.share_waited(program)) or shares[-1] < 0.5)

    def share_waited(self, program):
        """The longest wait for /healthz during a scrape, as a share of the scrape."""
        waits, ended = [], threading.Event()
        client = http.client.HTTPConnection("127.0.0.1", program.http_port())

        def ask():
            while not ended.is_set():
                start = time.monotonic()
                client.request("GET", "/healthz")
                client.getresponse().read()
                waits.append(time.monotonic() - start)

        asker = threading.Thread(target=ask)
        asker.start()
        start = time.monotonic()
        fetch(program, "/metrics", "gzip")
        took = time.monotonic() - start
        ended.set()
        asker.join()
        client.close()
        return max(waits) / took


class Trace(unittest.TestCase):
    def test_pages_follow_each_other_without_a_hole(self):
        with harness.demo() as program:
            with program.client() as client:
                for _ in range(50):
                    client.ask(31, harness.read_registers(0))
            path = "/api/v1/lines/floor1/trace"
            numbers, following = [], 0
            while True:
                page = program.get(f"{path}?since={following}&last=20")[1]
                entries = [entry["sequence"] for entry in page["frames"] + page["decisions"]]
                entries += [made["ended"] for made in page["transactions"]]
                self.assertLessEqual(len(entries), 20)
                numbers += sorted(entries)
                following = page["next"]
                if not entries or len(numbers) >= 100:
                    break
            self.assertEqual(numbers, list(range(1, len(numbers) + 1)))
            self.assertEqual(following, numbers[-1])
            self.assertEqual(program.get(f"{path}?last=501")[0], 400)


if __name__ == "__main__":
    unittest.main()
