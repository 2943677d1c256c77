"""./nfm library build: the parameter files and previews of the material library, from its sources.

The measured sources are RGL files, which are not part of the checkout; the others are analytic
models of fitter/jobs/library.py. Fits that are there already, of the same sources, are kept.
"""

import argparse
import sys
from functools import partial
from importlib import import_module
from pathlib import Path

from .environment import CHECKOUT
from .messages import say

FOLDER = CHECKOUT / "library"
RGL_FOLDER = CHECKOUT.parent / "shared" / "data" / "rgl"
FAILED, BAD_USAGE = 1, 2


def main(arguments: list[str]) -> int:
    """Fit what has to be fitted, render what has to be rendered; the exit status."""
    from fitter.errors import NfmError

    options = _parse(arguments)
    try:
        return _build(options)
    except NfmError as error:
        say(str(error))
        return FAILED


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="nfm library", description=__doc__.splitlines()[0])
    parser.add_argument("action", choices=["build"])
    parser.add_argument(
        "--rgl", type=Path, default=RGL_FOLDER, metavar="FOLDER", help="where the RGL files are"
    )
    parser.add_argument("--only", metavar="KEY,KEY", help="these materials; default: all")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="processes; default: 2")
    parser.add_argument(
        "--again", action="store_true", help="make the fits again, as after a change of the fitter"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=FOLDER,
        metavar="FOLDER",
        help="default: library/",
    )
    return parser.parse_args(arguments)


def _build(options: argparse.Namespace) -> int:
    from fitter.formats import parameter_file
    from fitter.jobs import library, workers

    entries = {entry.key: entry for entry in library.ENTRIES}
    keys = options.only.split(",") if options.only else list(entries)
    if unknown := [key for key in keys if key not in entries]:
        say(f"there is no material {unknown[0]!r}; there are {', '.join(entries)}")
        return BAD_USAGE
    options.output.mkdir(parents=True, exist_ok=True)
    names = {key: options.output / f"{key}{parameter_file.SUFFIX}" for key in keys}
    if options.again:
        for path in names.values():
            path.unlink(missing_ok=True)
    work = partial(_fit, rgl_folder=options.rgl)
    changed = set()
    results = workers.run(work, [(entries[key], path) for key, path in names.items()], options.jobs)
    for result in filter(None, results):
        key, was_fitted = result
        say(f"{key}: {'fitted' if was_fitted else 'kept'}")
        if was_fitted:
            changed.add(key)
    pictures = {key: options.output / f"{key}.png" for key in keys}
    missing = [key for key, path in pictures.items() if key in changed or not path.is_file()]
    if missing:
        from .blender import load_extension

        previews = import_module(f"{load_extension().__name__}.nfm_addon.library_previews")
        for key in missing:
            previews.render(names[key], pictures[key])
            say(f"{key}: rendered")
    sizes = [path.stat().st_size for path in options.output.iterdir() if path.is_file()]
    say(f"{len(keys)} materials; {options.output.name} has {sum(sizes) / 1e6:.2f} MB")
    return 0


def _fit(task: tuple, rgl_folder: Path) -> tuple[str, bool]:
    from fitter.jobs import library

    entry, path = task
    return entry.key, library.fit(entry, rgl_folder, path)


if __name__ == "__main__":
    from .blender import leave

    leave(main(sys.argv[1:]))
