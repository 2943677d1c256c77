# SPDX-License-Identifier: GPL-3.0-or-later
import base64
from html.parser import HTMLParser

import pytest

from compare.document import (
    Bullets,
    Heading,
    Paragraph,
    Picture,
    Strong,
    Table,
    to_html,
    to_markdown,
)

HOSTILE = '<script>alert("x")</script> & | `a` [b](http://c) *d* _e_ \\'
PNG = b"\x89PNG\r\n\x1a\nnot really"

BLOCKS = [
    Heading(1, f"Title {HOSTILE}"),
    Heading(2, "Part"),
    Paragraph(HOSTILE),
    Bullets(["one", HOSTILE]),
    Table(["material", "dB"], [["gold", Strong("50.1")], [HOSTILE, "40.0"]]),
    Picture("chart.png", PNG, HOSTILE),
]
VOID = {"meta", "img"}


class Parsed(HTMLParser):
    """Tags, attributes and text; fails on tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.attributes, self.text = [], [], [], ""
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.attributes += [(tag, *pair) for pair in attributes]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.text += data


@pytest.fixture(scope="module")
def page():
    return Parsed(to_html(BLOCKS))


def test_html_shows_text_as_it_is(page):
    # title, heading, paragraph, item, cell and caption
    assert page.text.count(HOSTILE) == 6
    assert "script" not in page.tags
    assert [v for tag, name, v in page.attributes if (tag, name) == ("img", "alt")] == [HOSTILE]


def test_html_asks_for_nothing(page):
    loading = {"src", "href", "data", "srcset", "action", "poster", "style"}
    sources = [value for _, name, value in page.attributes if name in loading]
    assert sources == [f"data:image/png;base64,{base64.b64encode(PNG).decode()}"]
    assert not {"link", "script", "iframe", "object", "base"} & set(page.tags)
    style = to_html([Heading(1, "x")]).partition("<style>")[2].partition("</style>")[0]
    assert style
    assert "url(" not in style
    assert "@import" not in style
    assert not any(name.startswith("on") for _, name, _ in page.attributes)


def test_html_structure(page):
    assert page.tags.count("tr") == 3
    assert page.tags.count("td") == 4
    assert page.tags.count("b") == 1
    assert page.tags.count("li") == 2
    assert page.tags[:3] == ["html", "head", "meta"]
    assert ("meta", "charset", "utf-8") in page.attributes


def test_markdown():
    text = to_markdown(
        [
            Heading(2, "Part"),
            Paragraph("a | b"),
            Bullets(["one", "two"]),
            Table(["material", "dB"], [["go|ld", Strong("50.1")]]),
            Picture("chart.png", PNG, "A chart."),
        ],
        "images",
    )
    assert text == (
        "## Part\n\na \\| b\n\n- one\n- two\n\n| material | dB |\n| --- | ---: |\n"
        "| go\\|ld | **50.1** |\n\n![A chart.](images/chart.png)\n\n*A chart.*\n"
    )


def test_markdown_escapes_what_it_would_take_for_markup():
    text = to_markdown([Paragraph(HOSTILE)], "images")
    assert "\\<script\\>" in text
    assert "\\[b\\]" in text
    assert "\\`a\\`" in text
    # every character is still there
    assert text.replace("\\\\", "\0").replace("\\", "").replace("\0", "\\") == HOSTILE + "\n"
