"""./nfm ui-test: the built extension in a real window of a full Blender, with mouse and keyboard.

A Blender is given with --blender PATH and runs on the present display or, where there is none, on a
virtual one (Xvfb). Without it, the window kept by the tool beside the checkout serves, which is set
up in NFM_WINDOW_ROOT when it is first needed. What happens there is a session:
tests/window/session.py, or --session NAME for another one of that folder.
"""

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from . import debian
from .blender import extension_tool, use_scratch_settings
from .environment import CHECKOUT
from .messages import SetupError, say

WINDOW_TOOL = CHECKOUT.parent / "shared" / "tools" / "blender_window.sh"
WINDOW_ROOT = Path(os.environ.get("NFM_WINDOW_ROOT", "/var/tmp/window"))

# Files of tests/window: an artist with a measured file, and the material library.
SESSIONS = ("session", "library", "curves")

SAMPLES = {"first.binary": "copper-paint", "second.binary": "glossy-plastic"}
FITTED = "third.nfm.json"
ANISOTROPIC = "fourth.nfm.json", "brushed-steel.nfm.json"  # and what it is in the material library
FRESH_SETTINGS = """import bpy
view = bpy.context.preferences.view
view.show_splash, view.filebrowser_display_type, view.use_save_prompt = False, "SCREEN", False
"""
SECONDS = 700  # that a session may take, unless told otherwise
FAILED = 1


class Launcher(Protocol):
    """Runs Blender; both folders are seen by it under the paths in `project`."""

    project: str

    def prepare(self) -> None:
        """Set up what is missing. May raise SetupError."""

    def run(self, *arguments: str) -> int:
        """Exit status of Blender with these arguments."""


class Executable:
    """A Blender of this machine."""

    def __init__(self, blender: Path, project: Path, seconds: int = SECONDS) -> None:
        self._blender, self.project, self._seconds = blender, str(project), seconds
        self._user = project / "user"
        self._user.mkdir()

    def prepare(self) -> None:
        """See to it that there can be a display."""
        if _needs_display() and not shutil.which("Xvfb"):
            debian.install(["xvfb"], "there is no display, and no Xvfb to make one")

    def run(self, *arguments: str) -> int:
        """Run it with settings of its own."""
        variables = os.environ | {"BLENDER_USER_RESOURCES": str(self._user)}
        with _display(needed="--command" not in arguments) as display:
            return subprocess.run(
                [self._blender, *arguments], env=variables | display, timeout=self._seconds
            ).returncode


class WindowTool:
    """The Blender that the tool beside the checkout keeps in a root of its own."""

    project = "/project"

    def __init__(self, project: Path, seconds: int = SECONDS) -> None:
        self._folder, self._user, self._seconds = project, project / "user", seconds

    def prepare(self) -> None:
        """Have the tool make its root, where Blender comes from."""
        if (WINDOW_ROOT / "usr" / "bin" / "blender").exists():
            return
        if os.geteuid() != 0:
            raise SetupError("only root can set up the window; give a full Blender: --blender PATH")
        if not shutil.which("debootstrap"):
            debian.install(["debootstrap"], "the window's root is made with debootstrap")
        say(f"setting up a window in {WINDOW_ROOT} (once, some minutes, 1.3 GB)")
        tool = subprocess.run(
            [WINDOW_TOOL, "setup", WINDOW_ROOT], capture_output=True, text=True, timeout=SECONDS
        )
        if tool.returncode:
            raise SetupError(f"the window could not be set up:\n{tool.stdout}{tool.stderr}".strip())

    def run(self, *arguments: str) -> int:
        """Run it; the tool brings the display."""
        options = ["--project", self._folder, "--user-dir", self._user]
        options += ["--size", "1600x1000", "--time-limit", self._seconds]
        return subprocess.run(
            [*map(str, [WINDOW_TOOL, "run", WINDOW_ROOT, *options, "--"]), *arguments]
        ).returncode


