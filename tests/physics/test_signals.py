"""Velocities of a place, as a robot with a heading has them."""

import numpy as np
import pytest

from bns.physics.signals import Body


@pytest.mark.parametrize(("direction", "along"), [("east", (1.0, 0.0)), ("north", (0.0, 1.0))])
def test_a_drift_is_turned_into_the_robots_frame_whichever_way_it_heads(direction, along):
    heading = np.array([[0.0, 0.4, np.pi / 2, 2.5, -2.0, -np.pi / 2, 7.0]])
    rest = np.zeros_like(heading)
    drift = np.array([[0.01, -0.02, 0.03, 0.04, -0.05, 0.06, 0.07]])
    still = Body(rest + 0.1, rest + 0.2, rest + 0.3, rest, rest, rest, rest)
    carried = still.with_drift(direction, drift, heading)
    seen = np.stack([carried.forward_m_s - 0.1, -(carried.sideways_m_s - 0.2)])[:, 0]  # forward and to the left
    for k, angle in enumerate(heading[0]):
        turned = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        np.testing.assert_allclose(turned @ seen[:, k], drift[0, k] * np.array(along), atol=1e-15)
    np.testing.assert_array_equal(carried.yaw_rad_s, still.yaw_rad_s)
