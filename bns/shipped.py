"""Folders that come with the package: beside it in a checkout, inside it where it was installed from a wheel."""

from __future__ import annotations

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
_INSIDE = "_shipped"
"""Where `setup.py` puts them. Looked at first: beside an installed package other packages lie, whatever their names."""


def shipped_root(folder: str) -> Path | None:
    """The folder that ``folder`` (analysis, sweeps) lies in; None if it did not come with this package."""
    for root in (PACKAGE / _INSIDE, PACKAGE.parent):
        if (root / folder).is_dir():
            return root
    return None
