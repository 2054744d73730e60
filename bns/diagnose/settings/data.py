"""Settings of what is odd about measurements, and of how they become tracks."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bns.diagnose.settings.gaps import Gaps
from bns.diagnose.settings.setting import BY_HAND, setting
from bns.diagnose.settings.stamps import Stamps


@dataclass(frozen=True)
class Data(Gaps, Stamps):
    """``data/``: checks of tables, division of a log into trials, tracks, tracker faults, tracking noise."""

    held_share: float = setting(
        0.2,
        "1",
        "If a larger fraction of the poses is repeated while the robot drives, the tracker is taken to be slower "
        f"than the log; {BY_HAND}.",
    )
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
    longest_trial_s: float = setting(
        1e6,
        "s",
        "A trial of more than eleven days means a wrong unit of time; its time grid would also fill the memory.",
    )
    largest_number: float = setting(1e30, "1", "Larger numbers are not measurements: their squares overflow.")
    most_columns: int = setting(2_000, "columns", f"A table with more columns is not the log of a robot; {BY_HAND}.")
    longest_line: int = setting(1 << 20, "characters", f"A longer first line is not the heading of a table; {BY_HAND}.")
    head_lines: int = setting(200, "lines", f"A longer block of comments above a table is not a heading; {BY_HAND}.")
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
    guess_degrees: float = setting(
        90.0,
        "number",
        "Larger headings are taken to be degrees: radians that are not wrapped can be of any size, but are rarely "
        f"this large; {BY_HAND}.",
    )
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
    still_m_s: float = setting(
        1e-3,
        "m/s",
        f"Wheels with a smaller commanded speed count as standing, because encoder readings fluctuate; {BY_HAND}.",
    )
    kept_standing_s: float = setting(
        1.0,
        "s",
        "How long a trial keeps standing before and after its drive, so that late starts and slow stops are "
        f"visible; {BY_HAND}.",
    )
    fault_ways: float = setting(
        3.0,
        "1",
        "A change of less than this many times the distance that the faster wheel drove is never a tracker fault: "
        "slip and gear errors stay below that.",
    )
    fault_usual: float = setting(
        12.0,
        "1",
        "A change of less than this many times the median of the trial is never a tracker fault, because fast "
        f"robots and coarse trackers differ; the number is {BY_HAND}.",
    )
    fault_most_cut: float = setting(
        0.2,
        "1",
        "At most this fraction of the poses is discarded because it follows a jump; the loss of precision is then "
        "under 12 %.",
    )
    fault_fewest_frames: int = setting(
        20, "frames", f"For a trial with fewer frames, the usual change is that of all trials; {BY_HAND}."
    )
    fault_around_s: float = setting(
        1.0,
        "s",
        "The fastest wheel command within this time before and after counts, because a robot may lag and clocks may "
        f"differ (`trial_clock_reach_s` is 0.6 s); {BY_HAND}.",
    )
    settled_s: float = setting(
        0.5,
        "s",
        "A robot that is told to stand is not taken to rest before this time: ten times the lag of a small robot's motors. One "
        "that coasts for longer shows it (`rest_goes_on`).",
    )
    rest_goes_on: float = setting(
        3.0,
        "1",
        "The first part of a rest is left out if the robot is further along its way after it by more than this many times what "
        "noise does, which goes back as often. Of 1000 normal numbers 1.3 are larger. Simulated at 25 Hz: where nothing coasts "
        "this lowers the noise by less than 1 %, by up to 4 % where it is slow wander alone (0.95 from pose to pose, six rests); "
        "robots that coast raise it by up to 10 %, that of the heading by 44 % with a lag of 0.4 s, quick spins and rests of 1 "
        "to 2 s (by 10 to 1400 % where all poses of a rest count).",
    )
    rest_parts: int = setting(
        3,
        "parts",
        "The first of so many equal parts of a rest is compared with the others, and left out at once: three comparisons "
        f"shorten a rest of two seconds to 0.6 s; {BY_HAND}.",
    )
    rest_fewest_left: int = setting(
        9,
        "poses",
        "A rest whose begin was left out counts only if so many poses remain: in fewer, a robot that still coasts cannot be told "
        "from noise. With 5, a lag of 0.4 s before rests of 0.8 to 1.3 s raised the noise by 32 % (simulated).",
    )
    rest_least: float = setting(
        1e-6, "m, rad", "Smaller motion is rounding of the log: the noise of any tracker is a hundred times as large."
    )
    fewest_at_rest: int = setting(
        30,
        "poses",
        "The noise is estimated from poses at rest only if there are at least this many; its standard deviation is "
        "then known to within 13 %.",
    )
    rest_agrees: float = setting(
        3.0,
        "standard errors",
        "Where the scatter at rest and that at high frequency while the robot drives differ by less, the latter is taken, which "
        "comes of more poses: 30 poses at rest know the noise to 13 % only. Of 1000 logs with the same noise in both, 3 differ "
        "by more.",
    )
    noise_trimmed: float = setting(
        3.0,
        "standard deviations",
        "Poses farther off do not count in the tracker's noise: of normal ones 0.27 %. With 3 % of the poses thirty times as far "
        "off, the noise comes out 0.6 % too large (by the median of the sizes: 3.4 %), and 2.3 times fewer poses do as well.",
    )
    noise_rounds: int = setting(
        3, "rounds", f"The limit beyond which poses do not count is taken from the noise found last, so often; {BY_HAND}."
    )
    trimmed_sd_se: float = setting(
        0.76,
        "1",
        "Relative standard error of a standard deviation without the numbers farther off, times the root of their number: of "
        "4000 draws of 60, 200 and 1000 normal numbers.",
    )
    drift_at_rest: float = setting(
        0.5,
        "1",
        "If poses at rest scatter about a line by less than this fraction of their scatter about their mean, the robot creeps, "
        "and the line is its own motion: white noise of a tracker keeps all of it, a random walk 0.63.",
    )
    parabola_frames: int = setting(
        7,
        "frames",
        "Number of frames to which a parabola is fitted. At 10 Hz this is 0.6 s, in which the path bends little "
        "under one command.",
    )
    parabola_order: int = setting(
        2, "1", "Motion at constant speed and turn rate is a parabola to second order in time."
    )
    parabola_slowest_hz: float = setting(
        8.0,
        "Hz",
        f"Below this frame rate a parabola over seven frames does not follow the motion of a robot; {BY_HAND}.",
    )
    most_frames: int = setting(
        16_000,
        "frames",
        "If there are more frames, an evenly spaced subset is used in the search, whose duration is proportional to "
        f"their number; neighbouring frames carry nearly the same information; the number is {BY_HAND}.",
    )
    run_up_s: float = setting(
        5.0,
        "s",
        "Where a table gives only one speed before the trial, the robot is assumed to have driven at that speed for "
        "this long: any lag has then settled.",
    )
    run_up_taken_s: float = setting(
        20.0,
        "s",
        "Seconds of commands before a piece of a long log that are included. Of 59 pieces with commands of 0.4 to 2 "
        "s at up to 0.2 m/s and an acceleration limit of 0.08 m/s^2, 8 begin with a wrong speed after 5 s, 1 after "
        "10 s, none after 20 s.",
    )
    run_up_step_s: float = setting(
        0.2,
        "s",
        "Longest step of the time grid before a trial: nothing is observed there, and effects are exact for "
        "constant commands.",
    )
