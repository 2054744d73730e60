"""A robot on a line whose guard runs in a process of its own, while the trial is this process."""

import os
import socket
import time
from contextlib import contextmanager

from bns.hardware.clock import RealClock
from bns.hardware.guard import process as guard_process
from bns.hardware.guard.notes import Notes
from bns.hardware.guard.recipe import bridge_recipe, bus_recipe, khepera_recipe
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import SerialLink
from bns.hardware.servos.bridge import BridgeChain
from bns.hardware.servos.dynamixel import DynamixelChain
from bns.hardware.wheels.khepera import BAUD, KheperaIII

HANGS_S = 30.0
RECIPES = {
    "serial": khepera_recipe(BAUD, 720),
    "bus": bus_recipe(range(1, 13)),
    "bridge": bridge_recipe(115200, 12),
}


def driver_of(link, guard, clock):
    journal = HardwareLog(None, clock)
    if link == "serial":
        return KheperaIII(SerialLink(guard.path, BAUD, clock, journal), clock, journal)
    if link == "bus":
        return DynamixelChain(guard.path, range(1, 13), clock, journal)
    return BridgeChain(guard.path, 12, clock, journal)


def set_off(link, driver):
    if link == "serial":
        driver.set_speed_m_s(0.1, 0.08)
    else:
        driver.arm()
        driver.move([0.5] * 12, [1.0] * 12)


def until(true):
    end_s = time.monotonic() + HANGS_S
    while not true():
        assert time.monotonic() < end_s
        time.sleep(0.01)


def trial_dies(guard):
    guard._control.close()
    guard._watch.close()
    guard._next.end()


def vanish(guard):
    """The trial is gone, as far as guard and who stands by can tell."""
    for one in (guard._control, guard._watch, guard._next.control, guard._next.watch):
        one.close()


def moving(held, link="serial"):
    """A robot that moves, its guard, and who stands by."""
    robot, guard = held(link)
    driver = driver_of(link, guard, RealClock())
    guard.arm()
    set_off(link, driver)
    robot.until(True)
    return robot, guard, guard._next


@contextmanager
def armed_guard(tmp_path):
    """In this process, told to watch over it; nothing is at its port."""
    near, far = socket.socketpair()
    with near, far:
        setup = {"process": os.getpid(), "silent_s": HANGS_S, "log": None, "link": str(tmp_path / "x" / "y")}
        setup |= {"port": "none", "sysfs": "/sys", "identity": None, "twins": [], "gives_up_s": HANGS_S}
        guard = guard_process.Guard(setup | {"stop": RECIPES["serial"].as_json()}, far, near, Notes(None))
        near.send(b"a")
        guard._turn(1.0)
        yield guard
