"""Right, abstained or wrong: an answer against what is acceptable, and against the true parameters."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from tests.hidden_effects.acceptable import acceptable
from tests.hidden_effects.answer import Answer
from tests.hidden_effects.world import World

RIGHT, ABSTAINED, WRONG = "right", "abstained", "wrong"


@dataclass(frozen=True)
class Coverage:
    """Whether a true parameter lies within its reported interval."""

    effect: str
    name: str
    true: float
    low: float | None
    high: float | None

    @property
    def inside(self) -> bool:
        """An interval that was not reported holds nothing."""
        return self.low is not None and self.high is not None and self.low <= self.true <= self.high


def judge(world: World, answer: Answer) -> str:
    """`insufficient-data` abstains under hard conditions, and is wrong under those of the targets."""
    if any(_fits(answer, right) for right in acceptable(world)):
        return RIGHT
    return ABSTAINED if answer.verdict == "insufficient-data" and is_hard(world) else WRONG


def is_hard(world: World) -> bool:
    """Fewer trials, a coarser camera, or poses at the ends of commands only."""
    return world.trials < 60 or world.camera.position_m > 0.0015 or world.layout.rows == "ends"


def _fits(answer: Answer, right: dict[str, object]) -> bool:
    required, allowed = (_as_sets(right[key]) for key in ("required", "allowed"))
    if answer.verdict != right["verdict"]:
        return False
    return answer.verdict in {"none", "unlisted"} or required <= answer.explanations <= required | allowed


def _as_sets(explanations: object) -> frozenset[frozenset[str]]:
    assert isinstance(explanations, Iterable)
    return frozenset(frozenset(names) for names in explanations)


def said(world: World, answer: Answer) -> str:
    """The answer in few words, for the confusion matrix."""
    if answer.verdict == "effects" and len(answer.effects) == 1:
        return answer.effects[0]
    several = {"effects": "set", "tie": "tie"}
    if answer.verdict in several:
        return f"{'right' if judge(world, answer) == RIGHT else 'other'} {several[answer.verdict]}"
    return answer.verdict


def coverage(world: World, answer: Answer) -> list[Coverage]:
    """Of every hidden parameter whose effect is part of a model without others; none for unlisted worlds."""
    if world.unlisted or set(answer.parameters) != set(world.hidden):
        return []
    return [
        Coverage(effect, name, true, *_interval(answer.parameters[effect].get(name, {})))
        for effect, parameters in world.hidden.items()
        for name, true in parameters.items()
    ]


def _interval(reported: dict[str, float]) -> tuple[float | None, float | None]:
    return reported.get("low"), reported.get("high")
