"""`bns.add`: effects added to a model, fitted to measurements, with the error before and after."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any

import pandas as pd

from bns.api.common.arguments import checked_progress, several
from bns.api.common.parameters import parameter_table
from bns.api.common.prepared import Prepared, prepared, with_effects
from bns.api.common.progress import Progress, silent
from bns.api.common.provenance import provenance
from bns.api.common.shown import Shown
from bns.api.measurements import Log
from bns.api.model import Given, Model
from bns.diagnose.adding import ExtendedModel, Memory, add_effects, effect_from
from bns.diagnose.predict.paired_errors import noise_json
from bns.diagnose.report.text import extension_text
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.settings.chosen import in_force
from bns.diagnose.values import numbers_of
from bns.errors import ModelError, in_both
from bns.physics.effect import Effect

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FORMULA = in_both("bns add LOG NAME --term … --on …", 'bns.add(log, "NAME", model, term=…, on=…)')
Wanted = str | PathLike[str] | Effect


@dataclass(frozen=True, repr=False)
class AddResult(Shown):
    """A model with effects added and all its numbers refitted."""

    ready: Prepared
    extended: ExtendedModel

    @property
    def model(self) -> Model:
        """The new model, with 95 % intervals and where its numbers come from; `bns.Model.save` writes it."""
        return Model(self.extended.model)

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of all effects of the model: effect, parameter, value, se, low, high (95 % interval), unit, at_bound."""
        return parameter_table(numbers_of(self.extended.fit))

    @property
    def errors(self) -> pd.DataFrame:
        """Position error on held-out trials (m, root mean square), all on the same windows.

        One row per step (model as given, then each effect added in turn; last the tracking noise), one column per horizon.
        NaN where there are no such windows.
        """
        horizons = self.extended.errors.horizons
        steps = {
            name: {h: e.models[k].rms_m for h, e in horizons.items()} for k, name in enumerate(self.extended.names)
        }
        noise = {h: e.noise_floor_m for h, e in horizons.items()}
        return pd.DataFrame({**steps, "tracking noise": noise}).T.rename_axis("step")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings: parameters at a bound, effects without influence, an error that does not fall."""
        return self.extended.warnings

    def summary(self) -> str:
        """The error by step, and the numbers."""
        return extension_text(self.extended)

    def to_json(self) -> dict[str, Any]:
        """One object of plain values, the same that `bns add --json` prints."""
        return {
            "model": self.extended.model.name,
            "effects": list(self.extended.names[1:]),
            "parameters": numbers_of(self.extended.fit),
            "error": self.extended.errors.as_json(),
            "tracking_noise": noise_json(self.extended.errors),
            "warnings": list(self.extended.warnings),
            "provenance": provenance(self.ready.model, self.ready.log.sha256),
        }

    def plot(self, ax: Axes | None = None) -> Axes:
        """The error at every step, one line per horizon; dotted: the tracking noise."""
        from bns.api.common.axes import drawn  # noqa: PLC0415  # matplotlib is slow to load
        from bns.diagnose.report.figures import error_by_step_axes  # noqa: PLC0415  # matplotlib is slow to load

        return drawn(ax, lambda axes: error_by_step_axes(axes, self.extended), (5.4, 3.0))

    def _line(self) -> str:
        e = self.extended.errors.horizons[self.ready.predictor.near]
        fell = f"{1e3 * e.models[0].rms_m:.1f} mm to {1e3 * e.models[-1].rms_m:.1f} mm"
        return f"{self.ready.model.name} + {' + '.join(self.extended.names[1:])}: {fell}, {e.horizon} ahead"


def add(
    log: Log,
    effects: Wanted | Sequence[Wanted],
    model: Given,
    *,
    term: str | None = None,
    on: str = "v",
    per_trial: bool = False,
    progress: Progress | None = None,
) -> AddResult:
    """Add effects to a model one after the other, and fit all of its numbers to measurements.

    Args:
        log: a file, a table, or `bns.Measurements`.
        effects: names of listed effects (`bns.effects`), Python files with an ``EFFECT``, `bns.Effect`, or several of these.
        model: `bns.Model`, or the name or file of one.
        term: defines the one name that is no listed effect's as a formula ("k * v * abs(w)"), added to the velocity ``on``: v, w,
            s, east or north. It may use the log's further columns by name (docs/formulas.md).
        per_trial: an effect that may differ from trial to trial (clock-offset) has a separate value in each.
        progress: called with the fraction done (None if unknown) and a text.

    Raises:
        ModelError: there is no such effect or model, or the model already has the effect.
        DataError: measurements that cannot be used, or of another robot.
    """
    wanted = several("effects", effects)
    checked_progress(progress)
    if not wanted:
        raise ModelError("No effect is given; give at least one name of bns.effects().")
    robot = with_effects(model)
    formula = None if term is None else _name_of_formula(wanted, robot)
    ready = prepared(log, robot)
    columns = getattr(ready.predictor.tracks, "extra", ())
    chosen = [_effect(each, robot, term if each == formula else None, on, columns) for each in wanted]
    given = [effect.name for effect, _ in chosen]
    twice = next((name for name in given if given.count(name) > 1), None)
    if twice is not None:
        raise ModelError(f"{twice} is given {given.count(twice)} times; a model can have each effect only once.")
    return added(ready, chosen, per_trial, progress=progress)


@in_force(DEFAULTS)
def added(
    ready: Prepared,
    effects: Sequence[tuple[Effect, Mapping[str, str]]],
    per_trial: bool = False,
    memory: Memory | None = None,
    progress: Progress | None = None,
) -> AddResult:
    """As `add`, for effects and data that are there; ``memory`` keeps fits from one call to the next."""
    told = progress or silent
    extended = add_effects(
        ready.predictor, ready.model, effects, ready.measured, per_trial, memory, told
    )
    told(1.0, "done")
    if ready.fitted_here:
        extended = replace(extended, warnings=(ready.fitted_here, *extended.warnings))
    return AddResult(ready, extended)


def _effect(
    wanted: Wanted, model: Model, term: str | None, on: str, columns: Iterable[str]
) -> tuple[Effect, Mapping[str, str]]:
    return (wanted, {}) if isinstance(wanted, Effect) else effect_from(fspath(wanted), model, term, on, columns)


def _name_of_formula(wanted: Sequence[Wanted], model: Any) -> Wanted:
    """The one name that is no listed effect's, or the only one that is given; ModelError if there is none, or are several."""
    free = [one for one in wanted if not isinstance(one, Effect) and not fspath(one).endswith(".py")]
    if len(wanted) > 1:
        free = [one for one in free if fspath(one) not in model.catalogue()]
    if len(free) != 1:
        names = ", ".join(map(_name, wanted))
        raise ModelError(
            f"A formula needs one name of its own, beside any names of listed effects; given are {names}: {_FORMULA}. "
            "A second formula goes into the model that the first one was added to."
        )
    return free[0]


def _name(wanted: Wanted) -> str:
    return wanted.name if isinstance(wanted, Effect) else fspath(wanted)
