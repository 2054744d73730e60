"""Fitted numbers as a table, the same for every result that has some."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pandas as pd

COLUMNS = ("effect", "parameter", "value", "se", "low", "high", "unit", "at_bound")


def parameter_table(numbers: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> pd.DataFrame:
    """One row per parameter, from effect -> parameter -> its value, standard error and interval."""
    rows = [{"effect": e, "parameter": p, **one} for e, of_effect in numbers.items() for p, one in of_effect.items()]
    return pd.DataFrame(rows, columns=list(COLUMNS))
