"""What a note advises follows from the errors at every horizon."""

import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

import bns.api.diagnose as asked_of
import bns.diagnose.diagnosis as said_by
from bns.api.diagnose import DiagnoseResult
from bns.cli.commands.diagnose import _which
from bns.diagnose.caveats import (
    _on_odd_numbers,
    _on_reach,
    _on_rejected,
    _on_rest,
    _on_terms,
    _on_undescribed,
    notes_on,
)
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.effect_caveats import _on_drift, _on_times, implausible_texts, on_effects, on_moved
from bns.diagnose.estimate.parameters import FreeParameter
from bns.diagnose.estimate.smoothing_tracker import SmoothingTracker
from bns.diagnose.predict.paired_errors import Change, HorizonErrors, ModelError, PairedErrors
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.along_variables import ResidualDependence
from bns.diagnose.residuals.unexplained import NOTHING, Unexplained
from bns.diagnose.residuals.worst_in_words import on_worst
from bns.diagnose.residuals.worst_trials import Apart, WithoutWorst
from bns.physics.effects import all_effects, effect_named
from tests.diagnose.worlds import NOMINAL, all_but_rivals_of, measured

MODELS = (SimpleNamespace(rms_m=0.1), SimpleNamespace(rms_m=0.1))


@pytest.mark.parametrize(
    ("rose", "medians", "fell", "said"),
    [
        (("trial",), (), ("command", "1s"), "rises over the whole trial, though it falls over one command and 1 second"),
        (("5s", "trial"), (), (), "rises over 5 seconds and the whole trial. So something else happens, and the extended model"),
        (("1s",), (), ("1s",), "With it the error on held-out trials rises over 1 second. So"),
        (
            ("1s",),
            ("1s",),
            ("1s", "5s"),
            "the error on held-out trials has a higher median over 1 second (most windows are predicted worse), though its root "
            "mean square falls over 5 seconds. So",
        ),
        (
            ("1s", "trial"),
            ("1s",),
            ("5s",),
            "rises over the whole trial and has a higher median over 1 second (most windows are predicted worse), though it",
        ),
        ((), (), (), "With it the error on held-out trials does not fall where its change is surest, so"),
    ],
)
def test_a_term_with_which_an_error_rises_must_not_be_added(rose, medians, fell, said):
    errors = SimpleNamespace(rose_in_the_end=rose, median_rose_in_the_end=medians, fell_in_the_end=fell)
    assert said in _on_rejected(["it slows down"], errors)


def test_an_effect_that_no_robot_has_with_such_numbers_is_told_unless_it_is_a_simpler_one():
    scrub = effect_named("scrub-friction")

    def tried(value, gain, why):
        model = SimpleNamespace(effects=[SimpleNamespace(effect=scrub)])
        fit = SimpleNamespace(free=(FreeParameter("scrub-friction", scrub.parameters[2]),), values=[value], model=model)
        earned = SimpleNamespace(elpd_diff=gain)
        return SimpleNamespace(name="scrub-friction", fit=fit, rejected_because=why, paired_comparison=earned)

    def said(one, accepted=()):
        nominal = SimpleNamespace(losses=np.full(20, 100.0))
        step = SimpleNamespace(ranking=(one,))
        return list(_on_odd_numbers(SimpleNamespace(steps=[step], nominal=nominal, accepted=accepted)))

    (note,) = said(tried(5.0, 50.0, "width_rad_s is at its bound, 5 rad/s"))
    assert note.startswith("scrub-friction would lower the error, but is no explanation: fitted, width_rad_s is at its bound")
    assert not said(tried(0.0, 50.0, "width_rad_s is at its bound, 0 rad/s"))
    assert not said(tried(5.0, 50.0, ""))
    assert not said(tried(5.0, 1e-3, "width_rad_s is at its bound, 5 rad/s"))
    assert not said(tried(5.0, 50.0, "width_rad_s is at its bound, 5 rad/s"), accepted=("motor-lag",))


