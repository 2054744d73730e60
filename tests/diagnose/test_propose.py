"""The next experiment: rivals that commands can tell apart are, those that none can are said to be; files that a trial reads."""

import json
import pickle
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.cli.main import main
from bns.cli.values import pose_of
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.design.competing_models import CompetingModel, competing_models_of, model_pairs_of, with_exact_delays
from bns.diagnose.design.discrimination import Discrimination, ExperimentSetup, discriminations
from bns.diagnose.design.independent_measurement import independent_measurements
from bns.diagnose.design.limits import arena_of, bounds_of
from bns.diagnose.design.planned import delays_of, noise_free_predictor, planned_tracks
from bns.diagnose.design.power import (
    LONGEST_MINUTES,
    ExpectedGain,
    PastTrials,
    decision_probability,
    expected_standard_errors,
    least_minutes,
    minutes_needed,
    power,
)
from bns.diagnose.design.proposal import ALIKE_RMS, ModelPair, Proposal, _expected, _power_by_minutes, propose
from bns.diagnose.design.search import Pool, select_trials
from bns.diagnose.design.sequences import (
    Arena,
    Bounds,
    Sequences,
    draw_sequences,
    extreme,
    mutate_sequences,
    short_durations,
    uniform,
)
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.proposal_text import proposal_lines, proposal_text
from bns.errors import DataError
from bns.measurements import write_measurements
from bns.physics.model import load_model
from bns.physics.wheels.differential_drive import simulate
from bns.robots import load_robot
from bns.trial.experiment import read_commands
from tests.diagnose.worlds import BASE_M, NOMINAL, hidden, measured

ARENA = Arena(-0.8, 0.8, -0.6, 0.6, (0.0, 0.0, np.pi / 2))
BOUNDS = Bounds(-0.2, 0.2, 0.4, 3.0, 12.0)
DEAD = hidden(dead_zone={"width_m_s": 0.006})


def found_in(model, **how):
    predictor = WheelPredictor(tracks_of(measured(model, **how)))
    return diagnose(predictor, NOMINAL), predictor


@pytest.fixture(scope="module")
def narrow():
    """A dead zone seen at hardly any difference of speeds: it might be a gain as well."""
    return found_in(DEAD, trials=12, ends_only=True, speeds=(0.085, 0.115), seed=4)


def path_of(plan, trial, model=NOMINAL):
    used = plan.duration_s[trial] > 0
    parts = (plan.left_m_s[trial][used], plan.right_m_s[trial][used], plan.duration_s[trial][used])
    return simulate(model, *([p] for p in parts), start=ARENA.start)[0]


@pytest.mark.parametrize("kind", [uniform, extreme])
def test_sequences_stay_inside_arena_and_bounds(kind):
    rng = np.random.default_rng(1)
    plan = draw_sequences(rng, 30, BOUNDS, ARENA, BASE_M, kind(BOUNDS))
    for one in (plan, mutate_sequences(rng, plan, BOUNDS, kind(BOUNDS))):
        used = one.duration_s > 0
        assert (np.abs(one.left_m_s) <= 0.2).all()
        assert (one.duration_s[used] >= 0.4 - 1e-9).all()
        assert (one.lasting_s <= 12.5).all()
        assert np.allclose(one.duration_s / 0.04, np.round(one.duration_s / 0.04))
    assert np.median(plan.lasting_s) > 10
    for trial in range(len(plan)):
        poses = path_of(plan, trial)
        assert ARENA.holds(poses[:, 0], poses[:, 1], 0.0).all()


def test_brief_trials_last_from_a_third_to_the_whole():
    rng = np.random.default_rng(1)
    lasts = short_durations(rng, BOUNDS, 200)
    assert 4 <= lasts.min() < 5
    assert 11 < lasts.max() <= 12
    plan = draw_sequences(rng, 200, BOUNDS, ARENA, BASE_M, uniform(BOUNDS), lasts)
    assert np.corrcoef(plan.lasting_s, lasts)[0, 1] > 0.7
    children = mutate_sequences(rng, plan, BOUNDS, uniform(BOUNDS))
    fewer = (children.duration_s > 0).sum(axis=1) < (plan.duration_s > 0).sum(axis=1)
    assert 0 < fewer.sum() < 100


