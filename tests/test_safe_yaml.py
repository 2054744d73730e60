"""What rigs, fault plans, mappings and network files have in common: whatever is wrong in one is answered in words."""

import json
import time

import numpy as np
import pytest
from safetensors.numpy import save

from bns.diagnose.data.mapping import load_mapping
from bns.errors import BnsError, DataError, HardwareError, ModelError
from bns.hardware.emulators.faults import load_plan
from bns.hardware.rig import load_rig, parse_rig
from bns.physics.snake.parameters import read_parameters
from bns.robots.simulator import load_simulator, static_path
from bns.safe_yaml import Lines, read_yaml

BOMB = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
    f"{after}: &{after} [{','.join([f'*{before}'] * 9)}]\n" for before, after in zip("abcdefgh", "bcdefghi", strict=True)
)
BAD = {
    "bomb": BOMB,
    "deep": "a: " + "[" * 4000,
    "nul": "a: \x00",
    "list": "[1, 2]",
    "number": "3",
    "empty": "",
    "twice": "a: 1\na: 2",
}


def of_rig(path):
    load_rig(path, "khepera")


def of_parameters(path):
    read_parameters(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("read", [of_rig, load_plan, load_mapping, of_parameters])
@pytest.mark.parametrize("bad", BAD)
def test_every_reader_answers_bad_files_in_words_and_at_once(tmp_path, read, bad):
    path = tmp_path / "x.yaml"
    path.write_text(BAD[bad], encoding="utf-8")
    began = time.process_time()
    with pytest.raises(BnsError) as caught:
        read(path)
    assert 10 < len(str(caught.value)) < 1000
    assert bad != "bomb" or "keys and values with all aliases; 50000 are allowed" in str(caught.value)
    assert time.process_time() - began < 8


@pytest.mark.parametrize(("read", "error"), [(of_rig, HardwareError), (load_plan, HardwareError), (load_mapping, DataError)])
def test_files_that_are_no_text_are_named(tmp_path, read, error):
    path = tmp_path / "x.yaml"
    path.write_bytes(b"a: caf\xe9\n")
    with pytest.raises(error, match=rf"cannot read the .* {path}: it is no UTF-8 text \(byte 6\)"):
        read(path)
    with pytest.raises(error, match=r"cannot read the .*nowhere.yaml: No such file"):
        read(tmp_path.with_name("nowhere.yaml"))


def test_keys_of_yaml_1_1_stay_texts_and_1e_3_is_a_number():
    tree, lines = read_yaml("on: v\noff: yes\nx: 1e-3\nlist:\n  - a: 1\n  -\n    b: 2\n", "it", ModelError)
    assert tree == {"on": "v", "off": True, "x": 0.001, "list": [{"a": 1}, {"b": 2}]}
    assert [lines.of("x"), lines.of("list", 1, "b"), lines.of("list", 0), lines.of("gone")] == [3, 7, 5, 1]


def test_lines_are_named_once():
    _, lines = read_yaml("a: 1\nb: [1, 2]\n", "it", ModelError)
    with pytest.raises(ModelError, match=r"^line 2: wrong$"), lines.at("b"), lines.at("b", 1):
        raise ModelError("wrong")
    with pytest.raises(ModelError, match=r"^wrong$"), Lines().at("b"):
        raise ModelError("wrong")


RIG = "robot: khepera\nport: x\nsurface_m: {x: [-1, 1], y: [-1, 1]}\ntracker: {kind: wii}\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (RIG.replace("kind: wii", "kind: [1]"), "line 4: tracker is .* needs a kind"),
        (RIG.replace("[-1, 1], y", "[-.inf, 1], y"), "line 3: surface_m"),
        (RIG.replace("[-1, 1], y", "[-1, 1e400], y"), "line 3: surface_m"),
        (RIG + "lost_s: 0\n", "line 5: lost_s is 0; it must be a number above 0"),
        (RIG + "driver: 3\n", "line 5: driver is 3"),
        (RIG + "speed: 3\n", "line 5: unknown key 'speed'"),
    ],
)
def test_rigs_name_the_line(text, message):
    with pytest.raises(HardwareError, match=message):
        parse_rig(text, "rig.yaml")


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("{from: 3}", "names of columns"),
        ("{from: [a, 3, b, c], unit: quaternion}", "names of columns"),
        ("{from: a, scale: x}", "line 2: .*scale is 'x'; it must be a number"),
        ("{from: a, offset: .inf}", "offset is inf"),
        ("{from: a, clockwise: 3}", "clockwise is 3; it must be true or false"),
        ("{from: a, unit: [m]}", "unknown unit"),
        ("3", "write {from: COLUMN"),
    ],
)
def test_mappings_name_the_line(tmp_path, entry, message):
    path = tmp_path / "m.yaml"
    path.write_text(f"columns:\n  x_m: {entry}\n")
    with pytest.raises(DataError, match=message):
        load_mapping(path)


def network(header, **tensors):
    return save({name: np.asarray(value) for name, value in tensors.items()}, metadata=header)


GOOD = {"networks": ["x"], "noise_sd": [0.1], "provenance": {}}


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff" * 16,
        network({}, a=np.zeros(3, np.float32)),
        network({"bns": "3"}, a=np.zeros(3, np.float32)),
        network({"bns": "{"}, a=np.zeros(3, np.float32)),
        network({"bns": "[" * 100_000}, a=np.zeros(3, np.float32)),
        *[network({"bns": json.dumps({**GOOD, **change})}, a=np.zeros(3, np.float32)) for change in (
            {}, {"networks": 3}, {"networks": [[1]]}, {"networks": []}, {"noise_sd": "a"}, {"noise_sd": [float("nan")]},
            {"provenance": 3},
        )],
    ],
)  # fmt: skip
def test_network_files_that_are_wrong_are_answered_in_words(tmp_path, data):
    path = tmp_path / "x.safetensors"
    path.write_bytes(data)
    with pytest.raises(ModelError):
        load_simulator(path)


@pytest.mark.parametrize("change", [lambda data: data[:-3], lambda data: data[:20], lambda data: data[:8] + b"x" + data[9:]])
def test_network_files_that_are_cut_or_changed_are_named(tmp_path, change):
    path = tmp_path / "x.safetensors"
    path.write_bytes(change(static_path("khepera").read_bytes()))
    with pytest.raises(ModelError, match=str(path)):
        load_simulator(path)
