"""./nfm build: the extension as a zip, with the wheels that Blender's own Python lacks.

The checkout has no wheels and its manifest names none, so that it loads and validates as it is.
They are downloaded once into the folder of the private environments, and a copy of the checkout
gets them and a manifest with their names.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

from . import environment
from .blender import extension_tool
from .messages import SetupError, say

# What Blender 4.5 and 5.2 run on: Pythons, and platforms as wheels and as manifests call them.
PYTHONS = ("3.11", "3.13")
PLATFORMS = {
    "manylinux_2_28_x86_64": "linux-x64",
    "macosx_11_0_arm64": "macos-arm64",
    "macosx_10_15_x86_64": "macos-x64",
    "win_amd64": "windows-x64",
}
BUNDLED = "OpenEXR"

LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "nfm-demo", "demo.blend", "wheels", "*.zip")


def main(arguments: list[str]) -> int:
    """Build the zip and say where it is."""
    parser = argparse.ArgumentParser(prog="nfm build", description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output-dir", type=Path, default=Path(), metavar="FOLDER")
    parser.add_argument(
        "--split-platforms",
        action="store_true",
        help="a zip for each platform, with its wheels alone; default: one for all",
    )
    options = parser.parse_args(arguments)
    folder = options.output_dir
    folder.mkdir(parents=True, exist_ok=True)  # the tool does not make it
    try:
        wheels = [*downloaded_wheels(environment.folder().parent / "wheels")]
        with tempfile.TemporaryDirectory(prefix="nfm-build-") as scratch:
            split = options.split_platforms
            platforms = PLATFORMS.values() if split else ()
            staged = stage(environment.CHECKOUT, Path(scratch, "nfm"), wheels, platforms)
            command = [sys.executable, extension_tool(), "build", "--source-dir", staged]
            command += ["--split-platforms"] * split
            if subprocess.run([*command, "--output-dir", folder]).returncode != 0:
                raise SetupError("Blender's extension tool failed (see above)")
    except SetupError as error:
        say(str(error))
        return 1
    return 0


def downloaded_wheels(folder: Path) -> Iterable[Path]:
    """The bundled wheels, downloaded unless they are there."""
    pins = environment.read_requirements(environment.CHECKOUT / "pyproject.toml")["dependencies"]
    (pin,) = (line for line in pins if line.startswith(BUNDLED))
    folder = folder / pin
    for python in PYTHONS:
        for platform in PLATFORMS:
            tags = f"*-cp{python.replace('.', '')}-*-{platform}.whl"
            if not any(folder.glob(tags)):
                say(f"downloading {pin} for Python {python} on {platform}")
                download(pin, python, platform, folder)
            yield from folder.glob(tags)


def download(pin: str, python: str, platform: str, folder: Path) -> None:
    """Download one wheel with pip."""
    pip = [sys.executable, "-I", "-m", "pip", "--disable-pip-version-check", "download", "--quiet"]
    choice = ["--no-deps", "--only-binary=:all:", "--python-version", python]
    command = [*pip, *choice, "--platform", platform, "--dest", str(folder), pin]
    if subprocess.run(command, stdout=2).returncode != 0:
        raise SetupError(f"pip could not download {pin} (see above); the next ./nfm build goes on")


def stage(
    checkout: Path, target: Path, wheels: Iterable[Path], platforms: Iterable[str] = ()
) -> Path:
    """Copy a checkout, with wheels and platforms that its manifest names; returns the copy.

    platforms : those that it is for, as manifests call them; none for all there are
    """
    shutil.copytree(checkout, target, ignore=LEFT_OUT)
    (target / "wheels").mkdir()
    names = [shutil.copy(wheel, target / "wheels") and wheel.name for wheel in sorted(wheels)]
    manifest = target / "blender_manifest.toml"
    lines = _list("wheels", [f"./wheels/{name}" for name in names])
    lines += _list("platforms", platforms)
    # before the first table: a key after it would belong to that
    head, table, rest = manifest.read_text(encoding="utf-8").partition("\n[")
    manifest.write_text(f"{head}\n{lines}{table}{rest}", encoding="utf-8")
    return target


def _list(key: str, values: Iterable[str]) -> str:
    lines = "".join(f'  "{value}",\n' for value in values)
    return f"{key} = [\n{lines}]\n" if lines else ""


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
