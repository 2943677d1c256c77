# SPDX-License-Identifier: GPL-3.0-or-later
"""A small document of headings, text, tables and pictures, written as Markdown and as HTML.

All text is plain: both writers escape it, so names that come from files cannot become markup. The
HTML holds its pictures and its style, and asks for nothing from anywhere.
"""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Sequence
from dataclasses import dataclass


class Strong(str):
    """A cell to be set in bold."""


@dataclass(frozen=True)
class Heading:
    """A heading; level 1 is the document's title."""

    level: int
    text: str


@dataclass(frozen=True)
class Paragraph:
    """Running text."""

    text: str


@dataclass(frozen=True)
class Bullets:
    """A list."""

    items: Sequence[str]


@dataclass(frozen=True)
class Table:
    """Rows of text; the first column is aligned left, the others right."""

    header: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Picture:
    """A PNG.

    file_name : within the document's folder of images; letters, digits, dots and hyphens
    """

    file_name: str
    png: bytes
    caption: str


Block = Heading | Paragraph | Bullets | Table | Picture


def to_markdown(blocks: Sequence[Block], images: str) -> str:
    """The document as Markdown whose pictures lie in the folder `images`."""
    return "\n\n".join(_markdown(block, images) for block in blocks) + "\n"


def to_html(blocks: Sequence[Block]) -> str:
    """The document as one HTML file."""
    title = next(block.text for block in blocks if isinstance(block, Heading))
    body = "\n".join(map(_html, blocks))
    return _PAGE.format(title=html.escape(title), style=_STYLE, body=body)


def _markdown(block: Block, images: str) -> str:
    match block:
        case Heading(level, text):
            return f"{'#' * level} {_escape_markdown(text)}"
        case Paragraph(text):
            return _escape_markdown(text)
        case Bullets(items):
            return "\n".join(f"- {_escape_markdown(item)}" for item in items)
        case Table(header, rows):
            lines = [list(map(_escape_markdown, header)), ["---", *["---:"] * (len(header) - 1)]]
            for row in rows:
                cells = [(cell, _escape_markdown(cell)) for cell in row]
                lines.append([f"**{t}**" if isinstance(c, Strong) else t for c, t in cells])
            return "\n".join(f"| {' | '.join(line)} |" for line in lines)
        case Picture(file_name, _, caption):
            text = _escape_markdown(caption)
            return f"![{text}]({images}/{file_name})\n\n*{text}*"


def _html(block: Block) -> str:
    match block:
        case Heading(level, text):
            return f"<h{level}>{html.escape(text)}</h{level}>"
        case Paragraph(text):
            return f"<p>{html.escape(text)}</p>"
        case Bullets(items):
            return f"<ul>{''.join(f'<li>{html.escape(item)}</li>' for item in items)}</ul>"
        case Table(header, rows):
            head = "".join(f"<th>{html.escape(cell)}</th>" for cell in header)
            lines = "\n".join(f"<tr>{''.join(map(_html_cell, row))}</tr>" for row in rows)
            return (
                f'<div class="table"><table>\n<thead><tr>{head}</tr></thead>\n'
                f"<tbody>\n{lines}\n</tbody>\n</table></div>"
            )
        case Picture(_, png, caption):
            data = base64.b64encode(png).decode("ascii")
            text = html.escape(caption)
            return (
                f'<figure><img alt="{text}" src="data:image/png;base64,{data}">'
                f"<figcaption>{text}</figcaption></figure>"
            )


def _html_cell(cell: str) -> str:
    text = html.escape(cell)
    return f"<td><b>{text}</b></td>" if isinstance(cell, Strong) else f"<td>{text}</td>"


def _escape_markdown(text: str) -> str:
    """Text whose characters are no Markdown and no HTML."""
    return re.sub(r"([\\`*_{}\[\]<>|#~!&])", r"\\\1", text)


_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, -apple-system, "Segoe UI", sans-serif; color: #1c1c1c;
  background: #fff; max-width: 76rem; margin: 2rem auto; padding: 0 1.5rem; }
h1 { font-size: 1.7rem; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ddd; }
p, li { max-width: 48rem; }
.table { overflow: auto; max-height: 44rem; border: 1px solid #ddd; display: inline-block;
  max-width: 100%; }
table { border-collapse: separate; border-spacing: 0; font-size: 13px;
  font-variant-numeric: tabular-nums; }
th { position: sticky; top: 0; background: #f2f2f2; border-bottom: 1px solid #bbb;
  vertical-align: bottom; }
th, td { padding: 0.25rem 0.7rem; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
tbody tr:nth-child(even) { background: #fafafa; }
tbody tr:hover { background: #eef4fb; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; display: block; }
figcaption { color: #555; font-size: 13px; max-width: 48rem; margin-top: 0.4rem; }
@media print { .table { max-height: none; overflow: visible; } figure { break-inside: avoid; } }
"""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{body}
</body>
</html>
"""
