"""Headings in degrees are refused however they are written, of robots of any size; radians never are."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.checks import checked
from bns.errors import DataError

COLUMNS = ["trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad"]
WRITTEN = {
    "unwrapped": lambda degrees: degrees,
    "-270 to 90": lambda degrees: (degrees + 270) % 360 - 270,
    "-180 to 180": lambda degrees: (degrees + 180) % 360 - 180,
    "0 to 360": lambda degrees: degrees % 360,
}
BASES_M = (0.05, 0.38, 1.5)


def driven(base_m, hz=10, noise=0.02, on_the_spot=False, trials=6, lasts_s=10):
    """Arcs, forwards and backwards, or turns on the spot, from any heading; the noise in wheelbases and in radians."""
    rng, rows = np.random.default_rng(1), []
    for trial in range(trials):
        x, y, heading, n = 0.0, 0.0, rng.uniform(-3, 3), 0
        while n < lasts_s * hz:
            speed = 0.0 if on_the_spot else rng.uniform(0.5, 2) * base_m * rng.choice([1, 1, -1])
            rate = rng.uniform(-1.5, 1.5)
            for _ in range(int(rng.uniform(1, 3) * hz)):
                half = rate * base_m / 2
                rows.append((trial, n / hz, speed - half, speed + half, x, y, heading))
                x += speed * np.cos(heading + rate / hz / 2) / hz
                y += speed * np.sin(heading + rate / hz / 2) / hz
                heading, n = heading + rate / hz, n + 1
    table = pd.DataFrame(rows, columns=COLUMNS)
    return table + rng.normal(size=table.shape) * [0, 0, 0, 0, noise * base_m, noise * base_m, noise]


@pytest.mark.parametrize("base_m", BASES_M)
@pytest.mark.parametrize("on_the_spot", [False, True])
@pytest.mark.parametrize("way", WRITTEN)
def test_degrees_are_refused_however_they_are_written(base_m, on_the_spot, way):
    table = driven(base_m, on_the_spot=on_the_spot)
    degrees = WRITTEN[way](np.degrees(table.heading_rad))
    with pytest.raises(DataError, match=r"heading_rad looks like degrees; .*unit: deg\}"):
        checked(table.assign(heading_rad=degrees))


@pytest.mark.parametrize("base_m", BASES_M)
@pytest.mark.parametrize("on_the_spot", [False, True])
@pytest.mark.parametrize(("hz", "noise"), [(2, 0.0), (10, 0.02), (40, 0.05)])
def test_radians_are_not(base_m, on_the_spot, hz, noise):
    table = driven(base_m, hz, noise, on_the_spot)
    for headings in (table.heading_rad, table.heading_rad % (2 * np.pi), table.heading_rad + 70.0):
        checked(table.assign(heading_rad=headings))


def test_radians_of_many_turns_to_one_side_are_not():
    table = driven(0.05, on_the_spot=True, trials=2, lasts_s=60)
    half = np.full(len(table), 0.05)
    turned = 70.0 + table.t_s * 2.0
    checked(table.assign(left_m_s=-half, right_m_s=half, heading_rad=turned))


def test_radians_of_the_smallest_robots_are_not():
    table = driven(0.02, noise=0.0, on_the_spot=True)
    checked(table.assign(heading_rad=table.heading_rad % (2 * np.pi)))


def test_compass_headings_in_degrees_are_refused_as_degrees_first():
    """A large robot that drives about and hardly turns: 4 degrees read as radians turn its way round."""
    table = driven(1.5)
    compass = (90 - np.degrees(table.heading_rad)) % 360
    with pytest.raises(DataError, match="looks like degrees"):
        checked(table.assign(heading_rad=compass))


def test_a_heading_that_is_none_is_not_called_degrees():
    """It runs round while the robot drives straight ahead, whatever the wheels do."""
    t = np.arange(0.0, 30.0, 0.1)
    told = np.full(len(t), 0.5)
    straight = pd.DataFrame({"trial": 0, "t_s": t, "left_m_s": told, "right_m_s": told, "x_m": 0.5 * t})
    checked(straight.assign(y_m=1e-3 * np.sin(9 * t), heading_rad=0.7 * t))
