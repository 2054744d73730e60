"""How far a piece of work is, as a bar on stderr."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bns.api.common.progress import Progress

SAYS_LITTLE = 0.03
"""A share so small says nothing yet of how long the whole takes."""


@contextmanager
def ticking(text: str) -> Iterator[Progress]:
    """A bar on stderr: the share that is done, the time left and what is being looked at; nothing where stderr is no terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda _share, _what: None
        return
    began = time.monotonic()
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TextColumn("{task.fields[left]}"))
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task(text, total=1.0, left="")

        def told(share: float | None, what: str) -> None:
            done = bar.tasks[0].completed if share is None else share
            left = time_left(time.monotonic() - began, done)
            bar.update(task, completed=done, description=f"{text}: {what}", left=left)

        yield told


def time_left(lasted_s: float, share: float) -> str:
    """What a piece of work will still take, by what it took so far; "" while that says too little."""
    if share <= SAYS_LITTLE or lasted_s < 1.0:
        return ""
    left = lasted_s * (1.0 - share) / share
    return f"{left:.0f} s left" if left < 90 else f"{left / 60:.0f} min left"