def test_the_same_seed_draws_the_same_sequences_and_another_seed_others():
    a, b, c = (draw_sequences(np.random.default_rng(s), 4, BOUNDS, ARENA, BASE_M, uniform(BOUNDS)) for s in (1, 1, 2))
    assert np.array_equal(a.left_m_s, b.left_m_s)
    assert not np.array_equal(a.left_m_s, c.left_m_s)


@pytest.mark.parametrize(
    "model",
    [
        hidden(motor_lag={"tau_s": 0.1}),
        hidden(tether_pull={"anchor_x_m": 0.4, "anchor_y_m": 0.3, "pull_per_s": 0.02}),
        hidden(floor_slope={"x_m_s": 0.004, "y_m_s": -0.003}),
    ],
    ids=lambda m: m.effects[0].effect.name,
)
def test_foreseen_tracks_are_those_of_the_simulation(model):
    plan = draw_sequences(np.random.default_rng(3), 5, BOUNDS, ARENA, BASE_M, uniform(BOUNDS))
    seen = noise_free_predictor(model, planned_tracks(plan, ARENA.start, 0.04, np.zeros(5))).tracks
    for trial in range(5):
        last = seen.pose[seen.first[trial + 1] - 1]
        assert np.abs(last - path_of(plan, trial, model)[-1]).max() < 1e-3


SHARED = [
    {},
    {"wheel_mismatch": {"ratio": 1.01}},
    {"turn_slip": {"slip_s": 0.1}},
    {"dead_zone": {"width_m_s": 0.018}},
    {"motor_lag": {"tau_s": 0.12}},
]


@pytest.mark.parametrize("shared", SHARED, ids=lambda s: "".join(s) or "alone")
def test_a_late_command_and_a_late_clock_are_foreseen_alike_beside_any_effect(shared):
    """Commands that reverse at once are those of which a step of the grid between two speeds is furthest from the truth."""
    late = 0.0817  # no multiple of a step
    delayed, stamped = hidden(**shared, command_delay={"delay_s": late}), hidden(**shared, clock_offset={"offset_s": late})
    bounds = replace(BOUNDS, slowest_m_s=-0.6, fastest_m_s=0.6)
    arena = Arena(-3.0, 3.0, -3.0, 3.0, ARENA.start)
    plan = draw_sequences(np.random.default_rng(3), 12, bounds, arena, BASE_M, extreme(bounds))
    tracks = planned_tracks(plan, ARENA.start, 0.04, np.zeros(12))
    assert delays_of((delayed, stamped)) == (late,)
    exact = noise_free_predictor(delayed, tracks, delays_of((delayed, stamped)))
    apart = exact.steps(delayed).body - exact.steps(stamped).body
    # a lag goes on inside a step, and the mean of late speeds over it bends the path a little otherwise
    assert np.abs(apart).max() < (5e-5 if "motor_lag" in shared else 1e-9)
    coarse = noise_free_predictor(delayed, tracks)
    assert np.abs(coarse.steps(delayed).body - coarse.steps(stamped).body).max() > 5e-5
    again = pickle.loads(pickle.dumps(exact))
    assert np.array_equal(again.steps(delayed).body, exact.steps(delayed).body)
    assert np.array_equal(exact.driving(tracks).grid.node_s, exact.grid.node_s)


def test_a_shared_effect_does_not_make_a_delay_and_a_clock_different():
    model = hidden(turn_slip={"slip_s": 0.1}, command_delay={"delay_s": 0.0817})
    predictor = WheelPredictor(tracks_of(measured(model, trials=12)))
    stamped = hidden(turn_slip={"slip_s": 0.1}, clock_offset={"offset_s": 0.08})
    problem = problem_for(predictor, model)
    begun = [CompetingModel(tuple(a.effect.name for a in m.effects), problem.fit(m)) for m in (model, stamped)]
    problem, pair = with_exact_delays(problem, begun)
    assert pair[0].fit.loss == pytest.approx(pair[1].fit.loss, abs=0.01)
    assert begun[0].fit.loss != pytest.approx(begun[1].fit.loss, abs=0.01)
    assert with_exact_delays(problem, pair[:0]) == (problem, ())
    plan = draw_sequences(np.random.default_rng(5), 12, BOUNDS, ARENA, BASE_M, extreme(BOUNDS))
    found, _ = discriminations(pair, plan, ExperimentSetup(problem, ARENA, 0.04, lambda p: np.zeros(len(p)), ((0, 1),)))
    assert all(one.rms() < ALIKE_RMS / 2 for one in found[(0, 1)])
    assert all(one.measured.sum() > 1000 for one in found[(0, 1)])
    told = independent_measurements(*(model.effects for model in pair))
    assert any("LED" in one and "clock-offset" in one for one in told)
    assert not any("turn-slip" in one for one in told)