def test_an_error_that_may_have_changed_by_luck_neither_fell_nor_rose():
    changes = {"command": Change(-0.01, -0.02, -0.005), "1s": Change(-0.01, -0.02, 0.01), "trial": Change(0.1, 0.05, 0.2)}
    each = {h: SimpleNamespace(total=None, changes=(change,), models=MODELS) for h, change in changes.items()}
    errors = PairedErrors(each, None, 20)
    assert (errors.fell_in_the_end, errors.rose_in_the_end) == (("command",), ("trial",))
    assert not errors.median_rose_in_the_end
    each["1s"] = SimpleNamespace(total=None, changes=(Change(-0.01, -0.02, 0.01, median_rose=True),), models=MODELS)
    each["trial"] = SimpleNamespace(total=None, changes=(Change(0.1, 0.05, 0.2, median_rose=True),), models=MODELS)
    assert errors.median_rose_in_the_end == ("1s",)
    assert errors.rose_in_the_end == ("1s", "trial")


@pytest.mark.parametrize(
    ("changes", "falls"),
    [
        (((-0.01, -0.02, -0.005), (0.01, -0.02, 0.03)), True),  # the surest one falls
        (((-0.01, -0.02, -0.005), (0.02, 0.01, 0.03)), False),  # one certainly rises
        (((0.001, -0.0003, 0.0025), (-0.0002, -0.0006, 0.0002)), False),  # the surest one does not fall
    ],
)
def test_terms_stand_where_the_error_falls_from_the_effects_to_them(changes, falls):
    large = Change(-1.0, -1.1, -0.9)
    each = {str(i): SimpleNamespace(changes=(large, Change(*one)), models=MODELS) for i, one in enumerate(changes)}
    errors = PairedErrors(each, None, 20)
    assert errors.falls_in_the_end is falls
    selection = SimpleNamespace(problem=None)
    found = Diagnosis("unlisted", selection, terms=("a term",), terms_in_words=("slower",), errors_with_terms=errors)
    assert found.terms_rejected is not falls
    assert found.behaviour == (("slower",) if falls else ())


@pytest.mark.slow
def test_a_measured_number_that_the_data_contradict_is_said_to():
    truth = NOMINAL.with_effect("wheelbase", factor=1.06).with_effect("motor-lag", tau_s=0.2)
    predictor = WheelPredictor(tracks_of(measured(truth, trials=14, seed=2)))
    for tau_s, said in ((0.1, True), (0.2, False)):
        given = NOMINAL.with_effect("motor-lag", basis="measured", reason="on the bench", tau_s=tau_s)
        found = diagnose(predictor, given, barred=all_but_rivals_of("wheelbase", "motor-lag"))
        assert found.effects == ("wheelbase",)
        about = [note for note in found.notes if note.startswith("motor-lag was measured (tau_s = 0.1 s); its param")]
        assert bool(about) == said
        assert not said or "The interval does not contain the number that was given." in about[0]


@pytest.mark.parametrize(
    ("changes_mm", "falls"),
    [
        ([(-14.0, -17.0, -12.0), (0.3, 0.1, 0.5)], True),  # 0.3 of 40 mm, where the trials end at rest
        ([(-14.0, -17.0, -12.0), (1.0, 0.5, 2.0)], False),
        ([(-3.0, -9.0, 0.1), (1.0, -2.0, 4.0)], True),  # undecided, as where trials went wrong: the surest decides
        ([(-1.0, -9.0, 8.0), (3.0, -1.0, 7.0)], False),
        ([(-3.0, np.nan, np.nan), (0.3, np.nan, np.nan)], True),  # too few trials for an interval
        ([(-3.0, np.nan, np.nan), (1.0, np.nan, np.nan)], False),
        ([(np.nan, np.nan, np.nan)], False),
    ],
)
def test_an_error_falls_where_that_is_surest_and_rises_nowhere_by_what_matters(changes_mm, falls):
    before = ModelError("as given", 0.04, 0.03, 0.05, 0.03, 0.1)
    horizons = {
        str(n): HorizonErrors(str(n), 20, 0, (before, before), (), Change(*(1e-3 * v for v in change)), 0.001)
        for n, change in enumerate(changes_mm)
    }
    assert PairedErrors(horizons, None, 20).falls == falls


