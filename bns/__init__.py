"""Bootstrapped Neuro-Simulation: run it, sweep it, analyse the batch."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"
__all__ = ["__version__", "load"]

if TYPE_CHECKING:
    from bns.store import load


def __getattr__(name: str) -> Any:
    """`bns.load(DIR)`: the store's reader, imported when it is asked for."""
    if name == "load":
        from bns.store import load  # noqa: PLC0415  # keeps `import bns` quick

        return load
    raise AttributeError(f"module 'bns' has no attribute {name!r}")
