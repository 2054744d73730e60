"""Settings of logs of bodies on joints: set points, markers, stretches; a part of those of the data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Bodies:
    """``data/bodies/``."""

    cycle_largest_rad: float = setting(
        2 * math.pi + 1e-6,
        "rad",
        "The parameters of a cycle are angles: beyond a full turn they are taken to be degrees (with room for "
        "rounding).",
    )
    set_point_beyond: float = setting(
        0.25,
        "1",
        "A set point that lies outside of a servo's range by more than this share of the range counts as being in "
        f"other units (1.6 rad are 90 degrees: 57 times as much); {BY_HAND}.",
    )
    set_point_turns_rad: float = setting(
        4 * math.pi,
        "rad",
        "The same for a servo without a range: beyond two turns to either side. Servos that go on turning are "
        f"velocity servos, which a diagnosis does not take; {BY_HAND}.",
    )
    set_points_in_other_units: float = setting(
        0.5,
        "1",
        "If more than this share of a servo's set points are in other units, the log is refused: single ones are "
        f"errors of the log; {BY_HAND}.",
    )
    sites_reach: float = setting(
        10.0,
        "1",
        "Sites of a body that is fixed at its base move over at most this many times its extent; otherwise their "
        "positions are not in metres (a site cannot leave the body; centimetres are 100 times as much).",
    )
    sites_still: float = setting(
        0.1,
        "1",
        "Sites that move over more than this share of the extent of a body that is fixed, while no set point ever "
        f"changes, mean that set points were not logged; a body that sags into its rest moves less; {BY_HAND}.",
    )
    cycle_longest_m: float = setting(
        5.0,
        "m",
        "If markers are further apart, their positions are taken to be in centimetres or millimetres (the markers "
        f"are 0.65 m apart); {BY_HAND}.",
    )
    stretch_s: float = setting(
        2.0,
        "s",
        "Tracks of a robot with position-controlled joints are cut into stretches of this length. Each is simulated "
        "from where the robot was seen: long enough for the robot to move, short enough to be predicted.",
    )
    sites_clear: float = setting(
        0.25,
        "1",
        "Poses of a body are left out where its first and its last site are nearer to one another than this fraction of their "
        f"median distance: there its heading has four times the usual noise; {BY_HAND}.",
    )
    sites_clear_at_begin: float = setting(
        0.5,
        "1",
        "No stretch of a body begins where its sites are nearer than this fraction of that distance: its heading turns all that "
        "is measured in the stretch. An arm whose sites came within 9 mm of one another in plan view was 39 mm off in one "
        "stretch, and 3 mm elsewhere.",
    )
    run_up_postures: int = setting(
        6,
        "postures",
        "Number of final postures of the previous cycle that are simulated first, to bring the joints into "
        "position: a silent joint stays where the previous cycle left it. With the true model of a silent joint, "
        "the error of the distance between the markers is then 12 mm (eight postures), 31 mm (four) and 49 mm "
        "(one), at the 80th percentile of 53 cycles.",
    )
    stretch_variables: int = setting(
        4,
        "joints",
        "Residuals are examined along the set points of at most this many joints, because each further test costs "
        "significance.",
    )
    cycle_stretched_m: float = setting(
        0.10,
        "m",
        "A cycle ends in the posture in which it began. If the distance of the markers changes by more, a marker "
        f"was mistaken or the robot rolled over; {BY_HAND}.",
    )
