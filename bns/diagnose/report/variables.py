"""What the variables along which errors show are called where a person reads them; formulas use their bare names."""

from __future__ import annotations

LABELS = {
    "left_m_s": "left wheel commanded (m/s)",
    "right_m_s": "right wheel commanded (m/s)",
    "speed_m_s": "speed commanded (m/s)",
    "wheel_difference_m_s": "right − left commanded (m/s)",
    "previous_speed_m_s": "speed before the change (m/s)",
    "previous_wheel_difference_m_s": "right − left before the change (m/s)",
    "time_in_command_s": "time in the command (s)",
    "time_in_trial_s": "time in the trial (s)",
    "session_s": "time in the session (s)",
    "way_m": "way driven in the trial (m)",
    "left_change_m_s": "fresh change of the left wheel's command (m/s)",
    "right_change_m_s": "fresh change of the right wheel's command (m/s)",
    "left_reversed": "left wheel freshly reversed (-1 to 1)",
    "right_reversed": "right wheel freshly reversed (-1 to 1)",
    "just_started": "trial just started (fades from 1)",
    "x_m": "place, x (m)",
    "y_m": "place, y (m)",
    "heading_rad": "heading (rad)",
    "place": "place",
    "a_lat_rad": "lateral amplitude (rad)",
    "a_vert_rad": "vertical amplitude (rad)",
    "omega_rad": "ω (rad)",
    "alpha_rad": "α (rad)",
    "previous_a_lat_rad": "lateral amplitude before (rad)",
    "previous_a_vert_rad": "vertical amplitude before (rad)",
    "previous_omega_rad": "ω before (rad)",
    "previous_alpha_rad": "α before (rad)",
    "cycle": "cycle of the trial",
    "change": "within a cycle (0) or from one to the next (1)",
}


def label(variable: str) -> str:
    """In words, with the unit; a logged column keeps its own name."""
    return LABELS.get(variable, variable)
