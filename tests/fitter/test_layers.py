# SPDX-License-Identifier: GPL-3.0-or-later
"""The folders of the fitter lie in layers: each imports from those before it and from the top."""

import ast
from pathlib import Path

import pytest

import fitter

FOLDER = Path(fitter.__file__).parent
LAYERS = (
    *("models", "pictures", "fitting", "anisotropic", "baselines", "grading"),
    *("editing", "formats", "shading", "jobs"),
)
# Modules at the top that use the folders; the others there use none.
CLIENTS = ("__main__", "command_line", "synthetic")


def imported_folders(path):
    """Folders of the fitter that a module imports from, without its own."""
    depth = len(path.relative_to(FOLDER).parts)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level == depth:
            names = [node.module] if node.module else [alias.name for alias in node.names]
            yield from (name.split(".")[0] for name in names if name.split(".")[0] in LAYERS)


def test_every_folder_is_a_layer():
    assert sorted(path.parent.name for path in FOLDER.glob("*/__init__.py")) == sorted(LAYERS)


@pytest.mark.parametrize("layer", LAYERS)
def test_a_layer_imports_from_those_before_it(layer):
    before = LAYERS[: LAYERS.index(layer)]
    for path in (FOLDER / layer).glob("*.py"):
        assert {*imported_folders(path)} <= {*before}, path


def test_what_all_share_imports_from_no_layer():
    for path in FOLDER.glob("*.py"):
        assert path.stem in CLIENTS or not [*imported_folders(path)], path
