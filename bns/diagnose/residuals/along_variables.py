"""Is there anything left? What a fitted model still gets wrong, along every variable there is.

For each variable a free curve (a field over the floor for the place) is added to the robot's forward, sideways and turning
velocity, and to all three as a share of them, and judged as any effect is: by what it earns on trials that it was not
fitted to. No physics is assumed, so whatever moves the robot by a rule that can be seen from outside shows here, listed or not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from bns.diagnose.data.tracks import Array
from bns.diagnose.data.variables import bare, label, velocity
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.estimate.fitting import Problem
from bns.diagnose.estimate.noise import huber
from bns.diagnose.estimate.normal_equations import NormalEquations, innovations_after, normal_equations
from bns.diagnose.estimate.parameters import active_mask
from bns.diagnose.estimate.significance import MIN_Z, PairedComparison, chance, paired_elpd_diff
from bns.diagnose.parallel import each
from bns.diagnose.predict.base import Predictor
from bns.diagnose.settings import DEFAULTS
from bns.physics.effect import Effect, Parameter
from bns.physics.model import Model
from bns.physics.order import FORMULAS
from bns.physics.signals import Body

SHARE = "share_of_motion"
"""All three velocities in proportion: what brakes a robot forward brakes it backward and in its turns as well."""
CHANNELS = ("forward_m_s", "sideways_m_s", "yaw_rad_s", SHARE)
WORLD = ("east_m_s", "north_m_s")
"""Velocities in the world's frame, for what a place does to the robot."""
KNOTS = DEFAULTS.residuals.knots
FIELD = DEFAULTS.residuals.field_bumps
PENALTIES = DEFAULTS.residuals.penalties
CHANCE = DEFAULTS.residuals.chance
LEAST = DEFAULTS.residuals.least


@dataclass(frozen=True)
class ResidualDependence:
    """What a free curve of one variable, added to one velocity, earns on held-out trials."""

    variable: str
    channel: str
    paired_comparison: PairedComparison
    share: float

    @property
    def in_words(self) -> str:
        """In a clause."""
        what, along = bare(velocity(self.channel)), bare(label(self.variable))
        return f"the error of {what} follows {along}: a free curve along it removes {self.share:.1%} of the loss"


def residual_dependence(problem: Problem, fit: Fit) -> list[ResidualDependence]:
    """Every variable with every velocity, the best first."""
    variables = problem.predictor.variables()
    headings, usual = variables.get("heading_rad"), float(fit.losses.mean())

    def compare_clocks(tried: tuple[str, list[Array], str]) -> ResidualDependence:
        variable, basis, channel = tried
        earned = earned_by_columns(problem, fit, _columns(problem, fit, channel, basis, headings))
        return ResidualDependence(variable, channel, earned, earned.elpd_diff / usual)

    tried = [(v, basis, c) for v, basis in curves(variables) for c in (*CHANNELS, *(WORLD if v == "place" else ()))]
    return sorted(each(compare_clocks, tried), key=lambda p: -p.paired_comparison.elpd_diff)


def significant_dependence(dependence: list[ResidualDependence]) -> list[ResidualDependence]:
    """The patterns that cannot be luck, are earned in many trials and are large enough to matter."""
    level = CHANCE / max(len(dependence), 1)
    return [
        p
        for p in dependence
        if p.paired_comparison.p_value < level and p.paired_comparison.z > MIN_Z and p.share > LEAST
    ]


def curves(variables: Mapping[str, Array]) -> Iterator[tuple[str, list[Array]]]:
    """Name and basis functions, (trials, steps) each, of every variable that varies."""
    for name, values in variables.items():
        if name in {"x_m", "y_m"}:
            continue
        # of the values that occur, however often: a variable that is nearly always zero bends where it is not
        seen = np.unique(values[np.isfinite(values)].round(6))
        knots = np.unique(np.quantile(seen, np.linspace(0, 1, KNOTS)))
        if len(knots) > 1:
            yield name, [np.interp(values, knots, row) for row in np.eye(len(knots))]
    if {"x_m", "y_m"} <= set(variables):
        yield "place", _bumps(variables["x_m"], variables["y_m"], FIELD)
    speeds = ("speed_m_s", "wheel_difference_m_s")
    if set(speeds) <= set(variables):
        yield "speed and turn", _bumps(variables[speeds[0]], variables[speeds[1]], FIELD - 1)


