"""The snake in MuJoCo: a row of servos on a smooth floor, generated from a file of parameters."""

from __future__ import annotations

import ctypes.util
import os
import sys


def _choose_rendering() -> None:
    """Without a display MuJoCo draws through EGL where that is installed; told to draw without it, its import fails."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault("MUJOCO_GL", "egl" if ctypes.util.find_library("EGL") else "off")


_choose_rendering()
