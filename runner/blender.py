"""The checkout as a loaded Blender extension, in the bpy module.

python -m runner.blender VERB ARGS runs a verb of the add-on's command line that way.
"""

import functools
import importlib
import os
import shutil
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import NoReturn

from .environment import CHECKOUT

REPOSITORY, EXTENSION = "nfm_dev", "nfm"


class ExtensionError(RuntimeError):
    """Blender did not enable the extension; the cause is chained."""


def use_scratch_settings() -> None:
    """Keep Blender off the user's settings, in this process and those it starts.

    Blender looks at the variables when it is imported, so this has to come before.
    """
    user = Path(_scratch().name) / "user"
    user.mkdir(exist_ok=True)
    for name in ("CONFIG", "SCRIPTS", "EXTENSIONS", "DATAFILES"):
        os.environ.pop(f"BLENDER_USER_{name}", None)  # they would win over RESOURCES
    os.environ["BLENDER_USER_RESOURCES"] = str(user)


@functools.cache
def _scratch() -> tempfile.TemporaryDirectory:
    # Cached, so that it is alive until Python ends and removes the folder.
    return tempfile.TemporaryDirectory(prefix="nfm-blender-")


def load_extension(checkout: Path = CHECKOUT) -> ModuleType:
    """Reset Blender to an empty factory scene, enable the checkout and return its root module.

    Blender sees it as bl_ext.nfm_dev.nfm: a link in a repository folder that exists as long as
    the process does.
    """
    use_scratch_settings()
    repository = Path(_scratch().name) / REPOSITORY
    repository.mkdir(exist_ok=True)
    link = repository / EXTENSION
    link.unlink(missing_ok=True)
    link.symlink_to(checkout, target_is_directory=True)

    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    import addon_utils  # importing bpy is what puts it on the path

    bpy.context.preferences.extensions.repos.new(
        name="dev", module=REPOSITORY, custom_directory=str(repository)
    )
    make_oslquery_importable()

    name = f"bl_ext.{REPOSITORY}.{EXTENSION}"
    errors: list[Exception] = []
    module = addon_utils.enable(name, default_set=False, handle_error=errors.append)
    if module is None:
        raise ExtensionError(f"Blender did not enable {checkout} as {name}") from next(
            iter(errors), None
        )
    return module


def make_oslquery_importable() -> None:
    """Add the folder the bpy wheel forgets; a real Blender has it on its path."""
    import bpy

    python = "python{}.{}".format(*sys.version_info[:2])
    packages = Path(bpy.utils.resource_path("LOCAL"), "python", "lib", python, "site-packages")
    if str(packages) not in sys.path:
        sys.path.append(str(packages))


def extension_tool() -> Path:
    """Blender's command-line tool for extensions, which runs under plain Python."""
    import bpy

    scripts = Path(bpy.utils.system_resource("SCRIPTS"))
    return scripts / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"


def leave(status: int) -> NoReturn:
    """End a process that has loaded Blender, with an exit status.

    At the end of a process in which anything still holds the module, Blender 4.5 waits for ever for
    a thread of its own (projects.blender.org #146640, mended in 5.0). So its destructors are left
    out there.
    """
    bpy = sys.modules.get("bpy")
    if bpy and bpy.app.module and bpy.app.version < (5, 0, 0):
        _scratch().cleanup()
        session = Path(bpy.app.tempdir)
        if session.name.startswith("blender_"):  # and not the folder of all temporary files
            shutil.rmtree(session, ignore_errors=True)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    sys.exit(status)


def main(arguments: list[str]) -> int:
    """Hand a verb and its arguments to the add-on's command line."""
    root = load_extension()
    return importlib.import_module(f"{root.__name__}.nfm_addon.command_line").main(arguments)


if __name__ == "__main__":
    leave(main(sys.argv[1:]))
