# SPDX-License-Identifier: GPL-3.0-or-later
import io

import pytest

from fitter.jobs.progress import BAR_WIDTH, Progress


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_piped_lines():
    stream = io.StringIO()
    with Progress(stream, "fit") as progress:
        for n in range(10):
            progress.update(n / 10, "explore" if n < 5 else "refine")
    assert stream.getvalue() == "fit: explore\nfit: refine\n"


def test_terminal_bar():
    stream = Terminal()
    with Progress(stream, "fit") as progress:
        progress.update(0, "explore 1")
        progress.update(0.5, "refine")
        progress.update(1, "polish")
    text = stream.getvalue()
    assert text.count("\n") == 1
    assert text.endswith("\n")
    first, middle, last = text[:-1].split("\r")[1:]
    assert first == f"fit [{'.' * BAR_WIDTH}]   0% explore 1"
    assert middle.rstrip() == f"fit [{'#' * 15}{'.' * 15}]  50% refine"
    assert last.rstrip() == f"fit [{'#' * BAR_WIDTH}] 100% polish"
    # a shorter line covers what the longer one left
    assert len(middle) == len(first)


@pytest.mark.parametrize("fraction", [-0.5, 1.5])
def test_bar_keeps_its_width(fraction):
    stream = Terminal()
    with Progress(stream, "x") as progress:
        progress.update(fraction, "y")
    text = stream.getvalue()
    assert text.index("]") - text.index("[") - 1 == BAR_WIDTH


@pytest.mark.parametrize("stream", [io.StringIO(), Terminal()])
def test_nothing_without_work(stream):
    with Progress(stream, "fit"):
        pass
    assert stream.getvalue() == ""


def test_line_ends_when_the_work_fails():
    stream = Terminal()
    with pytest.raises(RuntimeError), Progress(stream, "fit") as progress:
        progress.update(0.1, "explore")
        raise RuntimeError
    assert stream.getvalue().endswith("\n")
