"""Flexible terms that cancel one another: what they do together is said, where the robot drove, and nothing of each."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.diagnose import beside_terms
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.report.page import _of_all_terms
from bns.diagnose.residuals import together
from bns.diagnose.residuals.established import Established
from bns.diagnose.residuals.grammar import RESPONSE_OF, SURFACE
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.together import formula_in_words, said_of
from bns.diagnose.residuals.words import in_words
from bns.diagnose.select.negligible import below_noise
from bns.diagnose.select.result import SelectionResult
from bns.physics.formula import formula_effect
from tests.diagnose.worlds import NOMINAL, measured

SPEEDS = r"at (-?[\d.]+) m/s (?:with (-?\d+) °/s|straight (?:ahead|back))"


@pytest.fixture(scope="module")
def seen():
    return WheelPredictor(tracks_of(measured(NOMINAL, trials=20, seed=5, speeds=(-0.2, 0.2), straight=0.3, jitter=0.0)))


def driven(terms, **how):
    """A robot that does what the terms say."""
    table = measured(terms[0].fit.model, **{"trials": 20, "seed": 5, "speeds": (-0.2, 0.2), "straight": 0.3, "jitter": 0.0} | how)
    return WheelPredictor(tracks_of(table))


def terms_of(*written):
    """Terms (velocity, formula, numbers[, what it is a function of]) as a fit would have left them, in one model."""
    model, out = NOMINAL, []
    for i, (on, text, numbers, *_) in enumerate(written):
        effect = formula_effect(f"unlisted-{i + 1}", text, on)
        model = model.with_active(effect, tuple(numbers[p.name] for p in effect.parameters))
    for i, (on, text, numbers, *signal) in enumerate(written):
        fitted_so = {"values": numbers, "fit": SimpleNamespace(model=model), "signal": "".join(signal), "below_noise": False}
        out.append(SimpleNamespace(name=f"unlisted-{i + 1}", on=on, term=text, **fitted_so))
    return out


def where(text):
    """Forward velocity (m/s) and turn rate (rad/s) of the first place that is said."""
    v, w = re.search(SPEEDS, text).groups()
    return float(v), np.radians(float(w or 0.0))


SLOWER_IN_TURNS = ("v", "-k * v * w**2", {"k": 0.05})
UNLIKE = [(on, "k * u", {"k": k}, f"speed of the {on} wheel") for on, k in (("left", 0.05), ("right", -0.05))]
FASTER, SLOWER = ("v", "k * v", {"k": 0.3}), ("share", "k + 0 * v", {"k": -1 + 1 / 1.3})


def test_terms_that_cancel_are_said_by_their_sum_alone():
    """Faster by 30 % and slower by as much: what is left is a third term, by its formula where the sentence says."""
    terms = terms_of(FASTER, SLOWER_IN_TURNS, SLOWER)
    seen = driven(terms)
    said = said_of(terms, seen)
    sentence = next(words for words in said.sentences if words.startswith("together, the terms slow forward"))
    assert re.fullmatch(
        rf"together, the terms slow forward motion by up to [\d.]+ mm/s \({SPEEDS}\) and leave it as it is {SPEEDS}", sentence
    )
    assert "faster" not in sentence
    assert not any(in_words(term, seen) in said.sentences for term in (terms[0], terms[2]))
    assert all("only the sum of all describes the robot" in said.of_each[i] for i in (0, 2))
    v, w = where(sentence)
    expected_mm_s = 1e3 * abs(v) * 0.05 * w**2  # of 1.3 times the speed, and all of it divided by as much
    assert float(re.search(r"([\d.]+) mm/s", sentence).group(1)) == pytest.approx(expected_mm_s, rel=0.15)
    quiet = where(sentence.split(" leave it as it is ")[1])
    assert 0.05 * abs(quiet[0]) * quiet[1] ** 2 < 0.1 * expected_mm_s / 1e3


def test_terms_that_do_not_cancel_keep_their_words(seen):
    """Two wheels that differ, unlike ways of the same wheel's share; one slow in turns beside one that adds to it."""
    for written in (
        UNLIKE,
        [("v", "k * v", {"k": -0.1}), SLOWER_IN_TURNS],
        [("w", "k * w", {"k": -0.2}), ("v", "k * v", {"k": 0.1})],
    ):
        terms = terms_of(*written)
        words = tuple(in_words(term, seen) for term in terms)
        assert said_of(terms, seen) == together.Said(words, words)


