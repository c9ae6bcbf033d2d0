"""A strict reader of pages: what a browser would forgive is an error here."""

from __future__ import annotations

import re
from html.parser import HTMLParser

VOID = {"meta", "br", "hr", "img", "input", "link"}


class Reader(HTMLParser):
    """Collects what a page has, and fails on tags that do not match."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.headings: list[int] = []
        self.tags: list[tuple[str, dict[str, str]]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag, attrs):
        given = {name: value or "" for name, value in attrs}
        self.tags.append((tag, given))
        if tag not in VOID:
            self.open.append(tag)
        if "id" in given:
            self.ids.append(given["id"])
        self.references += [given[k][1:] for k in ("href", "xlink:href") if given.get(k, "").startswith("#")]
        self.references += [given[k] for k in ("aria-labelledby",) if k in given]
        for value in given.values():
            self.references += re.findall(r"url\(#([^)]+)\)", value)
        if re.fullmatch(r"h[1-6]", tag):
            self.headings.append(int(tag[1]))

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open[-1] == tag, f"</{tag}> closes <{self.open[-1]}>"
        self.open.pop()

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.text.append(data)


def read(html: str) -> Reader:
    """A page that holds what every page must: well formed, self-contained, accessible."""
    reader = Reader()
    reader.feed(html)
    reader.close()
    assert reader.open == []
    assert len(reader.ids) == len(set(reader.ids)), "two elements share an id"
    assert set(reader.references) <= set(reader.ids), "a reference leads nowhere"
    names = [tag for tag, _ in reader.tags]
    assert not {"script", "link", "img", "iframe", "object", "embed"} & set(names)
    assert not re.search(r"https?:|@import|url\((?!#)|\bsrc=", html), "the page would fetch something"
    assert reader.headings[0] == 1
    assert reader.headings.count(1) == 1
    for before, after in zip(reader.headings, reader.headings[1:], strict=False):
        assert after <= before + 1, "a level of headings is left out"
    assert names.count("table") == names.count("caption")
    assert names.count("figure") == names.count("figcaption")
    for tag, given in reader.tags:
        if tag == "svg":
            assert given["role"] == "img"
            assert len(given["aria-label"]) > 20
        if tag == "th":
            assert given["scope"] == "col"
    return reader
