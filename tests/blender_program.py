# SPDX-License-Identifier: GPL-3.0-or-later
"""The bpy module in the place of the program blender: python -m tests.blender_program ARGUMENTS.

Of Blender's arguments it knows those of docs/HEADLESS.md, and takes them one after the other, as
Blender does. Unlike the module, it begins with the user's settings and extensions.
"""

import os
import runpy
import sys
import traceback

import bpy

from runner.blender import leave, make_oslquery_importable


class Program:
    """What the arguments so far have set."""

    def __init__(self, commands: dict) -> None:
        self.commands = commands
        self.exit_code = 0  # of --python-exit-code

    def run(self, arguments: list[str]) -> int:
        """Take the arguments; returns the exit status."""
        if "--factory-startup" not in arguments:
            bpy.ops.wm.read_userpref()
        waiting = iter(arguments)
        scene = bpy.context.scene
        for argument in waiting:
            if argument in ("-b", "--background", "--factory-startup"):
                continue
            if argument == "--":
                break
            if argument in ("-c", "--command"):
                return self.commands[next(waiting)]([*waiting])
            if argument == "--python-exit-code":
                self.exit_code = int(next(waiting))
            elif argument == "--python":
                if status := self._script(next(waiting)):
                    return status
            elif argument == "-o":
                scene.render.filepath = next(waiting)
            elif argument == "-F":
                scene.render.image_settings.file_format = next(waiting)
            elif argument == "-s":
                scene.frame_start = int(next(waiting))
            elif argument == "-e":
                scene.frame_end = int(next(waiting))
            elif argument == "-t":
                scene.render.threads_mode, scene.render.threads = "FIXED", int(next(waiting))
            elif argument == "-a":
                bpy.ops.render.render(animation=True)
            elif argument.startswith("-"):
                raise ValueError(f"{argument}: unknown here")
            else:
                bpy.ops.wm.open_mainfile(filepath=os.path.abspath(argument))  # noqa: PTH100
                scene = bpy.context.scene
        return 0

    def _script(self, path: str) -> int:
        sys.argv = ["blender", *sys.argv[1:]]
        try:
            runpy.run_path(path, run_name="__main__")
        except SystemExit as end:
            if isinstance(end.code, str):
                sys.stderr.write(f"{end.code}\n")
                return 1
            return end.code or 0
        except Exception:
            traceback.print_exc()
            return self.exit_code
        return 0


def registered_commands() -> dict:
    """Commands by name, as add-ons register them from now on."""
    from bl_pkg import bl_extension_cli

    found = {"extension": bl_extension_cli.cli_extension_handler}
    register = bpy.utils.register_cli_command

    def noted(name: str, function: object) -> object:
        found[name] = function
        return register(name, function)

    bpy.utils.register_cli_command = noted
    return found


if __name__ == "__main__":
    make_oslquery_importable()
    leave(Program(registered_commands()).run(sys.argv[1:]))
