"""What to beware of about accepted effects: what they take for granted, what else may look like them, why they are named."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import stdtr

from bns.diagnose.data.stamps import stamp_scatter
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.estimate.fit import Fit, without_width
from bns.diagnose.estimate.plausibility import known_together
from bns.diagnose.estimate.smoothing_tracker import LATE, smoothing_tracker
from bns.diagnose.outcome import Outcome
from bns.diagnose.predict.horizons import IN_WORDS
from bns.diagnose.predict.jointed import JointedPredictor
from bns.diagnose.residuals.grammar import SHIFTS
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.negligible import Shift
from bns.diagnose.select.result import SelectionResult
from bns.diagnose.select.variants import order_of_friction, uncertain_variants
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import numbers_of, tied_sets
from bns.physics.effect import Effect, Parameter
from bns.physics.figures import figures, figures_apart, with_unit
from bns.physics.jointed.mechanism import machine
from bns.physics.jointed.model import JointedModel
from bns.physics.model import Model

LEAST_FALL = DEFAULTS.select.least_fall
CHANCE = DEFAULTS.residuals.chance
FEWEST_CLOCKS = DEFAULTS.verdict.fewest_clocks
STEADY = DEFAULTS.verdict.clock_steady


def on_effects(
    selection: SelectionResult, tracks: Tracks, imitating: Sequence[str] = (), all_explained: bool = True
) -> Iterator[str]:
    """What each of the accepted and competing effects calls for; what those take for granted that were ``imitating``.

    ``all_explained``: nothing that no listed effect explains is left.
    """
    names = {*selection.accepted, *(name for competitor in selection.competing_models for name in competitor)}
    known = known_effects(selection)
    tied = {
        name
        for group in tied_sets(selection)
        for some in group
        for name in some
        if not all(known[one].of_measuring for others in group for one in others)
    }
    for name in sorted(names):
        if known[name].of_measuring:
            yield f"{name} {'would be' if name in tied else 'is'} {whose_error(known[name])}."
    chain = sorted((known[name] for name in names), key=lambda effect: (effect.place, effect.name))
    logged = {*tracks.extra, *(("session_s",) if tracks.start_known else ())}
    yield from (effect.caveat for effect in chain if effect.caveat and not logged.intersection(effect.explained_by))
    # what an effect takes for granted may be why it seems to imitate something
    assuming = [*chain, *(known[name] for name in imitating if name in known)]
    yield from (effect.assumes for effect in assuming if effect.assumes)
    tracker = smoothing_tracker(selection.problem, selection.fit) if names.intersection(LATE) else None
    yield from filter(None, [tracker.in_words(all_explained) if tracker is not None else ""])
    yield from (text for effect in chain for other, text in effect.beside.items() if other in names)
    yield from (on_numbers(known[name]) for name in selection.accepted if known_together(selection.fit, name))
    yield from _on_stamps(tracks, names)
    yield from _on_times(selection, tracks, names)
    per_trial_effect = selection.fit.model.per_trial_effect
    if per_trial_effect is not None:
        own = np.array(per_trial_effect.trial_values)
        yield (
            f"{per_trial_effect.effect.name} has a separate value in each trial, {own.min():+.3f} to {own.max():+.3f} s; "
            "held-out trials are judged with the clock fitted to other poses of the same trial. "
            "A delay common to all trials cannot be distinguished from the clocks, nor can commands that take effect later in "
            "some trials than in others."
        )
        if tracks.start_known:
            yield from _on_drift(per_trial_effect.effect.name, tracks.start_s, own)


def whose_error(effect: Effect) -> str:
    """Of an effect of the measurement: whether something of the robot would leave the same log."""
    also = effect.or_of_robot
    return f"an error of the measurement, {f'or else one of the model of the robot: {also}' if also else 'not of the robot'}"


def on_servo_speed(selection: SelectionResult) -> Iterator[str]:
    """What the limit of the servos' speed is in radians per second: a share alone nobody can measure."""
    name = "servo-speed-limit"
    predictor = selection.problem.predictor if name in selection.accepted else None
    if isinstance(predictor, JointedPredictor):
        told, share = predictor.told_rad_s, selection.fit.model.values_of(name)["share"]
        yield (
            f"{name}: set points move at up to {told:.3g} rad/s (over half a second), so the servos turn at up to "
            f"{share * told:.3g} rad/s."
        )


