"""What a user has switched on, and the way back: every change makes another state, which undo and redo walk through."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

Key = tuple[str, str]
"""Effect and parameter."""


@dataclass(frozen=True)
class Term:
    """A formula of the user's: its name, what is added, and to which velocity."""

    name: str
    term: str
    on: str


@dataclass(frozen=True)
class Switches:
    """Names of the effects that are on, in the order in which they were switched on; numbers moved by hand; formulas."""

    on: tuple[str, ...] = ()
    by_hand: tuple[tuple[Key, float], ...] = ()
    terms: tuple[Term, ...] = ()

    def switched(self, name: str, on: bool) -> Switches:
        """With an effect on or off; numbers moved by hand are fitted again, since what they stood beside has changed."""
        names = tuple(n for n in self.on if n != name)
        return replace(self, on=(*names, name) if on else names, by_hand=())

    def moved(self, effect: str, parameter: str, value: float) -> Switches:
        """With a number at a value of the user's."""
        return replace(self, by_hand=tuple({**dict(self.by_hand), (effect, parameter): value}.items()))

    def fitted(self) -> Switches:
        """With all numbers as the fit has them."""
        return replace(self, by_hand=())

    def with_term(self, term: Term) -> Switches:
        """With a formula switched on, in the place of one of the same name."""
        others = tuple(t for t in self.terms if t.name != term.name)
        return replace(self.switched(term.name, True), terms=(*others, term))


@dataclass
class History:
    """The states so far; ``at`` is the one in force."""

    states: list[Switches] = field(default_factory=lambda: [Switches()])
    at: int = 0

    @property
    def now(self) -> Switches:
        """The state in force."""
        return self.states[self.at]

    def to(self, state: Switches) -> None:
        """Another state; what was undone is forgotten. Moves of the same number in a row are one step."""
        if state == self.now:
            return
        same_number = self.at > 0 and _same_number(self.states[self.at - 1], self.now, state)
        self.states = [*self.states[: self.at + (0 if same_number else 1)], state]
        self.at = len(self.states) - 1

    def undo(self) -> None:
        """One step back; nothing at the beginning."""
        self.at = max(self.at - 1, 0)

    def redo(self) -> None:
        """One step forward again; nothing at the end."""
        self.at = min(self.at + 1, len(self.states) - 1)


def _same_number(before: Switches, now: Switches, then: Switches) -> bool:
    return _moved(before, now) == _moved(now, then) and len(_moved(now, then)) == 1


def _moved(before: Switches, after: Switches) -> set[Key]:
    """The numbers in which two states differ; none where anything else differs too."""
    if (before.on, before.terms) != (after.on, after.terms):
        return set()
    one, other = dict(before.by_hand), dict(after.by_hand)
    return {key for key in one.keys() | other.keys() if one.get(key) != other.get(key)}
