"""The verbs of ./nfm, one line each."""

from typing import NamedTuple


class Verb(NamedTuple):
    """What a verb runs and what has to be there for it.

    `command` goes to the environment's interpreter, before the caller's arguments. `extras`
    are those of pyproject.toml that are installed only when this verb is used, `option_extras`
    those that an option of it needs. `option_blender` names the version of Blender that an option
    is run with where the caller did not choose one.
    """

    summary: str
    command: tuple[str, ...]
    loads_blender: bool = True
    extras: tuple[str, ...] = ()
    option_extras: tuple[tuple[str, str], ...] = ()
    option_blender: tuple[tuple[str, str], ...] = ()

    def extras_for(self, arguments: list[str]) -> tuple[str, ...]:
        """Return the extras that these arguments of the verb call for."""
        return (*self.extras, *_called_for(self.option_extras, arguments))

    def blender_for(self, arguments: list[str]) -> str | None:
        """Return the version of Blender that these arguments call for, if any."""
        return next(iter(_called_for(self.option_blender, arguments)), None)


def _called_for(table: tuple[tuple[str, str], ...], arguments: list[str]) -> list[str]:
    options = {argument.partition("=")[0] for argument in arguments}
    return [value for option, value in table if option in options]


def _module(name: str, *arguments: str) -> tuple[str, ...]:
    # -P: see ./nfm. runner.interruptible: Ctrl-C is an exit status, not a traceback.
    return ("-P", "-m", "runner.interruptible", name, *arguments)


VERBS = {
    "demo": Verb(
        "fit and render a sample material",
        _module("runner.blender", "demo"),
        # what 4.5 writes both open
        option_blender=(("--rebuild", "4.5"),),
    ),
    "fit": Verb(
        "fit a measured file, or a folder of them",
        _module("fitter", "fit"),
        loads_blender=False,
        option_extras=(("--dask", "dask"),),
    ),
    "export": Verb(
        "write fitted parameters as a MERL or UTIA file",
        _module("runner.blender", "export"),
    ),
    "eval": Verb("evaluate fitted parameters", _module("runner.blender", "eval")),
    "render": Verb("render the standard sphere", _module("runner.blender", "render")),
    "compare": Verb("fit other models too, and report", _module("compare"), extras=("report",)),
    "bench": Verb("print the tables of figures", _module("benchmarks"), extras=("report",)),
    "library": Verb("make the material library from its sources", _module("runner.library")),
    "build": Verb("build the extension's zip, with its wheels", _module("runner.package")),
    "test": Verb(
        "run ruff, then pytest on both Blender versions",
        _module("runner.checks"),
        extras=("report", "dask"),
        option_extras=(("--coverage", "coverage"),),
    ),
    "fuzz": Verb("feed spoiled files to the readers", _module("tests.fuzz"), loads_blender=False),
    "ui-test": Verb("try the add-on in a real window", _module("runner.ui_test")),
    "python": Verb("run the environment's interpreter", ()),
}


def usage() -> str:
    """Return the text of ./nfm --help."""
    width = max(map(len, VERBS))
    lines = "\n".join(f"  {name:{width}}  {verb.summary}" for name, verb in VERBS.items())
    return f"""\
usage: ./nfm [--blender 4.5|5.2] VERB [ARGUMENTS]

{lines}

./nfm VERB --help tells more about one of them.

  --blender VERSION  5.2 runs on Python 3.13, 4.5 on 3.11; default: 5.2 where possible.
                     The variable NFM_BLENDER does the same.
  --which            print the interpreter ./nfm has found, and stop
  NFM_HOME           folder of the private environments; default: .nfm in the checkout
"""
