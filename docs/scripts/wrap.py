#!/usr/bin/env python3
"""Wraps the paragraphs and list items of Markdown pages at a width, and changes nothing else: pages look the same.

    wrap.py [--check] [PAGE…]

Without pages, all of README.md, CONTRIBUTING.md, SECURITY.md, CHANGELOG.md and docs/, but for those that programs write.
With --check, names pages that would change, and fails if there are any. Code, tables, headings, HTML, quotes, definitions of
links and code spans keep their lines. A second run changes nothing.
"""
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WIDTH = 120
# Written by the program, its tests or the scripts beside this one.
WRITTEN = {f"docs/{page}.md" for page in (
    "reference/command-line", "reference/exporters", "reference/options", "reference/lecture-charts", "tutorial/gallery")}

FENCE = re.compile(r"^\s*(`{3,}|~{3,})")
ITEM = re.compile(r"^(\s*)([-*+]|\d{1,9}[.)])( {1,4})(?=\S)")
# Lines that are no text: headings, tables, HTML, quotes, rules, underlines of headings, definitions.
OTHER = re.compile(r"^\s*(#{1,6}(\s|$)|\||<|>|([-*_]\s*){3,}$|=+\s*$|\[[^\]]+\]:)")
# Words that start something else at the start of a line.
MARKUP = re.compile(r"^([-+*]|[-=]+|#{1,6}|[*_]{3,}|\d{1,9}[.)]|>.*|<.*|\|.*|`{3,}.*|~{3,}.*|\[[^\]]+\]:)$")
# Code spans, kept whole, and text between white space.
WORD = re.compile(r"(?:(`+)(?!`).*?(?<!`)\1(?!`)|\S)+", re.S)
HARD_BREAK = re.compile(r"( {2,}|\\)$")


def words(text):
    """Splits text into words, none of which would be markup at the start of a line."""
    found = []
    for match in WORD.finditer(text):
        word = re.sub(r"\s*\n\s*", " ", match.group())
        if found and MARKUP.match(word):
            found[-1] += " " + word
        else:
            found.append(word)
    return found


def fill(lines, first, rest):
    """Wraps the lines of a paragraph, with a prefix for the first line and one for the others."""
    out, line, prefix = [], None, first
    for word in words("\n".join(lines)):
        if line is None:
            line = prefix + word
        elif len(line) + 1 + len(word) <= WIDTH:
            line += " " + word
        else:
            out.append(line)
            prefix = rest
            line = prefix + word
    return out if line is None else out + [line]


class Wrapper:
    """Lines of a page, wrapped as far as they are read."""

    def __init__(self):
        self.out = []
        self.paragraph = []
        self.prefixes = ("", "")

    def end_paragraph(self):
        """Writes the open paragraph. Line breaks of its author stay."""
        first, rest = self.prefixes
        part = []
        for line in self.paragraph:
            part.append(line)
            if HARD_BREAK.search(line):
                self.write_part(part, first, rest)
                part, first = [], rest
        self.write_part(part, first, rest)
        self.paragraph = []

    def write_part(self, part, first, rest):
        if part:
            end = HARD_BREAK.search(part[-1])
            lines = fill([*part[:-1], HARD_BREAK.sub("", part[-1])], first, rest)
            lines[-1] += end.group() if end else ""
            self.out += lines

    def verbatim(self, line):
        self.end_paragraph()
        self.out.append(line)

    def begin(self, text, first, rest):
        self.end_paragraph()
        self.paragraph = [text]
        self.prefixes = (first, rest)


def wrap(text):
    """Returns a page with its paragraphs wrapped."""
    page = Wrapper()
    fence, in_html, in_quote = None, False, False
    # The columns at which the texts of the open list items start.
    items = []
    for line in text.split("\n"):
        indent = len(line) - len(line.lstrip(" "))
        marker = FENCE.match(line)
        if fence is not None:
            page.verbatim(line)
            if marker and line.strip().startswith(fence) and not line.strip().strip(fence[0]):
                fence = None
            continue
        if not line.strip():
            in_html = in_quote = False
            page.verbatim(line)
            continue
        if in_html or in_quote:
            page.verbatim(line)
            continue
        after_blank = not page.paragraph
        if after_blank:
            while items and indent < items[-1]:
                items.pop()
        base = items[-1] if items else 0
        if after_blank and indent >= base + 4 and not ITEM.match(line[base:]):
            page.verbatim(line)
        elif marker:
            fence = marker.group(1)
            page.verbatim(line)
        elif OTHER.match(line) and not (page.paragraph and line.lstrip().startswith("[")):
            in_html = line.lstrip().startswith("<")
            in_quote = line.lstrip().startswith(">")
            # An underline makes a heading of the paragraph, whose lines stay.
            if page.paragraph and re.match(r"^\s*(=+|-+)\s*$", line):
                page.out += [prefix + text.strip() for prefix, text in
                             zip([page.prefixes[0]] + [page.prefixes[1]] * len(page.paragraph), page.paragraph)]
                page.paragraph = []
            page.verbatim(line)
        elif item := ITEM.match(line):
            column = item.end()
            while items and indent < items[-1]:
                items.pop()
            items.append(column)
            page.begin(line[column:], line[:column], " " * column)
        elif page.paragraph:
            page.paragraph.append(line.lstrip(" "))
        else:
            page.begin(line.lstrip(" "), line[:indent], line[:indent])
    page.end_paragraph()
    return "\n".join(page.out)


def pages():
    """All pages that are written by hand."""
    top = [ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")]
    found = top + sorted((ROOT / "docs").rglob("*.md"))
    return [page for page in found if page.relative_to(ROOT).as_posix() not in WRITTEN and page.name != "SUMMARY.md"]


def main():
    check = "--check" in sys.argv[1:]
    chosen = [Path(name).resolve() for name in sys.argv[1:] if name != "--check"] or pages()
    changed = []
    for page in chosen:
        before = page.read_text(encoding="utf-8")
        after = wrap(before)
        assert wrap(after) == after, f"{page}: a second run changes lines"
        assert "".join(after.split()) == "".join(before.split()), f"{page}: text is lost"
        if after != before:
            changed.append(page)
            if not check:
                page.write_text(after, encoding="utf-8")
    for page in changed:
        print(page.relative_to(ROOT) if page.is_relative_to(ROOT) else page)
    if check and changed:
        sys.exit("run docs/scripts/wrap.py")


if __name__ == "__main__":
    main()