def _bumps(x: Array, y: Array, side: int) -> list[Array]:
    """Gaussian bumps on a grid over two variables."""
    (x0, x1), (y0, y1) = np.quantile(x, [0.01, 0.99]), np.quantile(y, [0.01, 0.99])
    wide, high = (0.6 * (top - low) / (side - 1) + 1e-9 for low, top in ((x0, x1), (y0, y1)))
    return [
        np.exp(-(((x - cx) / wide) ** 2 + ((y - cy) / high) ** 2) / 2)
        for cx in np.linspace(x0, x1, side)
        for cy in np.linspace(y0, y1, side)
    ]


def probe_effect(channel: str, curve: Array, heading_rad: Array | None) -> Effect:
    """An effect that adds ``size`` times a curve (trials, steps) to one velocity while the robot moves, or to all as a share."""

    def apply(body: Body, size: float) -> Body:
        if channel == SHARE:
            return body.scaled(1 + size * curve)
        added = size * curve * body.moving
        if channel in WORLD:
            assert heading_rad is not None  # a field over the floor comes of places
            return body.with_drift(channel.removesuffix("_m_s"), added, heading_rad)
        return body.with_added(channel, added)

    return Effect(
        name="nudge",
        stage="body",
        parameters=(Parameter("size", "1", -1e3, 1e3, (-1.0, 1.0), 0.0, "size of the curve"),),
        equation="",
        residuals="",
        lookalikes=(),
        apply=apply,
        after=FORMULAS,
    )


def with_curve(model: Model, predictor: Predictor, pattern: ResidualDependence) -> Model:
    """The model with the free curve of a pattern, a number for each of its knots (places: bumps), all 0."""
    variables = predictor.variables()
    basis = next(of for name, of in curves(variables) if name == pattern.variable)
    for k, curve in enumerate(basis):
        one = probe_effect(pattern.channel, curve, variables.get("heading_rad"))
        model = model.with_active(replace(one, name=f"{one.name}-{k}"), (0.0,))
    return model


def _columns(problem: Problem, fit: Fit, channel: str, basis: list[Array], headings: Array | None) -> Array:
    """Change of the whitened innovations a unit of each basis function, (frames, 3, k)."""
    small = 1e-3 if channel in {"yaw_rad_s", SHARE} else 1e-4
    out = np.empty((*fit.whitened.shape, len(basis)))
    for j, curve in enumerate(basis):
        changed = fit.model.with_active(probe_effect(channel, curve, headings), (small,))
        out[..., j] = (problem.whitened(changed) - fit.whitened) / small
    return out


def earned_by_columns(problem: Problem, fit: Fit, columns: Array) -> PairedComparison:
    """What a linear addition (frames, 3, k) to a fitted model earns on trials held out, at the better penalty."""
    return with_columns(problem, fit, columns)[0]


def with_columns(problem: Problem, fit: Fit, columns: Array) -> tuple[PairedComparison, Array]:
    """As `earned_by_columns`, and the held-out losses (trials,) of the model with them, its own numbers moving along.

    But for those that press against a bound: beyond it they might do what the addition does, and they cannot go there.
    """
    given = fit.jacobian[..., active_mask(fit.model, fit.free, normal_equations(fit.jacobian, fit.whitened)[1])]
    joint, own = np.concatenate([given, columns], axis=2), given.shape[2]
    equations = problem.normal_equations(joint, fit.whitened)
    tried = [_held_out_losses(problem, fit, joint, equations, own, penalty) for penalty in PENALTIES]
    elpd_diff, dse = max((paired_elpd_diff(fit.held_out, losses) for losses in tried), key=lambda pair: pair[0])
    comparison = PairedComparison(elpd_diff, dse, chance(equations, own) if elpd_diff > 0 else 1.0)
    return comparison, min(tried, key=lambda losses: float(losses.sum()))


def _held_out_losses(
    problem: Problem, fit: Fit, joint: Array, equations: NormalEquations, own: int, penalty: float
) -> Array:
    """Losses (trials,) with a linear addition to a fitted model, each trial judged by a fit to the others.

    The model's own numbers, the first ``own``, move along with it. ``penalty``: how many typical trials speak for the addition
    being nothing.
    """
    gradients, curvatures = equations.gradients, equations.curvatures
    total, trials = curvatures.sum(axis=0), len(curvatures)
    scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
    ridge = np.full(len(total), penalty / trials)
    ridge[:own] = 1e-9
    others = (total - curvatures) / np.outer(scale, scale) + np.diag(ridge)
    against = (gradients.sum(axis=0) - gradients) / scale
    steps = -np.linalg.solve(others, against[..., None])[..., 0] / scale
    moved = innovations_after(problem.predictor.tracks.first, joint, fit.whitened, steps)
    return problem.per_trial(huber(moved))
