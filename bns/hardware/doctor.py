"""What is wrong with a set-up, found without moving anything, and the next thing to try."""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from bns.errors import HardwareError
from bns.extras import extra
from bns.hardware.clock import Clock
from bns.hardware.link.hardware_log import HardwareLog
from bns.hardware.link.serial_link import SerialLink
from bns.hardware.platforms.snake import open_chain
from bns.hardware.rig import Rig
from bns.hardware.servos.servo_chain import ServoError
from bns.hardware.servos.snake_settings import snake_settings
from bns.hardware.tracking.calibration import WORST_RMS_PX, load_calibration
from bns.hardware.tracking.infrared.evdev import CLASS, input_devices
from bns.hardware.tracking.kinds import open_tracker
from bns.hardware.tracking.wii import KERNEL_NAME
from bns.hardware.wheels.khepera import BAUD, KheperaIII, check_battery
from bns.hardware.wheels.khepera_settings import khepera_settings
from bns.hardware.wheels.wheel_drive import RobotLostError

with extra("robot"):
    from serial.tools.list_ports import comports

_SLOW_LATENCY_MS = 1
_STRAIGHT_RAD = 0.17
_CABLES = "check the cables between the servos and the supply"


@dataclass(frozen=True)
class Finding:
    """One thing looked at: fine or not, what was found, and what to try if it is not."""

    fine: bool
    what: str
    next_step: str = ""

    def __str__(self) -> str:
        return f"{'ok  ' if self.fine else 'BAD '} {self.what}" + (f"\n     try: {self.next_step}" if self.next_step else "")


def examine(rig: Rig | None, clock: Clock, devices: Path = Path("/dev"), inputs: Path = CLASS) -> Iterator[Finding]:
    """Ports, permissions, adapters, cameras and input devices; with a rig, also its robot and its tracker."""
    yield from ports(devices)
    yield from cameras(devices)
    yield from remotes(inputs)
    if rig is not None:
        yield from _asked(lambda: robot_of(rig, clock), "the robot")
        yield from _asked(lambda: tracker_of(rig, clock), "the tracker")


def ports(devices: Path) -> Iterator[Finding]:
    """Serial ports, whether they may be used, and how long their adapters hold bytes back."""
    found = sorted({p.device for p in comports()} | {str(p) for p in devices.glob("rfcomm*")})
    if not found:
        yield Finding(False, "no serial port", "plug the adapter in; a Khepera: sudo rfcomm bind 0 ADDRESS")
    for port in found:
        yield may_use(Path(port), "dialout")
        latency = Path("/sys/class/tty") / Path(port).name / "device" / "latency_timer"
        if latency.exists():
            yield latency_of(port, int(latency.read_text()))


def latency_of(port: str, milliseconds: int) -> Finding:
    """Whether an FTDI adapter holds answers back: with 16 ms, a round of twelve servos takes a fifth of a second."""
    if milliseconds <= _SLOW_LATENCY_MS:
        return Finding(True, f"{port}: latency timer {milliseconds} ms")
    place = f"/sys/class/tty/{Path(port).name}/device/latency_timer"
    return Finding(False, f"{port}: latency timer {milliseconds} ms", f"echo 1 | sudo tee {place}")


def may_use(path: Path, group: str) -> Finding:
    """Whether a device file may be read and written."""
    if os.access(path, os.R_OK | os.W_OK):
        return Finding(True, f"{path} may be used")
    mode = stat.filemode(path.stat().st_mode) if path.exists() else "there is no such file"
    return Finding(False, f"no permission to use {path} ({mode})", f"sudo usermod -aG {group} $USER, then log in again")


def cameras(devices: Path) -> Iterator[Finding]:
    """Camera devices."""
    found = sorted(devices.glob("video*"))
    if not found:
        yield Finding(True, "no camera at this computer (a stream's address can be used as well)")
    for camera in found:
        yield may_use(camera, "video")


def remotes(inputs: Path) -> Iterator[Finding]:
    """Input devices by the names that their drivers give them, and whether the infra-red camera of a Wii remote may be used."""
    found = input_devices(inputs)
    for device in found:
        yield Finding(True, f"input device {device.file}: {device.name}")
    for device in found:
        if device.name == KERNEL_NAME:
            yield may_use(device.file, "input")
    if not any(device.name == KERNEL_NAME for device in found):
        yield Finding(True, "no Wii remote is paired (press 1+2 on it; the kernel's driver is hid-wiimote)")


