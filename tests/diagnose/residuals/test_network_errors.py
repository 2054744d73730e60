"""Networks that are wrong for a planted reason: thin data, an effect that no input tells of, both, neither."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bns.cli.main import main
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.predict.networks import NetworkPredictor
from bns.diagnose.residuals.missing_inputs import Commands, find_missing_inputs
from bns.diagnose.residuals.network_errors import _commands, nearness, why_wrong
from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights
from bns.errors import DataError
from bns.measurements import write_measurements
from bns.robots import load_robot
from bns.robots.simulator import StaticSimulator, load_simulator, save_simulator
from tests.diagnose.worlds import hidden, measured

ROBOT = load_robot("khepera")
COMMANDS = 10


def slow_only(inputs):
    return (inputs[2] < 0) & (inputs[3] < 0.2)


WORLDS = {
    "plain": hidden(),
    "lag": hidden(motor_lag={"tau_s": 0.6}),
    "slope": hidden(floor_slope={"x_m_s": 0.006, "y_m_s": 0.0}),
}


@cache
def driven(world, trials, seed):
    return measured(WORLDS[world], trials, seed=seed, ends_only=True, commands=COMMANDS)


def patterns(world):
    """Inputs (5, n) and targets (3, n) of random commands in a world."""
    inputs, targets = [], []
    for _, rows in driven(world, 60, 1).groupby("trial"):
        pose = rows[["x_m", "y_m", "heading_rad"]].to_numpy()
        step, heading = np.diff(pose, axis=0), pose[:-1, 2]
        right = step[:, 0] * np.sin(heading) - step[:, 1] * np.cos(heading)
        ahead = step[:, 0] * np.cos(heading) + step[:, 1] * np.sin(heading)
        speeds = 144_010 * rows[["left_m_s", "right_m_s"]].to_numpy()[:-1]
        inputs.append(ROBOT.inputs(np.column_stack([speeds, 1e3 * np.diff(rows.t_s)])))
        targets.append(ROBOT.targets(np.column_stack([right, ahead, step[:, 2]])))
    return np.concatenate(inputs, axis=1), np.concatenate(targets, axis=1)


@cache
def trained(world, kept=None):
    """Networks trained on random commands in a world, or on those of them that ``kept`` chooses."""
    X, Y = patterns(world)
    if kept is not None:
        X, Y = np.ascontiguousarray(X[:, kept(X)]), np.ascontiguousarray(Y[:, kept(X)])
    rule = Rprop.start(initial_weights(Key(0, 1), 3, ROBOT.hidden, ROBOT.input_count), "rprop+", ROBOT.sigmoid_output)
    rule.train(X, Y, X.shape[1], 600)
    return StaticSimulator(ROBOT.networks, rule.weights, np.empty(0), {}, X)


def asked(world, networks, trials=40):
    return why_wrong(NetworkPredictor(tracks_of(driven(world, trials, 2)), networks, ROBOT))


@pytest.mark.parametrize(
    ("world", "kept", "verdict", "variable"),
    [
        ("plain", None, ("neither",), None),
        ("plain", slow_only, ("thin-data",), None),
        ("lag", None, ("inputs-cannot-know",), "wheel_difference_kept_m_s"),
        ("slope", None, ("inputs-cannot-know",), "heading_rad"),
        ("slope", slow_only, ("thin-data", "inputs-cannot-know"), "heading_rad"),
    ],
)
@pytest.mark.slow
def test_the_planted_reason_is_named(world, kept, verdict, variable):
    why = asked(world, trained(world, kept))
    assert why.verdict == verdict
    assert [one.variable for one in why.missing_inputs[:1]] == ([variable] if variable else [])
    assert sum(why.share.values()) == pytest.approx(1.0)
    assert (why.share["thin data"] > 0.8) == (kept is not None)


@pytest.mark.slow
def test_in_words_numbers_and_a_figure(tmp_path, capsys):
    networks = tmp_path / "n.safetensors"
    save_simulator(trained("slope"), networks)
    write_measurements(driven("slope", 40, 2), tmp_path / "m.csv")
    given = [str(tmp_path / "m.csv"), "--model", str(networks), "--figures", str(tmp_path / "f")]
    assert main(["compare", *given]) == 0
    said = capsys.readouterr().out
    assert "why the networks are wrong: inputs-cannot-know" in said
    assert "follows heading halfway through the command" in said
    assert (tmp_path / "f" / "network-errors.png").is_file()
    assert main(["compare", *given[:3], "--json"]) == 0
    causes = json.loads(capsys.readouterr().out)["causes"]
    assert causes["verdict"] == ["inputs-cannot-know"]
    assert causes["missing_inputs"][0]["variable"] == "heading_rad"


def test_few_commands_among_the_patterns_are_no_verdict():
    why = asked("plain", trained("plain"), trials=2)
    assert why.verdict == ("insufficient-data",)
    assert why.as_json()["share"] == {}


def test_networks_without_their_patterns_are_refused_by_name(tmp_path):
    saved = trained("plain")
    save_simulator(StaticSimulator(saved.networks, saved.weights, np.empty(0)), tmp_path / "bare.safetensors")
    with pytest.raises(DataError, match=r"come with 0 training patterns.*--save-snn"):
        asked("plain", load_simulator(tmp_path / "bare.safetensors"), trials=2)


def test_distance_is_the_mean_of_the_three_nearest_distinct_patterns():
    patterns = np.array([[0.0] * 5, [0.0] * 5, [1.0, 0, 0, 0, 0], [0, 2.0, 0, 0, 0], [9.0] * 5])
    distance, _ = nearness(np.zeros((1, 5)), patterns)
    assert distance == pytest.approx([1.0])  # 0, 1 and 2; the repeated pattern counts once


def drifting(seed, slope):
    """Commands whose error follows time by ``slope``, and nothing else."""
    rng = np.random.default_rng(seed)
    t, luck = rng.uniform(0, 1, 300), rng.normal(size=(300, 3))
    error, variables = luck + slope * (t[:, None] - 0.5), {"t": t, "u": rng.normal(size=300)}
    return Commands(np.repeat(np.arange(30), 10), np.ones(300), np.ones((300, 3)), error, variables)


def test_a_planted_variable_is_found_with_its_share_and_luck_is_not():
    named, alone, share = find_missing_inputs(drifting(0, 4.0))
    assert [one.variable for one in named] == ["t"] == [alone[0].variable]
    assert share == pytest.approx(16 / 12 / (16 / 12 + 1), abs=0.08)
    for seed in range(5):
        assert find_missing_inputs(drifting(seed, 0.0))[0] == []


@pytest.mark.parametrize(
    ("lead_s", "expected"),
    [
        (None, [0, 1, 2, 3, 4, 5]),
        ([0.0, 2.0, 2.0, 0.0, 2.0, 0.0], [0, 0, 0, 1, 1, 2]),
        ([0.0, 2.0, 2.0, 2.0, 2.0, 2.0], [0, 1, 2, 3, 4, 5]),  # of a single one there is nothing else to compare
    ],
)
def test_commands_of_pieces_of_one_trial_belong_together(lead_s, expected):
    tracks = replace(tracks_of(driven("plain", 6, 1)), lead_s=None if lead_s is None else np.array(lead_s))
    _, commands = _commands(NetworkPredictor(tracks, trained("plain"), ROBOT))
    assert commands.trial.tolist() == np.repeat(expected, COMMANDS).tolist()