@contextlib.contextmanager
def _display(needed: bool) -> Iterator[dict[str, str]]:
    """Variables with a display: the present one, or a virtual one for as long as this lasts."""
    if not needed or not _needs_display():
        yield {}
        return
    reader, writer = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(writer), "-screen", "0", "1600x1000x24", "-noreset"],
        pass_fds=[writer],
        stderr=subprocess.DEVNULL,
    )
    try:
        os.close(writer)
        with os.fdopen(reader) as answer:
            number = answer.readline().strip()
        if not number:
            raise SetupError("Xvfb did not start")
        yield {"DISPLAY": f":{number}", "LIBGL_ALWAYS_SOFTWARE": "1"}
    finally:
        server.terminate()
        server.wait()


def _needs_display() -> bool:
    return sys.platform == "linux" and not os.environ.get("DISPLAY")


def main(arguments: list[str]) -> int:
    """Build, install, run the session; the exit status."""
    options = _parse(arguments)
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="nfm-ui-") as folder:
        project = Path(folder)
        try:
            launcher = _launcher(options.blender, project, options.time_limit)
            launcher.prepare()
        except (SetupError, subprocess.TimeoutExpired) as reason:
            say(str(reason))
            if options.if_possible:
                say("no window here: skipped")
                return 0
            return FAILED
        try:
            status = _run(launcher, project, options.session)
        except (SetupError, subprocess.TimeoutExpired) as error:
            say(str(error))
            status = FAILED
        if options.pictures:
            options.pictures.mkdir(parents=True, exist_ok=True)
            for picture in project.glob("*.png"):
                shutil.copy(picture, options.pictures)
    say(f"{'failed' if status else 'passed'} after {time.monotonic() - start:.0f} s")
    return status


def _parse(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="nfm ui-test", description=__doc__)
    parser.add_argument("--blender", type=Path, metavar="PATH", help="a full Blender, 4.5 or later")
    parser.add_argument(
        "--session", choices=SESSIONS, default=SESSIONS[0], help="which part; default: session"
    )
    parser.add_argument("--pictures", type=Path, metavar="FOLDER", help="keep the screenshots here")
    parser.add_argument("--time-limit", type=int, metavar="SECONDS", default=SECONDS)
    parser.add_argument(
        "--if-possible",
        action="store_true",
        help="succeed where there can be no window, and say why",
    )
    return parser.parse_args(arguments)


def _run(launcher: Launcher, project: Path, session: str) -> int:
    package = build_package(project)
    _write_samples(project)
    for script in (CHECKOUT / "tests" / "window").glob("*.py"):
        shutil.copy(script, project)
    inside = launcher.project
    say("installing the extension")
    install = ("extension", "install-file", "-r", "user_default", "-e", f"{inside}/{package.name}")
    if status := launcher.run("--command", *install):
        return status
    say("a session in the window")
    return launcher.run(
        *("--enable-event-simulate", "--python-expr", FRESH_SETTINGS),
        *("--python", f"{inside}/{session}.py", "--", inside),
    )


def build_package(folder: Path) -> Path:
    """The extension's zip, built in a folder by Blender's own tool."""
    use_scratch_settings()
    command = [
        sys.executable,
        extension_tool(),
        "build",
        "--source-dir",
        CHECKOUT,
        "--output-dir",
        folder,
    ]
    answer = subprocess.run([*map(str, command)], capture_output=True, text=True)
    packages = list(folder.glob("*.zip"))
    if answer.returncode or not packages:
        raise SetupError(f"the extension could not be built:\n{answer.stdout}{answer.stderr}")
    return packages[0]


def _write_samples(folder: Path) -> None:
    from fitter import synthetic
    from fitter.formats import parameter_file
    from fitter.jobs import fit_file

    for name, sample in SAMPLES.items():
        synthetic.write_sample(folder / name, sample)
    fitted = fit_file.material_from_file(str(folder / next(iter(SAMPLES))), quality="draft")
    parameter_file.save(folder / FITTED, replace(fitted, name="third"))
    name, source = ANISOTROPIC
    shutil.copyfile(CHECKOUT / "library" / source, folder / name)


def _launcher(blender: Path | None, project: Path, seconds: int = SECONDS) -> Launcher:
    if blender:
        if not os.access(blender, os.X_OK):
            raise SetupError(f"{blender} is not a program that can be run")
        return Executable(blender.resolve(), project, seconds)
    if not WINDOW_TOOL.exists():
        raise SetupError(f"there is no {WINDOW_TOOL}; give a full Blender with --blender PATH")
    return WindowTool(project, seconds)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
