"""Tables and places in a page of Markdown."""
import re


def cell(text):
    return str(text).replace("|", "\\|")


def table(titles, rows):
    def line(cells):
        return "| " + " | ".join(cell(text) for text in cells) + " |"
    return [line(titles), "|" + "---|" * len(titles), *map(line, rows), ""]


def page(lines):
    return "\n".join(lines).rstrip("\n") + "\n"


def anchor(heading):
    """What a link to it has behind '#', by GitHub's rules."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def one_line(text):
    return " ".join(text.split())
