"""`bns.diagnose`: which physical effect a model lacks, how sure that is, and what else it could be."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pandas as pd

from bns.api.common.arguments import checked_progress, several
from bns.api.common.cache import remembered
from bns.api.common.next_command import model_words, noted, own_files, repeated
from bns.api.common.parameters import parameter_table
from bns.api.common.prepared import Prepared, prepared, with_effects
from bns.api.common.progress import Meter, Progress
from bns.api.common.provenance import provenance
from bns.api.common.shown import Shown, counted
from bns.api.measurements import SAVED, Log, Measurements
from bns.api.model import Given, Model
from bns.diagnose.adding import documented
from bns.diagnose.design.competing_models import Rival, rivals_of
from bns.diagnose.diagnosing import diagnose as find
from bns.diagnose.diagnosis import Diagnosis
from bns.diagnose.estimate.fit import Fit
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.report.text import diagnosis_text
from bns.diagnose.settings import DEFAULTS, Settings
from bns.diagnose.settings.chosen import Chosen, changes_text, in_force, settings_of
from bns.diagnose.values import ranked_values
from bns.errors import DataError
from bns.physics.effect import Effect
from bns.physics.effects import effect_in_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from bns.api.propose import ProposeResult
    from bns.api.report import ReportResult

    Explorer = Any
    """`bns.Explorer`: it stands on a higher floor."""

PHASES = {"errors on trials held out": 0.7, "what is left": 0.8, "longer explanations": 0.9}
"""What share of a diagnosis is done when it tells so; before that every effect is tried."""
STEPS = 2.0
"""How often each effect is tried in most searches: once for every effect that is found, and once more."""
RANKING = ("rank", "elpd_diff", "dse", "p_value", "rejected_because")


@dataclass(frozen=True, repr=False)
class DiagnoseResult(Shown):
    """A verdict and its evidence. ``diagnosis`` holds the complete result, ``ready`` the data and the model behind it."""

    ready: Prepared
    diagnosis: Diagnosis
    settings: Settings = DEFAULTS
    asked: Mapping[str, Any] = field(default_factory=dict)
    """What a command line would repeat of the arguments, beside data and model."""

    @property
    def verdict(self) -> str:
        """none, effects, tie, unlisted or insufficient-data."""
        return self.diagnosis.verdict

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that the model lacks, in the order in which they were found."""
        return self.diagnosis.effects

    @property
    def model(self) -> Model:
        """The model refitted with these effects; the unchanged model if there were too few data to fit.

        With 95 % intervals and where its numbers come from, as that of `bns.add`; `bns.Model.save` writes it. If terms describe
        the remaining structure, `parameters` are fitted together with them; see `model_with_terms`.
        """
        selection = self.diagnosis.selection
        if selection is None:
            return self.ready.model
        return self._documented(selection.fit, self.diagnosis.errors)

    @property
    def model_with_terms(self) -> Model | None:
        """The model with the effects and the terms that describe what no effect explains; None if there are none."""
        terms = self.diagnosis.terms
        if not terms:
            return None
        return self._documented(terms[0].fit, self.diagnosis.errors_with_terms)

    @property
    def extended(self) -> Model | None:
        """The model with all that was found, effects and terms, as `bns diagnose -o` writes it; None if nothing was found.

        Without terms with which the error on held-out trials does not fall, or rises at any horizon.
        """
        with_terms = None if self.diagnosis.terms_rejected else self.model_with_terms
        return with_terms or (self.model if self.effects else None)

    @property
    def notes(self) -> tuple[str, ...]:
        """Further remarks on the verdict, a sentence or two each."""
        return self.diagnosis.notes

    @cached_property
    def rivals(self) -> tuple[Rival, ...]:
        """After a tie: the other explanations with their parameters, the best first; fitted when first asked for."""
        return rivals_of(self.diagnosis)

    @property
    def ranking(self) -> pd.DataFrame:
        """Gain of each effect when added alone, the best first: one row per effect, indexed by name.

        Columns: rank (from 0), elpd_diff (gain in log-likelihood per held-out trial), dse (its standard error), p_value,
        rejected_because (why it is not considered; "" if it is), and values (fitted parameters, {name: value in SI units}).
        """
        ranked = self.diagnosis.as_json()["ranking"]
        rows = [
            {
                "rank": place,
                "elpd_diff": entry["elpd_diff"],
                "dse": entry["dse"],
                "p_value": entry["p_value"],
                "rejected_because": entry["rejected_because"],
                "values": {name: number["value"] for name, number in entry["parameters"].items()},
            }
            for place, entry in enumerate(ranked)
        ]
        names = pd.Index([entry["name"] for entry in ranked], name="effect")
        return pd.DataFrame(rows, index=names, columns=[*RANKING, "values"])

    @property
    def parameters(self) -> pd.DataFrame:
        """Parameters of the accepted effects: effect, parameter, value, se, low, high (95 % interval), unit, at_bound."""
        return parameter_table(self.diagnosis.as_json()["parameters"])

    @property
    def errors(self) -> pd.DataFrame:
        """Position error (m) on held-out trials, before and after on the same windows: one row per horizon.

        Columns, in m: before, after (root mean square), median_before, median_after, change (after less before, so below 0 is
        better), change_low, change_high (its 95 % interval, paired by trial), noise_floor (of the tracking). Numbers of windows:
        windows, windows_left_out. Of `model`; if there are terms, see `errors_with_terms`.
        """
        return pd.DataFrame(self.diagnosis.as_json()["error"]).T.rename_axis("horizon")

    @property
    def errors_with_terms(self) -> pd.DataFrame:
        """As `errors`, before and after adding all effects and terms (`model_with_terms`); empty if there are no terms."""
        return pd.DataFrame(self.diagnosis.as_json()["error_with_terms"]).T.rename_axis("horizon")

    def summary(self, command: Mapping[str, str] | None = None) -> str:
        """Verdict first; then numbers, errors, ranking, notes. ``command``: words (data, model) that further commands repeat."""
        words = command or self.command
        return changes_text(self.settings) + noted(diagnosis_text(self.diagnosis, self.rivals, words), words)

    @property
    def command(self) -> dict[str, str]:
        """Words (data, model and what else was given) for the commands that follow."""
        words = repeated(**{**self.ready.log.given, **model_words(self.ready.model), **self.asked})
        return {**words, "before": SAVED} if self.ready.log.only_in_memory else words

    def to_json(self) -> dict[str, Any]:
        """One object of plain values, as `bns diagnose --json` prints it."""
        return {
            **self.diagnosis.as_json(),
            "rivals": [rival.as_json() for rival in self.rivals],
            "provenance": provenance(self.ready.model, self.ready.log.sha256, self.settings),
        }

    def plot(self, ax: Axes | None = None, most: int = 12) -> Axes:
        """Gain of each effect on held-out trials, with 95 % intervals. DataError if there were too few data for a search."""
        from bns.api.common.axes import drawn  # noqa: PLC0415  # matplotlib is slow to load
        from bns.diagnose.report.figures import ranking_axes  # noqa: PLC0415  # matplotlib is slow to load

        if self.diagnosis.selection is None:
            raise DataError(f"Nothing was ranked: {'; '.join(self.notes)}")
        return drawn(ax, lambda axes: ranking_axes(axes, self.diagnosis, most), (5.4, 3.8))

    def propose(self, **limits: Any) -> ProposeResult:
        """The next experiment, as `bns.propose` gives it, without diagnosing again."""
        from bns.api.propose import proposed  # noqa: PLC0415  # it builds on this module

        return proposed(self, **limits)

    def report(self, path: str | PathLike[str] = "report.html", **limits: Any) -> ReportResult:
        """The report, as `bns.report` writes it, without diagnosing again."""
        from bns.api.report import reported  # noqa: PLC0415  # it builds on this module

        return reported(self, path, **limits)

    def explore(self, **options: Any) -> Explorer:
        """This diagnosis as a page in the browser, as `bns.explore` opens it."""
        import bns  # noqa: PLC0415  # the front door knows where the page is

        return bns.explore(self, **options)

    def _documented(self, fit: Fit, errors: PairedErrors | None) -> Model:
        """The fitted model; effects of the user's own with their files, without which nobody could read them back."""
        model = documented(fit, self.ready.model, self.ready.measured, errors, self.ready.predictor)
        files = {n: {"file": str(Path(file).resolve())} for n, file in own_files(self.asked.get("also", ())).items()}
        if files:
            known = tuple(replace(a, written=files.get(a.effect.name, a.written)) for a in model.effects)
            model = replace(model, effects=known)
        return Model(model)

    def _line(self) -> str:
        lacks = f" ({', '.join(self.effects)})" if self.effects else ""
        trials = counted(len(self.ready.log), "trial")
        return f"{self.verdict}{lacks}; {self.ready.model.name} on {self.ready.log.name}, {trials}"


