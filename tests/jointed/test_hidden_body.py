"""The second snake, by which the diagnosis of bodies is judged: what it hides acts as it does on a robot."""

import mujoco
import numpy as np
import pytest

from tests.hidden_snake.body import BOARD_KG, MASS_KG, PITCH_M, RADIUS_M, Hidden, Snake


def put_down(hidden):
    """A snake that lies straight, and is at rest."""
    snake = Snake(hidden, np.random.default_rng(0))
    snake.put_down()
    return snake


def test_the_drag_of_the_tether_resists_the_point_on_which_it_acts():
    snake, turn_rad_s = put_down(Hidden(drag_n=0.95)), 2.0
    snake.data.qvel[5], snake.data.qvel[1] = turn_rad_s, -turn_rad_s * PITCH_M / 2  # about the middle of the first link
    mujoco.mj_forward(snake.model, snake.data)
    snake._tether()
    assert snake.data.xfrc_applied[1, :2] == pytest.approx([0.0, 0.0], abs=1e-9)
    snake.data.qvel[0] = 0.3
    mujoco.mj_forward(snake.model, snake.data)
    snake._tether()
    assert snake.data.xfrc_applied[1, :2] == pytest.approx([-1.0, 0.0], abs=1e-6)


def dragged(hidden, sideways_m_s, roll_rad_s=0.0, lifted_m=0.0):
    """Forces and torques (links, 6) of the scales on a straight snake that slides sideways, rolls, or is held above the floor."""
    snake = put_down(hidden)
    for _ in range(40):
        mujoco.mj_step(snake.model, snake.data)  # onto the floor
    snake.data.qpos[2] += lifted_m
    snake.data.qvel[:] = 0
    snake.data.qvel[1], snake.data.qvel[3] = sideways_m_s, roll_rad_s
    snake._chance()
    mujoco.mj_forward(snake.model, snake.data)
    snake.data.xfrc_applied[:] = 0
    snake._scales()
    return snake.data.xfrc_applied[1:].copy()


def test_scales_drag_by_the_load_of_each_contact_and_not_a_link_that_rolls_or_is_lifted():
    scales = Hidden(across=2.0)
    sliding = dragged(scales, 0.1)
    weight = MASS_KG + BOARD_KG
    assert -sliding[:, 1].sum() == pytest.approx(0.25 * weight * 9.81, rel=0.25)  # chance varies the friction
    assert np.abs(sliding[:, 0]).max() < 1e-6
    assert sliding[:, 3].min() < 0  # it acts at the floor, below the link
    rolling = dragged(scales, 0.1, roll_rad_s=-0.1 / RADIUS_M)
    assert np.abs(rolling[:, 1]).sum() < 0.1 * np.abs(sliding[:, 1]).sum()
    assert not dragged(scales, 0.1, lifted_m=0.01).any()