def test_separation_is_what_a_real_refit_leaves(narrow):
    d, _ = narrow
    a, *others = competing_models_of(d)
    b = next(one for one in others if one.names == ("camera-scale",))
    near = replace(BOUNDS, slowest_m_s=0.06, fastest_m_s=0.14)
    plan = draw_sequences(np.random.default_rng(5), 12, near, ARENA, BASE_M, uniform(near))
    setup = ExperimentSetup(d.selection.problem, ARENA, None, lambda p: np.zeros(len(p)), ((0, 1),))
    found, _ = discriminations([a, b], plan, setup)
    one = found[(0, 1)][0]
    # nothing known of the rival's numbers, all of the true ones
    free = replace(one, prior=1e-9 * np.eye(len(one.prior)), spread=np.zeros_like(one.spread))
    from bns.diagnose.estimate.fitting import Problem
    from bns.diagnose.estimate.noise import filter_for

    predictor = noise_free_predictor(a.fit.model, planned_tracks(plan, ARENA.start, None, np.zeros(12)))
    problem = Problem(
        predictor, filter_for(predictor, predictor.steps(a.fit.model), d.selection.problem.pose_filter.noise)
    )
    left = 2 * problem.fit(b.fit.model).loss
    assert free.total() == pytest.approx(left, rel=0.1)
    assert free.each().sum() == pytest.approx(free.total(), rel=0.01)
    known = replace(one, spread=free.spread)
    assert known.total() > free.total()  # what was known before helps to tell them apart
    assert one.each().sum() <= one.total() + 1e-6


def test_an_explanation_is_not_driven_apart_from_itself(narrow):
    d, _ = narrow
    a = competing_models_of(d)[0]
    plan = draw_sequences(np.random.default_rng(5), 12, BOUNDS, ARENA, BASE_M, extreme(BOUNDS))
    found, _ = discriminations(
        [a, a], plan, ExperimentSetup(d.selection.problem, ARENA, None, lambda p: np.zeros(len(p)), ((0, 1),))
    )
    assert found[(0, 1)][0].total() < 1e-3
    assert found[(0, 1)][0].each().max() < 1e-3


@pytest.mark.slow
def test_an_experiment_decides_in_half_the_time_of_random_commands(narrow):
    d, predictor = narrow
    assert d.verdict == "tie"
    arena = arena_of(predictor.tracks, (1.6, 1.2), (0.0, 0.0, np.pi / 2))
    two = replace(d, selection=replace(d.selection, competing_models=(("camera-scale",),)))
    proposal = propose(two, arena, bounds_of(predictor.tracks, NOMINAL, None), 4)
    [pair] = proposal.model_pairs
    assert {pair.first, pair.second} == {"dead-zone", "camera-scale"}
    assert not pair.indistinguishable
    assert pair.times_faster > 3
    for trial in range(len(proposal.plan)):
        poses = path_of(proposal.plan, trial, DEAD)
        assert ARENA.holds(poses[:, 0], poses[:, 1], 0.0).all()
    assert "times as long" in proposal_text(proposal)


@pytest.mark.slow
@pytest.mark.parametrize("shared", [{}, {"wheel_mismatch": {"ratio": 1.02}}], ids=["alone", "beside another"])
def test_what_is_the_same_from_outside_is_said_to_be_so(shared):
    d, predictor = found_in(hidden(**shared, command_delay={"delay_s": 0.1137}), trials=12)
    assert d.verdict == "tie"
    proposal = propose(d, arena_of(predictor.tracks, None, None), bounds_of(predictor.tracks, NOMINAL, None), 5)
    [pair] = [c for c in proposal.model_pairs if "command-delay" in c.first + c.second and "clock-offset" in c.first + c.second]
    assert pair.indistinguishable
    assert any("LED" in other for other in pair.independent_measurements)
    assert "no sequence of commands tells them apart" in proposal_text(proposal)
    assert len(proposal.plan) == 0
    assert proposal.power == 0


