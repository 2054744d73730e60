"""A robot that is unplugged is stopped when it, and no other device, comes back."""

import os
import shutil
import time
from pathlib import Path

import pytest

from bns.errors import HardwareError
from bns.hardware.guard.client import Guard
from bns.hardware.guard.line import identity
from bns.trial.session import _named

from .. import outlive
from ..robots_on_the_line import Robot
from .held import HANGS_S, RECIPES, trial_dies


def say_what_is_there(sysfs, port, serial, socket_name="1-1"):
    """What Linux says of a USB adapter: /sys/class/tty/NAME/device leads into the folder of its socket."""
    socket_folder = sysfs / f"devices-{serial}" / socket_name
    (socket_folder / "interface").mkdir(parents=True)
    for what, text in {"idVendor": "0403", "idProduct": "6014", "serial": serial}.items():
        (socket_folder / what).write_text(f"{text}\n")
    name = sysfs / "class" / "tty" / Path(os.path.realpath(port)).name
    name.mkdir(parents=True, exist_ok=True)
    (name / "device").unlink(missing_ok=True)
    (name / "device").symlink_to(socket_folder / "interface")


def test_devices_are_told_apart_by_serial_number_socket_or_address(tmp_path):
    say_what_is_there(tmp_path, "/dev/ttyUSB0", "FT1234")
    say_what_is_there(tmp_path, "/dev/ttyUSB1", "", "2-1.4")
    bluetooth = tmp_path / "class" / "tty" / "rfcomm0"
    bluetooth.mkdir()
    (bluetooth / "address").write_text("00:12:6F:00:00:01\n")
    (bluetooth / "channel").write_text("1\n")
    found = [identity(f"/dev/{name}", str(tmp_path)) for name in ("ttyUSB0", "ttyUSB1", "rfcomm0", "ttyS0")]
    assert found == ["usb 0403:6014 FT1234", "usb 0403:6014 2-1.4", "bluetooth 00:12:6F:00:00:01 1", None]


@pytest.mark.parametrize("same", [True, False])
def test_a_device_that_takes_the_ports_name_hears_nothing_unless_it_is_the_robots(tmp_path, same):
    robot = Robot("serial", tmp_path)
    say_what_is_there(tmp_path / "sys", robot.path, "FT1234")
    sysfs = str(tmp_path / "sys")
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S, tmp_path / "guard.jsonl", gives_up_s=3.0, sysfs=sysfs)
    guard.arm()
    line = os.open(guard.path, os.O_RDWR | os.O_NOCTTY)
    os.write(line, b"D,l20000,l20000\n")
    robot.until(True)
    os.close(line)
    shutil.rmtree(tmp_path / "sys")
    robot.line.cut()
    trial_dies(guard)
    before = len(robot.heard)
    robot.plug_in()
    say_what_is_there(tmp_path / "sys", robot.path, "FT1234" if same else "FT9999")
    assert guard._process.wait(HANGS_S) == 0
    kinds = [e["kind"] for e in outlive._events(tmp_path)]
    assert kinds[-1] == ("stopped" if same else "gave-up")
    assert robot.moves() is not same
    if not same:
        assert kinds.count("other-device") == 1
        assert len(robot.heard) == before
    robot.close()


def test_a_robot_that_comes_back_under_another_name_is_stopped(tmp_path):
    robot = Robot("serial", tmp_path)
    sysfs = tmp_path / "sys"
    say_what_is_there(sysfs, robot.path, "FT1234")
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S, tmp_path / "guard.jsonl", gives_up_s=HANGS_S, sysfs=str(sysfs))
    guard.arm()
    line = os.open(guard.path, os.O_RDWR | os.O_NOCTTY)
    os.write(line, b"D,l20000,l20000\n")
    robot.until(True)
    os.close(line)
    shutil.rmtree(sysfs)
    robot.line.cut()
    trial_dies(guard)
    kept = [os.openpty() for _ in range(3)]  # the name that it had is somebody else's now
    robot.plug_in()
    now = os.path.realpath(robot.path)
    robot.path.unlink()
    say_what_is_there(sysfs, now, "FT1234")
    say_what_is_there(sysfs, os.ttyname(kept[0][1]), "FT9999")
    assert guard._process.wait(HANGS_S) == 0
    events = outlive._events(tmp_path)
    assert events[-1]["kind"] == "stopped"
    assert [e["port"] for e in events if e["kind"] == "port-back"] == [now]
    assert not robot.moves()
    for ends in kept:
        for end in ends:
            os.close(end)
    robot.close()


def test_another_device_that_cannot_be_told_from_the_robots_hears_nothing(tmp_path):
    """Cheap adapters have all the same serial number."""
    robot, sysfs = Robot("serial", tmp_path), tmp_path / "sys"
    say_what_is_there(sysfs, robot.path, "0001", "1-1")
    ours, theirs = os.openpty()
    say_what_is_there(sysfs, os.ttyname(theirs), "0001", "1-2")
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S, tmp_path / "guard.jsonl", gives_up_s=1.5, sysfs=str(sysfs))
    guard.arm()
    (sysfs / "class" / "tty" / Path(os.path.realpath(robot.path)).name / "device").unlink()
    robot.line.cut()
    trial_dies(guard)
    assert guard._process.wait(HANGS_S) == 0
    assert [e["kind"] for e in outlive._events(tmp_path)][-1] == "gave-up"
    os.set_blocking(ours, False)
    with pytest.raises(BlockingIOError):
        os.read(ours, 1)
    os.close(ours)
    os.close(theirs)
    robot.close()


def test_a_guard_whose_port_never_comes_back_ends_after_the_time_that_the_rig_says(tmp_path):
    robot = Robot("serial", tmp_path)
    guard = Guard(str(robot.path), RECIPES["serial"], HANGS_S, tmp_path / "guard.jsonl", gives_up_s=1.5)
    guard.arm()
    robot.line.cut()
    began_s = time.monotonic()
    trial_dies(guard)
    assert guard._process.wait(HANGS_S) == 0
    assert time.monotonic() - began_s > 1.4
    assert [e["kind"] for e in outlive._events(tmp_path)][-1] == "gave-up"
    robot.close()


def test_errors_name_the_port_that_was_given_and_not_the_guards_way_to_it():
    way, port = "/tmp/g/ttyUSB0", "/dev/ttyUSB0"
    with pytest.raises(HardwareError, match=rf"^no servo at {port} \({port}\)$"), _named(way, port):
        raise HardwareError(f"no servo at {way} ({way})")
    with pytest.raises(KeyError, match=way), _named(way, port):
        raise KeyError(way)
