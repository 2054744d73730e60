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
        stream = getattr(sys, name)
        if stream is None:  # closed by whoever called
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115  # for the life of the process
        elif stream.isatty():
            setattr(sys, name, _that_may_go(stream))
        elif type(stream) is io.TextIOWrapper and isinstance(stream.buffer, io.RawIOBase):
            setattr(sys, name, _that_goes_on(stream))
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


def _that_goes_on(stream: io.TextIOWrapper) -> io.TextIOWrapper:
    """Under PYTHONUNBUFFERED=1 Python forgets what a disk that fills up did not take of a text, and reports no fault."""
    raw: io.RawIOBase = stream.buffer  # type: ignore[assignment]  # no buffer is between
    made = io.TextIOWrapper(io.BufferedWriter(raw), stream.encoding, line_buffering=True)
    vars(made)["instead_of"] = stream  # which would close the file when nobody knew it any more
    return made


def _spelt(error: UnicodeError) -> tuple[str, int]:
    """The text in place of what could not be encoded."""
    assert isinstance(error, UnicodeEncodeError)
    wrong = error.object[error.start : error.end]
    text = "".join(_PLAIN.get(letter) or unicodedata.normalize("NFKD", letter) for letter in wrong)
    return text.encode("ascii", "replace").decode(), error.end
