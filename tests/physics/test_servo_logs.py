"""The model of a servo against logs of a real one that turned a pendulum (Rhoban/bam: Feetech STS3250, slope 32, 12 V)."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import least_squares

from bns.physics.snake.parameters import shipped_parameters
from bns.physics.snake.servo import GRAVITY_M_S2, Servo, pendulum_rad, servo_of

LOGS = Path(__file__).resolve().parents[3] / "shared" / "data" / "servo_logs.csv.gz"
BEGIN = Servo(stiffness_n_m_rad=50.0, damping_n_m_s_rad=0.8, torque_limit_n_m=6.0, armature_kg_m2=0.005, friction_loss_n_m=0.15)
FASTEST = 59 * 2 * np.pi / 60


def test_a_servo_holds_a_weight_as_far_below_its_goal_as_its_stiffness_says():
    servo, mass, length = servo_of(shipped_parameters()), 0.3, 0.1
    t_s = np.arange(0, 2.0, 0.05)
    angle = pendulum_rad(servo, mass, length, t_s, np.full(len(t_s), np.pi / 2), 1.4)[-1]
    sag = mass * GRAVITY_M_S2 * length / servo.stiffness_n_m_rad
    assert np.pi / 2 - angle == pytest.approx(sag, abs=1.2 * servo.friction_loss_n_m / servo.stiffness_n_m_rad)


def test_a_servo_gets_no_faster_than_its_no_load_speed():
    t_s = np.arange(0, 0.6, 0.01)
    turned = pendulum_rad(servo_of(shipped_parameters()), 0.01, 0.01, t_s, np.full(len(t_s), 6.0), 0.0)
    fastest = np.abs(np.diff(turned) / 0.01).max()
    assert 0.8 * FASTEST < fastest < 1.01 * FASTEST


@pytest.mark.skipif(not LOGS.is_file(), reason="the logs are beside the project only: ../shared/data/servo_logs.csv.gz")
def test_the_same_model_with_its_own_numbers_is_a_real_servo():
    table = pd.read_csv(LOGS)
    table = table[(table.motor == "sts3250") & (table.torque_enable)]
    logs = {name: one for name, one in table.groupby("trajectory") if name != "lift_and_drop"}

    def off(x, name):
        log = logs[name]
        t_s = log.t_s.to_numpy()
        goal = np.interp(t_s - x[5], t_s, log.goal_rad)  # a command takes its time
        told = pendulum_rad(Servo(*np.exp(x[:5])), log.mass.iloc[0], log.length.iloc[0], t_s, goal, log.pos_rad.iloc[0], 0.004)
        return told - log.pos_rad.to_numpy()

    begin = np.append(np.log(list(vars(BEGIN).values())), 0.01)
    learned = ("sin_sin", "sin_time_square")
    fit = least_squares(lambda x: np.concatenate([off(x, name) for name in learned]), begin, diff_step=0.02, max_nfev=3)
    for name, log in logs.items():
        model = np.sqrt(np.mean(off(fit.x, name) ** 2))
        tracking = np.sqrt(np.mean((log.goal_rad - log.pos_rad) ** 2))
        assert model < 0.02, name
        assert model < tracking / 3, name
    servo = Servo(*np.exp(fit.x[:5]))
    assert servo.torque_limit_n_m / servo.damping_n_m_s_rad == pytest.approx(table.speed_rad_s.abs().max(), rel=0.25)
    assert 0 < fit.x[5] < 0.03
