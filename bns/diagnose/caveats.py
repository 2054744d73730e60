"""What a verdict cannot say in a word: what to beware of, what is left and where to look, what more trials would settle."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import stdtr

from bns.diagnose.data.split_trials import finer
from bns.diagnose.data.stamps import stamp_scatter
from bns.diagnose.data.tracks import Array, Tracks
from bns.diagnose.data.variables import bare, label, velocity
from bns.diagnose.estimate.cancelling import cancelled
from bns.diagnose.estimate.plausibility import known_together, with_unit
from bns.diagnose.estimate.single_wheel import single_wheel
from bns.diagnose.estimate.smoothing_tracker import LATE, smoothing_tracker
from bns.diagnose.outcome import Outcome
from bns.diagnose.predict.horizons import IN_WORDS
from bns.diagnose.predict.paired_errors import PairedErrors
from bns.diagnose.residuals.grammar import PAST, SHIFTS
from bns.diagnose.residuals.outliers import FAR
from bns.diagnose.residuals.unexplained import Unexplained
from bns.diagnose.residuals.worst_trials import WithoutWorst
from bns.diagnose.select.known_effects import known_effects
from bns.diagnose.select.negligible import Shift
from bns.diagnose.select.result import Candidate, SelectionResult
from bns.diagnose.select.variants import order_of_friction, uncertain_variants
from bns.diagnose.settings import DEFAULTS
from bns.diagnose.values import numbers_of, ties_of, without_width
from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.mechanism import machine
from bns.physics.jointed.model import JointedModel
from bns.physics.model import Model

MOST_EFFECTS = DEFAULTS.select.most_effects
LEAST_FALL = DEFAULTS.select.least_fall
NOTABLE = DEFAULTS.verdict.notable
CHANCE = DEFAULTS.residuals.chance
WORST_SHARE = DEFAULTS.residuals.worst_share
SHOWN = DEFAULTS.report.moments
OFTEN = DEFAULTS.verdict.often
FEWEST_CLOCKS = DEFAULTS.verdict.fewest_clocks


def notes_on(
    found: Outcome,
    tracks: Tracks,
    hint: Candidate | None,
    longer: Sequence[tuple[str, ...]] = (),
    terms: Sequence[str] = (),
    slight: Sequence[str] = (),
    formula_in_words: str = "",
) -> Iterator[str]:
    """All notes, one sentence or two each.

    ``hint``: an effect that more trials might confirm; ``longer``: explanations with one effect more that fit as well;
    ``terms``, ``slight``, ``formula_in_words``: the terms and the formula in words.
    """
    selection = found.selection
    yield from (implausible_text(selection, name) for name in selection.implausible)
    if len(selection.accepted) >= MOST_EFFECTS:
        yield f"The search ends at {MOST_EFFECTS} effects; more may be missing."
    if found.imitating:
        on_floor = isinstance(selection.fit.model, JointedModel)
        what = "a floor that is not alike everywhere" if on_floor else "something that no listed effect explains"
        yield (
            f"{' and '.join(found.imitating)} would lower the error, but only by imitating {what}: with a flexible term for that "
            "in the model, too little gain is left."
        )
    if found.withdrawn:
        yield (
            f"{' with '.join(found.withdrawn)} would raise the likelihood, but not improve predictions of held-out trials "
            "(root mean square and median on the same windows). So it is not presented as an explanation."
        )
    yield from _on_slight(found.unseen, slight)
    known = known_effects(selection) if found.negligible else {}
    for name, numbers in found.negligible.items():
        of_log = name not in known or known[name].of_measuring
        why = " It may be an artefact of the log, such as rounded time stamps." if of_log else ""
        said = ", ".join(f"{key} = {number['value']:.3g}{with_unit(number['unit'])}" for key, number in numbers.items())
        yield (
            f"{name} is certain but negligible ({said}): without it no error on held-out trials is higher by {LEAST_FALL:.0%} or "
            f"more, so it is not named.{why}"
        )
    yield from _on_moved(found)
    yield from _on_kept(found.kept_for)
    yield from _on_heading(found.seen_in_heading)
    yield from _on_effects(selection, tracks, found.imitating)
    yield from single_wheel(found.terms[0].fit if _described(found) else selection.fit)  # the numbers that are shown
    yield from _on_the_cone(selection.fit.model)
    for names in longer:
        yield _on_longer(selection, names)
    yield from _on_place(found)
    yield from _on_rest(found.rest, tracks)
    formula = found.formula
    if formula is not None and not formula.signal and formula.paired_comparison.p_value < CHANCE:
        values = ", ".join(f"{k} = {v:.4g}" for k, v in formula.values.items())
        said = f"{formula_in_words}: " if formula_in_words else ""
        yield f"A candidate term: {said}{formula.on} + {formula.term} with {values}."
    yield from _on_terms(found, terms, tracks)
    yield from _on_undescribed(found)
    if hint is not None:
        more = int(np.ceil(len(tracks) * max((3.2 / max(hint.paired_comparison.z, 0.5)) ** 2 - 1, 0.5)))
        few = f"{hint.name} may be missing, but {len(tracks)} trials are too few to decide; about {more} more would decide."
        yield few + finer(tracks.duration_s.sum(axis=1))
    for c in selection.steps[0].ranking if not selection.accepted else ():  # what is found explains the others' odd numbers
        if c.rejected_because and c.paired_comparison.elpd_diff > NOTABLE * float(selection.nominal.losses.mean()):
            yield (
                f"{c.name} would lower the error, but is no explanation: fitted, {c.rejected_because}. If a measurement of your "
                "own says that this is so, add the effect all the same (bns add)."
            )


def _on_terms(found: Outcome, terms: Sequence[str], tracks: Tracks) -> Iterator[str]:
    """On what no effect explains, in words; or why it is not in the extended model."""
    selection, with_terms = found.selection, found.errors_with_terms
    if with_terms is not None and not with_terms.falls_in_the_end:
        yield from [_on_rejected(terms, with_terms)] if terms else []
        return
    yield from (f"What no listed effect explains behaves like this: {words}." for words in terms)
    if found.terms:
        past = any(term.signal in PAST for term in found.terms)
        yield from (one.in_words for one in cancelled(selection.fit, found.terms[0].fit, selection.accepted, past))
        yield _on_reach(tracks)


def _described(found: Outcome) -> bool:
    """Are there terms, and may they be added?"""
    return bool(found.terms) and (found.errors_with_terms is None or found.errors_with_terms.falls_in_the_end)


def _on_undescribed(found: Outcome) -> Iterator[str]:
    """On effects beside something that no term describes: nothing tells how much of it they stand for."""
    names = found.selection.accepted
    if _described(found) or not names or not found.rest.any:
        return
    known = {h: one for h, one in found.errors.horizons.items() if one.models and one.noise_floor_m > 0}
    at = max(known, key=lambda h: known[h].models[-1].rms_m / known[h].noise_floor_m, default="")
    error, noise = (f"{1e3 * m:.3g} mm" for m in (known[at].models[-1].rms_m, known[at].noise_floor_m)) if at else ("", "")
    sizes = f" (error over {IN_WORDS[at]}: {error}; by noise alone: {noise})" if at else ""
    it, them = ("it", "this effect") if len(names) == 1 else ("they", "these effects")
    yield (
        f"No term describes what is left beside {' and '.join(names)}{sizes}, so {it} may stand for a part of that. The "
        f"intervals hold only if what is left has nothing to do with {them}."
    )


def _on_reach(tracks: Tracks) -> str:
    """Where terms that were fitted hold: a free curve says nothing of commands that were not driven."""
    wheels = tracks.left_m_s, tracks.right_m_s
    low, high = min(float(w.min()) for w in wheels), max(float(w.max()) for w in wheels)
    return (
        f"The free terms describe what this log has driven (wheels from {low:.3g} to {high:.3g} m/s, and turns as quick as "
        "these). Beyond that they are a guess: drive what you will ask of the model, and give it as --more."
    )


def implausible_text(selection: SelectionResult, name: str) -> str:
    """What to say of an accepted effect whose numbers no robot should have."""
    said = f"{name} fits best, but with an implausible value: {selection.implausible[name]}. No other set predicts as well; "
    model = selection.fit.model
    if name != "wheelbase" or not isinstance(model, Model):
        return f"{said}check it by an independent measurement."
    really = model.wheelbase_m * model.values_of(name)["factor"]
    return f"{said}is the wheelbase really {model.wheelbase_m:.3g} m, and not {really:.3g} m?"


def _on_slight(unseen: bool, slight: Sequence[str]) -> Iterator[str]:
    """On what is certainly left and does not count."""
    if unseen:
        described = f" ({'; '.join(slight)})" if slight else ""
        yield (
            f"What is left is certain but slight{described}: at every horizon it adds less to the error than the noise of the "
            "tracker does, so the verdict does not count it."
        )
    elif slight:
        yield (
            f"What is left is certain but slight: {'; '.join(slight)}. A term for it lowers no error on held-out trials by "
            f"{LEAST_FALL:.0%} for certain, so the verdict does not count it."
        )


def on_worst(both: WithoutWorst) -> str:
    """What becomes of a verdict with and without trials that are unlike the rest, how they are unlike, and what would say why."""
    one = len(both.trials) == 1
    counts, them = ("It does not count in the fits, but is", "it") if one else ("They do not count in the fits, but are", "them")
    known = {a.trial: f" ({a.in_words})" for a in both.apart[:SHOWN]}
    each = [f"{name}{known.get(name, '')}" for name in both.trials]
    those = f"trial {each[0]}" if one else f"trials {'; '.join(each) if known else ', '.join(each)}"
    verdict, effects = both.with_them
    other = f"{verdict} ({', '.join(effects)})" if effects else verdict
    said = f"the verdict is the same with {them}" if both.same else f"with {them} the verdict would be {other}"
    return (
        f"Unlike all others as a whole: {those}. {counts} part of the errors shown; {said}. {_causes(both)}`--without` excludes "
        f"{them}."
    )


def _causes(both: WithoutWorst) -> str:
    """Which causes are left of trials that are unlike the rest, and what tells them apart."""
    said = ""
    if any(a.once and not a.jumped for a in both.apart):
        said += (
            "One moment is a push, a slip, a cable that caught, a tracker that lost the robot, or a command that the log has at "
            "a wrong time: a film, or the logged commands of that moment, tells which. "
        )
    if any(not a.once for a in both.apart):
        said += (
            "The model lacks something, so a trial that differs throughout may be one in which this matters most. "
            if both.without[0] == "unlisted"
            else "A trial that differs throughout had another load, floor or start, or its commands are logged at wrong times or "
            "ask for what the model has least right: repeat it with the same commands. If it is off again, these tell why. "
        )
    return said


def on_many_apart(trials: Sequence[str]) -> str:
    """On trials that are unlike the rest and too many to be left out."""
    return (
        f"Unlike all others as a whole: trials {', '.join(trials)}. They are more than {WORST_SHARE:.0%} of all trials, so they "
        "count: what happened there may happen again. `--without` excludes them."
    )


def _on_rejected(terms: Sequence[str], with_terms: PairedErrors) -> str:
    """On terms that fit, and with which the error on held-out trials rises, or does not fall."""
    risen = with_terms.rose_in_the_end
    fallen = [horizon for horizon in with_terms.fell_in_the_end if horizon not in risen]
    rose, fell = (" and ".join(IN_WORDS.get(h, h) for h in names) for names in (risen, fallen))
    though = f", though it falls over {fell}" if fell else ""
    what = "a free term fits best that says" if len(terms) == 1 else "free terms fit best that say"
    them = "it" if len(terms) == 1 else "them"
    begun = f"Of what no listed effect explains {what}: {'; '.join(terms)}. With {them} the error on "
    if not risen:
        return f"{begun}held-out trials does not fall where its change is surest, so the extended model does without."
    return (
        f"{begun}held-out trials (root mean square or median) rises over {rose}{though}. So something else happens, and the "
        "extended model does without."
    )


def _on_the_cone(model: Model) -> Iterator[str]:
    if isinstance(model, JointedModel) and machine(model.mechanism).pyramidal:
        yield (
            "The model's contacts have a pyramidal friction cone, MuJoCo's default: along the diagonals they hold up to 29% less "
            "than along the axes, as no floor does. An effect of friction may stand for that. Set <option cone=\"elliptic\"/> in "
            "the model and ask again."
        )


def _on_moved(found: Outcome) -> Iterator[str]:
    """Numbers that are others without the negligible effects than with them: each outside of the other one's interval."""
    now = numbers_of(found.selection.fit) if found.beside_negligible else {}
    for name, numbers in found.beside_negligible.items():
        pairs = [(key, now[name][key], with_it) for key, with_it in numbers.items() if key in now.get(name, {})]
        moved = [(key, a, b) for key, a, b in pairs if not (_inside(a["value"], b) or _inside(b["value"], a))]
        if moved:
            said = ", ".join(f"{key} = {b['value']:.4g}{with_unit(b['unit'])}, not {a['value']:.4g}" for key, a, b in moved)
            yield f"With {' and '.join(found.negligible)} in the model, the parameters of {name} differ: {said}."


