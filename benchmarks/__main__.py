# SPDX-License-Identifier: GPL-3.0-or-later
"""./nfm bench NAME [ARGUMENTS]."""

import argparse
import sys

from . import (
    aniso,
    base,
    batch,
    diffuse,
    edit,
    exact,
    fit,
    importing,
    masking,
    noise,
    render,
    rgl,
    sampling,
    session,
    smooth,
)

BENCHMARKS = {
    "aniso": aniso,
    "base": base,
    "batch": batch,
    "diffuse": diffuse,
    "edit": edit,
    "exact": exact,
    "fit": fit,
    "import": importing,
    "masking": masking,
    "noise": noise,
    "render": render,
    "rgl": rgl,
    "sampling": sampling,
    "session": session,
    "smooth": smooth,
}


def main(argv: list[str]) -> int:
    """Parse and run; returns the exit status."""
    parser = argparse.ArgumentParser(prog="nfm bench")
    names = parser.add_subparsers(dest="name", required=True, metavar="NAME")
    for name, module in BENCHMARKS.items():
        summary = module.__doc__.strip().splitlines()[0]
        module.add_arguments(names.add_parser(name, help=summary, description=summary))
    arguments = parser.parse_args(argv)
    return BENCHMARKS[arguments.name].run(arguments)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
