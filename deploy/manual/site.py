#!/usr/bin/env python3
"""site.py OUT VERSION [--inside]: docs/*.md as pages of HTML in OUT, with contents, search and pictures.

Without --inside OUT is a site of its own, for a web server or a USB stick: no page needs a server. With it,
OUT is what the program serves below /docs/, and the page of REST is what it serves at /docs. A page may
have `<!-- words: ... -->`: what people call it who do not know our word; the search finds it by them. A link,
an anchor or a picture that is not there ends it. Wants python3-markdown-it.
"""
import html
import json
import os
import pathlib
import re
import shutil
import sys

from markdown_it import MarkdownIt

sys.dont_write_bytecode = True  # beside the sources
import rest_page  # noqa: E402
from tables import anchor  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
DOCS = ROOT / "docs"
THEME = HERE / "site"
PALETTE = ROOT / "src/web/page/page.css"
WORDS = re.compile(r"<!-- words: (.+?) -->")
FEW = 8       # headings of a page that are listed without a click
REST = "rest.html"


def plain(tokens):
    """The words of what is inside a line."""
    return "".join(plain(one.children) if one.children and one.type != "image" else
                   " " if one.type in ("softbreak", "hardbreak") else one.content for one in tokens or [])


class Page:
    """One page of Markdown: its title, its headings, its HTML, and what of it is searched."""

    def __init__(self, path):
        self.path = path                                       # "tasks/tokens.md"
        self.name = re.sub(r"\.md$", ".html", path)
        self.headings = []                                     # (level, text, id)
        self.parts = []                                        # [id, heading, words]: below each heading
        self.targets = []                                      # of links and pictures
        self.tokens = MarkdownIt("commonmark", {"html": True}).enable("table").parse((DOCS / path).read_text())
        self._number_headings()
        self.title = self.headings[0][1]
        self._read()

    def _number_headings(self):
        seen = {}
        for at, token in enumerate(self.tokens):
            if token.type != "heading_open":
                continue
            text = plain(self.tokens[at + 1].children)
            name = anchor(text)
            seen[name] = seen.get(name, -1) + 1
            token.attrSet("id", f"{name}-{seen[name]}" if seen[name] else name)
            self.headings.append((int(token.tag[1]), text, token.attrGet("id")))

    def _read(self):
        """Collects what is searched, and where links lead."""
        headings = iter(self.headings)
        heading = False
        called = []
        for token in self.tokens:
            if token.type == "heading_open":
                heading = True
                level, text, name = next(headings)
                self.parts.append([name if level > 1 else "", text, []])
            elif token.type == "html_block":
                called += WORDS.findall(token.content)
            elif token.type in ("fence", "code_block"):
                self.parts[-1][2].append(token.content)
            elif token.type == "inline":
                if not heading:
                    self.parts[-1][2].append(plain(token.children))
                heading = False
                for one in token.children:
                    self.targets += [one.attrGet("href") or one.attrGet("src")] \
                        if one.type in ("link_open", "image") else []
        self.parts[0][2] += called  # behind the text, of which the search shows a piece

    def ids(self):
        return {name for _, _, name in self.headings}

    def body(self, site):
        renderer = MarkdownIt("commonmark", {"html": True}).enable("table")
        for token in self.tokens:
            for one in [token, *(token.children or [])]:
                for name in ("href", "src"):
                    if target := one.attrGet(name):
                        one.attrSet(name, site.way(self, target))
        text = re.sub(r"(?s)<!--.*?-->\n?", "", renderer.renderer.render(self.tokens, renderer.options, {}))
        text = text.replace("<table>", '<div class="scroll"><table>').replace("</table>", "</table></div>")
        text = re.sub(r"<th( style=\"[^\"]*\")?></th>", "<td></td>", text)
        text = re.sub(r'<(h[2-6]) id="([^"]+)">(.*?)</\1>',
                      r'<\1 id="\2">\3 <a class="own" href="#\2" aria-label="Link to this section">#</a></\1>', text)
        return re.sub(r"<img [^>]*>", lambda found: self._picture(found[0]), text)

    def _picture(self, tag):
        """A picture that there is of the dark theme, too, is there twice; one is shown."""
        source = re.search(r'src="([^"]+)"', tag)[1]
        dark = source.replace("-light.png", "-dark.png")
        tag = tag.replace("<img ", '<img loading="lazy" ')
        if dark == source:
            return tag
        return tag.replace("<img ", '<img class="of-light" ') + \
            tag.replace(source, dark).replace("<img ", '<img class="of-dark" ')


