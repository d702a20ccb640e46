"""The manual inside the program: each page of docs/ at /docs/, whole, small and without anything from outside.

What needs a browser is skipped without chromium, and the look for barriers without axe-core as well: see
tests/page/README.md.
"""
import gzip
import html.parser
import json
import pathlib
import posixpath
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import urllib.error
import urllib.parse
import urllib.request

import harness
from harness import ROOT

sys.path.append(str(ROOT / "deploy/manual"))
import chrome  # noqa: E402

DOCS = ROOT / "docs"
SOURCES = sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md"))
# Bytes of the whole manual, packed. It is sent page by page; what it costs is room in the program of 10 MB.
LARGEST = 850_000
PICTURE = 150_000


class Html(html.parser.HTMLParser):
    """Of a page: what it links, what it loads, its ids, and the words a reader sees."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.ids, self.words, self.title = [], [], [], [], ""
        self.inline = []
        self._open = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        if tag not in ("meta", "link", "img", "input", "br", "hr"):
            self._open.append(tag)
        if tag == "a":
            self.links.append(values["href"])
        self.loads += [values[name] for name in ("src", "srcset", "poster") if name in values]
        self.loads += [values["href"]] if tag == "link" else []
        self.ids += [values["id"]] if "id" in values else []
        self.inline += [name for name in values if name.startswith("on") or name == "style"]
        self.inline += [tag] if tag == "style" or tag == "script" and "src" not in values else []

    def handle_endtag(self, tag):
        while self._open and self._open.pop() != tag:
            pass

    def handle_data(self, data):
        self.words.append(data)
        if self._open[-1:] == ["h1"]:
            self.title += data


def page_of(source):
    return "/docs/" + re.sub(r"\.md$", ".html", source)


class Served(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(harness.configured(
            "lines: [{name: secret7, device: tcp://127.0.0.1:9, stations: [{id: 1}]}]\n"
            "http: {listen: 127.0.0.1:0, anonymous: none}\n"))
        cls.kept = {}

    def fetch(self, path, **headers):
        request = urllib.request.Request(self.program.url(path), headers=headers)
        with urllib.request.urlopen(request, timeout=harness.PATIENCE) as response:
            return response.headers, response.read()

    def page(self, path):
        if path not in self.kept:
            self.kept[path] = Html(self.fetch(path)[1].decode())
        return self.kept[path]

    def pages(self):
        """Every page, by its path: those of docs/, the contents and REST."""
        return {path: self.page(path) for path in ["/docs/", "/docs", *map(page_of, SOURCES)]}

    def files(self):
        """Every file that a page links or loads within the manual."""
        found = set(self.pages())
        for path, page in self.pages().items():
            for target in [*page.links, *page.loads]:
                there = urllib.parse.urlsplit(urllib.parse.urljoin(path, target))
                if not there.netloc and there.path.startswith("/docs"):
                    found.add(there.path)
        return found | {"/docs/search.js"}

    def test_each_page_of_docs_is_there_with_its_words(self):
        for source in SOURCES:
            with self.subTest(page=source):
                page = self.page(page_of(source))
                text = (DOCS / source).read_text()
                title = re.search(r"(?m)^# (.+)$", text)[1]
                self.assertEqual(page.title, re.sub(r"[`*]", "", title))
                said = " ".join("".join(page.words).split())
                for block in re.findall(r"(?ms)^```\w*\n(.*?)^```$", text):
                    self.assertIn(" ".join(block.split()), said)

    def test_no_mark_of_a_test_is_shown(self):
        for path, page in self.pages().items():
            self.assertNotRegex("".join(page.words), r"<!--|-->", path)

    def test_it_is_free_also_where_nothing_else_is_and_holds_no_data(self):
        for path in ("/docs/", "/docs", "/docs/search.js", "/docs/tasks/tokens.html"):
            self.assertNotIn(b"secret7", self.fetch(path)[1])
        with self.assertRaises(urllib.error.HTTPError) as refused:
            self.fetch("/api/v1/lines")
        self.assertEqual(refused.exception.code, 401)
        refused.exception.close()

    def test_ways_arrive(self):
        for path, page in self.pages().items():
            for target in page.links:
                there = urllib.parse.urlsplit(urllib.parse.urljoin(path, target))
                if there.scheme or there.netloc or there.path in ("/", "/openapi.json"):
                    continue
                with self.subTest(page=path, link=target):
                    other = self.page(there.path)
                    if there.fragment:
                        self.assertIn(there.fragment, other.ids)

    def test_an_id_is_there_once(self):
        for path, page in self.pages().items():
            self.assertEqual(len(page.ids), len(set(page.ids)), path)

    def test_the_contents_lead_to_every_page_and_next_passes_all_of_them(self):
        led = {urllib.parse.urljoin("/docs/", link).partition("#")[0] for link in self.page("/docs/").links}
        self.assertEqual({page_of(source) for source in SOURCES} - led, set())
        at, passed = "/docs/index.html", []
        while at:
            passed.append(at)
            following = re.search(r'<a rel="next" href="([^"]+)"', self.fetch(at)[1].decode())
            at = following and posixpath.normpath(posixpath.join(posixpath.dirname(at), following[1]))
        self.assertEqual(sorted(passed), sorted(map(page_of, SOURCES)))

    def test_nothing_comes_from_elsewhere_and_nothing_is_inline(self):
        for path, page in self.pages().items():
            for target in page.loads:
                with self.subTest(page=path, loads=target):
                    there = urllib.parse.urlsplit(urllib.parse.urljoin(path, target))
                    self.assertEqual((there.scheme, there.netloc), ("", ""))
                    self.assertTrue(self.fetch(there.path)[1])
            self.assertEqual(page.inline, [], path)
        for name in ("site.js", "site.css"):
            text = self.fetch(f"/docs/{name}")[1].decode()
            self.assertNotRegex(text, r"@import|url\(|\bfetch\(|XMLHttpRequest")

    def test_headers_are_those_of_the_other_files(self):
        for path in self.files():
            with self.subTest(path=path):
                headers, body = self.fetch(path, **{"Accept-Encoding": "gzip"})
                self.assertEqual(headers["Content-Encoding"], "gzip")
                self.assertIn("default-src 'self'", headers["Content-Security-Policy"])
                self.assertNotIn("unsafe", headers["Content-Security-Policy"])
                self.assertEqual(gzip.decompress(body), self.fetch(path)[1])
                with self.assertRaises(urllib.error.HTTPError) as same:
                    self.fetch(path, **{"If-None-Match": headers["ETag"]})
                self.assertEqual(same.exception.code, 304)
                same.exception.close()

    def test_all_of_it_is_small(self):
        sizes = {path: len(self.fetch(path, **{"Accept-Encoding": "gzip"})[1]) for path in self.files()}
        total = sum(sizes.values()) - sizes["/docs/"]  # which is index.html once more
        print(f"\n  {len(SOURCES)} pages and REST, {len(sizes) - 1} files, {total} bytes packed, "
              f"{sizes['/docs/search.js']} of them the index", end="")
        self.assertLess(total, LARGEST)
        for path in DOCS.glob("pictures/*"):
            self.assertLess(path.stat().st_size, PICTURE, path.name)
            self.assertIn(f"/docs/pictures/{path.name}", sizes)

    def test_what_is_not_there_is_a_problem(self):
        for path in ("/docs/nothing.html", "/docs/tasks/nothing.html", "/docs/tasks/", "/docs/..%2fpage/app.js"):
            self.assertEqual(self.program.get(path)[0], 404, path)

    def test_the_index_finds_each_page_by_its_title(self):
        text = self.fetch("/docs/search.js")[1].decode()
        rows = json.loads(re.fullmatch(r"manual\((.*)\);\n", text, re.S)[1])
        titles = {urllib.parse.urljoin("/docs/", name): title for name, title, _ in rows}
        self.assertEqual(titles, {path: page.title for path, page in self.pages().items() if path != "/docs/"})
        for name, _, parts in rows:
            page = self.page(urllib.parse.urljoin("/docs/", name))
            for id_, heading, words in parts:
                self.assertTrue(heading)
                self.assertTrue(not id_ or id_ in page.ids, (name, id_))

    def test_the_index_has_what_people_call_a_page_who_do_not_know_our_word(self):
        rows = {name: parts[0][2].split() for name, _, parts in json.loads(self.fetch("/docs/search.js")[1][7:-3])}
        called = {source: re.findall(r"<!-- words: (.+?) -->", (DOCS / source).read_text()) for source in SOURCES}
        self.assertGreater(sum(map(bool, called.values())), 10)
        for source, found in called.items():
            for words in found:
                self.assertEqual(rows[re.sub(r"\.md$", ".html", source)][-len(words.split()):], words.split(), source)

    def test_rest_has_a_line_of_curl_for_each_call_and_every_member(self):
        text = self.fetch("/docs")[1].decode()
        document = json.loads((ROOT / "src/web/api/openapi/paths.json").read_text())
        schemas = json.loads((ROOT / "src/web/api/openapi/components.json").read_text())["schemas"]
        ids = set(self.page("/docs").ids)
        sections = dict(re.findall(r'<h3 id="(\w+)">(.*?)(?=<h[23]|</main>)', text, re.S))
        for path, methods in document.items():
            for method, call in methods.items():
                with self.subTest(method=method, path=path):
                    section = sections[call["operationId"]]
                    self.assertEqual(re.search(r"<code>curl -s.*? (-X (\w+) )?", section)[2] or "GET", method.upper())
                    self.assertEqual(text.count(f'href="#{call["operationId"]}"'), 1, "in its contents")
        for name, schema in schemas.items():
            self.assertIn(name, ids)
            for member in schema.get("properties", {}):
                self.assertIn(f"<td><code>{member}</code></td>", sections[name])


class Sources(unittest.TestCase):
    def test_no_line_is_long_and_no_paragraph_either(self):
        for source in SOURCES:
            text = (DOCS / source).read_text()
            made = "by `deploy/manual/reference.py`" in text
            text = re.sub(r"(?ms)^\s*```.*?^\s*```$", "", text)
            for line in text.splitlines():
                self.assertTrue(made or len(line) <= 400, f"{source}: {line}")
            for paragraph in re.split(r"\n\s*\n|\n(?=\s*(?:[-*]|\d+\.) |\||#)", text):
                if not paragraph.lstrip().startswith(("|", "#")):
                    self.assertLessEqual(len(paragraph.split()), 80 if not made else 120, f"{source}: {paragraph}")


class Site(unittest.TestCase):
    """The same as a folder, by one command."""

    def test_it_stands_alone(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "site"
            subprocess.run([ROOT / "deploy/manual/site.sh", out], check=True, capture_output=True, timeout=4 * harness.PATIENCE)
            pages = {path: Html(path.read_text()) for path in out.rglob("*.html")}
            self.assertEqual(len(pages), len(SOURCES) + 1)
            for path, page in pages.items():
                for target in [*page.links, *page.loads]:
                    if re.match(r"https?:|mailto:", target) and target in page.links:
                        continue
                    self.assertNotRegex(target, r"^/|:", path)
                    name, _, fragment = target.partition("#")
                    there = (path.parent / urllib.parse.unquote(name)).resolve() if name else path
                    self.assertTrue(there.is_relative_to(out.resolve()) and there.is_file(), (path, target))
                    if fragment:
                        self.assertIn(fragment, pages[out / there.relative_to(out.resolve())].ids, (path, target))

    def test_a_way_that_leads_nowhere_ends_it(self):
        with tempfile.TemporaryDirectory() as folder:
            tree = pathlib.Path(folder)
            for name in ("docs", "deploy/manual", "src/web"):
                shutil.copytree(ROOT / name, tree / name)
            page = tree / "docs/glossary.md"
            page.write_text(page.read_text() + "\n[a](nothing.md) [b](index.md#nothing) ![c](pictures/nothing.png)\n")
            done = subprocess.run(["/usr/bin/python3", "-B", tree / "deploy/manual/site.py", tree / "out", "1"],
                                  capture_output=True, text=True, check=False, timeout=4 * harness.PATIENCE)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(len(done.stderr.strip().split("\n")), 3, done.stderr)


@unittest.skipUnless(chrome.PROGRAM, "no chromium: deploy/install_packages.sh pictures")
class Keys(unittest.TestCase):
    """In a browser, without a mouse."""

    @classmethod
    def setUpClass(cls):
        cls.program = cls.enterClassContext(harness.demo())
        cls.chrome = cls.enterClassContext(chrome.Chrome())

    def open(self, path):
        self.chrome.open(self.program.url(path))
        return self.chrome

    def active(self):
        return self.chrome.script("document.activeElement.textContent.trim() || document.activeElement.id")

    def test_search_goes_to_a_page_and_back(self):
        page = self.open("/docs/tasks/numbers.html")
        page.key("/")
        self.assertEqual(self.active(), "site-words")
        page.key("tokens")
        page.wait("document.querySelector('#site-found b')?.textContent === 'Tokens'")
        page.key("Escape")
        self.assertTrue(page.script("document.querySelector('#site-found').hidden"))
        page.key(" ")
        page.wait("!document.querySelector('#site-found').hidden")
        page.key("ArrowDown")
        page.key("ArrowDown")
        self.assertEqual(page.script("[...document.querySelectorAll('#site-found a')].indexOf(document.activeElement)"), 1)
        page.key("ArrowUp")
        page.key("Enter")
        page.arrived("/docs/tasks/tokens.html")

    def test_search_finds_each_page_by_its_title(self):
        page = self.open("/docs/")
        page.script("document.querySelector('#site-words').focus()")
        page.key("panelgate")
        page.wait("document.querySelector('#site-found a')")
        for source in SOURCES:
            with self.subTest(page=source):
                title = re.search(r"(?m)^# (.+)$", (DOCS / source).read_text())[1].replace("`", "")
                found = page.script(
                    "new Promise((done) => { const field = document.querySelector('#site-words'); "
                    f"field.value = {json.dumps(title)}; field.dispatchEvent(new Event('input')); "
                    "setTimeout(() => done([...document.querySelectorAll('#site-found a')].map((one) => one.pathname)), 0); })")
                self.assertIn(page_of(source), found[:3])

    def test_search_finds_by_other_names_and_by_most_of_the_words(self):
        page = self.open("/docs/")
        page.script("document.querySelector('#site-words').focus()")
        page.key("dongle")
        page.wait("document.querySelector('#site-found a')?.pathname === '/docs/wiring/adapters.html'")
        page.key(" zebra")
        page.wait("document.querySelector('#site-count').textContent.endsWith(', with 1 of 2 words')")
        page.script("document.querySelector('#site-words').value = ''")
        page.key("zebra")
        page.wait("document.querySelector('#site-count').textContent === 'Nothing is found.'")

    def test_contents_and_next_page(self):
        page = self.open("/docs/start/demo.html")
        page.script("document.querySelector('a[href=\"#site-contents\"]').focus()")
        page.key("Enter")
        page.wait("document.activeElement.id === 'site-contents'")
        for _ in range(3):  # the part, its first page, its second
            page.key("Tab")
        page.key("Enter")
        page.arrived("/docs/start/first-panel.html")
        page.script("document.querySelector('[rel=next]').focus()")
        page.key("Enter")
        page.arrived("/docs/start/from-mbusd.html")

    def test_nothing_is_asked_elsewhere_and_nothing_complains(self):
        self.chrome.requests.clear()
        self.chrome.complaints.clear()
        for path in ("/docs/", "/docs", "/docs/operate/dashboard.html", "/docs/wiring/rs485.html"):
            for size in (chrome.WIDE, chrome.NARROW):
                self.chrome.resize(size)
                page = self.open(path)
                page.script("document.querySelector('#site-words').focus()")
                page.wait("document.querySelector('script[src$=\"search.js\"]')")
                self.assertLessEqual(page.script("document.documentElement.scrollWidth"), size[0], path)
        self.chrome.resize(chrome.WIDE)
        base = self.program.url("")
        self.assertEqual([url for url in self.chrome.requests if not url.startswith((base, "about:", "data:"))], [])
        self.assertEqual(self.chrome.complaints, [])

    def test_paper_is_white_and_has_only_the_text(self):
        page = self.open("/docs/tasks/tokens.html")
        page.command("Emulation.setEmulatedMedia", media="print", features=[{"name": "prefers-color-scheme", "value": "dark"}])
        try:
            self.assertEqual(page.script("getComputedStyle(document.body).backgroundColor"), "rgb(255, 255, 255)")
            for selector in ("header", "#site-contents", ".neighbours"):
                self.assertEqual(page.script(f"getComputedStyle(document.querySelector('{selector}')).display"), "none")
        finally:
            page.command("Emulation.setEmulatedMedia", media="", features=[])

    def test_each_view_of_the_dashboard_has_its_part_of_the_manual(self):
        views = re.findall(r"(\w+): \w+View\b|'': (\w+)View", (ROOT / "src/web/page/app.js").read_text())
        self.assertGreater(len(views), 8)
        for name, _ in views:
            with self.subTest(view=name):
                page = self.open(f"/#/{name}/press" if name == "station" else f"/#/{name}")
                page.wait("performance.getEntriesByName('shown').length === 1")
                self.assertRegex(page.script("document.querySelector('#help').ariaLabel"), r"^Help: .+")
                page.script("document.querySelector('#help').click()")
                page.arrived("/docs/operate/dashboard.html")
                self.assertTrue(page.script("document.getElementById(location.hash.slice(1))?.tagName === 'H2'"))

    def test_a_finding_and_an_exception_lead_to_their_entry(self):
        self.program.rest("PUT", "/api/v1/simulator/oven", {"dead": 1})
        page = self.open("/#/")
        try:
            page.wait("document.querySelector('.finding a.explained')")
            cause = page.script("document.querySelector('.finding').dataset.cause")
            page.script("document.querySelector('.finding a.explained').click()")
            page.arrived("/docs/reference/findings.html")
            self.assertEqual(page.script("location.hash"), f"#{cause}")
            self.assertTrue(page.script("document.getElementById(location.hash.slice(1)) !== null"))
        finally:
            self.program.rest("PUT", "/api/v1/simulator/oven", {})
        page = self.open("/#/request/press")
        page.wait("document.querySelector('#where')")
        page.script("document.querySelector('#where').focus()")
        page.key("holding-registers/65000")  # which the panel has not
        page.script("document.querySelector('#read').click()")
        page.wait("document.querySelector('.answer .refusal a.explained')")
        page.script("document.querySelector('.answer .refusal a.explained').click()")
        page.arrived("/docs/trouble/exceptions.html")

    def test_where_a_token_is_needed_help_tells_how_one_is_made(self):
        with harness.configured("lines: [{name: a, device: tcp://127.0.0.1:9, stations: [{id: 1}]}]\n"
                                "http: {listen: 127.0.0.1:0, anonymous: none}\n") as program:
            self.chrome.open(program.url("/"))
            self.chrome.wait("document.querySelector('#sign-in')")
            self.chrome.script("document.querySelector('#help').click()")
            self.chrome.arrived("/docs/tasks/tokens.html")


class Pages(unittest.TestCase):
    """Of the dashboard: what it names of the manual is there."""

    def test_each_cause_and_each_exception_has_its_entry(self):
        text = (ROOT / "src/web/page/help.js").read_text()
        headings = re.findall(r"(?m)^## (.+)$", (DOCS / "trouble/exceptions.md").read_text())
        anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
        named = re.findall(r"\d+: '#([\w-]+)'", text)
        self.assertEqual(len(named), 3)
        self.assertEqual(set(named) - anchors, set())
        causes = re.findall(r'(?m)^    "([\w-]+)",$', (ROOT / "include/panelgate/doctor/settings.hpp").read_text())
        causes += re.findall(r'\.cause = "([\w-]+)"', (ROOT / "src/gateway/findings.cpp").read_text())
        entries = re.findall(r"(?m)^### (.+)$", (DOCS / "reference/findings.md").read_text())
        self.assertEqual(sorted(causes), sorted(entries))


if __name__ == "__main__":
    unittest.main()