@pytest.mark.parametrize(("kept", "said"), [(0.6, True), (0.4, False), (-0.5, False)])
def test_a_term_is_said_while_a_good_part_of_it_is_left(seen, kept, said):
    """The second one takes back the rest; beside it, the first would have added a tenth."""
    terms = terms_of(("v", "k * v", {"k": 0.1}), ("v", "k * v * max(sign(v), -1)**2", {"k": -0.1 * (1.0 - kept)}))
    words = in_words(terms[0], seen)
    assert (words in said_of(terms, seen).sentences) is said


@pytest.mark.parametrize(("first", "said"), [(-0.1, True), (-0.6, False)])
def test_a_term_behind_one_that_slows_turns_is_not_said_of_turns_that_it_never_sees(seen, first, said):
    """It grows with the fourth power of the turn rate: of what it would take at the commanded one, 66 % is left, or 3 %."""
    terms = terms_of(("w", "k * w", {"k": first}), ("v", "-k * v * w**4", {"k": 0.01}, SURFACE))
    assert (in_words(terms[1], seen) in said_of(terms, seen).sentences) is said


def test_a_surface_beside_an_answer_to_past_commands_can_be_said(seen):
    """The latter's formula has functions of its own."""
    late = ("w", "k * (w - ago(0, 0.1))", {"k": -0.05}, RESPONSE_OF["w"])
    terms = terms_of(("v", "k * v * moving", {"k": -0.1}, SURFACE), late)
    assert in_words(terms[0], seen) in said_of(terms, seen).sentences


def test_the_smaller_side_of_a_term_counts_unless_it_is_tiny(seen):
    """Slower forwards, faster backwards, where another term takes that back."""

    def first_is_said(ahead, back):
        one = ("v", "-k * max(v, 0) + a * min(v, 0) * -1", {"k": ahead, "a": back})
        terms = terms_of(one, ("v", "a * min(v, 0)", {"a": back}))
        return in_words(terms[0], seen) in said_of(terms, seen).sentences

    assert not first_is_said(0.1, 0.05)
    assert first_is_said(0.1, 0.01)


def test_a_patch_of_floor_is_judged_inside_it(seen):
    """Where its tail reaches, the other term is larger; there is more of that than of the patch."""
    disc = "(1 / (1 + (((x - a)**2 + (y - b)**2) / c**2)**8))"
    patch = ("v", f"k * v * {disc}", {"k": -0.5, "a": 0.1, "b": 0.0, "c": 0.1}, "place")
    terms = terms_of(patch, ("v", "k * v", {"k": 0.02}))
    assert in_words(terms[0], seen) in said_of(terms, seen).sentences
    against = terms_of(patch, ("v", f"k * v * {disc}", {"k": 0.9, "a": 0.1, "b": 0.0, "c": 0.1}, "place"))
    assert not any("0.1 m of" in words for words in said_of(against, seen).sentences)


