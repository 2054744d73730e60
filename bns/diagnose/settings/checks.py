"""Settings of what is odd about a log: jumps, sizes of tables, other units, axes and clocks; a part of those of the data."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bns.diagnose.settings.setting import BY_HAND, setting


@dataclass(frozen=True)
class Checks:
    """``data/checks.py``, ``data/sources/``, and what is asked about units, axes and rests."""

    held_share: float = setting(
        0.2,
        "1",
        "If a larger fraction of the poses is repeated while the robot drives, the tracker is taken to be slower "
        f"than the log; {BY_HAND}.",
    )
    lost_commands: tuple[float, float, float] = setting(
        (0.06, 0.05, 0.001),
        "s, 1, 1",
        "Commands of 0 that last no longer than the first number, between two that differ by no more than this fraction, are "
        "told as lost or spurious if they take so much of the way (the third number): the logs of the iRobot Create robots of "
        f"UTIAS MRCLAM have single ones of 10 ms; {BY_HAND}.",
    )
    lost_commands_fewest: int = setting(3, "times", f"Fewer are not told; {BY_HAND}.")
    jump_m: float = setting(0.02, "m", f"A smaller change of position is never called a jump; {BY_HAND}.")
    jump_rad: float = setting(
        0.35, "rad", f"A smaller change of heading (20 degrees) is never called a jump; {BY_HAND}."
    )
    jump_rounds: int = setting(
        6, "rounds", f"Jumps can also come in pairs, so the search is repeated up to this many times; {BY_HAND}."
    )
    jump_near_s: float = setting(
        0.4, "s", f"A pose is judged by its neighbours only if they are no further away in time than this; {BY_HAND}."
    )
    short_step_s: float = setting(
        5e-4,
        "s",
        "Rows that are nearer to one another have times in another unit, where the robot goes much farther in them than "
        "commanded: cameras and drives log at up to 1 kHz.",
    )
    longest_trial_s: float = setting(
        1e6,
        "s",
        "A trial of more than eleven days means a wrong unit of time; its time grid would also fill the memory.",
    )
    reckoned_share: float = setting(
        1e-3,
        "1",
        "Where half of all steps from pose to pose have one ratio to what was commanded, to this share, poses look computed from "
        "the commands. In nine logs of real robots, half of the steps are 10 to 90 % off; in 63 simulated ones with noise of a "
        "tracker at least 1.6 %; in one computed from its commands 0.001 %.",
    )
    reckoned_fewest: int = setting(20, "steps", "So many steps are needed to say that.")
    largest_number: float = setting(1e30, "1", "Larger numbers are not measurements: their squares overflow.")
    most_columns: int = setting(2_000, "columns", f"A table with more columns is not the log of a robot; {BY_HAND}.")
    longest_line: int = setting(1 << 20, "characters", f"A longer first line is not the heading of a table; {BY_HAND}.")
    head_lines: int = setting(200, "lines", f"A longer block of lines above a table is not a heading; {BY_HAND}.")
    bag_largest_bytes: int = setting(
        4096,
        "bytes",
        "Larger messages of a recording are pictures, point clouds or maps; odometry with its covariances has about "
        "700 bytes.",
    )
    bag_longest_list: int = setting(
        8, "numbers", f"Longer lists without names are covariances, ranges or pictures; {BY_HAND}."
    )
    bag_clocks_apart_s: float = setting(
        1.0,
        "s",
        "If time stamps differ from the times of receipt by more, they come from another clock, and the times of "
        f"receipt are used; {BY_HAND}.",
    )
    long_step_s: float = setting(
        30.0,
        "s",
        "If rows are further apart, their times are not in seconds; the log is refused before it is processed "
        f"second by second; {BY_HAND}.",
    )
    finer_units: tuple[tuple[float, str], ...] = setting(
        ((1e6, "nanoseconds"), (3e3, "microseconds"), (0.0, "milliseconds")),
        "s, unit",
        "A step between rows above each of these numbers of seconds means that times are in the unit next to it: "
        "rows are 0.01 to 1 s apart, and the units differ by factors of a thousand.",
    )
    fastest_m_s: float = setting(
        20.0,
        "m/s",
        f"Wheel speeds above it are a mistaken unit: mm/s, or a device's own; {BY_HAND}.",
    )
    untold_ratio: float = setting(
        1.5,
        "1",
        "If a robot goes more than this many times as far as commanded, its commands are probably in separate rows; "
        f"{BY_HAND}.",
    )
    slowest_ratio: float = setting(
        0.2,
        "1",
        "A robot that goes less than this many times as far as commanded, in proportion to its commands, has commands in "
        "another unit: cm/s, or rad/s of wheels with a radius below 0.2 m. No robot that works loses so much; one that is "
        "stuck does not move in proportion.",
    )
    in_proportion: float = setting(
        0.8,
        "correlation",
        "Correlation of commanded and tracked distances per second above which they are in proportion; the noise of a "
        f"robot that is stuck does not correlate; {BY_HAND}.",
    )
    same_time_s: float = setting(1e-6, "s", "Times that differ by less are the same: the rest is rounding.")
    at_poses_share: float = setting(
        0.9,
        "1",
        "If at least this fraction of the commands begin exactly when a pose was taken, commands were logged with the "
        f"poses only; a few poses are always lost; {BY_HAND}.",
    )
    hundredths_ratio: tuple[float, float] = setting(
        (0.007, 0.014),
        "1",
        "A robot that goes between these many times as far as commanded has commands in cm/s: a hundredth, less what robots "
        f"lose by slip and lag, or more by larger wheels; {BY_HAND}.",
    )
    lengths_beyond: tuple[float, float] = setting(
        (1.25, 3.0),
        "factor",
        "A robot that goes at least as many times as far as commanded as inches in a metre, less the first factor, and at most "
        f"as many as millimetres, times the second one, has positions in such a unit; {BY_HAND}.",
    )
    unit_within: float = setting(
        1.3,
        "factor",
        "A unit is named where the robot goes as far as it would mean within this factor, which is what lag, slip and larger "
        f"wheels leave open; {BY_HAND}.",
    )
    minutes_ratio: tuple[float, float] = setting(
        (49.0, 77.0),
        "1",
        "A robot that drives this many times as fast as commanded, and turns as much faster, has times in minutes. The bounds "
        "are halfway, by ratio, to positions in inches (39) and centimetres (100).",
    )
    at_rest: tuple[float, float] = setting(
        (0.05, 0.35),
        "m, rad",
        "Poses of a trial whose middle nine tenths spread by more, in position or heading, are of a robot that moves. The noise "
        f"of a tracker and the drift of a robot at rest stay below; {BY_HAND}.",
    )
    drifts: tuple[float, float, float] = setting(
        (0.003, 0.02, 6.0),
        "m, rad, standard errors",
        "A robot that goes or turns further before its first command, and by so many standard errors further than the noise, "
        f"moves for a reason that nobody knows, and these poses are left out; {BY_HAND}.",
    )
    drifts_last: int = setting(5, "poses", f"How many of the last of these poses tell where it went; {BY_HAND}.")
    far_m: float = setting(
        1000.0,
        "m",
        "Positions that lie further from the origin, and further than the robot drives, are refused: places of effects are "
        "plausible up to here (`floor-patch`), or bounded (`lens-distortion`). A tracker's own origin is in its room.",
    )
    same_heading_rad: float = setting(
        1e-6,
        "rad",
        "Headings that differ by less are the same: the rest is rounding. The noise of any tracker is a hundred times as large.",
    )
    turned_for_certain_m: float = setting(
        0.1,
        "m",
        "If one wheel is commanded to drive this much further than the other, the robot turns: by 0.01 rad on the largest "
        "wheelbase that a model may have (10 m), by 1 rad on one of 0.1 m.",
    )
    upright_rad: float = setting(
        math.pi / 4,
        "rad",
        "The z axis of a robot on a floor points up, less slopes and the tilt of its markers: both stay well below 45 degrees. "
        "A quaternion in another order tilts it by 90 degrees on average.",
    )
    degrees_rad_m: float = setting(
        150.0,
        "rad/m",
        "More radians per metre of wheel difference mean a wheelbase of less than a centimetre, or degrees.",
    )
    degrees_beyond: float = setting(
        60.0, "rad", f"If no heading of a log is larger, they are radians: in degrees, a robot leaves this quickly; {BY_HAND}."
    )
    degrees_directions: tuple[float, float] = setting(
        (0.8, 0.6),
        "1",
        "Headings are degrees where directions of travel agree with them, read so, by at least the first number, and read as "
        f"radians by at most the second one (as `guess_headings`); {BY_HAND}.",
    )
    degrees_left: float = setting(
        0.5,
        "1",
        "They are, if read so they also leave at most this part of what directions differ by on their own (or by "
        "`degrees_rates_rad_m`): a robot that drives in one direction agrees with any heading that hardly changes; "
        f"{BY_HAND}.",
    )
    degrees_rates_rad_m: tuple[float, float] = setting(
        (15.0, 30.0),
        "rad/m",
        "More radians per metre of wheel difference than the first number tell degrees where directions disagree with radians; "
        "more than the second one, with headings beyond `degrees_beyond`, where no direction is known. Robots with a wheelbase "
        "from 0.05 m turn by at most 20, and in degrees one of 1.5 m by 38.",
    )
    speed_unit_band: float = setting(
        1.05,
        "factor",
        "Speeds look like another unit where the median way is within this factor of what the unit would mean. Robots' own gains "
        f"(0.3 to 2) lie outside the band of every unit; {BY_HAND}.",
    )
    speed_unit_trials: tuple[float, float] = setting(
        (1.2, 0.75),
        "factor, 1",
        f"They do so only if in this fraction of the trials the median way is within this factor of it, too; {BY_HAND}.",
    )
    speed_one_way: float = setting(
        0.99,
        "1",
        "Windows in which less than this fraction of the commanded way is in one direction say nothing of the unit: the robot "
        "comes back.",
    )
    speed_turn_rad: float = setting(
        2.0, "rad", f"Nor do windows in which the robot turns by more: the noise of its chord grows with the arc; {BY_HAND}."
    )
