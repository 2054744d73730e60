"""What a figure's script hands over: the picture, its numbers and its caption."""

from __future__ import annotations

from dataclasses import dataclass, field

import pandas as pd
from matplotlib.figure import Figure


@dataclass(frozen=True)
class FigureResult:
    """A figure and what its caption says: ``n`` runs stand in it, ``missing`` names what does not.

    ``shows`` says what is drawn and how, ``see`` what to look for; ``data`` are the numbers behind the picture, written
    beside it as CSV; ``table`` is what of them the page shows as a table. Without a picture the table stands alone.
    """

    name: str
    title: str
    figure: Figure | None
    shows: str
    n: int
    sweeps: tuple[str, ...]
    missing: tuple[str, ...] = ()
    see: str = ""
    data: pd.DataFrame | None = field(default=None, compare=False)
    table: pd.DataFrame | None = field(default=None, compare=False)
