"""Settings of the mapping that is proposed for a log; a part of those of the data."""

from __future__ import annotations

from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Guesses:
    """``data/guess/``."""

    guess_units: tuple[tuple[float, str], ...] = setting(
        ((1e6, "ns"), (3e3, "us"), (3.0, "ms")),
        "number, unit",
        "A typical time step in a file above each of these numbers means that times are in the unit next to it: rows "
        "are 0.01 to 1 s apart, and the units differ by factors of a thousand.",
    )
    guess_speed_within: tuple[float, float] = setting(
        (2.0, 1.2),
        "factor",
        "Commands whose names have no unit are in m/s, if the robot went as far within the first factor (robots that slip "
        "or lag lose less than half), and are proposed in cm/s or mm/s within the second one: a device's own units are of any "
        f"size; {BY_HAND}.",
    )
    guess_window_s: float = setting(
        1.0,
        "s",
        "How far the robot went is measured over about this time: long enough that the noise of a pose is small, short "
        f"enough that a path is nearly straight; {BY_HAND}.",
    )
    guess_headings: tuple[float, float] = setting(
        (0.8, 0.6),
        "1",
        "Headings are said to run clockwise, or from another axis, where directions of travel agree with that reading by at "
        "least the first number, and with the opposite sense of rotation by at most the second one: lengths of the mean of "
        f"unit vectors, 1 where all agree, near 0 on a path that turns by a round; {BY_HAND}.",
    )
    guess_free_shown: int = setting(12, "columns", "Most columns without an entry that a proposal lists.")
    guess_largest_m: float = setting(
        100.0,
        "m",
        "Positions that spread further are not taken for metres, and no unit of speeds is proposed from them; "
        f"{BY_HAND}.",
    )
    guess_cuts: tuple[float, float, float] = setting(
        (1.0, 2.0, 20.0),
        "s",
        "A log without trials is proposed to be cut where the robot is told to stand for so long (the first number), else at "
        f"gaps longer than the second one, else into pieces that last the third one; {BY_HAND}.",
    )
    guess_clear_gaps: tuple[float, float] = setting(
        (3.0, 0.25),
        "1",
        "Gaps in a log are clear, and it is proposed to be cut at them, if the shortest is so many times (the first number) "
        "as long as any other time between rows, and if there are at least so many of them (the second one) for each time that "
        f"the robot stands: a tracker that failed once cuts no log; {BY_HAND}.",
    )
    guess_flat: float = setting(
        0.2,
        "1",
        "A tracker's y axis is proposed to point up, where no quaternion tells, if its poses spread along it by less than "
        f"this part of their spread along z: a floor is flat to some mm; {BY_HAND}.",
    )
    guess_clock_s: float = setting(
        1.0,
        "s",
        "Clocks of two files are said to differ if the speeds driven follow those commanded by more than this: robots lag by "
        f"some tenths of a second; {BY_HAND}.",
    )
    guess_clock_step_s: float = setting(
        0.05, "s", f"Time step at which speeds driven and commanded are compared to join two clocks; {BY_HAND}."
    )
    guess_clock_half_s: float = setting(
        0.2, "s", f"Speeds driven are differences of positions from so long before to so long after; {BY_HAND}."
    )
    guess_clock_lasts_s: tuple[float, float] = setting(
        (10.0, 100_000.0),
        "s",
        "Clocks of files that last less, or longer, are not compared: a few commands fit anywhere, and numbers that reach over "
        f"more than a day are hardly times; {BY_HAND}.",
    )
    guess_clock_agree: tuple[float, float] = setting(
        (0.7, 2.0),
        "1",
        "The difference between two clocks is proposed where the correlation of speeds driven and commanded is at least the "
        "first number, and any other shift leaves at least so many times (the second one) its variance unexplained: commands "
        f"that repeat themselves fit at several; {BY_HAND}.",
    )
    guess_degrees: float = setting(
        90.0,
        "number",
        "Larger headings are taken to be degrees: radians that are not wrapped can be of any size, but are rarely "
        f"this large; {BY_HAND}.",
    )
    guess_still: float = setting(
        0.1,
        "of the furthest",
        "A tracked body that went less far than this, compared with the one that went furthest, is not proposed as the "
        f"robot; {BY_HAND}.",
    )
