"""What of a body is tried at all, and how rough answers become comparable."""

from types import SimpleNamespace

import numpy as np
import pytest

from bns.diagnose import diagnosing
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import gathered, huber, length
from bns.diagnose.predict.responses import Responses
from bns.diagnose.select import forwards, screening
from bns.diagnose.select.forwards import Forwards
from bns.diagnose.select.result import Candidate, SelectionStep
from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.model_files import load_body

SNAKE = load_body("snake")
TRIALS, FRAMES = 24, 6


def test_one_cycle_gone_astray_counts_little_and_a_model_that_is_wrong_everywhere_in_full():
    whitened = np.random.default_rng(0).normal(size=(400, 3))
    astray = whitened.copy()
    astray[7] = (300.0, -400.0, 0.0)
    assert huber(gathered(astray)).sum() < huber(whitened).sum() + 4 * 4**2
    assert length(gathered(astray))[7] == pytest.approx(4 * np.sqrt(3))
    np.testing.assert_array_equal(np.delete(gathered(astray), 7, axis=0), np.delete(whitened, 7, axis=0))
    np.testing.assert_array_equal(gathered(whitened + 50), whitened + 50)
    np.testing.assert_array_equal(gathered(np.zeros((5, 3))), np.zeros((5, 3)))


@pytest.mark.parametrize(
    ("name", "share", "upwards", "value"),
    [
        ("torque-limit", 0.5, False, 0.1**0.5),
        ("compliance", 0.6, True, 3.0**0.6),
        ("compliance", 1.2, False, 0.3**1.2),
        ("torque-limit", 1.2, False, 0.1**1.2),
        ("torque-limit", 9.0, False, 0.05),
        ("weak-joint-joint5", 0.6, False, 0.4),
        ("joint-zero-joint5", 0.5, False, -0.2),
        ("servo-delay", 0.5, True, 0.2),
        ("dead-band", 0.2, False, -0.2 * 0.15 / 4),
    ],
)
def test_multiples_are_stepped_by_ratio_and_everything_else_by_difference(name, share, upwards, value):
    parameter = SNAKE.catalogue()[name].parameters[0]
    assert parameter.part_way(share, upwards) == pytest.approx(value)


def test_the_nodes_of_a_limit_lie_where_it_begins_to_bind():
    effect = SNAKE.catalogue()["torque-limit"]
    nodes = Responses(lambda _model: np.zeros(1), SNAKE, None, (0.2, 0.6, 1.2))._planned(effect, effect.parameters[0], -1.0)
    assert nodes == pytest.approx([0.631, 0.251, 0.063], abs=1e-3)


@pytest.mark.parametrize(
    ("name", "upwards", "nodes"),
    [
        ("joint-friction-joint5", 1.0, [0.01, 0.06, 0.18, 0.36]),
        ("joint-friction-joint5", -1.0, [-0.015, -0.045, -0.05]),
        ("dry-friction", 1.0, [0.005, 0.02, 0.06, 0.12]),
    ],
)
def test_a_curve_is_known_where_an_effect_is_looked_for_first(name, upwards, nodes):
    """A friction of 0.0083 rad lies on a straight line to 0.01, and on none to 0.06, where the joint is stuck."""
    effect = SNAKE.catalogue()[name]
    planned = Responses(lambda _model: np.zeros(1), SNAKE, None, (0.2, 0.6, 1.2))._planned(effect, effect.parameters[0], upwards)
    assert planned == pytest.approx(nodes, abs=1e-3)


PATCH = SNAKE.effect_named("floor-patch")


def test_a_patch_is_screened_where_it_may_lie_and_not_number_by_number():
    problem, base, _ = one_sided((0.3, 4.0))
    here = (0.4, 0.0, 0.35, 2.0)
    lost = base.whitened
    problem.whitened = lambda model: lost * (0.5 if model.effects[-1].values == here else 1.0)
    found = screening._scored(problem, base, PATCH, tuple(screening._ways(PATCH)))
    assert found.values == here
    assert found.gain > 0


