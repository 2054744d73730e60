"""Settings of what is odd about measurements, and of how they become tracks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Data:
    """``data/``: checks of tables, trials out of one log, tracks, tracker faults, the noise of the tracking."""

    held_share: float = setting(
        0.2, "1", f"More repeated poses while the robot drives mean a tracker slower than the log; {BY_HAND}."
    )
    jump_m: float = setting(0.02, "m", f"No smaller change of position is called a jump; {BY_HAND}.")
    jump_rad: float = setting(0.35, "rad", f"No smaller change of heading (20 degrees) is called a jump; {BY_HAND}.")
    jump_rounds: int = setting(6, "rounds", f"Jumps come in pairs too, so they are sought again; {BY_HAND}.")
    jump_near_s: float = setting(
        0.4, "s", f"Neighbours further apart than this do not say where a pose between them belongs; {BY_HAND}."
    )
    longest_trial_s: float = setting(
        1e6, "s", "A trial of more than eleven days is a wrong unit of time, and its grid would fill the memory."
    )
    largest_number: float = setting(1e30, "1", "Larger numbers are no measurements: their squares overflow.")
    most_columns: int = setting(2_000, "columns", f"A table of more columns is no log of a robot; {BY_HAND}.")
    longest_line: int = setting(1 << 20, "characters", f"A longer first line is no table's heading; {BY_HAND}.")
    head_lines: int = setting(200, "lines", f"Comments above a table of more lines are no heading; {BY_HAND}.")
    bag_largest_bytes: int = setting(
        4096,
        "bytes",
        "Longer messages of a recording are pictures, clouds and maps: odometry with its covariances has about 700 bytes.",
    )
    bag_longest_list: int = setting(8, "numbers", f"Longer lists without names are covariances, ranges or pictures; {BY_HAND}.")
    bag_clocks_apart_s: float = setting(
        1.0,
        "s",
        f"Stamps further from when their messages were received go by another clock: the latter counts; {BY_HAND}.",
    )
    long_step_s: float = setting(
        30.0, "s", f"Rows further apart are no seconds: refused before anything is done second by second; {BY_HAND}."
    )
    finer_units: tuple[tuple[float, str], ...] = setting(
        ((1e6, "nanoseconds"), (3e3, "microseconds"), (0.0, "milliseconds")),
        "s, unit",
        "A step between rows above so many seconds was written in such a unit: rows lie 0.01 to 1 s apart, and units "
        "differ by thousands.",
    )
    untold_ratio: float = setting(
        1.5, "1", f"A robot that goes so many times as far as commanded has commands in rows of their own; {BY_HAND}."
    )
    degrees_rad_m: float = setting(
        150.0, "rad/m", "More radians for a metre of wheel difference: a wheelbase of under a centimetre, or degrees."
    )
    guess_units: tuple[tuple[float, str], ...] = setting(
        ((1e6, "ns"), (3e3, "us"), (3.0, "ms")),
        "number, unit",
        "A typical step of time in a file above so much was written in such a unit: rows lie 0.01 to 1 s apart, and "
        "units differ by thousands.",
    )
    guess_degrees: float = setting(
        90.0, "number", f"Radians that are not wrapped may be of any size, but rarely of this: degrees; {BY_HAND}."
    )
    cycle_largest_rad: float = setting(
        2 * math.pi + 1e-6,
        "rad",
        "A cycle's parameters are angles: beyond a whole turn they are degrees (rounding apart).",
    )
    cycle_longest_m: float = setting(
        5.0,
        "m",
        f"Markers further apart than this are in centimetres or millimetres (they are 0.65 m apart); {BY_HAND}.",
    )
    stretch_s: float = setting(
        2.0,
        "s",
        "Tracks of a robot whose joints are told positions are cut into stretches of this length, each simulated from where the "
        "robot was seen: long enough to move, short enough to be foreseen.",
    )
    run_up_postures: int = setting(
        6,
        "postures",
        "So many of the last postures of the cycle before bring the joints to where they are when a cycle begins: a silent joint "
        "stays where the cycle before left it. With the true model of a silent joint the distance of the markers is then off by "
        "12 mm (eight postures), 31 mm (four) and 49 mm (one), at the upper fifth of 53 cycles.",
    )
    stretch_variables: int = setting(
        4, "joints", "Residuals are looked at along the set points of so many joints at most: each costs chance."
    )
    cycle_stretched_m: float = setting(
        0.10,
        "m",
        "A cycle ends in the posture in which it began: markers that drift apart by more have been mistaken, or the robot "
        f"rolled; {BY_HAND}.",
    )
    still_m_s: float = setting(1e-3, "m/s", f"Wheels told to be slower than this stand: encoders tremble; {BY_HAND}.")
    kept_standing_s: float = setting(
        1.0,
        "s",
        f"How much standing a trial keeps before and after its drive: late starts and slow stops are seen there; {BY_HAND}.",
    )
    fault_ways: float = setting(
        3.0,
        "1",
        "No change of less than three times the way of the faster wheel is a fault: no slip or gear error is as large.",
    )
    fault_usual: float = setting(
        12.0,
        "1",
        "Nor is one of less than twelve times what is usual in the trial (median): fast robots and coarse trackers differ; "
        f"the number is {BY_HAND}.",
    )
    fault_most_cut: float = setting(
        0.2,
        "1",
        "No more of the poses than this is given up for what comes after a jump: the cost in precision is then under 12 %.",
    )
    fault_fewest_frames: int = setting(
        20, "frames", f"A trial with fewer frames takes what is usual from all trials; {BY_HAND}."
    )
    fault_around_s: float = setting(
        1.0,
        "s",
        "The wheels' fastest command within a second either way counts: a robot may lag, and clocks may differ "
        f"(`trial_clock_reach_s` is 0.6 s); {BY_HAND}.",
    )
    settled_s: float = setting(
        0.5, "s", "A robot told to stop is taken to stand after this long: ten times the lag of a small robot's motors."
    )
    fewest_at_rest: int = setting(
        30, "poses", "Fewer poses at rest than these say too little: the standard deviation is then known within 13 %."
    )
    parabola_frames: int = setting(
        7,
        "frames",
        "Frames under one parabola. At 10 Hz that is 0.6 s, in which a robot's path bends little under one command.",
    )
    parabola_order: int = setting(
        2, "1", "A constant turn at constant speed is a parabola to second order of the time."
    )
    parabola_slowest_hz: float = setting(
        8.0, "Hz", f"Below this frame rate a parabola through seven frames does not follow a robot; {BY_HAND}."
    )
    most_frames: int = setting(
        16_000,
        "frames",
        "More frames are thinned out before a search: it takes time in proportion, and neighbours say the same; "
        f"the number is {BY_HAND}.",
    )
    run_up_s: float = setting(
        5.0,
        "s",
        "How long a robot that was in motion when its trial began is taken to have driven like that, where a table tells one "
        "speed before alone: any lag has settled.",
    )
    run_up_taken_s: float = setting(
        20.0,
        "s",
        "Seconds of a long log that a piece takes along from before it. Of 59 pieces driven by commands of 0.4 to 2 s at up to "
        "0.2 m/s under an acceleration limit of 0.08 m/s^2, 8 begin with a wrong speed after 5 s, 1 after 10 s, none after 20 s.",
    )
    run_up_step_s: float = setting(
        0.2,
        "s",
        "Longest step of the grid before a trial itself begins: nothing is seen there, and effects are exact for constant "
        "commands.",
    )