@pytest.mark.parametrize(
    ("change", "low", "high", "added"), [(0.01, 0.001, 0.02, False), (0.01, -0.001, 0.02, False), (-0.01, -0.02, 0.001, True)]
)
def test_terms_with_which_the_error_does_not_fall_are_in_no_extended_model(monkeypatch, change, low, high, added):
    """The fits are mocked: with the term the gain is 0.8, without it 0.9."""
    fits = {name: SimpleNamespace(model=name, free=()) for name in ("without", "with")}
    monkeypatch.setattr(said_by, "numbers_of", lambda fit: {"speed-gain": 0.8 if fit is fits["with"] else 0.9})
    monkeypatch.setattr(asked_of, "documented", lambda fit, *_: fit.model)
    monkeypatch.setattr(asked_of, "Model", lambda model: model)
    errors = PairedErrors({"trial": SimpleNamespace(total=None, changes=(Change(change, low, high),), models=MODELS)}, None, 20)
    found = Diagnosis(
        "unlisted", SimpleNamespace(fit=fits["without"], accepted=("speed-gain",)), errors_with_terms=errors,
        terms=(SimpleNamespace(fit=fits["with"], name="unlisted", signal="speed"),),
    )  # fmt: skip
    result = DiagnoseResult(SimpleNamespace(model=None, measured=None, predictor=None), found)
    assert found.numbers == {"speed-gain": 0.8 if added else 0.9}
    assert result.extended == ("with" if added else "without")


@pytest.mark.parametrize(
    ("trials", "same", "said"),
    [
        (("7",), True, "trial 7. It does not count in the fits, but is part of the errors shown; the verdict is the same"),
        (("7",), False, "with it the verdict would be tie (clock-offset)"),
        (("7", "9"), False, "trials 7, 9. They do not count in the fits, but are part of the errors shown; with them the"),
    ],
)
def test_trials_that_are_left_out_are_one_or_several(trials, same, said):
    effects = ("clock-offset",)
    assert said in on_worst(WithoutWorst(trials, ("tie", effects), ("tie" if same else "effects", effects)))


MOMENT = SimpleNamespace(when="at 3.10 s, near (0.20, 0.10) m: moved 60 mm, predicted 0 mm")


@pytest.mark.parametrize(
    ("share", "jumped", "verdict", "said", "unsaid"),
    [
        (0.97, False, "effects", ["97% of the excess from one moment: at 3.10 s", "a command that the log has at"], "throughout"),
        (0.97, True, "effects", ["from one moment, where the tracker jumps: at 3.10 s"], "a push"),
        (0.1, False, "effects", ["spread over the trial", "repeat it with the same commands"], "a push"),
        (0.1, False, "unlisted", ["may be one in which this matters most"], "repeat it"),
    ],
)
def test_a_trial_unlike_the_rest_is_described_and_no_cause_is_named_that_the_data_exclude(share, jumped, verdict, said, unsaid):
    one = Apart("7", 2.2, share, MOMENT, jumped)
    note = on_worst(WithoutWorst(("7",), (verdict, ()), (verdict, ()), (one,)))
    assert note.startswith("Unlike all others as a whole: trial 7 (2.2 times the loss per pose of the median trial, ")
    assert all(text in note for text in said)
    assert unsaid not in note
    assert note.endswith("`--without` excludes it.")


@pytest.mark.parametrize(("moments", "said"), [(9, "too often for accidents: look for what they share"), (2, "else something")])
def test_moments_are_accidents_only_where_they_are_few(moments, said):
    outlier = SimpleNamespace(in_words="trial 7 at 3.10 s")
    rest = Unexplained((), None, (outlier,) * moments)
    (note,) = _on_rest(rest, range(20))
    assert f"{moments} of 20 trials have moments" in note
    assert said in note


def test_what_is_left_is_said_in_words():
    chance = SimpleNamespace(p_value=5e-5)
    left = [ResidualDependence("wheel_difference_m_s", "yaw_rad_s", chance, 0.083)]
    left.append(ResidualDependence("place", "share_of_motion", chance, 0.02))
    (note,) = _on_rest(Unexplained(tuple(left), None, ()), range(20))
    assert "turn rate along commanded difference, right − left (8.30%), the whole motion along place (2.00%); p < 0.0001" in note


def test_an_offset_of_the_marker_may_be_the_robots():
    model = SimpleNamespace(per_trial_effect=None, effects=(), catalogue=all_effects)
    selection = SimpleNamespace(
        accepted=("camera-scale", "marker-offset"), competing_models=(), steps=(), fit=SimpleNamespace(model=model, free=())
    )
    tracks = SimpleNamespace(extra={}, start_known=False, commands_at_poses_s=None, timed=False)
    camera, marker = list(on_effects(selection, tracks))[:2]
    assert camera == "camera-scale is an error of the measurement, not of the robot."
    assert marker.startswith("marker-offset is an error of the measurement, or else one of the model of the robot: ")