def robot_of(rig: Rig, clock: Clock) -> Iterator[Finding]:
    """What the robot at the rig's port says of itself."""
    if rig.robot not in _ROBOTS:
        yield Finding(True, f"the robot {rig.robot} is examined when its driver opens it")
        return
    yield from _ROBOTS[rig.robot](rig, clock)


def servos_of(rig: Rig, clock: Clock) -> Iterator[Finding]:
    """Whether all servos of a snake are there and fit; nothing moves."""
    settings = snake_settings(rig.driver)
    chain = open_chain(rig.port, settings, clock, HardwareLog(None, clock))
    try:
        found = chain.health()
        volts, hottest = min(h.voltage_v for h in found.values()), max(h.temperature_c for h in found.values())
        yield Finding(True, f"{len(found)} servos answer ({settings.wiring}), {volts:.1f} V or more, {hottest:.0f} °C or less")
        number, bent = max(found.items(), key=lambda item: abs(item[1].position_rad))
        angle = f"servo {number} is bent most, by {abs(math.degrees(bent.position_rad)):.0f}°"
        straight = abs(bent.position_rad) <= _STRAIGHT_RAD
        yield Finding(straight, angle, "" if straight else "lay the robot straight; check how that servo's horn is mounted")
        yield Finding(not chain.retries, f"{chain.retries} questions had to be asked again", _CABLES if chain.retries else "")
    except ServoError as error:
        raise HardwareError(f"{error}. Try: {_CABLES}") from error
    finally:
        chain.close()


def khepera_of(rig: Rig, clock: Clock) -> Iterator[Finding]:
    """Firmware, speeds and battery of a Khepera."""
    journal = HardwareLog(None, clock)
    link = SerialLink(rig.port, BAUD, clock, journal, khepera_settings(rig.driver).reply)
    try:
        robot = KheperaIII(link, clock, journal)
        made = robot.firmware
        yield Finding(True, f"Khepera III, firmware {made.version}.{made.revision}: {made.units_per_m_s:.0f} units per m/s")
        volts = robot.battery_v()
        check_battery(volts)
        yield Finding(True, f"battery {volts:.2f} V")
        still = max(abs(v) for v in robot.speed_m_s())
        yield Finding(still < 0.005, f"wheels at {still:.3f} m/s", "" if still < 0.005 else "bns trial stops it when it opens it")
        trip_s, timeout_s = link.times.smoothed_s or 0.0, link.times.timeout_s
        yield Finding(True, f"answers come after {1000 * trip_s:.0f} ms, and are waited for {1000 * timeout_s:.0f} ms")
        nearer = "bring it nearer" if robot.retries else ""
        yield Finding(not robot.retries, f"{robot.retries} questions had to be asked again", nearer)
    except RobotLostError as error:
        raise HardwareError(f"the robot stopped answering: {error}. Bring it nearer, charge it.") from error
    finally:
        link.close()


_ROBOTS: Mapping[str, Callable[[Rig, Clock], Iterator[Finding]]] = {"khepera": khepera_of, "snake": servos_of}


def tracker_of(rig: Rig, clock: Clock) -> Iterator[Finding]:
    """Calibration of the tracker's camera, and whether it opens."""
    if "calibration" in rig.tracker:
        found = load_calibration(Path(str(rig.tracker["calibration"])))
        good = found.rms_px <= WORST_RMS_PX
        yield Finding(good, f"calibration of {found.camera}: RMS {found.rms_px:.2f} pixels", "" if good else "bns calibrate")
    tracker = open_tracker(rig.tracker, clock)
    try:
        yield Finding(True, f"tracker {rig.tracker['kind']} opens; bns track shows what it sees")
    finally:
        tracker.close()


def _asked(examination: Callable[[], Iterator[Finding]], what: str) -> Iterator[Finding]:
    """Findings of an examination; a fault that ends it is one of them."""
    try:
        yield from examination()
    except HardwareError as error:
        text, _, step = str(error).partition(" Try: ")
        yield Finding(False, f"{what}: {text}", "what the line above says" if step in {"", "bns doctor"} else step)
