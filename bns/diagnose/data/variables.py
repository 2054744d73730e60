"""What the variables along which errors show are called where a person reads them; formulas use their bare names."""

from __future__ import annotations

LABELS = {
    "left_m_s": "commanded speed, left wheel (m/s)",
    "right_m_s": "commanded speed, right wheel (m/s)",
    "speed_m_s": "commanded speed (m/s)",
    "wheel_difference_m_s": "commanded difference, right − left (m/s)",
    "previous_speed_m_s": "previous speed (m/s)",
    "previous_wheel_difference_m_s": "previous difference, right − left (m/s)",
    "time_in_command_s": "time in the command (s)",
    "time_in_trial_s": "time in the trial (s)",
    "session_s": "time in the session (s)",
    "way_m": "distance driven in the trial (m)",
    "left_change_m_s": "recent change of the left wheel's command (m/s)",
    "right_change_m_s": "recent change of the right wheel's command (m/s)",
    "left_reversed": "left wheel recently reversed (-1 to 1)",
    "right_reversed": "right wheel recently reversed (-1 to 1)",
    "just_started": "trial just started (1, decaying to 0)",
    "x_m": "position x (m)",
    "y_m": "position y (m)",
    "heading_rad": "heading (rad)",
    "turned_rad": "turn since the trial began (rad)",
    "place": "place",
    "a_lat_rad": "lateral amplitude (rad)",
    "a_vert_rad": "vertical amplitude (rad)",
    "omega_rad": "ω (rad)",
    "alpha_rad": "α (rad)",
    "previous_a_lat_rad": "previous lateral amplitude (rad)",
    "previous_a_vert_rad": "previous vertical amplitude (rad)",
    "previous_omega_rad": "previous ω (rad)",
    "previous_alpha_rad": "previous α (rad)",
    "cycle": "cycle of the trial",
    "change": "within a cycle (0) or from one to the next (1)",
}


def label(variable: str) -> str:
    """In words, with the unit; a logged column keeps its own name."""
    return LABELS.get(variable, variable)


VELOCITIES = {
    "forward_m_s": "forward velocity (m/s)",
    "sideways_m_s": "sideways velocity (m/s)",
    "yaw_rad_s": "turn rate (rad/s)",
    "share_of_motion": "the whole motion (fraction)",
    "east_m_s": "velocity east (m/s)",
    "north_m_s": "velocity north (m/s)",
}
"""What an error along a variable is an error of."""


def velocity(channel: str) -> str:
    """What a curve is added to, in words, with the unit."""
    return VELOCITIES.get(channel, channel)


def bare(words: str) -> str:
    """Without the unit, for the middle of a sentence."""
    return words.partition(" (")[0]
