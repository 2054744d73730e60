"""What is left of a body along a variable counts where it would lower the error: a long log makes next to nothing certain."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bns.api.common.prepared import prepared
from bns.api.model import Model
from bns.diagnose import outcome
from bns.diagnose.caveats import _on_slight
from bns.diagnose.estimate.problem import settled_problem
from bns.diagnose.estimate.significance import PairedComparison
from bns.diagnose.residuals.along_variables import SHARE, ResidualDependence, residual_dependence, with_curve
from bns.diagnose.residuals.unexplained import Unexplained
from tests.jointed.arm import log, xml

PATTERNS = tuple(ResidualDependence(f"joint-{k}", SHARE, PairedComparison(1.0, 0.1, 5e-5), 0.002) for k in range(5))
NEARLY = (replace(PATTERNS[0], share=0.019),)


def standing(luck, rest):
    asked = []
    problem = SimpleNamespace(
        predictor=SimpleNamespace(luck=luck),
        pose_filter=None,
        fit=lambda model: asked.append(model) or SimpleNamespace(model=model),
    )
    selection = SimpleNamespace(problem=problem, fit=SimpleNamespace(model="given"))
    return SimpleNamespace(rest=rest, selection=selection), asked


@pytest.mark.parametrize(
    ("luck", "rest", "matters", "slight", "asked"),
    [
        ("luck", Unexplained(PATTERNS, None, ()), (), PATTERNS, ["joint-0", "joint-1", "joint-2"]),
        ("luck", Unexplained(PATTERNS, None, ()), ("joint-1",), (), ["joint-0", "joint-1"]),
        ("luck", Unexplained(PATTERNS, "swings", ()), (), (), []),
        ("luck", Unexplained(PATTERNS, None, ("a moment",)), (), (), []),
        ("luck", Unexplained((), None, ()), (), (), []),
        (None, Unexplained(PATTERNS, None, ()), (), (), []),  # of wheels, terms tell
        ("luck", Unexplained((*PATTERNS, replace(PATTERNS[0], share=0.021)), None, ()), (), (), []),  # large
        ("luck", Unexplained(NEARLY, None, ()), (), NEARLY, ["joint-0"]),
    ],
)
def test_patterns_whose_curves_lower_no_error_are_slight(luck, rest, matters, slight, asked, monkeypatch):
    stands, fitted = standing(luck, rest)
    monkeypatch.setattr(outcome, "with_curve", lambda _model, _predictor, pattern: pattern.variable)
    monkeypatch.setattr(outcome, "judged_errors", lambda _predictor, _filter, _given, judged: judged[1].model)
    monkeypatch.setattr(outcome, "fall_matters", lambda errors, *_: errors in matters)
    assert outcome._slight_along(stands) == slight
    assert fitted == asked


def test_the_free_curve_of_a_pattern_is_what_moves_a_body(tmp_path):
    """Shares of knots beside one another multiply, so that both together are 3 % and up to 0.0002 more."""
    (tmp_path / "arm.xml").write_text(xml())
    predictor = prepared(log(8, noise_m=2e-4), Model(tmp_path / "arm.xml")).predictor
    model = predictor._bare
    curved = with_curve(model, predictor, ResidualDependence("elbow_set_rad", SHARE, PATTERNS[0].paired_comparison, 0.01))
    knots = [active for active in curved.effects if active.effect.name.startswith("nudge-")]
    assert len(knots) >= 3
    plain, same = predictor.steps(model).body, predictor.steps(curved).body
    np.testing.assert_allclose(same, plain, atol=1e-12)
    moved = curved.with_values({one.effect.name: {"size": 0.03} for one in knots})
    np.testing.assert_allclose(predictor.steps(moved).body, 1.03 * plain, rtol=3e-4)


@pytest.mark.parametrize(("spring_n_m_rad", "counts"), [(1.5, True), (0.0, False)])
def test_a_hose_that_pulls_counts_and_the_same_patterns_of_an_arm_without_one_are_slight(tmp_path, spring_n_m_rad, counts):
    """MuJoCo has the spring, and no listed effect is one."""
    (tmp_path / "arm.xml").write_text(xml())
    predictor = prepared(log(10, seed=3, spring_n_m_rad=spring_n_m_rad), Model(tmp_path / "arm.xml")).predictor
    problem, fit = settled_problem(predictor, predictor._bare)
    patterns = tuple(residual_dependence(problem, fit))
    stands = SimpleNamespace(selection=SimpleNamespace(problem=problem, fit=fit), rest=Unexplained(patterns, None, ()))
    assert outcome._slight_along(stands) == (() if counts else patterns)


def test_it_is_said():
    (said,) = _on_slight(False, [PATTERNS[0].in_words])
    assert said.startswith("What is left is certain but slight: the error of the whole motion follows joint-0: a free curve")
    assert said.endswith("so the verdict does not count it.")
