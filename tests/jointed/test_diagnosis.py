"""A robot on joints diagnosed: curves of responses, stretches, and effects planted in a robot that is no snake."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import bns
from bns.api.common.prepared import prepared
from bns.cli.main import main
from bns.diagnose import outcome
from bns.diagnose.data.bodies.cycles import checked_cycles, cycle_tracks
from bns.diagnose.data.bodies.stretches import apart, poses_of, stretches_of_cycles
from bns.diagnose.design.competing_models import competing_models_of
from bns.diagnose.design.power import PastTrials
from bns.diagnose.design.repeats import RepeatPlanner
from bns.diagnose.estimate.plausibility import at_bound, implausible
from bns.diagnose.predict import paired_errors
from bns.diagnose.predict.responses import Responses
from bns.diagnose.report.text import error_lines
from bns.errors import DataError, ModelError
from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.model_files import load_body
from bns.physics.model import ActiveEffect
from tests.hidden_snake.__main__ import judged
from tests.hidden_snake.body import Hidden
from tests.hidden_snake.worlds import World, driven
from tests.jointed.arm import JOINTS, log, xml

SNAKE = load_body("snake")


def effect(name, neutral=0.0):
    number = Parameter("x", "1", -10.0, 10.0, (-1.0, 1.0), neutral, "")
    return Effect(name, "mechanics", (number,), "", "", (), lambda plant, x: plant)


A, B = effect("a"), effect("b")


def bent(model):
    """Points that go by x_a, its square, and both numbers' product; ``calls`` counts."""
    bent.calls += 1
    x = {active.effect.name: active.values[0] for active in model.at("mechanics")}
    a, b = x.get("a", 0.0), x.get("b", 0.0)
    return np.array([a, 0.01 * a * a, 0.01 * a * b, b]) / 100


def test_responses_are_exact_at_nodes_and_anchors_and_ask_for_few_simulations():
    bent.calls = 0
    bare = replace(SNAKE, effects=())
    responses = Responses(bent, bare, None, (0.5, 1.0))

    def seen(**values):
        active = tuple(ActiveEffect({"a": A, "b": B}[name], (value,)) for name, value in values.items())
        return responses.seen(replace(bare, effects=active)), replace(bare, effects=active)

    for value in (0.1, 0.3, 0.5, 1.0, 0.7, -0.2):
        got, model = seen(a=value)
        assert got[0] == pytest.approx(value / 100)
        assert got[1] == pytest.approx(bent(model)[1], abs=2e-5)
    both, model = seen(a=1.0, b=1.0)
    assert both[2] == 0.0  # curves do not know that numbers act on each other
    responses.anchor(model)
    assert seen(a=1.0, b=1.0)[0] == pytest.approx(bent(model))
    before = bent.calls
    seen(a=0.6, b=0.9)
    responses.anchor(seen(a=1.01, b=1.0)[1])
    assert bent.calls == before  # read between nodes; the model near an anchor is not simulated again


def test_a_model_of_one_number_that_was_simulated_bends_its_curve():
    bare = replace(SNAKE, effects=())
    bent.calls = 0

    def off(responses, value):
        model = replace(bare, effects=(ActiveEffect(A, (value,)),))
        return abs(responses.seen(model)[1] - bent(model)[1])

    straight, refined = Responses(bent, bare, None, (0.5, 1.0)), Responses(bent, bare, None, (0.5, 1.0))
    for value in (0.7, 0.75, 0.8):
        assert off(straight, value) > 1e-6
    assert refined.anchor(replace(bare, effects=(ActiveEffect(A, (0.75,)),)))
    assert off(refined, 0.75) == pytest.approx(0.0, abs=1e-12)
    for value in (0.7, 0.8):
        assert off(refined, value) < 0.3 * off(straight, value)
    before = set(refined._curves["a", "x"])
    assert {0.65, 0.85} <= before  # a twentieth of what is plausible to either side
    refined.anchor(replace(bare, effects=(ActiveEffect(A, (0.77,)),)))
    assert set(refined._curves["a", "x"]) == before  # too near to others for its slope to mean anything
    assert off(refined, 0.77) == pytest.approx(0.0, abs=1e-12)


