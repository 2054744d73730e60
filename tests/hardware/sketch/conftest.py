"""The sketch, built once; the driver on a board's time."""

from importlib import resources
from pathlib import Path

import pytest

from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.servos.bridge import BridgeChain

from .simulated_board import BoardClock, build

SKETCH = Path(str(resources.files("bns.hardware"))) / "bridge_sketch" / "bridge_sketch.ino"


@pytest.fixture(scope="package")
def built(tmp_path_factory):
    return build(SKETCH, tmp_path_factory.mktemp("sketch"))


@pytest.fixture
def driven():
    """driven(board, count) -> the driver, on the board's time."""
    opened = []

    def build(board, count=3, limits=None):
        clock = BoardClock(board)
        opened.append(BridgeChain(board.path, count, clock, HardwareLog(None, clock), limits))
        return opened[-1]

    yield build
    for each in opened:
        each.close()
