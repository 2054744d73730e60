"""Standard output and error for terminals and pipes of any encoding."""

from __future__ import annotations

import codecs
import errno
import io
import os
import sys
import unicodedata
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_PLAIN = {
    **{"±": "+/-", "°": " deg", "·": "*", "×": "x", "−": "-", "–": "-", "—": "-", "…": "...", "→": "->", "←": "<-"},
    **{"≤": "<=", "≥": ">=", "≈": "~", "√": "sqrt ", "²": "^2", "³": "^3", "“": '"', "”": '"', "’": "'", "‘": "'"},
    **{"µ": "u", "μ": "u", "α": "alpha", "β": "beta", "γ": "gamma", "Δ": "delta", "θ": "theta", "λ": "lambda"},
    **{"π": "pi", "σ": "sigma", "τ": "tau", "φ": "phi", "χ": "chi", "ω": "omega"},
}


def usable_streams() -> None:
    """See to it that both are there, and spell what their encoding lacks: ± as +/-, other signs as the nearest letter.

    A terminal that is closed later takes nothing and is no fault: whatever ends then ends with its own exit code.
    """
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by whoever called
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115  # for the life of the process
        elif getattr(sys, name).isatty():
            setattr(sys, name, _that_may_go(getattr(sys, name)))
    codecs.register_error("bns-plain", _spelt)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)  # what tests and notebooks put there has none
        if reconfigure is not None:
            reconfigure(errors="bns-plain")


class _Terminal(io.FileIO):
    """What is written to a terminal that is gone is lost."""

    def write(self, data: ReadableBuffer, /) -> int:
        """The number of bytes taken."""
        try:
            return super().write(data)
        except OSError as error:
            if error.errno != errno.EIO:
                raise
            return memoryview(data).nbytes


def _that_may_go(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    stream.flush()
    raw = _Terminal(stream.fileno(), "w", closefd=False)
    return io.TextIOWrapper(io.BufferedWriter(raw), stream.encoding, line_buffering=True)


def _spelt(error: UnicodeError) -> tuple[str, int]:
    """The text in place of what could not be encoded."""
    assert isinstance(error, UnicodeEncodeError)
    wrong = error.object[error.start : error.end]
    text = "".join(_PLAIN.get(letter) or unicodedata.normalize("NFKD", letter) for letter in wrong)
    return text.encode("ascii", "replace").decode(), error.end