@pytest.mark.slow
def test_after_a_clear_verdict_only_the_accepted_one_is_contested():
    d, _ = found_in(hidden(turn_slip={"slip_s": 0.12}), trials=12, seed=2)
    competing_models = competing_models_of(d)
    assert competing_models[0].names == ("turn-slip",)
    assert len(competing_models) > 1
    proposal = propose(d, ARENA, BOUNDS, 2.0)
    assert all(pair.already_decided for pair in proposal.model_pairs)
    said = {"data": "'my log.csv'", "model": "--model khepera"}
    proposal = replace(proposal, bounds=replace(BOUNDS, robot="khepera"))
    text = proposal_text(proposal, "next one.csv", said)
    assert "No experiment is needed: these measurements tell" in text
    assert "What follows is optional" in text
    assert "to drive it (optional): bns trial --robot khepera --rig RIG.yaml --commands 'next one.csv'" in text
    driven = "--more 'results/trials/experiment-next one/measurements.csv'"
    assert text.endswith(f"then: bns diagnose 'my log.csv' --model khepera {driven}")
    elsewhere = replace(proposal, arena=replace(proposal.arena, start=(0.5, 0.2, 0.0)))
    ahead = "bns propose 'my log.csv' --model khepera --minutes 2 --start=0,0,90 -o 'next one.csv'\nwritten to next one.csv"
    assert ahead in proposal_text(elsewhere, "next one.csv", said)
    undecided = replace(proposal, model_pairs=(replace(proposal.model_pairs[0], already_decided=False),))
    assert "No experiment is needed" not in proposal_text(undecided)
    assert text.startswith("verdict so far: effects; explanations compared: turn-slip;")
    assert proposal_text(undecided).startswith("verdict so far: effects; explanations to tell apart: turn-slip;")
    assert model_pairs_of(d, competing_models) == tuple((0, i) for i in range(1, len(competing_models)))


def test_power_grows_with_trials_and_is_small_where_nothing_separates():
    old, new, none = np.zeros(10), np.full(30, 3.0), np.zeros(30)
    chances = [power(ExpectedGain(old, new[:n], old, new[:n])) for n in (2, 8, 30)]
    assert chances[0] < chances[1] < chances[2]
    assert chances[2] > 0.9
    assert power(ExpectedGain(old, none + 1e-12, old, new)) < 0.1
    both = [ExpectedGain(old, new, old, new, chance=0.7), ExpectedGain(old, none + 1e-12, old, new, chance=0.3)]
    assert 0.6 < decision_probability(both) < 0.75
    assert minutes_needed(0.0, 10, 1.0) == np.inf


def test_the_expected_difference_is_told_in_standard_errors():
    old, new = np.zeros(10), np.full(30, 3.0)
    errors = [expected_standard_errors(ExpectedGain(old, new[:n], old, new[:n])) for n in (0, 2, 8, 30)]
    assert errors[0] == 0
    assert errors == sorted(errors)
    drawn = np.random.default_rng(1).normal(1.5, np.sqrt(3.0), (4000, 30))  # what `power` draws of the new trials
    gains = np.concatenate([np.zeros((4000, 10)), drawn], axis=1)
    seen = gains.mean(axis=1) / (gains.std(axis=1, ddof=1) / np.sqrt(40))
    assert errors[3] == pytest.approx(float(np.median(seen)), rel=0.05)
    assert expected_standard_errors(ExpectedGain(old[:1], new[:0], old[:1], new[:0])) == 0


def test_an_experiment_from_which_no_decision_is_expected_is_not_offered():
    pair = ModelPair("a", "b", 0.11, 31.0, 1.0, False, False, ("film it (a)",), (), 0.62)
    none = Sequences(*(np.zeros((0, 1)) for _ in range(3)))
    p = Proposal("tie", (), (pair,), none, ARENA, BOUNDS, 2.0)
    assert pair.no_decision
    lines = proposal_lines(p)
    assert "no decision is expected from so short an experiment" in lines[0]
    assert "0.6 standard errors, and it takes 2 to decide. For a probability of 90 % it takes 31.0 min" in lines[0]
    assert lines[1] == "No trial is proposed: none is expected to decide in 2 min."
    assert not replace(pair, standard_errors=1.4).no_decision
    assert not replace(pair, already_decided=True).no_decision
    assert not replace(pair, indistinguishable=True, standard_errors=0.0).no_decision


