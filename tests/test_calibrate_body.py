"""The snake's body fitted to statistics of random cycles: planted values come back, recipes are checked, files are written."""

from dataclasses import replace

import numpy as np
import pytest

from bns.cli.main import main
from bns.errors import ModelError
from bns.physics.snake.parameters import read_parameters, shipped_parameters, shipped_text
from bns.robots import load_robot
from bns.static_simulator import calibrate_body
from bns.static_simulator.body_statistics import STATISTICS, Cycles, driven
from bns.static_simulator.calibrate_body import Recipe, calibrate, describe, read_recipe, shipped_recipe, with_values

ROBOT = load_robot("snake")
RECIPE = """
cycles: 40
repeated: 3
looks: 8
parameters:
  tail_mass_kg: {low: 0.05, high: 0.6, reason: weighed}
  floor_tilt_rad: {low: 0.001, high: 0.1, reason: levelled}
targets:
  sd_dx_yellow_m: {value: 0.1, tolerance: 0.002, derived: planted}
  sd_dy_m: {value: 0.1, tolerance: 0.002, derived: planted}
"""
TRUE = replace(shipped_parameters(), tail_mass_kg=0.4, floor_tilt_rad=0.02)


def slipping(robot, parameters, cycles, repeated, seed, jobs=1):
    """Cycles of a body whose heavy end moves the less, the heavier it is, and that slips along with the tilt of its floor."""
    moved = np.random.default_rng(seed).normal(0, 1, (cycles + repeated, 5))
    moved *= [0.1 / np.sqrt(parameters.tail_mass_kg), 2 * parameters.floor_tilt_rad, 0.1, 2 * parameters.floor_tilt_rad, 0]
    moved[:, 4] = 1
    return Cycles(moved[:cycles], moved[cycles:])


@pytest.fixture
def found(monkeypatch):
    monkeypatch.setattr(calibrate_body, "driven", slipping)
    one = read_recipe(RECIPE)
    does = dict(zip(STATISTICS, slipping(ROBOT, TRUE, 40, 3, 0).statistics(), strict=True))
    recipe = replace(one, targets={name: (does[name], tolerance) for name, (_, tolerance) in one.targets.items()})
    return calibrate(ROBOT, replace(TRUE, tail_mass_kg=0.1, floor_tilt_rad=0.005), recipe)


def test_planted_values_are_found_and_told_with_their_intervals(found):
    assert found.after.tail_mass_kg == pytest.approx(0.4, rel=0.05)
    assert found.after.floor_tilt_rad == pytest.approx(0.02, rel=0.05)
    assert found.before.tail_mass_kg == 0.1
    for (low, high), name in zip(found.intervals, found.recipe.ranges, strict=True):
        value = getattr(found.after, name)
        assert 0.5 * value < low < value < high < 2 * value
    told = describe(found)
    target = found.recipe.targets["sd_dx_yellow_m"][0]
    assert f"sd_dx_yellow_m     {target:.3f} ± 0.002" in told
    assert f"tail_mass_kg           0.1 -> {found.after.tail_mass_kg:.4g}" in told


def test_what_no_statistic_depends_on_is_not_claimed_to_be_known(monkeypatch):
    monkeypatch.setattr(calibrate_body, "driven", slipping)
    one = read_recipe(RECIPE.replace("tail_mass_kg", "floor_friction"))
    found = calibrate(ROBOT, replace(TRUE, floor_friction=0.2), one)
    assert found.intervals[0, 1] > 8 * found.intervals[0, 0]


def test_found_values_are_written_with_their_basis(found):
    text = with_values(shipped_text(), found)
    rounded = {name: float(f"{getattr(found.after, name):.4g}") for name in ("tail_mass_kg", "floor_tilt_rad")}
    assert read_parameters(text) == replace(shipped_parameters(), **rounded)
    assert [line.split(":")[0] for line in text.splitlines()] == [line.split(":")[0] for line in shipped_text().splitlines()]
    (line,) = [line for line in text.splitlines() if line.startswith("tail_mass_kg:")]
    assert "basis: fitted, reason: " in line


def test_statistics_by_hand():
    moved = np.zeros((4, 5))
    moved[:, 4] = [1, 1, 0, 1]
    moved[:, 0] = [0.1, -0.1, 9.0, 0.3]
    again = moved[:2] + np.array([0.02, 0, 0, 0, 0])
    share, yellow, green, dy, repeat = Cycles(moved, again).statistics()
    assert (share, yellow, green, dy) == (0.75, pytest.approx(np.std([0.1, -0.1, 0.3])), 0, 0)
    assert repeat == 0  # the median over four displacements, of which one moved
    assert np.isinf(Cycles(moved[2:3], moved[2:3]).statistics()).all()


def test_same_seed_same_cycles_and_another_seed_others():
    first, again, other = (driven(ROBOT, shipped_parameters(), 2, 1, seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(first.moved, again.moved)
    assert not np.array_equal(first.moved, other.moved)
    assert not np.array_equal(first.moved[:1], first.again)  # the same cycle under other draws


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (RECIPE.replace("tail_mass_kg", "tail_mas_kg"), "unknown parameter of the snake 'tail_mas_kg'. Did you mean"),
        (RECIPE.replace("low: 0.05", "low: 0.7"), "the range of tail_mass_kg is 0.7 to 0.6; give 0 < low < high"),
        (RECIPE.replace("sd_dx_yellow_m", "sd_x"), "unknown statistic of cycles 'sd_x'"),
        (RECIPE.replace("tolerance: 0.002", "tolerance: 0"), "sd_dx_yellow_m has tolerance 0; give one above 0"),
        (RECIPE.replace("cycles: 40", "cycles: 2"), "cycles, repeated and looks are"),
        (RECIPE.replace("looks: 8", ""), "'looks'.*it needs parameters, targets"),
        ("parameters: [", "cannot be read"),
    ],
)
def test_recipes_that_are_none_are_refused(text, message):
    with pytest.raises(ModelError, match=f"(?s){message}"):
        read_recipe(text)


def test_the_shipped_recipe_begins_within_its_ranges():
    one = shipped_recipe()
    assert isinstance(one, Recipe)
    assert set(one.targets) == set(STATISTICS)
    for name, (low, high) in one.ranges.items():
        assert low <= getattr(shipped_parameters(), name) <= high, name


def test_command_prints_the_table_and_writes_the_file(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(calibrate_body, "driven", slipping)
    (tmp_path / "recipe.yaml").write_text(RECIPE)
    out = tmp_path / "fitted.yaml"
    assert main(["calibrate-body", "--recipe", str(tmp_path / "recipe.yaml"), "-o", str(out), "--jobs", "1"]) == 0
    assert "sd_dx_yellow_m" in capsys.readouterr().out
    read_parameters(out.read_text())
    assert main(["calibrate-body", "--recipe", str(tmp_path / "none.yaml")]) == 2
    assert "cannot read" in capsys.readouterr().err