def diagnose(
    log: Log,
    model: Given,
    *,
    also: Iterable[Effect | str | PathLike[str]] = (),
    without_effects: Iterable[str] = (),
    settings: Chosen | None = None,
    fresh: bool = False,
    progress: Progress | None = None,
    alone: Callable[[Mapping[str, Any]], None] | None = None,
) -> DiagnoseResult:
    """Find what a model lacks.

    Args:
        log: a file, a table, or `bns.Measurements`; at least twelve trials.
        model: `bns.Model`, or the name or file of one.
        also: effects of your own, tried in addition to the listed ones: `bns.Effect` or a Python file with an ``EFFECT``.
        without_effects: names of listed effects to exclude.
        settings: thresholds that differ from the default (docs/settings.md): a mapping of section -> name -> value, a YAML
            file of one, or `bns.diagnose.settings.Settings`. Changed settings are listed in the summary and in the provenance.
        fresh: compute the answer again instead of taking it from the cache (docs/python.md).
        progress: called with the fraction done (0 to 1, an estimate that never falls) and a text.
        alone: called with the gain of each effect alone as soon as it is known, as an entry of ``ranking`` in the JSON. It is
            called from several threads; a later search (without outlying trials) may correct the values.

    Raises:
        DataError: measurements that cannot be used, or of another robot.
        ModelError: there is no such model, or the file of an effect cannot be used.
    """
    checked_progress(progress)
    chosen = settings_of(settings)
    also, without_effects = several("also", also), several("without_effects", without_effects)
    with in_force(chosen):
        found = _found(_checked_again(log, chosen), model, also, without_effects, chosen, fresh, progress, alone)
    return replace(found, asked=_asked(model, also, without_effects, settings))