def test_nothing_is_said_of_a_speed_that_was_hardly_driven():
    """A short command is three times as fast as all others, and the terms do most there."""
    terms = terms_of(FASTER, SLOWER, ("v", "-k * v**3", {"k": 3.0}))
    robot, quiet = terms[0].fit.model, {"jitter": 0.0, "noise": (2e-4, 1e-3)}
    table = measured(robot, trials=24, seed=3, speeds=(0.02, 0.1), **quiet)
    fast = measured(robot, trials=1, commands=1, speeds=(0.29999, 0.3), **quiet)
    table = pd.concat([table, fast[fast["t_s"] < 0.35].assign(trial=99)], ignore_index=True)
    predictor = WheelPredictor(tracks_of(table))

    def of_speed(predictor):
        said = said_of(terms, predictor).sentences
        return next(words for words in said if words.startswith("together, the terms slow forward"))

    sentence = of_speed(predictor)
    assert max(v for v, _ in map(where, re.split(" and ", sentence))) < 0.11
    more = pd.concat([table, *(table[table["trial"] == 99].assign(trial=100 + i) for i in range(12))], ignore_index=True)
    assert where(of_speed(WheelPredictor(tracks_of(more))))[0] == pytest.approx(0.3, abs=0.01)


def test_a_change_that_the_poses_do_not_show_is_not_said():
    """A curve is off between its knots: the robot is as fast as told at low speed, and the model faster; in turns it is right."""
    terms = terms_of(FASTER, SLOWER, ("v", "-k * v**3", {"k": 5.0}), ("v", "k * v * max(1 - abs(v) / 0.1, 0)", {"k": 0.3}))
    robot = terms[0].fit.model
    fits, fails = driven(terms), driven(terms_of(FASTER, SLOWER, ("v", "-k * v**3", {"k": 5.0})))
    assert robot == terms[3].fit.model

    def of_speed(predictor):
        return next(w for w in said_of(terms, predictor).sentences if w.startswith("together, the terms slow forward"))

    assert "make it faster" in of_speed(fits)
    assert "make it faster" not in of_speed(fails)


@pytest.mark.parametrize("slope", [None, {"x_m_s": 0.03, "y_m_s": 0.01}])
def test_how_far_poses_are_beyond_a_model_is_a_velocity_of_the_robot(slope):
    """Forward, to its right, and turning; what the floor adds in the world's frame is predicted, and counts for nothing."""
    added = {"v": 0.02, "s": 0.03, "w": 0.1}
    model = NOMINAL if slope is None else NOMINAL.with_effect("floor-slope", **slope)
    robot = model
    for on, size in added.items():
        robot = robot.with_active(formula_effect(f"more-{on}", "k * moving", on), (size,))
    predictor = WheelPredictor(tracks_of(measured(robot, trials=16, jitter=0.0)))
    assert predictor.conditions.seen is not None
    there = np.isfinite(predictor.conditions.seen).all(axis=-1) & (predictor.grid.step_s > 0.0)
    off, lasted_s = together._off(model, predictor, there), predictor.grid.step_s[there]
    heading = predictor.conditions.seen[..., 2][there]
    for towards in (np.cos(heading), -np.cos(heading), np.sin(heading), -np.sin(heading)):  # on average drift shows nowhere
        ahead = towards > 0.7
        assert {on: one[ahead].sum() / lasted_s[ahead].sum() for on, one in off.items()} == pytest.approx(added, rel=0.2)


def test_what_was_hardly_driven_makes_no_neighbourhood_wider():
    slow = np.linspace(-0.1, 0.1, 1000)
    alone, beside = together._cell(slow, True), together._cell(np.append(slow, [0.9] * 5), True)
    assert len(np.unique(beside[:1000])) == pytest.approx(len(np.unique(alone)), abs=1) == 11
    assert together._cell(np.zeros(3), True).tolist() == [0.0] * 3


def test_where_no_neighbourhood_was_driven_long_enough_no_place_is_said(seen, monkeypatch):
    monkeypatch.setattr(together, "DRIVEN", 0.9)
    sentences = said_of(terms_of(FASTER, SLOWER_IN_TURNS, SLOWER), seen).sentences
    sentence = next(words for words in sentences if "together" in words)
    to = r"-[\d.]+ mm/s to [+-][\d.]+ mm/s"
    assert re.fullmatch(f"together, the terms change forward velocity by {to} for 90% of the time", sentence)


