"""`bns.compare`: a model, or a run's networks, compared with measurements as it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import TYPE_CHECKING, Any, cast

import pandas as pd

from bns.api.common.arguments import checked_progress
from bns.api.common.cache import remembered
from bns.api.common.prepared import Prepared, PreparedNetworks, are_networks, prepared, prepared_networks, these_very
from bns.api.common.progress import Meter, Progress
from bns.api.common.provenance import provenance
from bns.api.common.shown import Shown, counted
from bns.api.measurements import Log, Measurements
from bns.api.model import Given, Model
from bns.diagnose.adding import known_to, model_yaml
from bns.diagnose.comparison import Comparison
from bns.diagnose.comparison import compare as held_against
from bns.diagnose.data.bodies.joints import JointTracks
from bns.diagnose.predict.base import Predictor
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.predict.networks import NetworkPredictor
from bns.diagnose.predict.run_ups import joint_stretches
from bns.diagnose.report.network_text import network_errors_text
from bns.diagnose.report.text import ahead, comparison_text
from bns.diagnose.residuals.network_errors import NetworkErrors, why_wrong
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.settings.chosen import in_force
from bns.errors import DataError, ModelError
from bns.physics import model as physics
from bns.physics.jointed.model import JointedModel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PHASES = {"noise": 0.0, "errors": 0.3, "what explains them": 0.5, "curves": 0.9}
"""What share of a comparison is done when it tells so."""


@dataclass(frozen=True, repr=False)
class CompareResult(Shown):
    """How far predictions are off, and where.

    ``comparison`` holds the complete result. ``causes`` says why the networks of a run are wrong; it is None for a model, and
    for networks without their training patterns. ``used`` says how much of the measurements is compared; "" for all.
    ``notes``: what to beware of.
    """

    log: Measurements
    model: Model
    comparison: Comparison
    causes: NetworkErrors | None = None
    of_networks: bool = False
    used: str = ""
    notes: tuple[str, ...] = ()

    @property
    def errors(self) -> pd.DataFrame:
        """One row per horizon: position_m, forward_m, left_m (m), heading_rad (rad), root mean square; position_se_m (NaN for
        one trial); windows (how many), noise_floor_m (what tracking noise alone would show; NaN where the poses cannot tell)."""
        table = pd.DataFrame(self.comparison.errors).T
        table["noise_floor_m"] = pd.Series({h: self.comparison.noise_floor_m(h) for h in self.comparison.errors})
        return table.rename_axis("horizon")

    @property
    def changes(self) -> pd.DataFrame:
        """One row per further model and horizon, on the windows of `errors`: position_m and position_median_m of that model (m),
        change_m (its root mean square minus that of the model compared) with its 95 % interval low_m, high_m, paired by trial
        (NaN where trials are few)."""
        rows = [
            {"model": e.models[1].name, "horizon": h, "position_m": e.models[1].rms_m, "position_median_m": e.models[1].median_m}
            | {"change_m": e.changes[0].change_m, "low_m": e.changes[0].low_m, "high_m": e.changes[0].high_m}
            for errors in self.comparison.beside
            for h, e in errors.horizons.items()
        ]
        columns = ["model", "horizon", "position_m", "position_median_m", "change_m", "low_m", "high_m"]
        return pd.DataFrame(rows, columns=columns).set_index(["model", "horizon"])

    @property
    def residual_dependence(self) -> pd.DataFrame:
        """What a free curve along each variable would explain: variable, velocity, share (fraction of the loss), p_value."""
        return pd.DataFrame(
            self.comparison.as_json()["residual_dependence"], columns=["variable", "velocity", "share", "p_value"]
        )

    @property
    def worst(self) -> pd.DataFrame:
        """The worst moments: trial, t_s (s), position_m (m), heading_rad (rad)."""
        return pd.DataFrame([vars(moment) for moment in self.comparison.worst])

    def summary(self) -> str:
        """Errors at every horizon, what explains them, the worst moments; of networks also why they are wrong."""
        text = comparison_text(self.comparison)
        if self.notes:
            text = "\n".join([text, "", "notes:", *(f"  - {note}" for note in self.notes)])
        return text if self.causes is None else f"{text}\n\n{network_errors_text(self.causes)}"

    def to_json(self) -> dict[str, Any]:
        """One object of plain values, the same that `bns compare --json` prints."""
        causes = {} if self.causes is None else {"causes": self.causes.as_json()}
        findings = [vars(each) for each in self.log.measured.findings]
        made_of = {"provenance": provenance(self.model, self.log.sha256)}
        return {**self.comparison.as_json(), **causes, "findings": findings, "notes": list(self.notes), **made_of}

    def plot(self, ax: Axes | None = None, variable: str | None = None, direction: str | None = None) -> Axes:
        """Mean error a second along one variable (by default the one that explains most), with its 95 % band.

        DataError if there is no such variable or direction, or no curve at all.
        """
        from bns.api.common.axes import drawn  # noqa: PLC0415  # matplotlib is slow to load
        from bns.diagnose.report.figures import curve_axes, curves_of  # noqa: PLC0415  # matplotlib is slow to load

        curves = curves_of(self.comparison, variable, direction)
        if not curves:
            known = ", ".join(dict.fromkeys(curve.variable for curve in self.comparison.curves)) or "none"
            raise DataError(
                f"There is no curve along {variable or 'any variable'} {direction or ''}; there are: {known}."
            )
        return drawn(ax, lambda axes: curve_axes(axes, curves[0], self.comparison))

    def _line(self) -> str:
        c = self.comparison
        near = c.errors[c.near]
        error = f"{1e3 * near['position_m']:.1f} mm off" if near.get("windows") else "nothing to compare"
        return f"{c.model} on {self.log.name}: {error}, {ahead(c.near)} ahead, {counted(c.trials, 'trial')}"


@in_force(DEFAULTS)
def compare(
    log: Log,
    model: Given,
    *,
    beside: Given | Sequence[Given] = (),
    fresh: bool = False,
    progress: Progress | None = None,
) -> CompareResult:
    """Compare a model, as it is, with measurements; nothing is fitted.

    Args:
        log: a file, a table, or `bns.Measurements`.
        model: `bns.Model`, the name or file of one, networks (.safetensors), or a robot's static simulator (``snake``).
        beside: one more model, or several: their errors on the same windows, and the change from ``model`` to each of them
            with its 95 % interval, paired by trial (`CompareResult.changes`). Measurements that none of them was fitted to
            say whether an effect that was added is worth it.
        fresh: compute the answer again instead of taking it from the cache (docs/python.md).
        progress: called with the fraction done (0 to 1) and a text.

    Raises:
        DataError: measurements that cannot be used, or of another robot.
        ModelError: no such model, or networks among several.
    """
    checked_progress(progress)
    others = _several(beside)
    networks = prepared_networks(log, model)
    if networks and others:
        raise ModelError(f"{networks.model.name} holds networks; only models with effects are compared beside others.")
    ready = networks or prepared(log, model)
    named = _named(ready, others)
    meter = Meter(progress, PHASES, pace=1)

    def work() -> Comparison:
        return held_against(ready.predictor, ready.model, tick=meter, beside=named)

    also = [[name, one.canonical_json(), model_yaml(one)] for name, one, _ in named]
    result = remembered("compare", ready, also, work, Comparison, fresh) if isinstance(ready, Prepared) else work()
    kept = isinstance(ready.predictor, NetworkPredictor) and ready.predictor.learned_from.size > 0
    causes = why_wrong(cast("NetworkPredictor", ready.predictor)) if kept else None
    of_networks = isinstance(ready.predictor, NetworkPredictor)
    meter.done()
    used = ready.thinned if isinstance(ready, Prepared) else ""
    notes = _fitted_here(ready, named) if isinstance(ready, Prepared) else ()
    return CompareResult(ready.log, ready.model, result, causes, of_networks, used, notes)


def _several(beside: Given | Sequence[Given]) -> tuple[Given, ...]:
    return tuple(beside) if isinstance(beside, list | tuple) else (cast("Given", beside),)


def _named(ready: Prepared | PreparedNetworks, others: Sequence[Given]) -> list[tuple[str, Model, Predictor | None]]:
    """Further models, each checked as the first, under names of their own, and what foresees those of another body."""
    named: list[tuple[str, Model, Predictor | None]] = []
    taken = {ready.model.name}
    for number, given in enumerate(others, start=2):
        if isinstance(given, physics.Model | str | PathLike) and are_networks(given):
            raise ModelError(f"{given} holds networks; only models with effects are compared beside others.")
        one = prepared(ready.log, given)
        name = one.model.name if one.model.name not in taken else f"{one.model.name} ({number})"
        taken.add(name)
        named.append((name, one.model, _of_its_own(ready.predictor, one)))
    return named


def _of_its_own(first: Predictor, other: Prepared) -> Predictor | None:
    """What foresees a model of another body, on the stretches that the first one counts; None for one of the same."""
    own = other.predictor
    if not isinstance(first, JointedPredictor) or not isinstance(own, JointedPredictor) or first.foresees(other.model):
        return None
    if own.sites != first.sites:
        raise ModelError(
            f"{other.model.name} is seen at the sites {', '.join(own.sites)}, and the model that it is compared beside at "
            f"{', '.join(first.sites)}. Give both models the same sites in the same order."
        )
    if isinstance(other.log.measured.tracks, JointTracks):
        assert isinstance(other.model, JointedModel)
        same = joint_stretches(other.log.measured.tracks, other.model.mechanism, first.all_stretches)
        own = JointedPredictor(same, other.model, own.near)
    return own.on_stretches_of(first)


def _fitted_here(ready: Prepared, named: Sequence[tuple[str, Model, Predictor | None]]) -> tuple[str, ...]:
    """What to beware of: models that were fitted to these measurements know them."""
    of_others = [
        f"The model {name} was fitted to {these_very(known, ready.measured)}: its errors are lower than on new ones."
        for name, one, _ in named
        if (known := known_to(one, ready.measured))
    ]
    return tuple(note for note in (ready.fitted_here, *of_others) if note)
