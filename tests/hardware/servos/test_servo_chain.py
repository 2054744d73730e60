"""What every servo must keep, and when it is taken for stuck."""

import pytest

from bns.hardware.servos.servo_chain import Health, ServoError, ServoLimits, StrainWatch, StuckServoError


@pytest.mark.parametrize("load", [0.8, -0.8])
def test_a_servo_is_stuck_at_its_share_of_the_torque_that_it_is_given_in_either_direction(load):
    watch, said = StrainWatch(ServoLimits(load=0.95, torque=0.8, stuck_s=1.0)), {3: Health(0.0, load, 12.0, 30.0)}
    watch.look(said, 0.0)
    with pytest.raises(StuckServoError, match=r"servo 3 has used 80% of its torque for 1\.5 s"):
        watch.look(said, 1.5)


def test_a_servo_may_be_as_hot_as_its_limit_and_no_hotter():
    limits = ServoLimits(temperature_c=65.0)
    limits.check({1: Health(0.0, 0.0, 12.0, 65.0)})
    with pytest.raises(ServoError, match="servo 1 is at 66 °C; let it cool below 65"):
        limits.check({1: Health(0.0, 0.0, 12.0, 66.0)})
