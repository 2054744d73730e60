"""An emulated Khepera on a pseudo-terminal, on a clock that runs as fast as it can."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.engine.philox import Key
from bns.hardware.clock import EmulatedClock
from bns.hardware.emulators.body import DifferentialBody
from bns.hardware.emulators.devices.khepera import KheperaEmulator
from bns.hardware.emulators.devices.terminal import PseudoTerminal
from bns.hardware.emulators.faults import Fault, Faults
from bns.hardware.link.hardware_log import HardwareLog, events
from bns.hardware.link.serial_link import SerialLink
from bns.hardware.wheels.khepera import BAUD, KheperaIII, firmware
from bns.physics.model import load_model

NORTH = (0.0, 0.0, np.pi / 2)


@pytest.fixture
def clock():
    return EmulatedClock(np.inf)


@pytest.fixture
def body():
    return DifferentialBody(load_model("khepera-world"), Key.of_run(1, 0, "khepera", "circle"), NORTH)


@pytest.fixture
def bench(tmp_path, clock, body):
    """bench(version, *faults) -> driver, link, emulator, line, sent()."""
    opened = []

    def build(version=2, *faults, seed=0):
        emulator = KheperaEmulator(body, clock, firmware(version, 4), Faults(tuple(faults), seed, "khepera"))
        line = PseudoTerminal(emulator, tmp_path, f"khepera{len(opened)}")
        emulator.cut_line = lambda _seconds: line.cut()
        journal = HardwareLog(tmp_path / f"bench{len(opened)}.jsonl", clock)
        link = SerialLink(str(line.path), BAUD, clock, journal)
        opened.append((link, line, journal))

        def sent():
            journal.sync()
            return [e["data"] for e in events(tmp_path / f"bench{len(opened) - 1}.jsonl", "sent")]

        driver = KheperaIII(link, clock, journal)
        return SimpleNamespace(driver=driver, link=link, emulator=emulator, line=line, sent=sent, body=body, clock=clock)

    yield build
    for link, line, journal in opened:
        link.close()
        line.close()
        journal.close()


@pytest.fixture
def fault():
    return Fault