def test_a_place_at_zero_has_no_sign():
    plan = Sequences(*(np.full((2, 3), number) for number in (0.1, 0.1, 2.0)))
    arena = replace(ARENA, start=(-1e-4, -2e-3, -1e-3))
    (said,) = proposal_lines(Proposal("none", (), (), plan, arena, BOUNDS, 2.0))
    assert "each from x = 0.00 m, y = 0.00 m, heading 0°" in said


@pytest.mark.slow
def test_too_few_minutes_give_no_trial_and_say_how_many_it_takes(narrow):
    d, predictor = narrow
    two = replace(d, selection=replace(d.selection, competing_models=(("camera-scale",),)))
    near = replace(bounds_of(predictor.tracks, NOMINAL, None), slowest_m_s=0.085, fastest_m_s=0.115)
    proposal = propose(two, arena_of(predictor.tracks, (1.6, 1.2), (0.0, 0.0, np.pi / 2)), near, 0.1)
    [pair] = proposal.model_pairs
    assert pair.no_decision
    assert len(proposal.plan) == 0
    assert pair.minutes > 0.5
    assert "no decision is expected" in proposal_text(proposal)


def test_what_counts_of_a_separation_is_what_the_diagnosis_could_tell():
    told = lambda each: float(PastTrials().effective_discrimination(np.sum(each), np.sum(np.square(each))))  # noqa: E731
    assert told([0.01] * 50) == pytest.approx(0.5, rel=0.01)  # little a trial: their sum
    assert told([1e6]) == pytest.approx(
        4, rel=0.01
    )  # one trial, however telling: a gain as large as its standard error
    assert told([1e6] * 4) == pytest.approx(16, rel=0.01)
    assert PastTrials(squares=100.0).effective_discrimination(np.array(10.0), np.array(10.0)) < told([1.0] * 10)
    assert PastTrials(scatter=3.0).effective_discrimination(np.array(10.0), np.array(10.0)) < told([1.0] * 10)


def test_short_trials_are_chosen_where_each_tells_enough_and_long_ones_where_not():
    plan = Sequences(*(np.array([[v]] * 20 + [[w]] * 20) for v, w in ((0.1, 0.1), (0.1, 0.1), (3.0, 9.0))))
    none = np.zeros((0, 0))
    for long_tells, lasting in ((2.0, 3.0), (20.0, 9.0)):
        each = np.repeat([50.0, 50.0 * long_tells] if lasting == 3.0 else [0.1, 0.1 * long_tells], 20)
        one = Discrimination(each, np.zeros((40, 0)), np.zeros((40, 0, 0)), none, none, 0, np.ones(40))
        first = select_trials(Pool(plan, {(0, 1): (one, one)}), 12.0, {(0, 1): PastTrials()})[:3]
        assert plan.lasting_s[first].tolist()[0] == lasting


def test_a_pair_without_numbers_separates_by_its_error_alone():
    none = np.zeros((0, 0))
    one = Discrimination(np.array([1.0, 2.0]), np.zeros((2, 0)), np.zeros((2, 0, 0)), none, none, 0, np.ones(2))
    assert one.total() == 3.0
    assert one.each().tolist() == [1.0, 2.0]


