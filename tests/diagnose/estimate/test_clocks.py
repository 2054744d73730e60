"""Clocks that differ from trial to trial: found, judged on poses that did not set them, written down."""

from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bns.cli.main import main
from bns.diagnose import diagnosing
from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.diagnosing import diagnose
from bns.diagnose.estimate.clocks.trial_clock_test import every_other_block, fit_trial_clocks, with_trial_clocks
from bns.diagnose.estimate.clocks.trial_clocks import eliminate_clocks, with_fitted_clocks
from bns.diagnose.estimate.noise import weights
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.outcome import Outcome, predicts_better_throughout
from bns.diagnose.predict.wheels import WheelPredictor
from bns.errors import ModelError
from bns.measurements import write_measurements
from bns.physics.model import load_model, parse_model
from tests.diagnose.worlds import NOMINAL, hidden, measured

LATE_S = np.random.default_rng(5).uniform(-0.25, 0.25, 12)


def apart(late_s, **effects):
    """Trials of a robot, each stamped by a clock of its own."""
    trials = [measured(hidden(clock_offset={"offset_s": s}, **effects), trials=1, seed=i) for i, s in enumerate(late_s)]
    return pd.concat([t.assign(trial=i) for i, t in enumerate(trials)], ignore_index=True)


@pytest.fixture(scope="module")
def predictor():
    return WheelPredictor(tracks_of(apart(LATE_S, wheelbase={"factor": 1.05})))


@pytest.mark.slow
def test_clocks_and_what_they_hide_are_found(predictor):
    found = diagnose(predictor, NOMINAL)
    answer = found.as_json()
    assert set(answer["effects"]) == {"clock-offset", "wheelbase"}
    own = np.array(found.model.per_trial_effect.trial_values)
    np.testing.assert_allclose(own, LATE_S, atol=0.012)
    factor = answer["parameters"]["wheelbase"]["factor"]
    assert factor["low"] < 1.05 < factor["high"]
    assert answer["parameters"]["clock-offset"]["between_trials_s"]["value"] == pytest.approx(
        LATE_S.std(ddof=1), rel=0.1
    )
    assert answer["error"]["1s"]["after"] < 0.5 * answer["error"]["1s"]["before"]
    assert any("a separate value in each trial" in note for note in answer["notes"])


@pytest.mark.parametrize(
    ("one_s", "left", "kept"), [(1.9, True, True), (2.1, True, False), (2.1, False, True), (np.nan, True, True)]
)
def test_beside_something_left_clocks_stand_only_if_the_error_is_lower_at_every_horizon(monkeypatch, one_s, left, kept):
    """With mocked searches: with clocks the errors are 1 mm over a command and ``one_s`` over 1 s, with a term 2 and 2 mm."""
    asked = []

    class Search(diagnosing.StepwiseSelection):
        def run(self, before=None):
            asked.append(self._own_clocks)
            return self._own_clocks

    def ended(clocks, *_):
        pairs = {"command": 1.0, "1s": one_s} if clocks else {"command": 2.0, "1s": 2.0}
        errors = SimpleNamespace(horizons={h: SimpleNamespace(models=[SimpleNamespace(rms_m=e)]) for h, e in pairs.items()})
        model = SimpleNamespace(per_trial_effect=clocks or None)
        fit, nominal = SimpleNamespace(model=model), SimpleNamespace(model=NOMINAL)
        selection = SimpleNamespace(fit=fit, nominal=nominal, accepted=(), competing_models=())
        unknown = dict.fromkeys(field.name for field in fields(Outcome))
        rest = SimpleNamespace(any=left)
        given = {"selection": selection, "errors": errors, "rest": rest, "dependence": []}
        none = dict.fromkeys(("terms", "slight", "withdrawn", "imitating"), ())
        none |= {name: {} for name in ("negligible", "beside_negligible", "kept_for", "seen_in_heading")}
        return Outcome(**{**unknown, **given, **none})

    monkeypatch.setattr(diagnosing, "StepwiseSelection", Search)
    monkeypatch.setattr(diagnosing, "outcome_of", ended)
    monkeypatch.setattr(diagnosing, "_from_better_numbers", lambda selection, _: selection)
    monkeypatch.setattr(diagnosing, "_longer", lambda *_: [])
    monkeypatch.setattr(diagnosing, "_hint", lambda *_: None)
    monkeypatch.setattr(diagnosing, "_verdict", lambda *_: "unlisted")
    monkeypatch.setattr(diagnosing, "notes_on", lambda *_: [])
    monkeypatch.setattr(diagnosing, "listed", lambda *_: {})
    monkeypatch.setattr(diagnosing, "calibrated", lambda *_: None)
    plain = WheelPredictor(tracks_of(measured(NOMINAL)))
    found = diagnosing._diagnosed(plain, NOMINAL, None, lambda _: None, (), lambda _: None)
    assert (found.selection.fit.model.per_trial_effect is not None) is kept
    assert asked == ([True, False] if left else [True])


def test_one_clock_for_all_is_not_called_many():
    common = WheelPredictor(tracks_of(apart(np.full(10, 0.1))))
    problem = problem_for(common, NOMINAL)
    assert fit_trial_clocks(problem, problem.fit(NOMINAL)) is None


