"""The snake's body fitted to statistics of random cycles: planted values come back, recipes are checked, files are written."""

from dataclasses import replace

import numpy as np
import pytest

from bns.cli.main import main
from bns.errors import ModelError
from bns.physics.snake.parameters import read_parameters, shipped_parameters, shipped_text
from bns.robots import load_robot
from bns.static_simulator.body_statistics import STATISTICS, Cycles, driven
from bns.static_simulator.calibrate_body import Recipe, calibrate, describe, read_recipe, shipped_recipe, with_values

ROBOT = load_robot("snake")
RECIPE = """
cycles: 14
repeated: 3
looks: 3
parameters:
  tail_mass_kg: {low: 0.05, high: 0.6, reason: weighed}
targets:
  sd_dx_yellow_m: {value: 0.1, tolerance: 0.002, derived: planted}
"""


def planted():
    """A heavy tail, and a recipe that asks for what a body with it does."""
    heavy = replace(shipped_parameters(), tail_mass_kg=0.4)
    one = read_recipe(RECIPE)
    done = driven(ROBOT, heavy, one.cycles, one.repeated, 0).statistics()[STATISTICS.index("sd_dx_yellow_m")]
    return heavy, replace(one, targets={"sd_dx_yellow_m": (float(done), 0.002)})


@pytest.fixture(scope="module")
def found():
    return calibrate(ROBOT, replace(shipped_parameters(), tail_mass_kg=0.1), planted()[1])


def test_a_planted_mass_is_found_and_told_with_its_interval(found):
    assert found.after.tail_mass_kg == pytest.approx(0.4, rel=0.25)
    assert found.before.tail_mass_kg == 0.1
    low, high = found.intervals[0]
    assert low < found.after.tail_mass_kg < high
    target = found.recipe.targets["sd_dx_yellow_m"][0]
    off = [abs(one.statistics()[1] - target) for one in (found.cycles_before, found.cycles_after)]
    assert off[1] < off[0] / 3
    assert "tail_mass_kg" in describe(found)
    assert f"{target:.3f} ± 0.002" in describe(found)


def test_found_values_are_written_with_their_basis(found):
    text = with_values(shipped_text(), found)
    assert read_parameters(text) == replace(shipped_parameters(), tail_mass_kg=float(f"{found.after.tail_mass_kg:.4g}"))
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
        (RECIPE.replace("cycles: 14", "cycles: 2"), "cycles, repeated and looks are"),
        (RECIPE.replace("looks: 3", ""), "'looks'.*it needs parameters, targets"),
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


def test_command_prints_the_table_and_writes_the_file(tmp_path, capsys):
    (tmp_path / "recipe.yaml").write_text(RECIPE.replace("cycles: 14", "cycles: 4").replace("looks: 3", "looks: 1"))
    out = tmp_path / "fitted.yaml"
    assert main(["calibrate-body", "--recipe", str(tmp_path / "recipe.yaml"), "-o", str(out), "--jobs", "1"]) == 0
    assert "sd_dx_yellow_m" in capsys.readouterr().out
    read_parameters(out.read_text())
    assert main(["calibrate-body", "--recipe", str(tmp_path / "none.yaml")]) == 2
    assert "cannot read" in capsys.readouterr().err