@pytest.mark.parametrize("imitating", [(), ("backlash",)])
def test_what_an_effect_takes_for_granted_is_said_also_where_it_seems_to_imitate(imitating):
    model = SimpleNamespace(per_trial_effect=None, effects=(), catalogue=all_effects)
    accepted = () if imitating else ("backlash",)
    selection = SimpleNamespace(accepted=accepted, competing_models=(), steps=(), fit=SimpleNamespace(model=model, free=()))
    tracks = SimpleNamespace(extra={}, start_known=False, commands_at_poses_s=None, timed=False)
    notes = list(on_effects(selection, tracks, imitating))
    assert sum("the gears are assumed to touch in the forward direction" in note for note in notes) == 1


@pytest.mark.parametrize(("accepted", "said"), [(("motor-lag",), 1), (("clock-offset",), 1), (("speed-gain",), 0)])
def test_a_lag_is_said_to_be_perhaps_the_trackers(monkeypatch, accepted, said):
    found = SmoothingTracker(tau_s=0.1, z=5.0)
    monkeypatch.setattr("bns.diagnose.effect_caveats.smoothing_tracker", lambda problem, fit: found)
    model = SimpleNamespace(per_trial_effect=None, effects=(), catalogue=all_effects)
    fit = SimpleNamespace(model=model, free=())
    selection = SimpleNamespace(accepted=accepted, competing_models=(), steps=(), problem=None, fit=fit)
    tracks = SimpleNamespace(extra={}, start_known=False, commands_at_poses_s=None, timed=False)
    assert sum(note == found.in_words() for note in on_effects(selection, tracks)) == said
    assert sum(note == found.in_words(False) for note in on_effects(selection, tracks, all_explained=False)) == said


@pytest.mark.parametrize(("rate", "scatter_s", "said"), [(1e-4, 5e-3, True), (0.0, 5e-3, False), (1e-4, 0.5, False)])
def test_clocks_that_move_along_the_session_are_said_to(monkeypatch, rate, scatter_s, said):
    monkeypatch.setattr("bns.diagnose.effect_caveats.known_effects", lambda _: {})
    start_s = np.arange(40.0) * 35.0
    own_s = 0.02 + rate * start_s + scatter_s * np.random.default_rng(2).normal(size=40)
    notes = list(_on_drift("clock-offset", start_s, own_s))
    assert bool(notes) == said
    if said:
        assert re.search(r"by \+0\.3[4-8]\d* s per hour of the session .* differ by (9\d|10\d)(\.\d+)? parts in a mill", notes[0])
    for known in (True, False):  # else trials are taken to follow each other without a pause
        tracks = SimpleNamespace(extra={}, start_known=known, start_s=start_s, commands_at_poses_s=None)
        assert sum("parts in a million" in note for note in on_effects(with_clocks(own_s), tracks)) == (said and known)
    assert list(_on_drift("clock-offset", start_s[:4], own_s[:4])) == []
    assert list(_on_drift("clock-offset", 0 * start_s, own_s)) == []


@pytest.mark.parametrize(("scatter_s", "steady"), [(0.01, True), (0.03, False)])
def test_clocks_that_follow_the_session_unevenly_do_not_differ_by_a_rate(scatter_s, steady):
    """0.14 s along the session, of which 0.04 s is the standard deviation."""
    start_s = np.arange(40.0) * 35.0
    own_s = 1e-4 * start_s + scatter_s * np.random.default_rng(3).normal(size=40)
    assert (abs(np.corrcoef(start_s, own_s)[0, 1]) > 0.9) == steady
    (note,) = _on_drift("clock-offset", start_s, own_s)
    assert ("parts in a million" in note) == steady
    assert ("such as a queue of commands" in note) == (not steady)


def with_clocks(own_s):
    """A search that accepted nothing but clocks of trials."""
    clocks = SimpleNamespace(effect=effect_named("clock-offset"), trial_values=tuple(own_s))
    model = SimpleNamespace(per_trial_effect=clocks, effects=())
    return SimpleNamespace(accepted=(), competing_models=(), steps=(), fit=SimpleNamespace(model=model, free=()))