@pytest.mark.slow
def test_a_trial_file_is_written_that_a_trial_reads(tmp_path, capsys):
    data, out = tmp_path / "d.csv", tmp_path / "next.csv"
    write_measurements(measured(DEAD, trials=12, ends_only=True, speeds=(0.085, 0.115), seed=4), data)
    arguments = ["propose", str(data), "--model", "khepera", "--minutes", "3", "--arena", "1.6x1.2", "--start=0,0,90"]
    assert main([*arguments, "-o", str(out)]) == 0
    assert f"--commands {out}" in capsys.readouterr().out
    trials = read_commands(out, load_robot("khepera"))
    table = pd.read_csv(out)
    assert len(trials) == table["trial"].nunique()
    assert (table[["left_m_s", "right_m_s"]] >= 0.0207).all(axis=None)  # a Khepera's least speed, and what was seen
    assert table["duration_s"].sum() == pytest.approx(180, rel=0.2)
    assert main([*arguments, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["trials"] == len(trials)
    assert 0 <= told["power"] <= 1


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--minutes", "0"], "above 0"),
        (["--minutes", "nan"], "above 0"),
        (["-o", "commands.txt"], "ends in .csv"),
    ],
)
def test_what_cannot_be_asked_is_refused_before_the_work(tmp_path, more, message, capsys):
    assert main(["propose", str(tmp_path / "none.csv"), "--model", "khepera", *more]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arena", "start", "speeds", "message"),
    [
        (2, None, None, "width and height"),
        ((0.01, 3), None, None, "each above 0.1"),
        (None, (1, 2), None, "X,Y,DEGREES"),
        (None, (1, 2, np.nan), None, "X,Y,DEGREES"),
        (None, (99, 0, 0), None, "outside of the arena"),
        (None, (0, 0, 90), None, r"heading is 90 rad, more than a whole round.*in radians \(1\.571 for 90 degrees\)"),
        (None, None, (0.3, 0.1), "LOW,HIGH"),
        (None, None, "fast", "LOW,HIGH"),
    ],
)
def test_limits_that_make_no_sense_are_refused(narrow, arena, start, speeds, message):
    tracks = narrow[1].tracks
    with pytest.raises(DataError, match=message):
        (arena_of(tracks, arena, start), bounds_of(tracks, NOMINAL, speeds))


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.0), (1e-3, -1e-9)])
def test_a_robot_that_always_starts_at_the_edge_may_start_there_again(x, y):
    """Nobody chose the arena, so it includes where the trials began, and no more beyond."""
    begins = np.tile([x, y, np.pi / 2], (6, 1))
    away = np.linspace(0, 1, 50)[:, None] * [0.2, 0.9, 0.0]
    poses = np.concatenate([begin + away for begin in begins])
    tracks = SimpleNamespace(pose=poses, first=np.arange(0, 301, 50))
    arena = arena_of(tracks)
    assert arena.start == pytest.approx((x, y, np.pi / 2))
    assert (arena.x_low_m, arena.y_low_m) == pytest.approx((x - 0.05, y - 0.05), abs=1e-6)
    assert (arena.x_high_m, arena.y_high_m) == pytest.approx((x + 0.2, y + 0.9), abs=0.02)
    with pytest.raises(DataError, match="outside of the arena"):
        arena_of(tracks, None, (x, y, 0.0))


def test_no_rivals_no_experiment():
    d, predictor = found_in(NOMINAL, trials=4)
    with pytest.raises(DataError, match="insufficient-data"):
        propose(d, arena_of(predictor.tracks, None, None), bounds_of(predictor.tracks, NOMINAL, None), 5)


def test_an_arena_too_small_for_any_trial_is_refused(narrow):
    d, _ = narrow
    tight = Arena(-0.06, 0.06, -0.06, 0.06, (0.0, 0.0, 0.0))
    with pytest.raises(DataError, match="stays inside the arena"):
        propose(d, tight, Bounds(0.15, 0.2, 1.0, 3.0, 12.0), 5)


def test_measurements_of_two_files_are_taken_together(tmp_path):
    from bns.diagnose.data.load import load_measured

    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    for path, seed in ((first, 1), (second, 2)):
        write_measurements(measured(NOMINAL, trials=3, seed=seed), path)
    both, alone = load_measured(first, more=[second]), load_measured(first)
    assert both.tracks.names == ("0", "1", "2", "1-b: 0", "1-b: 1", "1-b: 2")
    assert both.digest != alone.digest
    assert np.allclose(both.tracks.pose[: len(alone.tracks.pose)], alone.tracks.pose)


def test_sequences_of_different_lengths_are_joined():
    short, long = (Sequences(*(np.ones((1, n)) for _ in range(3))) for n in (1, 3))
    assert short.joined(long).lasting_s.tolist() == [1.0, 3.0]


def test_a_robot_that_bns_cannot_drive_gets_no_command_for_it(narrow):
    """The next command is one that works: bns trial drives its own robots, as fast as they go."""
    d, predictor = narrow
    own = bounds_of(predictor.tracks, load_model("khepera"))
    assert own.robot == "khepera"
    other = bounds_of(predictor.tracks, replace(load_model("khepera"), name="differential-drive"))
    fast = bounds_of(predictor.tracks, load_model("khepera"), (-0.2, 0.9))
    assert (other.robot, fast.robot) == ("", "")
    for bounds, command in ((own, "to drive it: bns trial --robot khepera"), (other, "log them as before")):
        text = proposal_text(propose(d, ARENA, replace(bounds, trial_s=6.0), 0.5), "next.csv")
        assert command in text
        assert ("bns trial" in text) == (bounds is own)