class Site:
    def __init__(self, version, inside):
        self.version, self.inside = version, inside
        paths = sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md"))
        self.pages = {path: Page(path) for path in paths}
        self.sections = self._sections()                       # [(heading, id, [(title, path)])]
        self.order = ["index.md", *(path for _, _, entries in self.sections for _, path in entries)]
        self.rest = rest_page.RestPage()
        self._check()

    def _sections(self):
        """As docs/index.md lists them, the first page of each entry."""
        found, heading = [], False
        tokens = self.pages["index.md"].tokens
        for at, token in enumerate(tokens):
            if token.type == "heading_open" and token.tag == "h2":
                heading = True
                found.append((plain(tokens[at + 1].children), token.attrGet("id"), []))
            elif token.type == "inline" and found and not heading and token.children[0].type == "link_open":
                words = token.children[1:[one.type for one in token.children].index("link_close")]
                found[-1][2].append((plain(words), token.children[0].attrGet("href")))
            elif token.type == "heading_close":
                heading = False
        return found

    def _check(self):
        faults = [f"index.md does not lead to {path}" for path in self.pages if path not in self.order]
        for page in self.pages.values():
            for target in page.targets:
                path, _, name = target.partition("#")
                if re.match(r"[a-z]+:", target):
                    continue
                there = os.path.normpath(os.path.join(os.path.dirname(page.path), path)) if path else page.path
                if there in self.pages:
                    if name and name not in self.pages[there].ids():
                        faults.append(f"{page.path}: {target}: there is no such heading")
                elif not (DOCS / there).is_file() or there.startswith(".."):
                    faults.append(f"{page.path}: {target}: there is no such page")
        if faults:
            sys.exit("\n".join(faults))

    def at(self, page, name):
        """The way from a page to a file of the site. The program has the page of REST beside its folder."""
        if self.inside and page is self.rest:
            return "/docs" if name == REST else "/docs/" + name
        if self.inside and name == REST:
            return "../" * (1 + page.name.count("/")) + "docs"
        return os.path.relpath(name, os.path.dirname(page.name) or ".")

    def way(self, page, target):
        path, hash_, name = target.partition("#")
        if re.match(r"[a-z]+:", target) or not path:
            return target
        there = os.path.normpath(os.path.join(os.path.dirname(page.path), path))
        return self.at(page, re.sub(r"\.md$", ".html", there)) + hash_ + name

    def contents(self, page):
        """The parts, with the pages of the one that the page belongs to: all of them on each were 60 kB more."""
        lines = []
        for heading, name, entries in self.sections:
            lines.append(f'<li><a href="{self.at(page, "index.html")}#{name}">{html.escape(heading)}</a>')
            if page.path in [path for _, path in entries]:
                lines.append("<ul>")
                for title, path in entries:
                    here = ' aria-current="page"' if path == page.path else ""
                    lines.append(f'<li><a href="{self.at(page, self.pages[path].name)}"{here}>{html.escape(title)}</a></li>')
                lines.append("</ul>")
            lines.append("</li>")
        here = ' aria-current="page"' if page is self.rest else ""
        lines.append(f'<li><a href="{self.at(page, REST)}"{here}>REST, every member</a></li>')
        return "<ul>\n" + "\n".join(lines) + "\n</ul>"

    def neighbours(self, page):
        """Links to the page before and the one behind."""
        if page.path not in self.order:
            return ""
        place = self.order.index(page.path)
        around = [("prev", "Previous", place - 1), ("next", "Next", place + 1)]
        links = [f'<a rel="{rel}" href="{self.at(page, self.pages[self.order[to]].name)}">'
                 f"<small>{word}</small>{html.escape(self.pages[self.order[to]].title)}</a>"
                 for rel, word, to in around if 0 <= to < len(self.order)]
        return f'<nav class="neighbours" aria-label="Previous and next page">{"".join(links)}</nav>'

    def where(self, page):
        for heading, name, entries in self.sections:
            if page.path in [path for _, path in entries]:
                return f'<p class="where"><a href="{self.at(page, "index.html")}#{name}">{html.escape(heading)}</a></p>'
        return ""

    def on_this_page(self, page):
        headings = [(text, name) for level, text, name in page.headings if level == 2]
        if len(headings) < 3:
            return ""
        links = "".join(f'<li><a href="#{name}">{html.escape(text)}</a></li>' for text, name in headings)
        return f'<details class="here"{" open" if len(headings) <= FEW else ""}><summary>On this page</summary>' \
               f"<ul>{links}</ul></details>"

    def framed(self, page, main):
        """The template with all its words."""
        words = {"title": html.escape(page.title), "main": main, "contents": self.contents(page),
                 "css": self.at(page, "site.css"), "script": self.at(page, "site.js"), "version": self.version,
                 "icon": self.at(page, "icon.svg"), "index": self.at(page, "index.html"),
                 "base": re.sub(r"site\.js$", "", self.at(page, "site.js")),
                 "dashboard": '<a href="/">Dashboard</a>' if self.inside else ""}
        return re.sub(r"@(\w+)@", lambda found: words[found[1]], (THEME / "page.html").read_text())

    def page(self, page):
        head, body = page.body(self).split("</h1>\n", 1)
        main = self.where(page) + head + "</h1>\n" + self.on_this_page(page) + body + self.neighbours(page)
        return self.framed(page, main)

    def index(self):
        """What is searched: [[way from the site's root, title, [[id, heading, words] of each part]], ...]"""
        pages = [[page.name, page.title, page.parts] for page in map(self.pages.get, self.order)]
        pages.append(["../docs" if self.inside else REST, self.rest.title, self.rest.parts])
        rows = [[name, title, [[id_, heading, " ".join(" ".join(words).split())] for id_, heading, words in parts]]
                for name, title, parts in pages]
        return "manual(" + json.dumps(rows, ensure_ascii=False, separators=(",", ":")) + ");\n"

    def files(self):
        """{name: bytes}"""
        found = {page.name: self.page(page).encode() for page in self.pages.values()}
        found[REST] = self.framed(self.rest, self.rest.body("/openapi.json" if self.inside else "openapi.json")).encode()
        found["search.js"] = self.index().encode()
        palette = PALETTE.read_text().split("\n\n* {")[0]
        found["site.css"] = (palette + "\n\n" + (THEME / "site.css").read_text()).encode()
        found["site.js"] = (THEME / "site.js").read_bytes()
        found["icon.svg"] = (ROOT / "src/web/page/icon.svg").read_bytes()
        if not self.inside:
            found["openapi.json"] = json.dumps(self.rest.document.all, indent=1, ensure_ascii=False).encode()
        for path in sorted(DOCS.glob("pictures/*.*g")):
            found[f"pictures/{path.name}"] = path.read_bytes()
        return found


def main(out, version, *words):
    files = Site(version, "--inside" in words).files()
    out = pathlib.Path(out)
    if (out / "site.css").exists():  # what an earlier run has made, pages that are gone included
        shutil.rmtree(out)
    for name, data in files.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(data)


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[3:] not in ([], ["--inside"]):
        sys.exit(__doc__)
    main(*sys.argv[1:])