def thinned(every):
    """A robot that does what it is told, its poses and commands logged together in one frame of so many."""
    table = measured(NOMINAL, trials=30, seed=5, noise=(0.0005, 0.002))
    table = pd.concat([rows.iloc[::every] for _, rows in table.groupby("trial")], ignore_index=True)
    return WheelPredictor(tracks_of(table))


@pytest.mark.slow
def test_a_clock_that_comes_from_commands_logged_with_poses_is_said_to():
    """A command between two poses seems to begin with the second one: half an interval late on average."""
    found = diagnose(thinned(4), NOMINAL, barred=all_but_rivals_of("clock-offset"))
    assert found.effects == ("clock-offset",)
    assert found.numbers["clock-offset"]["offset_s"]["value"] == pytest.approx(-0.08 + 0.02, abs=0.01)
    assert any("shorter than the 0.16 s between poses" in note for note in found.notes)


def test_commands_between_poses_are_seen():
    table = measured(NOMINAL, trials=6, seed=5)
    assert tracks_of(table).commands_at_poses_s == pytest.approx(0.04)
    lost = table.copy()
    lost.loc[lost.index % 3 == 0, ["x_m", "y_m", "heading_rad"]] = np.nan
    assert tracks_of(lost).commands_at_poses_s is None
    few = table.copy()
    few.loc[few.index % 37 == 0, ["x_m", "y_m", "heading_rad"]] = np.nan
    assert tracks_of(few).commands_at_poses_s == pytest.approx(0.04)
    still = table.assign(left_m_s=0.1, right_m_s=0.1)
    assert tracks_of(still).commands_at_poses_s is None


@pytest.mark.parametrize(("tau_s", "said"), [(0.03, True), (0.3, False)])
def test_only_times_shorter_than_that_between_poses_are_doubted(tau_s, said):
    selection = SimpleNamespace(fit=SimpleNamespace(model=NOMINAL.with_effect("motor-lag", tau_s=tau_s)))
    tracks = tracks_of(measured(NOMINAL, trials=3, seed=5))
    assert bool(list(_on_times(selection, tracks, {"motor-lag"}))) == said
    assert not list(_on_times(selection, tracks, {"wheelbase"}))


def test_a_slip_in_seconds_is_no_time():
    selection = SimpleNamespace(fit=SimpleNamespace(model=NOMINAL.with_effect("side-slip", slip_s=0.03)))
    assert not list(_on_times(selection, tracks_of(measured(NOMINAL, trials=3, seed=5)), {"side-slip"}))


@pytest.mark.parametrize(("z", "more"), [(2.0, 16), (3.0, 5), (0.1, 400)])
def test_so_many_more_trials_as_would_make_a_sign_certain_are_asked_for(z, more):
    """The gain in standard errors grows with the root of the trials: from 2 to 3.2 it takes 2.56 times as many."""
    selection = SimpleNamespace(
        implausible_in=lambda _: {}, accepted=(), competing_models=(), steps=(SimpleNamespace(ranking=()),),
        fit=SimpleNamespace(model=NOMINAL, free=()), nominal=SimpleNamespace(losses=np.ones(10)),
    )  # fmt: skip
    nothing = dict.fromkeys(("imitating", "withdrawn", "unseen", "negligible", "formula", "errors_with_terms"))
    nothing |= {"beside_negligible": {}, "kept_for": {}, "seen_in_heading": {}, "slight_along": ()}
    found = SimpleNamespace(**nothing | {"selection": selection, "negligible": {}, "imitating": (), "rest": NOTHING, "terms": ()})
    hint = SimpleNamespace(name="turn-slip", paired_comparison=SimpleNamespace(z=z))
    (note,) = notes_on(found, tracks_of(measured(NOMINAL, trials=10)), hint)
    assert note == f"turn-slip may be missing, but 10 trials are too few to decide; about {more} more would decide."


