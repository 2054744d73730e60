"""Standard output and error for terminals and pipes of any encoding."""

from __future__ import annotations

import codecs
import os
import sys
import unicodedata
from pathlib import Path

_PLAIN = {
    **{"±": "+/-", "°": " deg", "·": "*", "×": "x", "−": "-", "–": "-", "—": "-", "…": "...", "→": "->", "←": "<-"},
    **{"≤": "<=", "≥": ">=", "≈": "~", "√": "sqrt ", "²": "^2", "³": "^3", "“": '"', "”": '"', "’": "'", "‘": "'"},
    **{"µ": "u", "μ": "u", "α": "alpha", "β": "beta", "γ": "gamma", "Δ": "delta", "θ": "theta", "λ": "lambda"},
    **{"π": "pi", "σ": "sigma", "τ": "tau", "φ": "phi", "χ": "chi", "ω": "omega"},
}


def usable_streams() -> None:
    """See to it that both are there, and spell what their encoding lacks: ± as +/-, other signs as the nearest letter."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by whoever called
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115  # for the life of the process
    codecs.register_error("bns-plain", _spelt)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)  # what tests and notebooks put there has none
        if reconfigure is not None:
            reconfigure(errors="bns-plain")


def _spelt(error: UnicodeError) -> tuple[str, int]:
    """The text in place of what could not be encoded."""
    assert isinstance(error, UnicodeEncodeError)
    wrong = error.object[error.start : error.end]
    text = "".join(_PLAIN.get(letter) or unicodedata.normalize("NFKD", letter) for letter in wrong)
    return text.encode("ascii", "replace").decode(), error.end