def _on_kept(kept_for: Mapping[str, Sequence[Shift]]) -> Iterator[str]:
    """Effects that are named though no error shows them: the data may as well be without them, and then say something else."""
    for name, shifts in kept_for.items():
        said = ", ".join(
            f"{s.parameter} of {s.effect} would be {s.lacking:.3g}{with_unit(s.unit)} instead of {s.having:.3g}" for s in shifts
        )
        yield (
            f"{name} is certain, but without it no error on held-out trials is higher by {LEAST_FALL:.0%} or more. It is named "
            f"because without it {said}: measure one of these by itself to decide."
        )


def _on_heading(seen: Mapping[str, tuple[str, float, float]]) -> Iterator[str]:
    """Effects for which the table of errors, which is of positions, has no reason."""
    for name, (horizon, without, having) in seen.items():
        yield (
            f"{name} lowers the error of the heading (over {IN_WORDS[horizon]} from {1e3 * without:.2g} to {1e3 * having:.2g} "
            f"mrad), and no error of position by {LEAST_FALL:.0%} or more."
        )


def _inside(value: float, number: Mapping[str, Any]) -> bool:
    """Whether a value lies in the interval of a number; so it is said to where there is no interval."""
    low, high = number["low"], number["high"]
    return low is None or high is None or without_width(low, high) or bool(low <= value <= high)


