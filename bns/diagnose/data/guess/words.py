"""What names of columns, topics and files say of what is in them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from bns.diagnose.data.mapping import FORWARD, TURN, UNITS

WORDS: dict[str, tuple[str, ...]] = {
    "trial": ("trial", "run", "episode", "experiment", "mission", "lap"),
    "t_s": ("t", "t s", "time", "stamp", "timestamp", "ms", "us", "ns"),
    "left_m_s": ("left", "vleft", "vl", "wl", "phi l", "l"),
    "right_m_s": ("right", "vright", "vr", "wr", "phi r", "r"),
    FORWARD: ("v", "linear x", "twist x", "vx", "forward velocity", "linear velocity", "forward", "speed", "velocity"),
    TURN: ("omega", "angular z", "w", "wz", "yaw rate", "yawrate", "angular velocity", "turn rate"),
    "x_m": ("position x", "pos x", "px", "tx", "x", "easting", "east"),
    "y_m": ("position y", "pos y", "py", "ty", "y", "northing", "north"),
    "heading_rad": (
        *("yaw", "heading", "theta", "psi", "compass", "orientation", "rotation z", "rz"),
        *("course", "cog", "bearing", "azimuth"),
    ),
}
"""Column of the table -> words that its sources have in their names, the surer first."""
QUATERNIONS = (
    *(tuple(f"{letter}{axis}" for axis in "xyzw") for letter in "qr"),
    *(tuple(f"{word} {axis}" for axis in "xyzw") for word in ("orientation", "rotation")),
)
_TRUTH: tuple[str, ...] = (
    *("ground truth", "groundtruth", "truth", "gt", "mocap", "vrpn", "optitrack", "vicon", "qualisys", "tracker"),
    *("aruco", "apriltag", "lidar", "icp", "slam", "amcl", "map", "world"),
)
_TOLD: tuple[str, ...] = (
    *("cmd", "command", "commands", "commanded", "set", "setpoint", "target", "desired", "ref", "reference"),
    *("control", "input"),
)
_MEASURED = ("odom", "odometry", "encoders?", "joint states", "measured", "meas", "actual", "feedback")
_RATES = ("vel", "velocity", "speed", "rate", "acc", "accel", "acceleration", "linear", "angular", "twist")

_SHORT = {"mps": "m s", "mmps": "mm s", "cmps": "cm s", "mms": "mm s", "cms": "cm s", "kmh": "km h"}
_SHORT |= {"radps": "rad s", "degps": "deg s", "dps": "deg s"}
_SHORT |= {"millis": "ms", "msec": "ms", "micros": "us", "usec": "us", "nanos": "ns", "nsec": "ns"}
"""Units of speeds and times as they are written in one word."""


def words_of(name: str) -> str:
    """A column's name in small words: `cmdVel_left (mm/s)` -> `cmd vel left mm s`, `vLeft_mmps` -> `v left mm s`."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    return " ".join(_SHORT.get(word, word) for word in re.findall(r"[a-z0-9]+", spaced.lower()))


def rank(said: str, truth: bool) -> int:
    """1 where words speak for poses of a tracker (``truth``) or for commands, -1 where they speak of wheel odometry, else 0."""
    for words, merit in ((_TRUTH if truth else _TOLD, 1), (_MEASURED, -1)):
        if any(re.search(rf"\b{word}\b", said) for word in words):
            return merit
    return 0


def may_be_pose(said: str) -> bool:
    """Whether words can be of a measured pose: not of a command, nor of a speed."""
    return rank(said, truth=False) <= 0 and not any(re.search(rf"\b{word}\b", said) for word in _RATES)


def ranked_source(words: Sequence[str], names: Mapping[str, str], truth: bool) -> str | None:
    """As `source`, but of those that speak for poses of a tracker or for commands first, of wheel odometry last (`rank`)."""
    levels = ({name: said for name, said in names.items() if rank(said, truth) == level} for level in (1, 0, -1))
    return next(filter(None, (source(words, level) for level in levels)), None)


def source(words: Sequence[str], names: Mapping[str, str]) -> str | None:
    """The first of ``names`` (name -> its words) that has one of ``words``, the surest first."""
    return next((name for word in words for name, said in names.items() if re.search(rf"\b{word}\b", said)), None)


def unit_of(said: str) -> str | None:
    """The unit that a name ends with; of several that fit, the longest."""
    fitting = [u for u in UNITS if re.search(rf"\b{' '.join(re.findall('[a-z]+', u))}$", said)]
    return max(fitting, key=len, default=None)