def implausible_texts(selection: SelectionResult, fit: Fit) -> Iterator[str]:
    """What to say of accepted effects whose numbers in a fit, the one that is shown, no robot should have."""
    for name, why in selection.implausible_in(fit).items():
        yield _implausible_text(fit, name, why)


def _implausible_text(fit: Fit, name: str, why: str) -> str:
    said = f"{name} fits best, but with an implausible value: {why}. No other set predicts as well; "
    model = fit.model
    if name != "wheelbase" or not isinstance(model, Model):
        return f"{said}check it by an independent measurement."
    really = model.wheelbase_m * model.values_of(name)["factor"]
    return f"{said}is the wheelbase really {model.wheelbase_m:.3g} m, and not {really:.3g} m?"


def on_numbers(effect: Effect) -> str:
    """On an effect of which no number is certain by itself."""
    own = " and ".join(p.name for p in effect.parameters)
    return (
        f"{effect.name}: {own} are only known together. Each by itself may have any value of its interval, and the others make "
        "up for it: do not read one alone, and do not take the sentence at its word."
    )


def _on_drift(name: str, start_s: Array, own_s: Array) -> Iterator[str]:
    """On clocks of trials that move along the session."""
    trials = len(own_s)
    if trials < FEWEST_CLOCKS or np.ptp(start_s) == 0.0 or np.ptp(own_s) == 0.0:
        return
    r = float(np.corrcoef(start_s, own_s)[0, 1])
    t = abs(r) * np.sqrt((trials - 2) / max(1.0 - r * r, 1e-12))
    if 2.0 * float(stdtr(trials - 2, -t)) < CHANCE:
        rate = r * float(own_s.std() / start_s.std())
        changes = f"The values of {name} change by {3600 * rate:+.3g} s per hour of the session (correlation {r:+.2f})"
        if abs(r) > STEADY:
            yield f"{changes}: the clocks run at rates that differ by {1e6 * abs(rate):.3g} parts in a million."
        else:
            yield (
                f"{changes}, and not evenly, as clocks that run at different rates would have it: something else delays, such as "
                "a queue of commands."
            )


def _on_stamps(tracks: Tracks, names: Collection[str]) -> Iterator[str]:
    """On delays that may be the mean of those with which poses are stamped."""
    late = [name for name in SHIFTS if name in names]
    scatter = stamp_scatter(tracks) if late and tracks.timed else None
    if scatter is not None:
        yield (
            f"The poses' time stamps scatter by {1e3 * scatter.sd_s:.2g} ms (see the irregularities in the data), as if they "
            f"were given on arrival: {' and '.join(late)} may be the mean of these delays, and not of the robot."
        )


def _on_times(selection: SelectionResult, tracks: Tracks, names: Collection[str]) -> Iterator[str]:
    """On times that are shorter than the one between poses, where no command was logged between poses."""
    step_s = tracks.commands_at_poses_s
    if step_s is None:
        return
    for active in selection.fit.model.effects:
        for parameter, value in zip(active.effect.parameters, active.values, strict=True):
            if active.effect.name in names and _is_time(active.effect, parameter) and 0 < abs(value) < step_s:
                yield (
                    f"{active.effect.name}: {parameter.name} = {value:.3g} s is shorter than the {step_s:.3g} s between poses, "
                    "and in this log commands change only in rows that have a pose. If a row holds the command of its time, each "
                    f"command began up to {step_s:.3g} s earlier than it seems, which looks like a clock that is off by half of "
                    "that. Log each command in a row of its own, with the time at which it was sent."
                )
                return


def _is_time(effect: Effect, p: Parameter) -> bool:
    """A lag, a delay or a shift of clocks; what a body does has seconds as well where a speed is divided by an acceleration."""
    return p.unit == "s" and effect.stage in {"wheel", "clock"}


