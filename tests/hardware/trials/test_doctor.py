"""What the doctor finds."""

from pathlib import Path

import pytest

from bns.cli.main import main
from bns.hardware.doctor import cameras, examine, latency_of, may_use, ports, remotes
from bns.hardware.platforms.snake import RIG as RIG_OF_THE_SNAKE
from bns.hardware.rig import load_rig

RIG = """robot: khepera
port: {port}
surface_m: {{x: [-0.9, 0.9], y: [-0.7, 0.7]}}
tracker: {{kind: wii, device: {device}, height_m: 2.0, view_rad: 0.7}}
"""


def rig(tmp_path, port, device):
    file = tmp_path / "rig.yaml"
    file.write_text(RIG.format(port=port, device=device))
    return str(file)


def test_what_is_missing_is_named_with_the_next_step(tmp_path, capsys):
    assert main(["doctor", "--rig", rig(tmp_path, "/dev/nowhere", tmp_path / "none")]) == 2
    said = capsys.readouterr().out
    assert "BAD  the robot: there is no port /dev/nowhere" in said
    assert "BAD  the tracker: cannot open the Wii remote" in said
    assert "to be fixed" in said
    assert "bns doctor" not in said  # it has just been asked
    assert said.count("try:") > said.count("Try:") == 0


def test_the_robot_is_the_one_that_the_rig_names(tmp_path, capsys):
    text = RIG_OF_THE_SNAKE.read_text(encoding="utf-8").replace("/dev/ttyUSB0", "/dev/nowhere")
    (tmp_path / "snake.yaml").write_text(text, encoding="utf-8")
    assert main(["doctor", "--rig", str(tmp_path / "snake.yaml")]) == 2
    assert "BAD  the robot: there is no port /dev/nowhere" in capsys.readouterr().out
    assert main(["doctor", "--robot", "khepera", "--rig", str(tmp_path / "snake.yaml")]) == 2
    assert "is a rig for snake" in capsys.readouterr().err


def findings(tmp_path, bench, volts):
    emulated = bench()
    emulated.link.close()
    emulated.emulator._full_v = volts
    own = load_rig(Path(rig(tmp_path, emulated.line.path, tmp_path / "none")), "khepera")
    return [str(found) for found in examine(own, emulated.clock, tmp_path)]


def test_an_emulated_robot_is_found_healthy(tmp_path, bench):
    said = findings(tmp_path, bench, 7.9)
    for fine in ("Khepera III, firmware 2.4: 144010 units per m/s", "battery 7.90 V", "wheels at 0.000 m/s"):
        assert f"ok   {fine}" in said


def test_a_flat_battery_is_found(tmp_path, bench):
    assert any(found.startswith("BAD  the robot: the battery is at 5.0 V") for found in findings(tmp_path, bench, 5.0))


@pytest.mark.parametrize(("milliseconds", "fine"), [(1, True), (16, False)])
def test_latency_timer(milliseconds, fine):
    found = latency_of("/dev/ttyUSB0", milliseconds)
    assert found.fine == fine
    assert ("latency_timer" in found.next_step) != fine


def test_devices_that_may_not_be_used(tmp_path, monkeypatch):
    monkeypatch.setattr("os.access", lambda *_: False)
    (tmp_path / "video0").write_text("")
    [found] = cameras(tmp_path)
    assert not found.fine
    assert "usermod -aG video" in found.next_step
    assert not may_use(tmp_path / "video0", "dialout").fine


def test_no_ports_at_all(tmp_path, monkeypatch):
    monkeypatch.setattr("bns.hardware.doctor.comports", list)
    [found] = ports(Path(tmp_path))
    assert not found.fine
    assert "rfcomm bind" in found.next_step


def test_input_devices_are_listed_by_name(tmp_path):
    (none,) = remotes(tmp_path)
    assert str(none).startswith("ok   no Wii remote is paired (press 1+2 on it")
    for number, name in ((0, "Power Button"), (91, "Nintendo Wii Remote IR")):
        (tmp_path / f"event{number}" / "device").mkdir(parents=True)
        (tmp_path / f"event{number}" / "device" / "name").write_text(f"{name}\n")
    listed, paired, usable = remotes(tmp_path)
    assert str(listed) == "ok   input device /dev/input/event0: Power Button"
    assert str(paired) == "ok   input device /dev/input/event91: Nintendo Wii Remote IR"
    assert not usable.fine


def test_without_a_rig_it_says_that_no_robot_was_checked(monkeypatch, capsys):
    monkeypatch.setattr("bns.cli.commands.doctor.examine", lambda *_: [])
    assert main(["doctor"]) == 0
    assert "no robot and no tracker was checked: give --rig FILE" in capsys.readouterr().out
