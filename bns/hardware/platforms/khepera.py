"""A Khepera III on its rig: its driver over its link, and two wheels that are driven like any others."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from bns.errors import HardwareError
from bns.hardware.clock import Clock, EmulatedClock
from bns.hardware.emulators.faults import FaultPlan
from bns.hardware.emulators.khepera_rig import EmulatedKheperaRig
from bns.hardware.guard.recipe import StopRecipe, khepera_recipe
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import SerialLink
from bns.hardware.rig import Rig
from bns.hardware.safety import Stopping, StopsAtTheEnd
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.wheels.khepera import BAUD, FLAT_V, STILL_M_S, WHEELBASE_M, KheperaIII, check_battery, firmware
from bns.hardware.wheels.khepera_settings import khepera_settings
from bns.hardware.wheels.wheel_drive import RobotLostError
from bns.hardware.wheels.wheeled import WheeledPlatform, Wheels
from bns.robots.khepera import UNITS_PER_M_S

RIG = resources.files("bns.hardware") / "rigs" / "khepera.yaml"

WHEELS = Wheels(UNITS_PER_M_S, 1000.0, WHEELBASE_M, least_v=FLAT_V)
REPEATS = 1
"""How often a trial drives its final controller by default: the dissertation shows one drive of it (section 4.3)."""


def open_platform(rig: Rig, clock: Clock, journal: HardwareLog, stopping: Stopping) -> WheeledPlatform:
    """Open port and tracker, and make sure before anything else that the robot stands still, is charged and is seen."""
    settings = khepera_settings(rig.driver)
    link = SerialLink(rig.port, BAUD, clock, journal, settings.reply)
    try:
        driver = KheperaIII(link, clock, journal, settings.stop_s)
        with StopsAtTheEnd(driver.stop):
            check_battery(driver.battery_v())
        tracker = open_tracker(rig.tracker, clock)
    except RobotLostError as error:
        link.close()
        raise HardwareError(f"the robot answers badly: {error}. Bring it nearer, charge it, try again.") from error
    except BaseException:
        link.close()
        raise
    return WheeledPlatform(driver, tracker, WHEELS, rig, clock, journal, stopping)


def stop_recipe(rig: Rig) -> StopRecipe:
    """For the guard: still by the reading of any firmware."""
    return khepera_recipe(BAUD, int(STILL_M_S * firmware(2, 0).units_per_m_s))


def emulate(rig: Rig, folder: Path, clock: EmulatedClock, plan: FaultPlan, seed: int) -> EmulatedKheperaRig:
    """An emulated robot under an emulated Wii remote, their ports in `folder`."""
    return EmulatedKheperaRig(rig, folder, clock, plan, seed)