def test_a_patch_is_read_as_the_sum_of_its_pieces_and_each_is_simulated_once():
    asked = []

    def simulate(model):
        asked.append(model)
        rough = model.plant.rough
        return np.array([sum(one.rise * (one.x_m + 1.0) for one in rough), 0.0]) / 1000

    responses = Responses(simulate, SNAKE, None, (0.2, 0.6, 1.2))
    model = SNAKE.with_active(PATCH, (0.4, 0.0, 0.35, 2.0))
    pieces = PATCH.pieces(**model.effects[0].by_name)
    expected = sum(amount * (int(piece.name.split("-")[2]) * 0.4 + 1.0) for piece, amount in pieces if amount)
    assert responses.seen(model)[0] == pytest.approx(expected / 1000)
    assert len(asked) == 1 + len(pieces)
    responses.seen(SNAKE.with_active(PATCH, (0.4, 0.0, 0.35, 0.6)))
    assert len(asked) == 1 + len(pieces)
    assert responses.anchor(model)  # the patch itself
    assert responses.seen(model)[0] == pytest.approx(np.log(2.0) * 1.4 / 1000)


def one_sided(which):
    """A problem whose residuals are what a multiple below 1 does; above 1 it does something else."""
    rng = np.random.default_rng(1)
    below, above = rng.normal(size=(2, TRIALS * FRAMES, 3))
    first = np.arange(TRIALS + 1) * FRAMES
    problem = Problem.__new__(Problem)
    problem.predictor = SimpleNamespace(tracks=SimpleNamespace(first=first))
    lost = 0.3 * below + 0.1 * rng.normal(size=below.shape)

    def whitened(model):
        value = model.effects[-1].values[0]
        return lost + ((1 - value) * below if value < 1 else (value - 1) * above)

    problem.whitened = whitened
    base = SimpleNamespace(model=SNAKE, whitened=lost, jacobian=np.zeros((*lost.shape, 0)))
    parameter = Parameter("x", "1", 0.05, 9.0, which, 1.0, "")
    return problem, base, Effect("multiple", "mechanics", (parameter,), "", "", (), lambda plant, x: plant)


def test_a_multiple_is_screened_both_ways():
    problem, base, effect = one_sided((0.3, 4.0))  # upwards it may go further, so one way alone would be that way
    upwards = screening._scored_at(problem, base, effect, (4.0**0.6,))
    both = screening._scored(problem, base, effect, tuple(screening._ways(effect)))
    assert both.gain > 10 * upwards.gain
    assert both.p_value < 1e-3
    assert both.values == (pytest.approx(0.3**0.6),)


@pytest.mark.parametrize("changed", [0.0, np.nan])
def test_an_effect_that_changes_nothing_or_cannot_be_computed_is_worth_nothing(changed):
    problem, base, effect = one_sided((0.3, 4.0))
    problem.whitened = lambda _model: base.whitened + changed
    found = screening._scored_at(problem, base, effect, (0.4,))
    assert (found.gain, found.p_value) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("name", "ways"),
    [
        ("compliance", [0.3**0.6, 3.0**0.6]),
        ("torque-limit", [0.1**0.6]),
        ("joint-zero-joint5", [0.24]),
        ("weak-joint-joint5", [0.4, 0.0]),
        ("servo-delay", [0.24, -0.01, 0.02]),
        ("dead-band", [0.09, 0.03]),
        ("joint-zero-joint0", [0.24]),
    ],
)
def test_effects_are_screened_well_inside_of_what_is_plausible_and_where_robots_reach_a_bound(name, ways):
    assert [way for (way,) in screening._ways(SNAKE.catalogue()[name])] == pytest.approx(ways)


