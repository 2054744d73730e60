"""The snake in MuJoCo: a row of servos on a smooth floor, generated from a file of parameters."""

from __future__ import annotations

import ctypes.util
import os
import sys

WAY = "MUJOCO_GL"
"""Variable of the environment that tells MuJoCo what to draw with."""


def _choose_rendering() -> str:
    """Without a display MuJoCo draws through EGL where that is installed. Told to draw with what is not there, its import
    fails: it is then told to draw with nothing, for driving needs no pictures. What is wrong, or ""."""
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        os.environ.setdefault(WAY, "egl" if ctypes.util.find_library("EGL") else "off")
    try:
        import mujoco  # noqa: F401, PLC0415  # whether it can be imported is what is asked
    except ModuleNotFoundError:
        return ""  # the modules here that drive say which extra is missing; parameters and gait need none
    except Exception as error:  # what is missing shows as an error of a kind of its own for each library
        wanted = os.environ.get(WAY)
        if wanted is None:
            raise
        os.environ[WAY] = "off"
        return f"{WAY}={wanted} cannot be used here: {error}; unset it, or name another"
    return ""


UNUSABLE = _choose_rendering()
"""Why pictures cannot be rendered in the way that the environment asks for; empty where nothing is known against it."""