def test_distances_of_multiples_go_by_ratio():
    stiffness, offset = (SNAKE.catalogue()[name].parameters[0] for name in ("compliance", "joint-zero-joint5"))
    assert stiffness.apart(0.3, 3.0) == pytest.approx(1.0)
    assert stiffness.apart(0.6, 0.3) == pytest.approx(stiffness.apart(1.0, 2.0))
    assert offset.apart(-0.4, 0.4) == pytest.approx(1.0)
    assert offset.apart(0.1, 0.3) == pytest.approx(offset.apart(0.2, 0.0))
    for p, value in ((stiffness, 0.7), (offset, 0.1)):
        for share in (0.05, -0.05):
            there = p.beside(value, share)
            assert p.apart(value, there) == pytest.approx(0.05)
            assert (there > value) == (share > 0)
    assert stiffness.beside(5.9, 0.5) == 6.0


@pytest.mark.parametrize(("value", "nodes"), [(0.02, 1), (-0.75, 2), (9.97, 1)])
def test_curves_are_not_refined_across_neutral_or_beyond_a_bound(value, nodes):
    bent.calls = 0
    refined = Responses(bent, replace(SNAKE, effects=()), None, (0.5, 1.0))
    refined.anchor(replace(SNAKE, effects=(ActiveEffect(A, (value,)),)))
    assert len(refined._curves["a", "x"]) == nodes


def test_a_silent_joint_may_be_found_and_other_bounds_stay_bounds():
    silent, stopped = SNAKE.effect_named("weak-joint-joint5").parameters[0], effect("a").parameters[0]
    for parameter, value, rejected in ((silent, 0.0, False), (silent, 1.0, True), (stopped, -10.0, True)):
        free = (SimpleNamespace(effect="e", parameter=parameter),)
        fit = SimpleNamespace(free=free, values=[value], interval=lambda index: (-np.inf, np.inf))
        assert at_bound(fit, "e") is rejected
        assert bool(implausible(fit, "e")) is rejected


def test_distances_hold_what_a_pose_does_not():
    points = np.array([[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]], [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]])
    assert apart(points) == pytest.approx(np.array([[2**0.5, 2, 2**0.5], [1, 2, 1]]))
    assert poses_of(points)[:, 2].tolist() == [0.0, 0.0]
    assert apart(points[:, :1]).shape == (2, 0)


@pytest.fixture(scope="module")
def camera():
    return cycle_tracks(checked_cycles(driven(World("x", "none", Hidden(), ()), 1, 3, 3, camera=True))[0])


def test_frames_between_the_ends_of_a_cycle_become_frames_of_its_stretch(camera):
    stretches = stretches_of_cycles(camera, SNAKE.mechanism, 12)
    counts = np.bincount(stretches.stretch)
    assert len(counts) == camera.stable.sum()
    assert (counts > 5).all()
    assert stretches.timed
    assert not np.isfinite(stretches.since_s[stretches.ends]).any()
    assert (stretches.since_s[stretches.begins] == 0).all()
    last = stretches.of(np.array([len(counts) - 1]))
    assert len(last) == 1
    assert len(last.t_s) == counts[-1]
    assert last.names == (camera.names[camera.trial[2 * np.flatnonzero(camera.stable)[-1]]],)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    file = tmp_path_factory.mktemp("arm") / "arm.xml"
    file.write_text(xml())
    return file


@pytest.mark.slow
def test_a_sound_arm_lacks_nothing(arm):
    found = bns.diagnose(log(12, seed=1), bns.Model(arm))
    assert (found.verdict, found.effects) == ("none", ())


def test_the_noise_of_a_body_is_said_to_come_from_distances():
    tracked = SimpleNamespace(tracking=(0.0015, 0.007))
    noise = paired_errors._noise_of(tracked)
    said = list(error_lines(paired_errors.PairedErrors({}, noise, 1)))[-1]
    assert "1.50 mm per pose, estimated from distances between tracked points" in said


@pytest.mark.parametrize("clocks", [False, True])
def test_effects_may_be_negligible_where_trials_have_no_clocks_of_their_own(monkeypatch, clocks):
    found = ("floor-slope", "tether-pull"), {"drag": ()}
    monkeypatch.setattr(outcome, "negligible_and_errors", lambda selection: (found[0], "errors", found[1]))
    monkeypatch.setattr(outcome, "seen_in_heading", lambda errors, names: dict.fromkeys(names, errors))
    model = SimpleNamespace(per_trial_effect="clock-offset" if clocks else None)
    selection = SimpleNamespace(fit=SimpleNamespace(model=model), accepted=("floor-slope", "tether-pull", "drag", "weak-joint"))
    assert outcome._negligible(selection) == (((), {}, {}) if clocks else (*found, {"weak-joint": "errors"}))


@pytest.fixture(scope="module")
def bent_arm(arm):
    return bns.diagnose(log(12, seed=1, zero_rad=0.08), bns.Model(arm))


