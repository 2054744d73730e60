"""A port that is in use by a guard: which one, whose, and what to do."""

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from bns.cli.main import main
from bns.errors import HardwareError
from bns.hardware.clock import RealClock
from bns.hardware.guard.client import Guard
from bns.hardware.guard.holder import holder_text
from bns.hardware.guard.recipe import khepera_recipe
from bns.hardware.link.serial_link import open_port

RECIPE = khepera_recipe(115200, 720)
DIES = """
import os, sys
from tests.hardware.guard.test_holder import RECIPE, Guard
guard = Guard(sys.argv[1], RECIPE, 0.3)
guard.arm()
os.write(1, f"{guard.process} {guard._next.process.pid}".encode())
os._exit(4)
"""


@pytest.fixture
def port():
    """A line at whose other end nobody answers."""
    near, far = os.openpty()
    yield os.ttyname(far)
    os.close(near)
    os.close(far)


@pytest.fixture
def left_behind(port):
    """The processes of a guard whose trial has ended while its robot may move, and of what stands by."""
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", DIES, port], cwd=root, stdout=subprocess.PIPE, timeout=60, check=False)
    guards = [int(one) for one in done.stdout.split()]
    yield guards
    for one in guards:
        with suppress(ProcessLookupError):
            os.kill(one, signal.SIGKILL)


def test_a_guard_without_a_trial_is_named_and_how_to_end_it(port, left_behind, capsys):
    guard, standby = left_behind
    os.kill(guard, signal.SIGTERM)  # which is to make it stop the robot, not to end it
    time.sleep(0.3)
    with pytest.raises(HardwareError) as said:
        open_port(port, 115200, RealClock())
    assert f"is in use by the guard (process {guard}) of a trial that has ended" in str(said.value)
    both = "kill -9 " + " ".join(map(str, sorted(left_behind)))
    assert f"Cut its power; then end the guard: {both}" in str(said.value)
    assert main(["servos", "scan", "--port", port]) == 2
    assert both in capsys.readouterr().err
    os.kill(guard, signal.SIGKILL)
    os.kill(standby, signal.SIGKILL)
    until_free(port)


def until_free(port):
    """Open the line and close it, once a process that was killed has let it go: its name goes first, its files a little later."""
    end_s = time.monotonic() + 60.0
    while True:
        try:
            return open_port(port, 115200, RealClock()).close()
        except HardwareError:
            if time.monotonic() > end_s:
                raise
            time.sleep(0.02)


def test_a_trial_that_goes_on_is_named(port):
    guard = Guard(port, RECIPE, 0.3)
    try:
        with pytest.raises(HardwareError) as said:
            open_port(port, 115200, RealClock())
        assert holder_text("/dev/zero") == ""
    finally:
        guard.close()
    assert f"is in use by another trial (process {os.getpid()}; its guard is process {guard.process})" in str(said.value)
    assert "kill" not in str(said.value)


def test_no_guard_and_no_list_of_processes(port, tmp_path):
    assert holder_text(port) == ""
    assert holder_text(port, tmp_path) == ""
