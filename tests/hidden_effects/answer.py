"""What the product said, read from its JSON: a verdict, and the sets of effects that it says explain the data equally well."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

VERDICTS = ("none", "effects", "tie", "unlisted", "insufficient-data")


@dataclass(frozen=True)
class Answer:
    """`explanations`: one set for `effects`, all that are tied for `tie`, none otherwise. `effects` as they were listed."""

    verdict: str
    effects: tuple[str, ...]
    explanations: frozenset[frozenset[str]]
    parameters: dict[str, dict[str, dict[str, Any]]]


def read(given: dict[str, Any]) -> Answer:
    """Of the product's object; a verdict that nobody knows is kept, and is never right.

    Where whole sets are tied, `explanations` lists them; else they are read from `ties`, whose elements may be joined by "+".
    """
    verdict, effects = str(given.get("verdict")), tuple(given.get("effects") or ())
    groups = given.get("ties") or []
    explanations: set[frozenset[str]] = set()
    if verdict == "effects":
        explanations = {frozenset(effects)}
    if verdict == "tie":
        told = given.get("explanations")
        explanations = {frozenset(names) for names in told} if told else _expanded(frozenset(effects), groups)
    return Answer(verdict, effects, frozenset(explanations), given.get("parameters") or {})


def _expanded(effects: frozenset[str], groups: list[list[str]]) -> set[frozenset[str]]:
    """Every choice of one element a group, beside what is listed and belongs to no group."""
    choices = [[frozenset(element.split("+")) for element in group] for group in groups if group]
    for group in choices:
        fitted = next((element for element in sorted(group, key=len, reverse=True) if element <= effects), frozenset())
        effects -= fitted
    return {effects.union(*chosen) for chosen in product(*choices)}