@pytest.mark.slow
def test_a_joint_of_an_arm_whose_zero_is_off_is_named(bent_arm):
    assert (bent_arm.verdict, bent_arm.effects) == ("effects", ("joint-zero-elbow",))
    assert bent_arm.diagnosis.numbers["joint-zero-elbow"]["offset_rad"]["value"] == pytest.approx(0.08, abs=0.005)


@pytest.mark.slow
def test_a_weak_joint_of_an_arm_is_named_with_its_strength(arm):
    found = bns.diagnose(log(12, seed=2, strength=0.5), bns.Model(arm))
    assert found.effects == ("weak-joint-elbow",)
    assert found.diagnosis.numbers["weak-joint-elbow"]["strength"]["value"] == pytest.approx(0.5, abs=0.05)


@pytest.mark.slow
def test_an_offset_is_added_by_the_command_line_and_read_back(arm, tmp_path, capsys):
    data, out = tmp_path / "log.csv", tmp_path / "mended.yaml"
    log(8, seed=3, zero_rad=0.08).to_csv(data, index=False)
    assert main(["add", str(data), "joint-zero-elbow", "--model", str(arm), "-o", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["parameters"]["joint-zero-elbow"]["offset_rad"]["value"] == pytest.approx(0.08, abs=0.004)
    before = prepared(data, str(arm))
    after = bns.compare(data, bns.Model(out)).errors["position_m"]
    assert after["stretch"] < 0.5 * bns.compare(data, before.model).errors["position_m"]["stretch"]


@pytest.mark.slow
def test_an_experiment_repeats_the_stretches_that_tell_most(bent_arm, tmp_path):
    proposed = bent_arm.propose(minutes=1)
    assert proposed.proposal.competing_models[0].names == ("joint-zero-elbow",)
    written = pd.read_csv(proposed.to_csv(tmp_path / "next.csv"))
    assert list(written.columns) == ["trial", "t_s", *(f"{j}_set_rad" for j in JOINTS)]
    assert written["trial"].nunique() == len(proposed.proposal.plan) == proposed.to_json()["trials"]
    lasting = proposed.proposal.plan.lasting_s
    assert lasting.sum() < 60 + lasting.max()
    assert (np.abs(written[f"{JOINTS[1]}_set_rad"]) <= 1.2).all()
    assert "what was driven before" in proposed.summary(str(tmp_path / "next.csv"))
    assert proposed.plot().get_xlabel() == "ahead (cm)"


@pytest.mark.slow
def test_what_is_planned_tells_more_than_stretches_by_lot(bent_arm):
    d = bent_arm.diagnosis
    models = competing_models_of(d)
    planner = RepeatPlanner(d.selection.problem, ((0, 1),))
    best = planner.best(np.random.default_rng(0), models, 60.0, {(0, 1): PastTrials()})
    by_lot = planner.random(np.random.default_rng(0), models, len(best.plan))
    totals = [sum(one.total() for one in pool.discriminations[0, 1]) for pool in (best, by_lot)]
    assert totals[0] > 1.1 * totals[1]


@pytest.mark.slow
def test_limits_of_wheels_are_refused_for_a_body(bent_arm):
    with pytest.raises(DataError, match="for wheels"):
        bent_arm.propose(arena=(2.0, 2.0))


@pytest.mark.slow
def test_a_body_has_a_report_with_an_experiment(bent_arm, tmp_path):
    page = bent_arm.report(tmp_path / "report.html", minutes=1).path.read_text()
    for said in ("joint-zero-elbow", "shoulder_set_rad", "what was driven before", "bns propose"):
        assert said in page
    assert "bns trial" not in page


def test_networks_of_the_snake_are_named_apart_from_its_body(tmp_path):
    with pytest.raises(ModelError, match="holds networks"):
        bns.diagnose(tmp_path / "none.csv", "snake-networks")


@pytest.mark.parametrize(
    ("right", "verdict", "explanations", "good"),
    [
        (("a",), "effects", [["a"]], True),
        (("a",), "effects", [["a", "b"]], False),
        (("a",), "tie", [["b"], ["a"]], True),
        (("a",), "unlisted", [["a"]], False),
        ((), "none", [[]], True),
        ((), "effects", [["a"]], False),
    ],
)
def test_answers_are_judged_by_what_was_hidden(right, verdict, explanations, good):
    world = World("w", "single" if right else "none", Hidden(), right)
    assert judged(world, {"verdict": verdict, "effects": [], "explanations": explanations}) is good