@pytest.mark.parametrize(
    ("one", "said"),
    [
        ("(1 + 2 * x)", r"near \(-?\d\.\d\d, -?\d\.\d\d\) m"),
        ("exp(-tau)", r"at [\d.]+ s of a trial"),
        ("(2 + cos(heading))", r"at a heading of -?\d+°"),
    ],
)
def test_of_places_and_times_the_sum_is_said_by_place_and_time(one, said):
    terms = terms_of(("v", f"k * v * {one}", {"k": 0.3}), ("v", f"a * v * {one}", {"a": -0.15}))
    (sentence,) = said_of(terms, driven(terms)).sentences[-1:]
    assert re.match(rf"together, the terms make forward motion faster by up to [\d.]+ mm/s \({said}\)", sentence)


def test_turns_and_sideways_motion_have_words_of_their_own():
    in_turns = ("w", "k * w", {"k": 0.5}), ("w", "a * w", {"a": -0.8})
    terms = terms_of(*in_turns, ("s", "k * v", {"k": 0.5}), ("s", "a * v", {"a": -0.4}))
    turns, sideways = said_of(terms, driven(terms)).sentences[-2:]
    assert re.match(r"together, the terms slow turns by up to [\d.]+ °/s \(at ", turns)
    # a tenth of its speed, to the right forwards
    to = "together, the terms push the robot to its (right|left)"
    assert re.match(rf"{to} by up to [\d.]+ mm/s \({SPEEDS}\) and push it", sideways)
    v, _ = where(sideways)
    assert ("its right by" in sideways.split(" and ")[0]) is (v > 0.0)


def test_a_change_that_is_alike_everywhere_has_no_place():
    terms = terms_of(("v", "k * sign(v)", {"k": 0.05}), ("v", "a * sign(v)", {"a": -0.06}))
    said = said_of(terms, driven(terms)).sentences
    assert said[-1] == "together, the terms slow forward motion by 10 mm/s, nearly alike everywhere"


def test_a_velocity_that_hardly_changes_is_not_said_beside_others():
    """Both terms scale turns, too, and cancel there."""
    half = ("share", "k + 0 * v", {"k": -0.5})
    terms = terms_of(half, ("v", "k * v", {"k": 0.4}), ("w", "k * w", {"k": 0.9999}))
    said = said_of(terms, driven(terms))
    assert any("forward motion" in words for words in said.sentences)
    assert not any("turns" in words for words in said.sentences)


def test_a_term_below_the_noise_is_not_said_beside_others(seen):
    terms = terms_of(*UNLIKE)
    words = tuple(in_words(term, seen) for term in terms)
    terms[1].below_noise = True
    assert said_of(terms, seen) == together.Said((words[0], f"{words[1]} (less than the tracking noise)"), words[:1])
    terms[0].below_noise = True
    assert said_of(terms, seen).sentences == words


@pytest.mark.parametrize(
    ("without_m", "noise_m", "windows", "below"),
    [
        ((0.0014, 0.0014), 0.001, 9, True),
        ((0.0015, 0.001), 0.001, 9, False),
        ((0.001, 0.0015), 0.001, 9, False),
        ((0.0014, 0.0015), 0.001, 0, True),
        ((0.001, 0.001), float("nan"), 9, False),
    ],
)
def test_below_the_noise_is_what_adds_less_than_it_at_every_horizon(without_m, noise_m, windows, below):
    """1.4² - 1² is 0.96 of the noise's square, 1.5² - 1² is 1.25."""

    def at(error_m, windows):
        models = [SimpleNamespace(name="all", rms_m=0.001), SimpleNamespace(name="a", rms_m=error_m)]
        rms_of = {one.name: one.rms_m for one in models}.get
        return SimpleNamespace(models=models, rms_of=rms_of, noise_floor_m=noise_m, windows=windows)

    errors = SimpleNamespace(horizons={"1s": at(without_m[0], 9), "trial": at(without_m[1], windows)})
    assert below_noise(errors, ("a", "b")) == (("a",) if below else ())
    assert below_noise(None, ("a",)) == ()


