"""A servo that is deaf when its torque is to be taken off, in front of the sketch on a simulated Mega 2560."""

import pytest

from bns.hardware.servos.bridge_frames import WATCHDOG_S
from bns.hardware.servos.servo_chain import ServoError

from ..manual_bus import ID, ManualBus, ManualServo
from .simulated_board import Board, lacking
from .test_manual_bus import holding, sent_off

pytestmark = pytest.mark.skipif(bool(lacking()), reason=lacking())


class DeafBus(ManualBus):
    """Servos of which some hear nothing in a span of time; `deaf`: number -> begin, end."""

    def __init__(self, servos):
        super().__init__(servos)
        self.deaf, self._now_s = {}, 0.0

    def heard(self, now_s, byte):
        self._now_s = now_s
        return super().heard(now_s, byte)

    def _answer(self, servo, *packet):
        begin_s, end_s = self.deaf.get(servo.table[ID], (0.0, 0.0))
        return None if begin_s <= self._now_s < end_s else super()._answer(servo, *packet)


@pytest.fixture
def on_the_way(built, driven):
    """A board with three servos on their way, and its driver, which has just asked how they are."""
    mega = Board(built, DeafBus([ManualServo(n + 1) for n in range(3)]))
    driver = driven(mega, 3)
    sent_off(mega, driver)
    mega.run_until(0.2)
    driver.health()
    assert all(holding(mega))
    yield mega, driver
    mega.close()


@pytest.mark.parametrize("deaf_s", [0.2, 1.5])
def test_the_watchdog_goes_on_until_a_deaf_servo_hears_it(on_the_way, deaf_s):
    mega, _ = on_the_way
    begin_s = mega.now_s + WATCHDOG_S - 0.05
    mega.bus.deaf = {2: (begin_s, begin_s + deaf_s)}
    mega.run_until(WATCHDOG_S - 0.05 + deaf_s)
    assert holding(mega) == [0, 1, 0]
    mega.run_until(0.1)
    assert not any(holding(mega))


def test_an_order_to_stop_goes_on_after_a_computer_that_has_left(on_the_way):
    mega, driver = on_the_way
    mega.bus.deaf = {2: (mega.now_s, mega.now_s + 0.5)}
    assert not driver.stop(patience_s=0.0).confirmed
    assert holding(mega) == [0, 1, 0]
    mega.run_until(0.7)
    assert not any(holding(mega))


def test_the_computer_is_answered_while_servos_are_deaf(on_the_way):
    mega, driver = on_the_way
    mega.bus.deaf = dict.fromkeys((1, 2, 3), (mega.now_s, 1000000000.0))
    mega.run_until(2.0 * WATCHDOG_S)
    for _ in range(5):
        began_s = mega.now_s
        with pytest.raises(ServoError, match="servo 1 does not answer the bridge"):
            driver.health()
        assert mega.now_s - began_s < 0.1
    assert driver.retries == 0
    assert "servos [1, 2, 3] did not stop" in driver.stop(patience_s=0.2).problem


def test_servos_that_are_armed_again_keep_their_torque(on_the_way):
    mega, driver = on_the_way
    mega.bus.deaf = {2: (mega.now_s, 1e9)}
    assert not driver.stop(patience_s=0.0).confirmed
    mega.bus.deaf = {}
    sent_off(mega, driver)
    for _ in range(4):
        mega.run_until(0.1)
        driver.health()
    assert all(holding(mega))
