"""A share of a sweep that one job of a cluster carries out by itself."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from bns.errors import SpecError

_TEXT = re.compile(r"(\d{1,6})/(\d{1,6})")
_T = TypeVar("_T")


@dataclass(frozen=True)
class Shard:
    """Share ``number`` (from 1 on) of ``count``; SpecError if there is no such share.

    The shares are disjoint and make up the whole, the same on every machine.
    """

    number: int
    count: int

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise SpecError(f"there is no shard {self.number}/{self.count}: the first number goes from 1 to the second.")

    @classmethod
    def parse(cls, text: str) -> Shard:
        """The shard written as ``3/40``."""
        match = _TEXT.fullmatch(text)
        if match is None:
            raise SpecError(f"a shard is written K/N, as 3/40 for the third of forty, not {text!r}.")
        return cls(int(match[1]), int(match[2]))

    @property
    def name(self) -> str:
        """As it stands in file names: ``3-of-40``."""
        return f"{self.number}-of-{self.count}"

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"

    def share(self, runs: Sequence[_T]) -> Sequence[_T]:
        """Every ``count``-th of the ordered runs: all shards go through the seeds together."""
        return runs[self.number - 1 :: self.count]

