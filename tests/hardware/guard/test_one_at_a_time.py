"""One process a bus, and one a trial."""

import numpy as np
import pytest
from filelock import FileLock

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.devices.bus import Bus
from bns.hardware.emulators.devices.servo import Servo
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Faults
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.servo_setup import ServoBus
from bns.hardware.servos.bridge import BridgeChain
from bns.hardware.servos.dynamixel import DynamixelChain

IDS = (1, 2, 3)
EMULATED = ["trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf"]


class CountedBus(Bus):
    received = 0

    def receive(self, data):
        self.received += len(data)
        return super().receive(data)


@pytest.fixture
def first(tmp_path):
    """The first driver of a bus, with torque on; the bus, its line."""
    clock = EmulatedClock(np.inf)
    bus = CountedBus([Servo(n, clock, Faults()) for n in IDS], clock)
    line = PseudoTerminal(bus, tmp_path, "bus")
    driver = DynamixelChain(str(line.path), IDS, clock, HardwareLog(None, clock))
    driver.arm()
    yield driver, bus, line
    driver.close()
    line.close()


@pytest.mark.parametrize(
    "second",
    [
        lambda port, clock: DynamixelChain(port, IDS, clock, HardwareLog(None, clock)),
        lambda port, clock: BridgeChain(port, 3, clock, HardwareLog(None, clock)),
        ServoBus,
    ],
)
def test_a_second_driver_is_refused_and_says_nothing_to_the_servos(first, second):
    driver, bus, line = first
    heard = bus.received
    with pytest.raises(HardwareError, match=r"is in use by another program .*another trial"):
        second(str(line.path), EmulatedClock(np.inf))
    assert bus.received == heard
    assert all(driver.read(n, "torque_enable") == 1 for n in IDS)
    driver.close()
    second_driver = DynamixelChain(str(line.path), IDS, EmulatedClock(np.inf), HardwareLog(None, EmulatedClock(np.inf)))
    second_driver.close()


@pytest.mark.parametrize("resume", [False, True])
def test_given_commands_are_driven_by_one_process(tmp_path, capsys, resume):
    file = tmp_path / "proposed.csv"
    file.write_text("trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,0.5\n2,0.1,0.1,0.5\n")
    asked = [*EMULATED, "--results", str(tmp_path), "--commands", str(file)]
    folder = tmp_path / "trials" / "experiment-proposed-emulated"
    if resume:
        assert main(asked) == 0
    before = (folder / "journal.jsonl").read_bytes() if resume else None
    folder.parent.mkdir(exist_ok=True)
    with FileLock(folder.with_suffix(".lock")):
        assert main([*asked, *(["--resume"] if resume else [])]) == 2
    assert "is being driven by another process" in capsys.readouterr().err
    assert ((folder / "journal.jsonl").read_bytes() if resume else None) == before
    assert main([*asked, *(["--resume"] if resume else [])]) == 0
