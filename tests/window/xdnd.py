# SPDX-License-Identifier: GPL-3.0-or-later
"""A file manager's half of drag and drop on X11: python xdnd.py X Y FILE... drops files there.

X and Y count from the top left of the screen. It speaks the XDND protocol (version 5) to the window
at that place, as a file manager does while the mouse is dragged and let go. Exit status 0 once
the window says that it has the files. Needs libX11 and nothing else.
"""

import ctypes
import sys
import time
from ctypes import POINTER, Structure, Union, byref, c_char_p, c_int, c_long, c_ubyte, c_ulong
from ctypes.util import find_library
from pathlib import Path

VERSION = 5
PATIENCE = 60  # seconds that the window may take for an answer
CLIENT_MESSAGE, SELECTION_REQUEST, SELECTION_NOTIFY = 33, 30, 31
ATOM, ANY_TYPE, REPLACE, COPY_NOW = 4, 0, 0, 0

Pointer, Window, Atom, Time = ctypes.c_void_p, c_ulong, c_ulong, c_ulong
HEADER = [("type", c_int), ("serial", c_ulong), ("send_event", c_int), ("display", Pointer)]


class ClientMessage(Structure):
    _fields_ = [
        *HEADER,
        ("window", Window),
        ("message_type", Atom),
        ("format", c_int),
        ("data", c_long * 5),
    ]


class SelectionRequest(Structure):
    _fields_ = [
        *HEADER,
        ("owner", Window),
        ("requestor", Window),
        ("selection", Atom),
        ("target", Atom),
        ("property", Atom),
        ("time", Time),
    ]


class SelectionNotify(Structure):
    _fields_ = [
        *HEADER,
        ("requestor", Window),
        ("selection", Atom),
        ("target", Atom),
        ("property", Atom),
        ("time", Time),
    ]


class Event(Union):
    _fields_ = [
        ("type", c_int),
        ("message", ClientMessage),
        ("request", SelectionRequest),
        ("notify", SelectionNotify),
        ("pad", c_long * 24),
    ]


class Drag:
    """Files under way to whatever window is at a place of the screen."""

    def __init__(self, x, y, paths):
        self._x = ctypes.CDLL(find_library("X11") or "libX11.so.6")
        self._x.XOpenDisplay.restype = Pointer
        for name in ("XDefaultRootWindow", "XCreateSimpleWindow", "XInternAtom"):
            getattr(self._x, name).restype = c_ulong
        self._display = Pointer(self._x.XOpenDisplay(None))
        if not self._display:
            raise SystemExit("xdnd: there is no display")
        self._root = self._x.XDefaultRootWindow(self._display)
        size = (0, 0, 1, 1, 0)
        self._source = self._x.XCreateSimpleWindow(
            self._display, c_ulong(self._root), *size, c_ulong(0), c_ulong(0)
        )
        self._place = x, y
        self._data = "".join(f"{Path(path).resolve().as_uri()}\r\n" for path in paths).encode()

    def drop(self):
        """Enter the window, move to the place, let go, hand the files over."""
        target = self._target()
        types = [self._atom("text/uri-list"), 0, 0]
        selection = self._atom("XdndSelection")
        self._x.XSetSelectionOwner(
            self._display, c_ulong(selection), c_ulong(self._source), c_ulong(COPY_NOW)
        )
        self._send(target, "XdndEnter", [VERSION << 24, *types])
        x, y = self._place
        self._send(target, "XdndPosition", [0, x << 16 | y, 0, self._atom("XdndActionCopy")])
        status = self._answer("XdndStatus")
        if not status[1] & 1:
            raise SystemExit("xdnd: the window does not take the files")
        self._send(target, "XdndDrop", [0, 0, 0, 0])
        self._answer("XdndFinished")

    def _target(self):
        """The window at the place that takes drops; moves the mouse there too."""
        x, y = self._place
        self._x.XWarpPointer(
            self._display, c_ulong(0), c_ulong(self._root), 0, 0, c_ulong(0), c_ulong(0), x, y
        )
        window = self._root
        at, child = (c_int(), c_int()), c_ulong()
        while window:
            if self._takes_drops(window):
                return window
            self._x.XTranslateCoordinates(
                self._display,
                c_ulong(self._root),
                c_ulong(window),
                x,
                y,
                *map(byref, at),
                byref(child),
            )
            window = child.value
        raise SystemExit(f"xdnd: no window at {x}, {y} takes drops")

    def _takes_drops(self, window):
        kind, form, count, left, data = Atom(), c_int(), c_ulong(), c_ulong(), POINTER(c_ubyte)()
        self._x.XGetWindowProperty(
            self._display,
            c_ulong(window),
            c_ulong(self._atom("XdndAware")),
            c_long(0),
            c_long(1),
            0,
            c_ulong(ANY_TYPE),
            *map(byref, (kind, form, count, left, data)),
        )
        return count.value > 0

    def _send(self, target, name, data):
        event = Event()
        event.message.type, event.message.window = CLIENT_MESSAGE, target
        event.message.message_type, event.message.format = self._atom(name), 32
        event.message.data[:] = [self._source, *data]
        self._x.XSendEvent(self._display, c_ulong(target), 0, c_long(0), byref(event))
        self._x.XFlush(self._display)

    def _answer(self, name):
        """Data of the window's message of this name; its questions for the files are answered."""
        wanted, event, end = self._atom(name), Event(), time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if not self._x.XPending(self._display):
                time.sleep(0.02)
                continue
            self._x.XNextEvent(self._display, byref(event))
            if event.type == SELECTION_REQUEST:
                self._hand_over(event.request)
            elif event.type == CLIENT_MESSAGE and event.message.message_type == wanted:
                return list(event.message.data)
        raise SystemExit(f"xdnd: no {name} within {PATIENCE} s")

    def _hand_over(self, request):
        self._x.XChangeProperty(
            self._display,
            c_ulong(request.requestor),
            c_ulong(request.property),
            c_ulong(request.target),
            8,
            REPLACE,
            c_char_p(self._data),
            len(self._data),
        )
        event = Event()
        event.notify.type = SELECTION_NOTIFY
        for field in ("requestor", "selection", "target", "property", "time"):
            setattr(event.notify, field, getattr(request, field))
        self._x.XSendEvent(self._display, c_ulong(request.requestor), 0, c_long(0), byref(event))
        self._x.XFlush(self._display)

    def _atom(self, name):
        return self._x.XInternAtom(self._display, name.encode(), 0)


if __name__ == "__main__":
    Drag(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]).drop()
