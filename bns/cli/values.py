"""What users type, as values: sizes, poses, ranges."""

from __future__ import annotations

import math
import re
import sys

from bns.errors import DataError


def arena_of(text: str | None) -> tuple[float, ...] | None:
    """Width and height of ``WxH``, or the four sides of ``X0,X1,Y0,Y1``, in m; None stays None. DataError for what is neither."""
    if text is None:
        return None
    sides = _numbers(text, 4)
    if sides is not None:
        return tuple(sides)
    found = re.fullmatch(r"\s*([0-9.]+)\s*[xX×]\s*([0-9.]+)\s*", text)
    try:
        width, height = (float(v) for v in found.groups()) if found else (math.nan, math.nan)
    except ValueError:
        width = height = math.nan
    if not math.isfinite(width + height):
        raise DataError(
            f"--arena {text!r} is no size; write width x height in metres, each above 0.1: --arena 1.8x1.3, or the lowest and "
            "highest x and y: --arena=-0.5,1.3,0,1.3"
        )
    return width, height


def pose_of(text: str | None) -> tuple[float, float, float] | None:
    """x_m, y_m, heading_rad of ``X,Y,DEGREES``; None stays None. DataError for what is no pose."""
    if not text:
        return None
    numbers = _numbers(text, 3)
    if numbers is None:
        raise DataError(
            f"--start {text!r} is no pose; write X,Y,DEGREES (metres; 0 faces east, 90 north): --start 0,0,90"
        )
    x, y, degrees = numbers
    if 0 < abs(degrees) < 2 * math.pi and not degrees.is_integer():
        print(f"bns: --start: the heading is taken as {degrees:g} degrees, not radians", file=sys.stderr)
    return x, y, math.radians(degrees)


def speeds_of(text: str | None) -> tuple[float, float] | None:
    """Lowest and highest of ``LOW,HIGH``, m/s; None stays None. DataError for what is no range."""
    if text is None:
        return None
    numbers = _numbers(text, 2)
    if numbers is None or not numbers[0] < numbers[1]:
        raise DataError(f"--speeds {text!r} is no range; write LOW,HIGH in m/s, such as --speeds=-0.2,0.2.")
    return numbers[0], numbers[1]


def _numbers(text: str, count: int) -> list[float] | None:
    """So many finite numbers between commas, or None."""
    try:
        numbers = [float(v) for v in text.split(",")]
    except ValueError:
        return None
    return numbers if len(numbers) == count and all(map(math.isfinite, numbers)) else None