def _on_longer(selection: SelectionResult, names: Sequence[str]) -> str:
    """Two effects that would do what one accepted effect does; whether they have as many numbers as it has."""
    known = known_effects(selection)
    gone = [name for name in selection.accepted if name not in names]
    come = [name for name in names if name not in selection.accepted]
    lost, gained = (sum(len(known[name].parameters) for name in some) for some in (gone, come))
    numbers = "as many numbers" if gained == lost else "fewer numbers" if gained < lost else ""
    more = f"one more effect and {numbers}" if numbers else "one more effect"
    return f"{' with '.join(come)} in the place of {' with '.join(gone)} would explain as much, with {more}."


def _on_place(found: Outcome) -> Iterator[str]:
    """On effects that could act at another place in the chain; not with terms, which change the numbers."""
    if not found.terms:
        yield from (variant.in_words for variant in uncertain_variants(found.selection))
        order = order_of_friction(found.selection)
        if order:
            yield order


def _on_effects(selection: SelectionResult, tracks: Tracks, imitating: Sequence[str] = ()) -> Iterator[str]:
    names = {*selection.accepted, *(name for competitor in selection.competing_models for name in competitor)}
    known = known_effects(selection)
    tied = {name for group in ties_of(selection) for name in group if not all(known[one].of_measuring for one in group)}
    for name in sorted(names):
        if known[name].of_measuring:
            begun = f"{name} {'would be' if name in tied else 'is'} an error of the measurement"
            also = known[name].or_of_robot
            yield f"{begun}, or else one of the model of the robot: {also}." if also else f"{begun}, not of the robot."
    chain = sorted((known[name] for name in names), key=lambda effect: (effect.place, effect.name))
    logged = {*tracks.extra, *(("session_s",) if tracks.start_known else ())}
    yield from (effect.caveat for effect in chain if effect.caveat and not logged.intersection(effect.explained_by))
    # what an effect takes for granted may be why it seems to imitate something
    assuming = [*chain, *(known[name] for name in imitating if name in known)]
    yield from (effect.assumes for effect in assuming if effect.assumes)
    tracker = smoothing_tracker(selection.problem, selection.fit) if names.intersection(LATE) else None
    yield from [tracker.in_words] if tracker is not None and tracker.in_words else []
    yield from (text for effect in chain for other, text in effect.beside.items() if other in names)
    yield from (_on_numbers(known[name]) for name in selection.accepted if known_together(selection.fit, name))
    yield from _on_stamps(tracks, names)
    yield from _on_times(selection, tracks, names)
    per_trial_effect = selection.fit.model.per_trial_effect
    if per_trial_effect is not None:
        own = np.array(per_trial_effect.trial_values)
        yield (
            f"{per_trial_effect.effect.name} has a separate value in each trial, {own.min():+.3f} to {own.max():+.3f} s; "
            "held-out trials are judged with the clock fitted to other poses of the same trial. "
            "A delay common to all trials cannot be distinguished from the clocks."
        )
        if tracks.start_known:
            yield from _on_drift(per_trial_effect.effect.name, tracks.start_s, own)