def test_speeds_in_other_units_are_refused():
    with pytest.raises(DataError, match="above 20 m/s look like mm/s"):
        bounds_of(tracks_of(measured(NOMINAL, trials=2)), NOMINAL, (-300.0, 300.0))


@pytest.mark.parametrize(("text", "said"), [("0,0,1.57", True), ("0,0,90", False), ("0,0,0", False), ("0,0,3", False)])
def test_a_heading_that_looks_like_radians_is_said_to_be_degrees(text, said, capsys):
    assert pose_of(text)[2] == pytest.approx(np.radians(float(text.rpartition(",")[2])))
    assert ("degrees, not radians" in capsys.readouterr().err) == said


def test_power_is_told_by_the_minutes_driven_until_then():
    new, old = np.full(40, 3.0), np.zeros(5)
    both = [ExpectedGain(old, new, old, new), ExpectedGain(old, new, old, new)]
    minutes, chances = zip(*_power_by_minutes(both, np.repeat([20.0, 40.0], 20)), strict=True)
    assert (minutes[0], minutes[-1]) == (0.0, pytest.approx(20.0))
    assert (np.diff(minutes) > 0).all()
    assert chances[0] == 0.0
    assert chances[-1] == decision_probability(both)
    half = chances[minutes.index(pytest.approx(20 / 3))]  # the twenty short trials
    assert half == decision_probability([one.first(20) for one in both])


@pytest.mark.parametrize(
    ("told", "old", "worth", "times"),
    [
        (3.0, 0.0, 3.0, 0.0),  # suffices
        (1.0, 0.0, 1.0, (3.28 / 3.13) ** 2),  # expected to show 3.1 standard errors
        (0.3, 0.0, 0.3, (3.28 / 1.72) ** 2),
        (0.3, 9.0, 0.3, 0.0),  # decided already
        (0.3, -90.0, 0.3, np.inf),  # the trials so far speak against it
    ],
)
def test_a_plan_that_does_not_suffice_takes_longer_than_it_lasts(told, old, worth, times):
    new, before = np.full(40, told), np.full(12, old) + 0.01 * (np.arange(12) - 5.5)
    both = [ExpectedGain(before, new, np.full(12, 1.0), np.full(40, worth))] * 2
    minutes = least_minutes(both, np.full(40, 15.0))
    assert minutes == (pytest.approx(10.0 * times, rel=0.2) if np.isfinite(times) else LONGEST_MINUTES)
    assert (minutes > 10.0) == (times > 0.0)


def test_a_difference_that_old_trials_make_too_small_a_share_takes_more_new_ones():
    """Sure by its standard error, but a small share of what is explained in all, until enough is driven."""
    both = [ExpectedGain(np.full(100, 0.2), np.full(10, 8.0), np.full(100, 2e4), np.full(10, 80.0))] * 2
    assert decision_probability(both) < 0.1
    minutes = least_minutes(both, np.full(10, 12.0))
    trials = round(5 * minutes)
    assert 10 < trials < 1000
    assert decision_probability([e.first(trials) for e in both]) >= 0.9
    assert decision_probability([e.first(round(0.8 * trials)) for e in both]) < 0.9


def test_what_was_seen_so_far_counts_for_the_explanation_that_it_was_likelier_under():
    one, other, nothing = (
        SimpleNamespace(fit=SimpleNamespace(held_out=np.array(losses))) for losses in ([1.0, 1.0], [2.0, 1.5], [5.0, 4.0])
    )
    told, worth = (SimpleNamespace(each=lambda values=values: np.array(values)) for values in ([3.0], [7.0]))
    for_one = _expected(one, other, nothing, told, worth, scatter=2.0)
    assert (for_one.old.tolist(), for_one.worth_old.tolist()) == ([1.0, 0.5], [4.0, 3.0])
    assert (for_one.new.tolist(), for_one.worth_new.tolist(), for_one.scatter) == ([3.0], [7.0], 2.0)
    assert for_one.chance == pytest.approx(1 / (1 + np.exp(-0.75)))
    for_other = _expected(other, one, nothing, told, worth, scatter=2.0)
    assert for_other.old.tolist() == [-1.0, -0.5]
    assert for_one.chance + for_other.chance == pytest.approx(1.0)