@pytest.mark.parametrize("far", [0.2, 0.9])
def test_what_comes_near_the_best_is_worked_out_before_it_is_compared(monkeypatch, far):
    asked = []
    search = Forwards.__new__(Forwards)
    search._predictor = SimpleNamespace(anchor=lambda model: asked.append(model) or True, counted=None)
    monkeypatch.setattr(forwards, "Problem", lambda *_: SimpleNamespace(fit=lambda model: SimpleNamespace(loss=1.0, model=model)))
    search._acceptance = SimpleNamespace(candidate=lambda _problem, _fit, added, name: Candidate(name, added, None))
    rough = [Candidate(name, SimpleNamespace(loss=loss, model=name), None) for name, loss in (("a", 10.0), ("b", 100 - 90 * far))]
    out = search._worked_out(SimpleNamespace(pose_filter=None), SimpleNamespace(loss=100.0), rough)
    assert asked == (["a", "b"] if far > forwards.BEHIND else ["a"])
    assert [c.fit.loss for c in out] == ([1.0, 1.0] if far > forwards.BEHIND else [1.0, 100 - 90 * far])


def test_where_nothing_lowers_the_loss_nothing_is_worked_out():
    search = Forwards.__new__(Forwards)
    search._predictor = SimpleNamespace(anchor=lambda _model: pytest.fail("worked out"))
    rough = [Candidate(name, SimpleNamespace(loss=loss, model=name), None) for name, loss in (("a", 100.0), ("b", 101.0))]
    assert search._worked_out(None, SimpleNamespace(loss=100.0), rough) == rough


def test_a_step_of_the_search_compares_what_was_worked_out(monkeypatch):
    search = Forwards.__new__(Forwards)
    search._predictor, search._catalogue = SimpleNamespace(screening=64), dict.fromkeys("abcde")
    search._worth = {}
    gain = {"a": 100.0, "b": 90.0}

    def candidate(name, elpd):
        return Candidate(name, None, SimpleNamespace(elpd_diff=elpd))

    monkeypatch.setattr(search, "_worth_a_fit", lambda *_: list(gain), raising=False)
    monkeypatch.setattr(search, "_tried", lambda *given: candidate(given[-1], gain.get(given[-1], 0.0)), raising=False)
    search._acceptance = SimpleNamespace(earned=lambda *_: False)
    well = {"a": 50.0, "b": 95.0}
    monkeypatch.setattr(search, "_worked_out", lambda _problem, _fit, tried: [candidate(c.name, well[c.name]) for c in tried])
    step, _, _ = search._forward_step(None, SimpleNamespace(model=SNAKE), ())
    assert [(c.name, c.paired_comparison.elpd_diff) for c in step.ranking] == [("b", 95.0), ("a", 50.0)]
    assert step.of == 5


@pytest.mark.parametrize("body", [True, False])
def test_frames_gone_astray_are_bounded_for_a_body_alone(body):
    whitened = np.ones((40, 4))
    whitened[7] = 100.0
    problem = Problem.__new__(Problem)
    problem.predictor = SimpleNamespace(tracks=None, steps=lambda model: None, luck=object() if body else None)
    problem.pose_filter = SimpleNamespace(whitened=lambda tracks, steps: whitened)
    problem._counted = None
    assert np.abs(problem._worked_out(SNAKE)[7]).max() == (pytest.approx(4.0) if body else 100.0)


def chosen(found):
    return [effect.name for effect in screening.worth_a_fit(found)]


def of(name, gain, p_value=0.001):
    return screening.Screened(SimpleNamespace(name=name), gain, p_value)


def test_a_gain_is_what_the_loss_falls_by_to_the_bottom_of_its_parabola():
    """Of the loss x²·4/2 - 2·x the bottom is at 1/2, lower by 1/2; a number that does nothing gains nothing."""
    assert screening._gain(np.array([2.0]), np.array([[4.0]])) == pytest.approx(0.5)
    assert screening._gain(np.array([2.0, 0.0]), np.diag([4.0, 0.0])) == pytest.approx(0.5)


