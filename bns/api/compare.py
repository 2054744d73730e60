"""`bns.compare`: a model, or a run's networks, compared with measurements as it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import pandas as pd

from bns.api.common.arguments import checked_progress
from bns.api.common.cache import remembered
from bns.api.common.prepared import Prepared, prepared, prepared_networks
from bns.api.common.progress import Meter, Progress
from bns.api.common.provenance import provenance
from bns.api.common.shown import Shown
from bns.api.measurements import Log, Measurements
from bns.api.model import Given, Model
from bns.diagnose.comparison import Comparison
from bns.diagnose.comparison import compare as held_against
from bns.diagnose.predict.networks import NetworkPredictor
from bns.diagnose.report.network_text import network_errors_text
from bns.diagnose.report.text import ahead, comparison_text
from bns.diagnose.residuals.network_errors import NetworkErrors, why_wrong
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.settings.chosen import in_force
from bns.errors import DataError

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
        return f"{c.model} on {self.log.name}: {error}, {ahead(c.near)} ahead, {c.trials} trials"


@in_force(DEFAULTS)
def compare(
    log: Log, model: Given, *, fresh: bool = False, progress: Progress | None = None
) -> CompareResult:
    """Compare a model, as it is, with measurements; nothing is fitted.

    Args:
        log: a file, a table, or `bns.Measurements`.
        model: `bns.Model`, the name or file of one, networks (.safetensors), or a robot's static simulator (``snake``).
        fresh: compute the answer again instead of taking it from the cache (docs/python.md).
        progress: called with the fraction done (0 to 1) and a text.

    Raises:
        DataError: measurements that cannot be used, or of another robot.
        ModelError: no such model.
    """
    checked_progress(progress)
    networks = prepared_networks(log, model)
    ready = networks or prepared(log, model)
    meter = Meter(progress, PHASES, pace=1)


    def work() -> Comparison:
        return held_against(ready.predictor, ready.model, tick=meter)

    result = remembered("compare", ready, (), work, Comparison, fresh) if isinstance(ready, Prepared) else work()
    kept = isinstance(ready.predictor, NetworkPredictor) and ready.predictor.learned_from.size > 0
    causes = why_wrong(cast("NetworkPredictor", ready.predictor)) if kept else None
    of_networks = isinstance(ready.predictor, NetworkPredictor)
    meter.done()
    used = ready.thinned if isinstance(ready, Prepared) else ""
    notes = (ready.fitted_here,) if isinstance(ready, Prepared) and ready.fitted_here else ()
    return CompareResult(ready.log, ready.model, result, causes, of_networks, used, notes)