def on_longer(selection: SelectionResult, names: Sequence[str]) -> str:
    """Two effects that would do what one accepted effect does, with more numbers than it has."""
    gone = [name for name in selection.accepted if name not in names]
    come = [name for name in names if name not in selection.accepted]
    return f"{' with '.join(come)} in the place of {' with '.join(gone)} would explain as much, with one more effect."


def on_place(found: Outcome) -> Iterator[str]:
    """On effects that could act at another place in the chain; not with terms, which change the numbers."""
    if not found.terms:
        yield from (variant.in_words for variant in uncertain_variants(found.selection))
        order = order_of_friction(found.selection)
        if order:
            yield order


def on_the_cone(model: Model) -> Iterator[str]:
    """On contacts of a body with a friction that no floor has."""
    if isinstance(model, JointedModel) and machine(model.mechanism).pyramidal:
        yield (
            "The model's contacts have a pyramidal friction cone, MuJoCo's default: along the diagonals they hold up to 29% less "
            "than along the axes, as no floor does. An effect of friction may stand for that. Set <option cone=\"elliptic\"/> in "
            "the model and ask again."
        )


def on_moved(found: Outcome) -> Iterator[str]:
    """Numbers that are others without the negligible effects than with them: each outside of the other one's interval."""
    now = numbers_of(found.selection.fit) if found.beside_negligible else {}
    for name, numbers in found.beside_negligible.items():
        pairs = [(key, now[name][key], with_it) for key, with_it in numbers.items() if key in now.get(name, {})]
        moved = [(key, a, b) for key, a, b in pairs if not (_inside(a["value"], b) or _inside(b["value"], a))]
        if moved:
            said = ", ".join(_contrasted(key, b["value"], a["value"], b["unit"]) for key, a, b in moved)
            yield f"With {' and '.join(found.negligible)} in the model, the parameters of {name} differ: {said}."


def _contrasted(name: str, value: float, other: float, unit: str) -> str:
    """Two values of a number, with as many figures as show the difference: 1.0198, not 1.0202."""
    count = figures_apart(value, other, 4)
    return f"{name} = {figures(value, count)}{with_unit(unit)}, not {figures(other, count)}"


def _inside(value: float, number: Mapping[str, Any]) -> bool:
    """Whether a value lies in the interval of a number; so it is said to where there is no interval."""
    low, high = number["low"], number["high"]
    return low is None or high is None or without_width(low, high) or bool(low <= value <= high)


def on_kept(kept_for: Mapping[str, Sequence[Shift]]) -> Iterator[str]:
    """Effects that are named though no error shows them: the data may as well be without them, and then say something else."""
    for name, shifts in kept_for.items():
        said = ", ".join(
            f"{s.parameter} of {s.effect} would be {s.lacking:.3g}{with_unit(s.unit)} instead of {s.having:.3g}" for s in shifts
        )
        yield (
            f"{name} is certain, but without it no error on held-out trials is higher by {LEAST_FALL:.0%} or more. It is named "
            f"because without it {said}: measure one of these by itself to decide."
        )


def on_heading(seen: Mapping[str, tuple[str, float, float]]) -> Iterator[str]:
    """Effects for which the table of errors, which is of positions, has no reason."""
    for name, (horizon, without, having) in seen.items():
        before, after = _apart(1e3 * without, 1e3 * having)
        yield (
            f"{name} lowers the error of the heading (over {IN_WORDS[horizon]} from {before} to {after} mrad), and no error of "
            f"position by {LEAST_FALL:.0%} or more."
        )


def _apart(one: float, other: float) -> tuple[str, str]:
    """Two numbers with as few digits as tell them apart, two at least, and all before the point."""
    whole = len(str(int(max(one, other))))
    written = [(f"{one:.{digits}g}", f"{other:.{digits}g}") for digits in range(max(2, whole), whole + 6)]
    return next((pair for pair in written if pair[0] != pair[1]), written[0])
