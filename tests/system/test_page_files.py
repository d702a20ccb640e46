"""What the dashboard is made of, looked at without a browser: sizes, headers, the table of words."""
import gzip
import json
import re
import shutil
import subprocess
import unittest
import urllib.error
import urllib.request

import harness

FOLDER = harness.ROOT / "src/web/page"
LANGUAGES = 4
LARGEST = 150_000  # bytes of everything a browser fetches, packed, but for the editor
EDITOR = {"codemirror.js", "codemirror.css", "yaml.js", "lint.js", "show-hint.js"}
LARGEST_EDITOR = 125_000
LONGEST = 300      # lines of a file


TABLES = ("words.js", "finding_words.js", "day_words.js", "configuration_words.js")


def words():
    table = {}
    for name in TABLES:
        text = (FOLDER / name).read_text()
        table |= json.loads(text[text.index("= ") + 2:text.rindex(";")])
    return table


class Files(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(harness.demo())

    def fetch(self, path, **headers):
        request = urllib.request.Request(self.program.url(path), headers=headers)
        with urllib.request.urlopen(request, timeout=harness.PATIENCE) as response:
            return response.headers, response.read()

    def named(self):
        """Every file that the page, its styles and its modules name."""
        found, open_ = {"index.html"}, ["index.html"]
        while open_:
            name = open_.pop()
            text = self.fetch("/" if name == "index.html" else f"/page/{name}")[1].decode()
            names = re.findall(r"page/([\w.-]+\w)", text) + (
                re.findall(r"from '\./([\w.]+)'", text) if name.endswith(".js") and ".min." not in name and name not in EDITOR else [])
            for other in set(names) - found:
                found.add(other)
                open_.append(other)
        return found

    def test_every_file_is_named_and_every_name_is_a_file(self):
        own = {path.name for path in FOLDER.iterdir()}
        self.assertEqual(self.named() - own, {"dygraph.min.js", "dygraph.min.css"} | EDITOR)
        self.assertEqual(own - self.named(), set())

    def test_all_of_it_is_small(self):
        sizes = {}
        for name in self.named():
            headers, body = self.fetch("/" if name == "index.html" else f"/page/{name}", **{"Accept-Encoding": "gzip"})
            self.assertEqual(headers["Content-Encoding"], "gzip", name)
            gzip.decompress(body)
            sizes[name] = len(body)
        editor = sum(sizes.pop(name) for name in EDITOR)
        self.assertLess(editor, LARGEST_EDITOR)
        total = sum(sizes.values())
        print(f"\n  {len(sizes)} files, {total} bytes packed, {sizes['dygraph.min.js']} of them the plots'", end="")
        self.assertLess(total, LARGEST)

    def test_headers_are_strict_and_let_a_browser_keep_what_it_has(self):
        for path in ("/", "/page/app.js", "/page/page.css", "/page/icon.svg"):
            headers, _ = self.fetch(path)
            policy = headers["Content-Security-Policy"]
            self.assertIn("default-src 'self'", policy)
            self.assertNotIn("unsafe", policy)
            self.assertEqual(headers["X-Content-Type-Options"], "nosniff")
            with self.assertRaises(urllib.error.HTTPError) as same:
                self.fetch(path, **{"If-None-Match": headers["ETag"]})
            self.assertEqual(same.exception.code, 304)
            same.exception.close()

    def test_the_page_has_no_style_or_script_within(self):
        text = (FOLDER / "index.html").read_text()
        self.assertNotRegex(text, r"<style|<script(?![^>]*src=)|\son\w+=|\sstyle=")
        self.assertNotRegex("".join(path.read_text() for path in FOLDER.iterdir()), r"https?://(?!www\.w3\.org/2000/svg)")

    def test_files_are_short(self):
        for path in FOLDER.iterdir():
            self.assertLessEqual(path.read_text().count("\n"), LONGEST, path.name)


class Modules(unittest.TestCase):
    @unittest.skipIf(shutil.which("node") is None, "no node: apt-get install nodejs")
    def test_the_pure_ones_do_what_they_say(self):
        done = subprocess.run(["node", "--test", str(harness.ROOT / "tests/page")], capture_output=True, text=True,
                              timeout=harness.PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)


class Words(unittest.TestCase):
    def test_every_word_is_said_in_every_language_with_the_same_values(self):
        for key, said in words().items():
            self.assertEqual(len(said), LANGUAGES, key)
            for text in said:
                self.assertTrue(text.strip(), key)
                self.assertEqual(sorted(re.findall(r"{\w+}", text)), sorted(re.findall(r"{\w+}", said[0])), key)

    def test_every_cause_of_the_line_doctor_is_said_with_figures_that_it_has(self):
        doctor = "".join(path.read_text() for path in (harness.ROOT / "src/doctor").glob("*.cpp"))
        codes = re.findall(r'^    "([a-z-]+)",$', (harness.ROOT / "include/panelgate/doctor/settings.hpp").read_text(), re.M)
        figures = set(re.findall(r'\{"(\w+)",', doctor)) | set(re.findall(r'figures\["(\w+)"\]', doctor))
        gateway = "".join(path.read_text() for path in (harness.ROOT / "src/gateway").glob("findings.cpp"))
        of_gateway = set(re.findall(r'\.cause = "([a-z-]+)"', gateway))
        figures |= set(re.findall(r'\{"(\w+)",', gateway)) | {"clients"}
        table = words()
        for cause in of_gateway:
            self.assertLessEqual({f"finding.{cause}", f"advice.{cause}"}, set(table))
        damage = {"wrong-baud", "wrong-parity", "noise", "tcp-framing", "damaged-replies"}
        for cause in codes:
            self.assertLessEqual({f"finding.{cause}", f"advice.{cause}"}, set(table))
            self.assertIn("evidence.damage" if cause in damage else f"evidence.{cause}", table)
        for key, (english, *_) in table.items():
            if key.startswith(("advice.", "evidence.")) and (gateway or key != "evidence.overload"):
                self.assertLessEqual(set(re.findall(r"{(\w+)}", english)), figures, key)

    def test_no_word_is_there_twice(self):
        keys = re.findall(r'^"([^"]+)":', "".join((FOLDER / name).read_text() for name in TABLES), re.M)
        self.assertEqual(len(keys), len(set(keys)))

    def test_every_word_that_the_page_says_is_in_the_table_and_every_other_is_said(self):
        code = "".join(path.read_text() for path in FOLDER.glob("*.js") if path.name not in TABLES)
        table = words()
        said = set(re.findall(r"\bt\('([\w.-]+)'", code)) - {key for key in re.findall(r"\bt\('([\w.-]+\.)' \+", code)}
        self.assertEqual(said - set(table), set())
        quoted = set(re.findall(r"'([\w.-]+)'", code))
        kinds = re.findall(r"\bt\('(\w+\.)' \+", code) + [f"{kind}." for kind in re.findall(r"word\('(\w+)'", code)] + ["state.", "finding.", "advice.", "evidence."]
        unsaid = {key for key in table if key not in quoted and not any(key.startswith(kind) for kind in kinds)}
        self.assertEqual(unsaid, set())


if __name__ == "__main__":
    unittest.main()
