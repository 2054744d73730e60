"""Words of a command line that the commands which follow it repeat."""

from __future__ import annotations

import shlex
from collections.abc import Iterable
from os import PathLike, fspath


def repeated(
    data: str, model: str, wheelbase_m: float | None = None, more: Iterable[str | PathLike[str]] = ()
) -> dict[str, str]:
    """Data (with ``more`` of them) and model, quoted for a shell."""
    base = [] if wheelbase_m is None else ["--wheelbase", f"{wheelbase_m:g}"]
    joined = [word for path in more for word in ("--more", fspath(path))]
    return {"data": shlex.quote(data), "model": shlex.join(["--model", model, *base, *joined])}