def test_the_terms_of_an_outcome_are_marked(monkeypatch):
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=8)))
    problem = problem_for(predictor, NOMINAL)
    one = fitted(problem, problem.fit(NOMINAL), "v", "k * v * abs(v)", "unlisted", "speed and turn")
    two = fitted(problem, one.fit, "w", "k * w * abs(w)", "unlisted-2", "speed and turn")
    found = Established((), (replace(one, fit=two.fit), two), problem, two.fit)
    monkeypatch.setattr(beside_terms, "negligible_and_errors", lambda _: ((), "errors", {}))
    monkeypatch.setattr(beside_terms, "below_noise", lambda errors, names: names[1:] if errors == "errors" else ())
    ended = beside_terms._without_negligible(found, SelectionResult(problem, one.fit, one.fit, (), ()), predictor)
    assert [term.below_noise for term in ended.terms] == [False, True]


def test_one_term_and_a_formula_have_their_own_words(seen):
    (term,) = terms_of(FASTER)
    assert said_of([term], seen) == together.Said((in_words(term, seen),), (in_words(term, seen),))
    assert said_of([], seen) == together.Said((), ())
    assert formula_in_words(term, seen) == in_words(term, seen)
    assert formula_in_words(None, seen) == "" == formula_in_words(term, SimpleNamespace(variables=dict))


def test_all_answers_have_the_same_sentences():
    found = Diagnosis("unlisted", None, terms_in_words=("one", "another"), terms_said=("another", "together, they are slow"))
    assert found.behaviour == ("another", "together, they are slow")
    assert _of_all_terms(found) == ("together, they are slow",)
    assert replace(found, terms_in_words=()).as_json()["behaviour"] == ["another", "together, they are slow"]
    risen = SimpleNamespace(falls_in_the_end=False)
    rejected = replace(found, errors_with_terms=risen)
    assert rejected.behaviour == _of_all_terms(rejected) == ()


def turning_first(trials, seed, base_m=0.16, most_m_s=0.25):
    """Poses of a robot that gives up forward speed for its turn where a wheel would be too fast; drawn as arcs, by hand."""
    rng, rows = np.random.default_rng(seed), []
    for trial in range(trials):
        x, y, heading, t = *rng.uniform(-0.3, 0.3, 2), rng.uniform(-3, 3), 0.0
        for _ in range(8):
            v, w = rng.uniform(0.03, 0.28), rng.uniform(-2.1, 2.1) * (rng.uniform() < 0.75)
            driven = min(v, most_m_s - abs(w) * base_m / 2.0)
            for _ in range(20):
                seen = np.array([x, y, heading]) + rng.normal(size=3) * [1e-3, 1e-3, 4e-3]
                rows.append((trial, t, v - w * base_m / 2.0, v + w * base_m / 2.0, *seen))
                middle, t = heading + w * 0.025, t + 0.05
                x, y, heading = x + driven * 0.05 * np.cos(middle), y + driven * 0.05 * np.sin(middle), heading + w * 0.05
    names = ("trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad")
    return pd.DataFrame(rows, columns=names)


@pytest.mark.slow
def test_of_a_robot_that_is_never_faster_than_told_no_sentence_says_so():
    robot = replace(NOMINAL, wheelbase_m=0.16)
    found = diagnose(WheelPredictor(tracks_of(turning_first(40, 2))), robot)
    assert found.verdict == "unlisted"
    assert len(found.terms) > 1
    assert not any("faster" in words for words in found.behaviour)
    assert not any("faster" in note for note in found.notes if "behaves like this" in note)
    (sentence,) = [words for words in found.behaviour if "forward motion" in words]
    v, w = where(sentence)
    cut_mm_s = 1e3 * (v - min(v, 0.25 - abs(w) * 0.08))
    assert float(re.search(r"by up to ([\d.]+) mm/s", sentence).group(1)) == pytest.approx(cut_mm_s, rel=0.15)
    v, w = where(sentence.split(" leave it as it is ")[1])
    assert v + abs(w) * 0.08 < 0.25
