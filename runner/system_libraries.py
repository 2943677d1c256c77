"""The shared libraries that bpy takes from the system, and their Debian packages."""

import re
import subprocess
from pathlib import Path

from . import debian
from .messages import SetupError, say

# What bpy 4.5 and 5.2 link, by themselves or through MaterialX and USD.
DEBIAN_PACKAGES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libGLX.so.0": "libglx0",
    "libGLdispatch.so.0": "libglvnd0",
    "libICE.so.6": "libice6",
    "libOpenGL.so.0": "libopengl0",
    "libSM.so.6": "libsm6",
    "libX11.so.6": "libx11-6",
    "libXau.so.6": "libxau6",
    "libXdmcp.so.6": "libxdmcp6",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXt.so.6": "libxt6",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libbsd.so.0": "libbsd0",
    "libgcc_s.so.1": "libgcc-s1",
    "libgomp.so.1": "libgomp1",
    "libmd.so.0": "libmd0",
    "libstdc++.so.6": "libstdc++6",
    "libuuid.so.1": "libuuid1",
    "libxcb.so.1": "libxcb1",
    "libxkbcommon.so.0": "libxkbcommon0",
}

_LDD_FOUND = re.compile(r"=> (/.*) \(0x[0-9a-f]+\)$", re.MULTILINE)
_LDD_MISSING = re.compile(r"^\s*(\S+) => not found", re.MULTILINE)
_IMPORT_MISSING = re.compile(r"(\S+): cannot open shared object file")


def ensure(python: Path) -> None:
    """See to it that bpy loads in the environment of `python`; silent once it has.

    The libraries found are kept in a list beside the environment's stamp. While they are all
    there nothing is done; an environment taken to another machine is checked again.
    """
    environment = python.parent.parent
    found_before = environment / "system-libraries"
    if found_before.exists() and all(
        Path(line).exists() for line in found_before.read_text(encoding="utf-8").splitlines()
    ):
        return

    say("checking that Blender finds its system libraries")
    missing = find_missing(python)
    while missing:
        debian.install(packages_of(missing), f"Blender needs {', '.join(sorted(missing))}")
        before, missing = missing, find_missing(python)
        if missing & before:
            raise SetupError(f"Blender still does not find {', '.join(sorted(missing))}")
    found = _LDD_FOUND.findall(_ldd(environment))
    outside = [path for path in found if not path.startswith(str(environment))]
    found_before.write_text("\n".join(outside), encoding="utf-8")


def find_missing(python: Path) -> set[str]:
    """Return the sonames bpy asks for and the system does not have.

    ldd lists all of them at once; the import names only the first but has the last word.
    """
    if missing := set(_LDD_MISSING.findall(_ldd(python.parent.parent))):
        return missing
    attempt = subprocess.run([python, "-I", "-c", "import bpy"], capture_output=True, text=True)
    if attempt.returncode == 0:
        return set()
    if missing := set(_IMPORT_MISSING.findall(attempt.stderr)):
        return missing
    raise SetupError(f"Blender does not load:\n{attempt.stderr.strip()}")


def packages_of(sonames: set[str]) -> set[str]:
    """Return the Debian packages that hold the libraries."""
    unknown = sorted(sonames - DEBIAN_PACKAGES.keys())
    if unknown:
        raise SetupError(
            f"Blender needs {', '.join(unknown)}, and which package has it is not known here.\n"
            f"  apt-file search {unknown[0]}\nfinds it on Debian."
        )
    return {DEBIAN_PACKAGES[soname] for soname in sonames}


def _ldd(environment: Path) -> str:
    """Return what ldd says about the bpy module, or nothing where there is no ldd."""
    libraries = environment.glob("lib/python3*/site-packages/bpy/__init__*.so")
    try:
        return subprocess.run(["ldd", *libraries], capture_output=True, text=True).stdout
    except FileNotFoundError:
        return ""
