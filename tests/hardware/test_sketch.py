"""The Arduino's sketch, compiled for this computer, between the driver and emulated servos."""

import os
import shutil
import subprocess
import time
import tty
from importlib import resources
from pathlib import Path

import pytest

from bns.hardware.bridge import BridgeChain
from bns.hardware.bridge_frames import HELLO, MOVE, START, STATE, STOP, Frame, decoded, encoded
from bns.hardware.clock import RealClock
from bns.hardware.emulators.ax12 import Bus
from bns.hardware.emulators.bridge import BridgeEmulator
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.emulators.servo import Servo
from bns.hardware.emulators.terminal import PseudoTerminal
from bns.hardware.hardware_log import HardwareLog
from bns.hardware.servo_chain import ServoError, ServoLimits

HERE = Path(__file__).parent / "arduino"
SKETCH = Path(str(resources.files("bns.hardware"))) / "bridge_sketch" / "bridge_sketch.ino"
SLOWNESS = 10
pytestmark = pytest.mark.skipif(shutil.which("g++") is None, reason="needs g++ to compile the sketch")


class SlowClock(RealClock):
    """As slow as the sketch's."""

    def now_s(self):
        return time.monotonic() / SLOWNESS

    def sleep(self, seconds):
        time.sleep(SLOWNESS * seconds)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    program = tmp_path_factory.mktemp("sketch") / "sketch"
    asked = ["g++", "-std=c++11", "-Wall", "-Wextra", "-Werror", "-O1", f"-I{HERE}", f'-DSKETCH="{SKETCH}"']
    subprocess.run([*asked, f"-DSLOWNESS={SLOWNESS}", str(HERE / "main.cpp"), "-o", str(program)], check=True)
    return program


@pytest.fixture
def bridge(compiled, tmp_path, clock):
    """bridge(*faults, **registers) -> path of the computer's side, servos. Real time before the sketch, emulated behind it."""
    opened = []

    def build(*faults, count=3, **registers):
        struck = Faults(tuple(faults), 1, "bus")
        bus = Bus([Servo(n + 1, clock, struck, **registers) for n in range(count)], clock, struck)
        line = PseudoTerminal(bus, tmp_path, "servos")
        master, slave = os.openpty()
        tty.setraw(slave)
        process = subprocess.Popen([str(compiled), str(master), str(line.path)], pass_fds=[master])
        opened.append((line, master, slave, process))
        return os.ttyname(slave), bus.servos

    yield build
    for line, master, slave, process in opened:
        process.kill()
        process.wait()
        line.close()
        os.close(master)
        os.close(slave)


def until(true, patience_s=30.0):
    """Whether it came true in time."""
    end_s = time.monotonic() + patience_s
    while not true() and time.monotonic() < end_s:
        time.sleep(0.05)
    return true()


def told(port, data, wait_s=2.0):
    """Bytes that answer these, raw."""
    file = os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        os.write(file, data)
        back, end_s = b"", time.monotonic() + wait_s
        while time.monotonic() < end_s and decoded(back)[0] is None:
            time.sleep(0.005)
            try:
                back += os.read(file, 4096)
            except BlockingIOError:
                continue
        return back
    finally:
        os.close(file)


def test_the_driver_drives_through_the_sketch(bridge, clock):
    port, servos = bridge(ccw_angle_limit=600, present_position=520)
    driver = BridgeChain(port, 3, SlowClock(), HardwareLog(None, SlowClock()), ServoLimits(torque=0.5))
    try:
        driver.arm()
        assert [s.get("goal_position") for s in servos] == [520] * 3
        assert driver.move([0.2, -0.2, 2.0], [1.0, 1.0, 0.0]) == pytest.approx([0.2, -0.2, 0.45], abs=0.006)
        assert [s.get("moving_speed") for s in servos] == [86, 86, 1]
        assert until(lambda: driver.health() and [s.get("torque_limit") for s in servos] == [511] * 3)  # grown in steps
        clock.sleep(1.0)
        assert driver.health()[1].position_rad == pytest.approx(0.2, abs=0.01)
        assert driver.stop().confirmed
        assert not any(s.get("torque_enable") for s in servos)
        with pytest.raises(ServoError, match="asked 6 times"):  # not armed any more
            driver.move([0.0] * 3, [1.0] * 3)
    finally:
        driver.close()


def test_a_computer_that_falls_silent_loses_the_torque(bridge):
    port, servos = bridge()
    driver = BridgeChain(port, 3, SlowClock(), HardwareLog(None, SlowClock()))
    driver.arm()
    assert until(lambda: driver.health() and all(s.get("torque_enable") for s in servos))
    driver.close()
    assert until(lambda: not any(s.get("torque_enable") for s in servos))


def test_a_servo_that_is_silent_is_named(bridge, clock):
    port, _ = bridge(Fault("silent-servo", at_s=1.0, for_s=1e9, servo=2))
    driver = BridgeChain(port, 3, SlowClock(), HardwareLog(None, SlowClock()))
    try:
        clock.sleep(1.0)
        with pytest.raises(ServoError, match="servo 2 does not answer the bridge"):
            driver.health()
        assert "servos [2] did not stop" in driver.stop(patience_s=0.5).problem
    finally:
        driver.close()


@pytest.mark.parametrize(
    "question",
    [
        encoded(Frame(HELLO, 7, b"")),
        b"noise\xa5" + encoded(Frame(STATE, 8, b"")),
        encoded(Frame(STOP, 9, b"")),
        encoded(Frame(MOVE, 10, bytes(12))),  # not armed: refused
        encoded(Frame(MOVE, 11, bytes(3))),
        encoded(Frame(99, 12, b"?")),
        bytes([START, 200, STATE]) + encoded(Frame(STATE, 13, b"")),  # a torn frame before it
    ],
)
def test_sketch_and_emulator_answer_the_same_bytes(bridge, clock, question):
    port, servos = bridge(present_position=600)
    told(port, encoded(Frame(HELLO, 1, b"")))
    emulator = BridgeEmulator([Servo(n + 1, clock, Faults(), present_position=600) for n in range(3)], clock)
    by_emulator = emulator.receive(question)
    if not by_emulator:  # it waits for the rest of a frame that never comes
        clock.sleep(0.1)
        by_emulator = emulator.receive(question)
    emulator.close()
    answers = told(port, question) or told(port, question)
    assert len(servos) == 3
    if by_emulator:
        assert decoded(answers)[0] == decoded(by_emulator)[0]
        assert answers.startswith(by_emulator)
    else:
        assert decoded(answers)[0].kind == STATE | 0x80
