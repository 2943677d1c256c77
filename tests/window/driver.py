# SPDX-License-Identifier: GPL-3.0-or-later
"""Mouse, keyboard and pictures of a Blender window, from within Blender.

Needs --enable-event-simulate. A session is a generator that yields seconds to wait; `run` calls it
from a timer and ends Blender with the session's status.
"""

import os
import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy

PATIENCE = 120  # seconds that anything may take


class Window:
    """The main window and its mouse; the origin is at the bottom left."""

    def __init__(self, pictures):
        self.pictures = Path(pictures)
        self.at = (400, 400)

    @property
    def window(self):
        return bpy.context.window_manager.windows[0]

    def event(self, kind, value="PRESS", **options):
        x, y = self.at
        self.window.event_simulate(type=kind, value=value, x=x, y=y, **options)

    def move(self, x, y):
        self.at = (int(x), int(y))
        self.event("MOUSEMOVE", "NOTHING")

    def key(self, kind, **options):
        self.event(kind, **options)
        self.event(kind, "RELEASE", **options)

    def drag(self, start, end):
        self.move(*start)
        yield 0.1
        self.event("LEFTMOUSE")
        yield 0.1
        for step in range(1, 11):
            share = step / 10
            self.move(*(a + (b - a) * share for a, b in zip(start, end, strict=True)))
            yield 0.05
        self.event("LEFTMOUSE", "RELEASE")
        yield 0.3

    def area(self, kind):
        return next((area for area in self.window.screen.areas if area.type == kind), None)

    def until(self, what, done, pause=0.1):
        """Wait until a condition holds, looked at with pauses of so many seconds."""
        end = time.monotonic() + PATIENCE
        while not done():
            assert time.monotonic() < end, f"waited in vain until {what}"
            yield pause
        print(f"session: {what}", flush=True)

    def picture(self, name):
        """Take a picture of the screen, once everything is drawn."""
        yield 1.5
        path = self.pictures / f"{name}.png"
        if shutil.which("import"):
            subprocess.run(["import", "-window", "root", str(path)], check=True)
        else:
            with bpy.context.temp_override(window=self.window):
                bpy.ops.screen.screenshot(filepath=str(path))
        print(f"session: picture {path.name}", flush=True)


def run(session, window):
    """Run a session; exit status 0 if it came to its end."""
    steps = session(window)

    def tick():
        try:
            return next(steps)
        except StopIteration:
            print("session: passed", flush=True)
            status = 0
        except BaseException:
            traceback.print_exc()
            for _ in window.picture("failed"):
                pass
            status = 1
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)

    bpy.app.timers.register(tick, first_interval=2, persistent=True)