def test_only_what_is_likely_and_near_the_best_is_fitted():
    assert chosen([of("a", 10.0), of("b", 2.1), of("c", 1.9)]) == ["a", "b"]
    assert chosen([of("luck", 90.0, 0.06), of("a", 10.0), of("b", 2.1)]) == ["a", "b"]
    assert chosen([of("luck", 9.0, 0.3), of("more", 8.0, 0.4)]) == ["luck"]  # what comes nearest is shown, too
    assert chosen([]) == []
    assert len(chosen([of(str(n), 10.0) for n in range(20)])) == screening.MOST


def test_all_effects_are_screened_on_the_fewest_tracks_and_the_better_ones_on_more(monkeypatch):
    asked = {21: [], 64: [], 142: []}
    gains = {f"e{n}": float(n) for n in range(60)}
    last = SimpleNamespace(screening=None, size=21, anchor=lambda model: True, steps=lambda model: None)
    light = SimpleNamespace(screening=last, size=64, anchor=lambda model: True, steps=lambda model: None)

    def scored(few, _base, effect, ways):
        asked[few.predictor.size].append(effect.name)
        assert ways == (((0.5,), (2.0,)) if few.predictor.size == 21 else ((0.5,),))  # later at the values that did best
        chance = 0.3 if effect.name == "e58" and few.predictor.size == 64 else 0.01
        return screening.Screened(effect, gains[effect.name], chance, (0.5,))

    def problem(predictor, *_):
        noise = SimpleNamespace(noise=None)
        return SimpleNamespace(
            predictor=predictor, pose_filter=noise, fit=lambda model, rounds: SimpleNamespace(model=model)
        )

    monkeypatch.setattr(screening, "_scored", scored)
    monkeypatch.setattr(screening, "_ways", lambda _effect: [(0.5,), (2.0,)])
    monkeypatch.setattr(screening, "problem_with_noise", problem)
    effects = [SimpleNamespace(name=name) for name in gains]
    whole = problem(SimpleNamespace(screening=light, size=142))
    found = screening.screened(whole, SimpleNamespace(model=None), effects)
    assert len(asked[21]) == 60
    assert asked[64] == [f"e{n}" for n in range(59, 59 - 18, -1)]  # three tenths of all
    assert asked[142] == ["e59", *(f"e{n}" for n in range(57, 57 - 7, -1))]  # not what luck explains; at most eight
    assert found[0].effect.name == "e59"


def test_what_numbers_of_the_base_gain_on_few_tracks_is_no_effect_s_gain():
    problem, base, effect = one_sided((0.3, 4.0))
    plain = screening._scored_at(problem, base, effect, (0.4,))
    given = np.random.default_rng(3).normal(size=(*base.whitened.shape, 1))
    pulled = SimpleNamespace(model=base.model, whitened=base.whitened + 0.5 * given[..., 0], jacobian=-given)
    problem_of = problem.whitened
    problem.whitened = lambda model: problem_of(model) + 0.5 * given[..., 0]
    assert screening._scored_at(problem, pulled, effect, (0.4,)).gain == pytest.approx(plain.gain, rel=0.2)


@pytest.mark.parametrize(("of_how_many", "p_value", "hinted"), [(2, 0.05, True), (55, 0.05, False), (2, 0.02, False)])
def test_a_sign_of_too_few_trials_is_judged_by_all_effects_that_were_screened(of_how_many, p_value, hinted):
    """Of a body few standard errors are enough to be taken: what was not had another one stand for it."""
    earned = SimpleNamespace(p_value=p_value, z=2.2, elpd_diff=1.0)
    candidate = SimpleNamespace(name="clock-drift", rejected_because="", paired_comparison=earned)
    step = SelectionStep((candidate, candidate), 0.1, "", of=of_how_many)
    problem = SimpleNamespace(predictor=SimpleNamespace(luck=object()))
    found = SimpleNamespace(accepted=(), steps=(step,), nominal=SimpleNamespace(losses=np.ones(9)), problem=problem)
    assert (diagnosing._hint(found, 9) is candidate) is hinted
    assert diagnosing._hint(found, 9, {"clock-drift"}) is None  # said to lower no error: more trials are not asked for, too
