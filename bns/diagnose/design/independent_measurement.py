"""What else could be measured: where no command tells two effects apart, something beside commands and poses does."""

from __future__ import annotations

from collections.abc import Iterable

INDEPENDENT_MEASUREMENT = {
    "command-delay": "film an LED on the robot that lights when a command arrives, with the tracker's camera",
    "clock-offset": "film an event that both clocks stamp (an LED switched by the computer that logs the commands)",
    "speed-gain": "let the robot drive straight and measure the way on the floor with a tape",
    "wheelbase": "measure the distance between the wheels' tracks, or count turns on the spot against a mark on the floor",
    "camera-scale": "lay a tape measure on the floor in the camera's view and compare its length with the tracked one",
    "camera-rotation": "track a straight edge laid along the direction that the headings call north",
    "marker-offset": "measure with a ruler where the marker sits, from the middle of the axle",
    "wheel-mismatch": "measure both wheels' circumferences",
    "motor-lag": "log the wheels' own speeds (encoders) at a high rate while a command changes",
    "acceleration-limit": "log the wheels' own speeds (encoders) at a high rate while a command changes",
    "battery-sag": "log the battery's voltage (column battery_v)",
    "floor-slope": "lay a spirit level on the floor",
    "tether-pull": "repeat some trials with the cable unplugged or held up",
    "yaw-bias": "lift the robot and log both wheels' own speeds (encoders)",
}
"""Effect -> a measurement that sees it alone."""


def independent_measurements(first: Iterable[str], second: Iterable[str]) -> list[str]:
    """Measurements that would tell two explanations apart, from the effects that only one of them names."""
    only = sorted(set(first) ^ set(second))
    return [f"{INDEPENDENT_MEASUREMENT[name]} ({name})" for name in only if name in INDEPENDENT_MEASUREMENT]
