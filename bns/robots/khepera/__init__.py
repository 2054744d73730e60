"""The Khepera III: two wheels, commands of left speed, right speed and duration, driven open loop (section 4.2)."""

from bns.robots.khepera.robot import UNITS_PER_M_S, Khepera
from bns.robots.khepera.rules import GOAL_RADIUS_M, LARGEST_HEADING_RAD, MISSED_GOAL_M, SMALLEST_SUM_M, START

__all__ = (
    "GOAL_RADIUS_M",
    "LARGEST_HEADING_RAD",
    "MISSED_GOAL_M",
    "ROBOT",
    "SMALLEST_SUM_M",
    "START",
    "UNITS_PER_M_S",
    "Khepera",
)

ROBOT = Khepera()