def _asked(
    model: Given, also: Iterable[Effect | str | PathLike[str]], without_effects: Iterable[str], settings: Chosen | None
) -> dict[str, Any]:
    """Those arguments that are names or files: a command line has no others."""
    return {
        **({"model": fspath(model)} if isinstance(model, str | PathLike) else {}),
        "also": tuple(fspath(file) for file in also if not isinstance(file, Effect)),
        "without_effects": tuple(without_effects),
        "settings": fspath(settings) if isinstance(settings, str | PathLike) else None,
    }


def _checked_again(log: Log, settings: Settings) -> Log:
    """Measurements that were read under the default settings, checked under these."""
    if settings.data == DEFAULTS.data or not isinstance(log, Measurements):
        return log
    return log.checked_again()


def _found(
    log: Log,
    model: Given,
    also: Iterable[Effect | str | PathLike[str]],
    without_effects: Iterable[str],
    settings: Settings,
    fresh: bool,
    progress: Progress | None,
    alone: Callable[[Mapping[str, Any]], None] | None,
) -> DiagnoseResult:
    own = [each if isinstance(each, Effect) else effect_in_file(Path(each)) for each in also]
    robot = with_effects(model)
    barred = [robot.effect_named(name).name for name in without_effects]
    ready = prepared(log, robot)
    extra = {effect.name: effect for effect in own}
    meter = Meter(progress, PHASES, pace=STEPS * (len(ready.model.catalogue()) + len(extra)))

    def work() -> Diagnosis:
        told = (lambda candidate: None) if alone is None else (lambda candidate: alone(ranked_values(candidate)))
        return find(ready.predictor, ready.model, extra=extra, tick=meter, barred=barred, alone=told).slim()

    found = work() if own else remembered("diagnose", ready, sorted(barred), work, Diagnosis, fresh, settings)
    meter.done()
    if ready.fitted_here:
        found = replace(found, notes=(ready.fitted_here, *found.notes))
    return DiagnoseResult(ready, found, settings)
