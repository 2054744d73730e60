"""Free surfaces over speed and turn, where a log says little of a part of them; and formulas without a signal, in words."""

import numpy as np
import pandas as pd
import pytest

from bns.diagnose.data.tracks import tracks_of
from bns.diagnose.estimate.problem import problem_for
from bns.diagnose.predict.wheels import WheelPredictor
from bns.diagnose.residuals.grammar import SURFACE, families
from bns.diagnose.residuals.symbolic import fitted
from bns.diagnose.residuals.words import in_words
from bns.physics.formula import value_of
from tests.diagnose.worlds import NOMINAL, measured


def test_a_surface_has_no_number_of_its_own_where_the_robot_hardly_drove():
    """Slow commands turn sharply, fast ones hardly: where both are asked for the surface goes on as it is nearest to there."""
    rng = np.random.default_rng(1)
    table = measured(NOMINAL, trials=12, seed=2)
    speed, fast = rng.uniform(0.02, 0.2, len(table)), rng.uniform(size=len(table)) < 0.5
    changed = table.groupby("trial")["left_m_s"].diff().fillna(1.0) != 0.0
    speed, fast = (pd.Series(one).where(changed.to_numpy()).ffill() for one in (speed, fast.astype(float)))
    half = np.where(fast > 0, 0.005, 0.06)
    predictor = WheelPredictor(tracks_of(table.assign(left_m_s=(speed * fast - half), right_m_s=(speed * fast + half))))
    found = {f.on: f for f in families(predictor, NOMINAL.wheelbase_m) if f.signal == SURFACE}
    assert {on: len(f.functions) for on, f in found.items()} == {"w": 1, "v": 2, "share": 3}
    fastest, sharpest = float(np.abs(speed * fast).max()), 0.12 / NOMINAL.wheelbase_m

    def numbers(v, w):
        return [round(float(value_of(one, {"v": v, "w": w})), 2) for one in found["share"].functions]

    assert numbers(fastest, sharpest) == numbers(0.0, sharpest)
    assert numbers(fastest, 0.6 * sharpest) == numbers(fastest, 0.0) != numbers(0.0, sharpest)
    both_ways = WheelPredictor(tracks_of(measured(NOMINAL, trials=20, seed=3, speeds=(-0.2, 0.2))))
    everywhere = families(both_ways, NOMINAL.wheelbase_m)
    assert len(next(f for f in everywhere if (f.signal, f.on) == (SURFACE, "share")).functions) > 8


@pytest.mark.parametrize(
    ("term", "said"),
    [("k * v", "forward velocity differs from its command (by up to "), ("k * v * abs(w)", "forward velocity depends on ")],
)
def test_a_velocity_does_not_depend_on_itself(term, said):
    predictor = WheelPredictor(tracks_of(measured(NOMINAL, trials=4, seed=3)))
    problem = problem_for(predictor, NOMINAL)
    assert in_words(fitted(problem, problem.fit(NOMINAL), "v", term), predictor).startswith(said)