def test_clocks_are_eliminated_as_from_the_whole_system(predictor):
    """Slow twin: shared numbers and all clocks solved for at once."""
    turned = NOMINAL.with_effect("wheelbase", factor=1.02).with_effect("clock-offset", offset_s=0.0)
    model = with_trial_clocks(turned, "clock-offset")
    problem = problem_for(predictor, NOMINAL)
    fit = problem.fit(model, rounds=0)
    whitened, trial = fit.whitened, predictor.tracks.trial
    changed = fit.model.with_values({"wheelbase": {"factor": 1.0201}})
    column = (problem.whitened(changed) - whitened)[..., None] / 1e-4
    slopes = eliminate_clocks(problem, fit.model, whitened, column)
    clock = (
        problem.whitened(fit.model.with_trial_values(np.array(fit.model.per_trial_effect.trial_values) + 1e-3))
        - whitened
    ) / 1e-3
    each = clock[:, :, None] * (trial[:, None] == np.arange(len(LATE_S)))[:, None, :]
    whole = np.concatenate([column, each], axis=2) * np.sqrt(weights(whitened))[:, None, None]
    curvature = np.einsum("kcp,kcq->pq", whole, whole)
    together = curvature[0, 0] - curvature[0, 1:] @ np.linalg.solve(curvature[1:, 1:], curvature[1:, 0])
    alone = np.einsum("kcp,kcq,k->pq", slopes.jacobian, slopes.jacobian, weights(whitened))[0, 0]
    assert alone == pytest.approx(together, rel=1e-3)


def test_a_clock_is_set_by_its_own_trial_alone(predictor):
    problem = problem_for(predictor, NOMINAL)
    begun = problem.fit(
        with_trial_clocks(NOMINAL.with_effect("clock-offset", offset_s=0.0), "clock-offset"), rounds=0
    ).model
    one = np.array(begun.per_trial_effect.trial_values)
    one[0] += 0.05
    again = with_fitted_clocks(problem, begun.with_trial_values(one))
    np.testing.assert_allclose(
        again.per_trial_effect.trial_values[1:], begun.per_trial_effect.trial_values[1:], atol=2e-3
    )
    np.testing.assert_allclose(
        again.per_trial_effect.trial_values[0], begun.per_trial_effect.trial_values[0], atol=0.02
    )  # the valley is flat there


def test_blocks_share_every_trial_evenly(predictor):
    even = every_other_block(predictor.tracks)
    shares = [even[predictor.tracks.trial == i].mean() for i in range(len(LATE_S))]
    np.testing.assert_allclose(shares, 0.5, atol=0.05)


def test_added_by_command_and_compared(tmp_path, capsys):
    data, model = tmp_path / "m.parquet", tmp_path / "mended.yaml"
    write_measurements(apart(LATE_S[:8]), data)
    arguments = ["--model", "khepera", "--data", str(data), "-o", str(model)]
    assert main(["add", "clock-offset", "--per-trial", *arguments]) == 0
    extended = load_model(model)
    assert extended.per_trial_effect.effect.name == "clock-offset"
    assert not extended.per_trial_effect.trial_values
    assert "one value a trial" in extended.per_trial_effect.reason
    capsys.readouterr()
    assert main(["compare", str(data), "--model", str(model)]) == 0
    after = capsys.readouterr().out
    assert main(["compare", str(data), "--model", "khepera"]) == 0
    before = capsys.readouterr().out

    def one_second(text):
        return float(next(line for line in text.splitlines() if line.startswith("  1s")).split()[1])

    assert one_second(after) < 0.5 * one_second(before)


def test_per_trial_is_refused_where_it_makes_no_sense(tmp_path, capsys):
    effect = "{name: wheelbase, per_trial: VALUE, values: {factor: 1.1}, basis: guess, reason: r}"
    wheelbase = f"base: differential-drive\nwheelbase_m: 0.1\neffects:\n  - {effect}\n"
    with pytest.raises(
        ModelError, match=r"wheelbase has one value for all trials; per_trial goes with clock-offset alone"
    ):
        parse_model(wheelbase.replace("VALUE", "true"), "m")
    with pytest.raises(ModelError, match="per_trial of wheelbase in model m is 'maybe'; it must be true or false"):
        parse_model(wheelbase.replace("VALUE", "maybe"), "m")
    data = tmp_path / "m.parquet"
    write_measurements(measured(NOMINAL, trials=8), data)
    arguments = ["--model", "khepera", "--data", str(data), "-o", str(tmp_path / "n.yaml")]
    assert main(["add", "wheelbase", "--per-trial", *arguments]) == 2
    assert "--per-trial (in Python: per_trial=True) goes with clock-offset" in capsys.readouterr().err
    assert not (tmp_path / "n.yaml").exists()


def test_clocks_of_trials_may_stand_only_where_they_predict_better_at_every_horizon():
    def errors(**rms_m):
        at = {h: SimpleNamespace(models=[SimpleNamespace(rms_m=9.0), SimpleNamespace(rms_m=one)]) for h, one in rms_m.items()}
        return SimpleNamespace(horizons=at)

    def ended(with_terms=None, **rms_m):
        return SimpleNamespace(errors=errors(**rms_m), errors_with_terms=with_terms)

    one, nan = ended(near=0.1, far=0.2), float("nan")
    assert predicts_better_throughout(one, ended(near=0.11, far=0.21))
    assert not predicts_better_throughout(one, ended(near=0.11, far=0.19))
    assert not predicts_better_throughout(one, ended(near=0.1, far=0.21))
    assert predicts_better_throughout(one, ended(near=0.11, far=nan))
    assert not predicts_better_throughout(one, ended(errors(near=0.05, far=0.05), near=0.11, far=0.21))