@pytest.mark.parametrize(("terms", "all_explained"), [((), True), ((SimpleNamespace(fit=None),), False)])
def test_notes_on_effects_know_whether_something_is_left(monkeypatch, terms, all_explained):
    told = []
    monkeypatch.setattr("bns.diagnose.caveats.on_effects", lambda *given: [told.append(given[3])])
    nothing = dict.fromkeys(("imitating", "withdrawn", "unseen", "negligible", "formula", "errors_with_terms"))
    nothing |= {"beside_negligible": {}, "kept_for": {}, "seen_in_heading": {}, "slight_along": ()}
    selection = SimpleNamespace(implausible_in=lambda _: {}, accepted=(), fit=None)
    found = SimpleNamespace(**nothing | {"selection": selection, "rest": NOTHING, "terms": terms, "negligible": {}})
    monkeypatch.setattr("bns.diagnose.caveats.on_moved", lambda _: [])
    notes = notes_on(found, None, None)
    while not told:
        next(notes)
    assert told == [all_explained]


OF_ROBOT = f"one of the model of the robot: {all_effects()['camera-rotation'].or_of_robot}"


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("slope-load", ""),
        ("camera-scale", " It would be an error of the measurement, not of the robot."),
        ("camera-rotation", f" It would be an error of the measurement, or else {OF_ROBOT}."),
        ("clock-drift", " It may be an artefact of the log, such as rounded time stamps."),
    ],
)
def test_a_number_without_a_unit_is_written_without_one(monkeypatch, name, cause):
    monkeypatch.setattr("bns.diagnose.caveats.known_effects", lambda _selection: all_effects())
    monkeypatch.setattr("bns.diagnose.caveats.on_effects", lambda *_: [])
    monkeypatch.setattr("bns.diagnose.caveats.on_moved", lambda _: ["What it moves."])
    selection = SimpleNamespace(
        implausible_in=lambda _: {}, accepted=(), competing_models=(), steps=(SimpleNamespace(ranking=()),),
        fit=SimpleNamespace(model=NOMINAL, free=()), nominal=SimpleNamespace(losses=np.ones(10)),
    )  # fmt: skip
    numbers = {"x_m_s": {"value": 0.0026, "unit": "m/s"}, "behind_share": {"value": 0.00124, "unit": "1"}}
    nothing = {**dict.fromkeys(("withdrawn", "unseen", "formula", "errors_with_terms")), "beside_negligible": {}, "kept_for": {}}
    nothing |= {"seen_in_heading": {}, "slight_along": ()}
    found = SimpleNamespace(
        **nothing, selection=selection, negligible={name: numbers}, imitating=(), rest=NOTHING, terms=()
    )
    note, moves = notes_on(found, tracks_of(measured(NOMINAL, trials=10)), None)
    assert moves == "What it moves."
    assert "negligible (x_m_s = 0.0026 m/s, behind_share = 0.00124):" in note
    assert note.endswith(f"so it is not named.{cause}")


def test_an_implausible_wheelbase_is_asked_about_with_both_distances():
    fit = SimpleNamespace(model=NOMINAL.with_effect("wheelbase", factor=1.5).with_effect("speed-gain", gain=1.5))
    why = {"wheelbase": "factor = 1.5 is too much", "speed-gain": "so is gain"}
    selection = SimpleNamespace(implausible_in=lambda shown: why if shown is fit else pytest.fail("another fit"))
    on_wheelbase, on_gain = implausible_texts(selection, fit)
    assert on_wheelbase.startswith("wheelbase fits best, but with an implausible value: factor = 1.5 is too much. ")
    assert on_wheelbase.endswith("is the wheelbase really 0.0884 m, and not 0.133 m?")
    assert on_gain.endswith("check it by an independent measurement.")


@pytest.mark.parametrize(("r", "said"), [(0.80, True), (0.78, False), (-0.80, True)])
def test_of_a_few_clocks_only_a_correlation_that_is_hardly_luck_is_a_drift(r, said):
    """Of eight clocks; p is 0.017 and 0.022, by the table of Student's distribution with six degrees of freedom."""
    start_s = 30.0 * np.arange(8)
    along = (start_s - start_s.mean()) / start_s.std()
    beside = np.array([1.0, -1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0])  # no trend, no mean
    notes = list(_on_drift("clock-offset", start_s, 0.01 * (r * along + np.sqrt(1 - r * r) * beside)))
    assert bool(notes) == said
    assert not said or f"(correlation {r:+.2f})" in notes[0]


