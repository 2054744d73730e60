"""Every threshold of the diagnosis, with its unit and its reason. Modules of the rooms name those that they use."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field, fields
from typing import Any

from bns.diagnose.settings.data import Data
from bns.diagnose.settings.design import Design
from bns.diagnose.settings.estimate import Estimate
from bns.diagnose.settings.predict import Predict
from bns.diagnose.settings.report import Report
from bns.diagnose.settings.residuals import Residuals
from bns.diagnose.settings.select import Select, Verdict

DIGITS = 12
"""Hexadecimal digits of the digest: two settings that differ share one by chance in one of 3e14 cases."""


@dataclass(frozen=True)
class Settings:
    """The settings of all rooms, in the order in which a log walks through them."""

    data: Data = field(default_factory=Data)
    predict: Predict = field(default_factory=Predict)
    estimate: Estimate = field(default_factory=Estimate)
    select: Select = field(default_factory=Select)
    residuals: Residuals = field(default_factory=Residuals)
    verdict: Verdict = field(default_factory=Verdict)
    design: Design = field(default_factory=Design)
    report: Report = field(default_factory=Report)

    def as_json(self) -> dict[str, dict[str, Any]]:
        """Room -> name -> value, plain values in SI units; tuples are lists."""
        plain: dict[str, dict[str, Any]] = json.loads(json.dumps(asdict(self)))
        return plain

    def digest(self) -> str:
        """The first `DIGITS` hexadecimal digits of the SHA-256 of `as_json`, keys sorted: the same values, the same digest."""
        return hashlib.sha256(json.dumps(self.as_json(), sort_keys=True).encode()).hexdigest()[:DIGITS]

    def rows(self) -> Iterator[tuple[str, str, Any, str, str]]:
        """Room, name, value, unit and reason of every setting, in order."""
        for room in fields(self):
            held = getattr(self, room.name)
            for one in fields(held):
                yield room.name, one.name, getattr(held, one.name), one.metadata["unit"], one.metadata["why"]


DEFAULTS = Settings()
"""What every diagnosis goes by."""
