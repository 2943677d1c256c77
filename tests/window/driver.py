# SPDX-License-Identifier: GPL-3.0-or-later
"""Mouse, keyboard, drops and pictures of a Blender window, from within Blender.

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
import numpy as np

PATIENCE = 240  # seconds that anything may take
PAGES = 8  # to scroll through in search of a button
XDND = Path(__file__).with_name("xdnd.py")


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

    def click(self, x, y):
        yield from self.drag((x, y), (x, y))

    @property
    def takes_drops(self):
        """Whether another program can drop files here: on X11."""
        return bool(os.environ.get("DISPLAY")) and not os.environ.get("WAYLAND_DISPLAY")

    def drop(self, x, y, *paths):
        """Have another program drop files here, as a file manager does."""
        height = self.window.height
        command = [sys.executable, XDND, int(x), height - 1 - int(y), *paths]
        process = subprocess.Popen([*map(str, command)])
        yield from self.until("the files are dropped", lambda: process.poll() is not None)
        assert process.returncode == 0

    def area(self, kind):
        return next((area for area in self.window.screen.areas if area.type == kind), None)

    def override(self, area, region="WINDOW"):
        """Context of a region of an area."""
        found = next(item for item in area.regions if item.type == region)
        return bpy.context.temp_override(window=self.window, area=area, region=found)

    def button(self, area, path, region="WINDOW"):
        """Move over an area, and scroll it, until the mouse is on a property's button; its place.

        path : the end of its data path, such as "lobe_1.gain"
        """
        found = next(item for item in area.regions if item.type == region)
        x = found.x + 0.7 * found.width
        for _ in range(PAGES):
            for y in range(found.y + found.height - 8, found.y + 8, -8):
                self.move(x, y)
                yield 0.03
                with self.override(area, region):
                    below = bpy.context.property
                if below and below[1].endswith(path):
                    return self.at
            for _ in range(6):
                self.event("WHEELDOWNMOUSE")
                yield 0.05
            yield 0.5
        raise AssertionError(f"no button {path} in {area.type}")

    def until(self, what, done, pause=0.1):
        """Wait until a condition holds, looked at with pauses of so many seconds.

        Tells how long that took, and the longest time for which the interface stood still.
        """
        start = last = time.monotonic()
        still = 0.0
        while not done():
            assert last < start + PATIENCE, f"waited in vain until {what}"
            yield pause
            now = time.monotonic()
            still, last = max(still, now - last - pause), now
        print(f"session: {what} ({last - start:.1f} s, still {still:.1f} s)", flush=True)

    def picture(self, name):
        """Take a picture of the screen, once everything is drawn; its path."""
        yield 1.5
        path = self.pictures / f"{name}.png"
        if shutil.which("import"):
            subprocess.run(["import", "-window", "root", str(path)], check=True)
        else:
            with bpy.context.temp_override(window=self.window):
                bpy.ops.screen.screenshot(filepath=str(path))
        print(f"session: picture {path.name}", flush=True)
        return path

    def pixels(self, path, x, y, size):
        """Colours (n, 3), 0..1 as displayed, of a square of a picture around a place."""
        image = bpy.data.images.load(str(path))
        try:
            pixels = np.empty((image.size[1], image.size[0], image.channels), np.float32)
            image.pixels.foreach_get(pixels.ravel())
        finally:
            bpy.data.images.remove(image)
        rows, columns = (slice(int(at - size / 2), int(at + size / 2)) for at in (y, x))
        return pixels[rows, columns, :3].reshape(-1, 3)


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
