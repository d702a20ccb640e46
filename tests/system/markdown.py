"""A page of Markdown, as its tests see it: blocks with the marks before their fences, and prose."""
import collections
import dataclasses
import re

_MARK = re.compile(r"<!-- (?:test: (?P<test>\S+)(?: (?P<argument>[^>]*?))?|not run: (?P<reason>.+?)|"
                   r"serial: (?P<serial>\d+ \d[NEO]\d)) -->$")


@dataclasses.dataclass
class Block:
    kind: str        # what stands behind the fence: sh, yaml, ...
    text: str
    line: int        # of its fence
    mark: str = ""   # demo, program-78, ... or "not run"
    argument: str = ""
    serial: str = "19200 8N1"

    def commands(self):
        """Its lines of shell; what a backslash continues is one."""
        lines = re.sub(r"\\\n\s*", "", self.text).splitlines()
        return [line for line in lines if line and not line.startswith("#")]


class Page:
    def __init__(self, text):
        self.text = text
        self.blocks = []
        self.prose = []  # (number, line): what is outside the blocks, marks and other comments left out
        marks = {}
        lines = iter(enumerate(text.splitlines(), 1))
        for number, line in lines:
            bare = line.strip()
            if bare.startswith("```"):
                self.blocks.append(_block(lines, number, line, marks))
                self.prose.append((number, ""))
                marks = {}
            elif found := _MARK.match(bare):
                marks.update({k: v for k, v in found.groupdict().items() if v})
            else:
                marks = {}
                self.prose.append((number, "" if bare.startswith("<!--") else line))

    def marked(self, mark):
        return [block for block in self.blocks if block.mark == mark]

    def paragraphs(self):
        """[(number of the first line, text)]; an entry of a list is one, tables and headings are none."""
        found = []
        goes_on = False
        for number, line in self.prose:
            bare = line.strip()
            if not bare or bare.startswith(("#", "|")):
                goes_on = False
                continue
            if not goes_on or re.match(r"([-*+]|\d+[.)]) ", bare):
                found.append((number, bare))
            else:
                found[-1] = (found[-1][0], f"{found[-1][1]} {bare}")
            goes_on = True
        return found

    def links(self):
        """Targets of links and pictures, in Markdown and in HTML."""
        text = re.sub(r"`[^`\n]*`", "", "\n".join(line for _, line in self.prose))
        return re.findall(r"\]\(<?([^)\s>]+)>?(?: [^)]*)?\)", text) + \
            re.findall(r"(?m)^\[[^\]]+\]: (\S+)", text) + \
            re.findall(r"\b(?:src|srcset|href)=\"([^\"]+)\"", text)

    def anchors(self):
        """What a link may have behind '#', by GitHub's rules."""
        found = []
        seen = collections.Counter()
        for _, line in self.prose:
            if heading := re.match(r"#{1,6} (.+)", line):
                shown = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading[1].strip())
                slug = re.sub(r"[^\w\- ]", "", shown.lower()).replace(" ", "-")
                found.append(f"{slug}-{seen[slug]}" if seen[slug] else slug)
                seen[slug] += 1
        return found + re.findall(r"<a (?:id|name)=\"([^\"]+)\"", self.text)


def _block(lines, number, fence, marks):
    indent = len(fence) - len(fence.lstrip())
    text = ""
    for _, line in lines:
        if line.strip() == "```":
            break
        text += line[min(indent, len(line) - len(line.lstrip())):] + "\n"
    else:
        raise ValueError(f"line {number}: a block without an end")
    return Block(fence.strip().lstrip("`"), text, number,
                 "not run" if "reason" in marks else marks.get("test", ""),
                 marks.get("argument", ""), marks.get("serial", Block.serial))