def _on_numbers(effect: Effect) -> str:
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
        yield (
            f"The values of {name} change by {3600 * rate:+.3g} s per hour of the session (correlation {r:+.2f}): the clocks "
            f"run at rates that differ by {1e6 * abs(rate):.3g} parts in a million."
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


def _on_rest(rest: Unexplained, tracks: Tracks) -> Iterator[str]:
    if left := rest.residual_dependence[:SHOWN]:
        along = ", ".join(f"{bare(velocity(p.channel))} along {bare(label(p.variable))} ({p.share:.2%})" for p in left)
        chance = max(p.paired_comparison.p_value for p in left)
        yield (
            "Left unexplained by listed effects, with the fraction of the loss on held-out trials that a free curve along a "
            f"variable removes: {along}; p {'<' if chance < 1e-4 else '<='} {max(chance, 1e-4):.2g}."
        )
    if rest.command_times is not None:
        yield rest.command_times.note
    if rest.autocorrelation is not None:
        yield rest.autocorrelation.in_words
    if rest.outliers:
        worst = "; ".join(o.in_words for o in rest.outliers[:SHOWN])
        more = ", and so on" if len(rest.outliers) > SHOWN else ""
        some = f"{len(rest.outliers)} of {len(tracks)} trials"
        begun = f"{some} have moments with more than {FAR:g} times the usual error ({worst}{more})"
        if rest.shared is not None:
            yield f"{begun}. What they share: {rest.shared.in_words}. Look at what the robot does after such commands."
        elif rest.place is not None:
            yield f"{begun}. What they share: {rest.place.in_words}. Look at what differs there: the floor, tracking, a cable."
        elif len(rest.outliers) >= OFTEN * len(tracks):
            yield f"{begun}. That is too often for accidents: look for what they share, such as a place or a change of command."
        else:
            yield (
                f"{begun}. If they share a place, a direction or a change of command, the robot or the floor does this, and it "
                "comes back when that is driven again; else something happened once, such as a push or a cable that caught."
            )
