"""The static simulator is trained on part of what it is verified without, and comes out the same twice."""

import numpy as np
import pytest

from bns.engine.philox import Key
from bns.errors import ModelError
from bns.robots import load_robot
from bns.robots import simulator as files
from bns.static_simulator import train as pre
from bns.worlds import build_world


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(pre, "TRIALS", 24)
    monkeypatch.setattr(pre, "ROUNDS", 2)
    monkeypatch.setattr(pre, "ITERATIONS", 100)


@pytest.fixture
def robot():
    return load_robot("khepera")


def test_same_seed_same_bytes_and_another_seed_others(quick, robot, tmp_path):
    written = []
    for name, seed in (("a", 0), ("b", 0), ("c", 1)):
        files.save_simulator(pre.precompute(robot, build_world("physics", robot), seed), tmp_path / name)
        written.append((tmp_path / name).read_bytes())
    assert written[0] == written[1]
    assert written[0] != written[2]


def test_whole_trials_are_held_out(quick, robot):
    patterns = pre.collect(robot, build_world("physics", robot), Key.of_run(0, 0, "khepera", "precompute"))
    by_trial = patterns.verification.reshape(24, pre.COMMANDS)
    assert (by_trial.all(axis=1) | ~by_trial.any(axis=1)).all()
    assert 0 < by_trial[:, 0].sum() < 12


def test_noise_is_the_spread_of_the_residuals_on_verification_patterns(quick, robot):
    world = build_world("physics", robot)
    simulator = pre.precompute(robot, world)
    patterns = pre.collect(robot, world, Key.of_run(0, 0, "khepera", "precompute"))
    residuals, accuracy = pre.verify(robot, simulator.weights, patterns)
    assert len(residuals) == simulator.provenance["verification_patterns"]
    np.testing.assert_allclose(simulator.noise_sd, residuals.std(axis=0))
    assert accuracy == simulator.provenance["accuracy"]


def test_perfect_predictions_are_called_so(quick, robot):
    patterns = pre.collect(robot, build_world("physics", robot), Key.of_run(0, 0, "khepera", "precompute"))
    weights = pre.precompute(robot, build_world("physics", robot)).weights
    outputs = pre.predict(weights, np.ascontiguousarray(patterns.inputs))
    _, accuracy = pre.verify(robot, weights, pre.Patterns(patterns.inputs, outputs, patterns.verification))
    for got in accuracy.values():
        assert got["r2"] == pytest.approx(1)
        assert got["slope"] == pytest.approx(1)


def test_missing_simulator_says_which_command_makes_it(monkeypatch, tmp_path):
    monkeypatch.setattr(files, "static_path", lambda robot: tmp_path / "none.safetensors")
    files.load_static_simulator.cache_clear()
    with pytest.raises(ModelError, match="bns precompute --robot khepera"):
        files.load_static_simulator("khepera")
    files.load_static_simulator.cache_clear()


def test_other_files_are_refused(tmp_path):
    (tmp_path / "text.safetensors").write_text("hello")
    with pytest.raises(ModelError, match=r"text\.safetensors is no safetensors file"):
        files.load_simulator(tmp_path / "text.safetensors")
    from safetensors.numpy import save_file

    save_file({"a": np.zeros(3)}, str(tmp_path / "foreign.safetensors"))
    with pytest.raises(ModelError, match="does not say which networks"):
        files.load_simulator(tmp_path / "foreign.safetensors")