def left_beside(names, terms, falls, noise_m, left=True):
    """As an `Outcome`: 27 mm are left over a command and 15 mm over a second."""
    at = {
        h: SimpleNamespace(models=[SimpleNamespace(rms_m=rms_m)], noise_floor_m=noise_m)
        for h, rms_m in (("1s", 0.015), ("command", 0.027))
    }
    with_terms = SimpleNamespace(falls_in_the_end=falls) if terms else None
    selection = SimpleNamespace(accepted=names)
    rest, errors = SimpleNamespace(any=left), SimpleNamespace(horizons=at)
    return SimpleNamespace(selection=selection, terms=terms, errors_with_terms=with_terms, rest=rest, errors=errors)


@pytest.mark.parametrize(("terms", "falls", "said"), [((), None, True), (("a curve",), False, True), (("a curve",), True, False)])
def test_effects_beside_what_no_term_describes_may_stand_for_a_part_of_it(terms, falls, said):
    found = list(_on_undescribed(left_beside(("motor-lag", "backlash"), terms, falls, 0.003)))
    assert found == [
        "No term describes what is left beside motor-lag and backlash (error over one command: 27 mm; by noise alone: 3 mm), so "
        "they may stand for a part of that. The intervals hold only if what is left has nothing to do with these effects."
    ][: int(said)]
    assert not list(_on_undescribed(left_beside(("motor-lag",), terms, falls, 0.003, left=False)))
    assert not list(_on_undescribed(left_beside((), terms, falls, 0.003)))


def test_where_the_noise_is_not_known_no_size_is_given():
    (found,) = _on_undescribed(left_beside(("motor-lag",), (), None, float("nan")))
    assert found.startswith("No term describes what is left beside motor-lag, so it may stand for a part of that.")


def test_terms_are_said_to_hold_for_what_was_driven():
    tracks = SimpleNamespace(left_m_s=np.array([[-0.1, 0.25]]), right_m_s=np.array([[0.0, -0.31]]))
    assert "has driven (wheels from -0.31 to 0.25 m/s, and turns as quick as these)" in _on_reach(tracks)
    fit = SimpleNamespace(model=None)
    found = SimpleNamespace(selection=SimpleNamespace(fit=fit, accepted=()), errors_with_terms=None, terms=(), slight=())
    assert list(_on_terms(found, [], tracks)) == []


@pytest.mark.parametrize(("others", "said"), [((("command-delay",),), True), ((), False)])
def test_of_a_tie_the_command_line_says_which_explanation_it_wrote(others, said):
    selection = SimpleNamespace(competing_models=others)
    text = _which(SimpleNamespace(diagnosis=SimpleNamespace(selection=selection), effects=("clock-offset", "wheelbase")))
    assert ("it has the first: clock-offset, wheelbase." in text) is said
    assert said or text == ""


@pytest.mark.parametrize("together", [True, False])
def test_numbers_that_are_only_known_together_are_said_to_be(monkeypatch, together):
    monkeypatch.setattr("bns.diagnose.effect_caveats.known_together", lambda fit, name: together and name == "backlash")
    model = SimpleNamespace(per_trial_effect=None, effects=(), catalogue=all_effects)
    fit = SimpleNamespace(model=model, free=())
    selection = SimpleNamespace(accepted=("backlash", "speed-gain"), competing_models=(), steps=(), fit=fit)
    tracks = SimpleNamespace(extra={}, start_known=False, commands_at_poses_s=None, timed=False)
    said = [note for note in on_effects(selection, tracks) if "only known together" in note]
    assert [note.split(":")[0] for note in said] == (["backlash"] if together else [])


def test_two_numbers_that_differ_are_written_so(monkeypatch):
    def of(value):
        return {"value": value, "low": value - 1e-4, "high": value + 1e-4, "unit": "1"}

    fit = SimpleNamespace(kept={"ratio": of(1.0198)})
    beside = {"wheel-mismatch": {"ratio": of(1.0202)}}
    moved = SimpleNamespace(selection=SimpleNamespace(fit=fit), beside_negligible=beside, negligible={"side-slip": {}})
    monkeypatch.setattr("bns.diagnose.effect_caveats.numbers_of", lambda fit: {"wheel-mismatch": fit.kept})
    (note,) = on_moved(moved)
    assert note == "With side-slip in the model, the parameters of wheel-mismatch differ: ratio = 1.0202, not 1.0198."
