"""How results show themselves: one line, a text, a notebook's cell, axes of matplotlib."""

from __future__ import annotations

import html
import io
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bns.plotting.style import COLUMN_IN, style

LONGEST_LINE = 200


class Shown(ABC):
    """A result: `repr` is one line of at most 200 characters, `summary` the text that the command line prints."""

    @abstractmethod
    def summary(self) -> str:
        """The result as text, several lines."""

    @abstractmethod
    def _line(self) -> str:
        """The most important facts, after the class's name."""

    def __repr__(self) -> str:
        line = " ".join(f"<{type(self).__name__}: {self._line()}>".split())
        return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 2]}…>"

    def _repr_html_(self) -> str:
        """What a notebook shows."""
        return f"<b>{html.escape(self._line())}</b><pre>{html.escape(self.summary())}</pre>"


class NotebookAxes(Axes):
    """Axes that a notebook shows as their figure, although the figure is not one of pyplot's."""

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        figure = self.get_figure(root=True)
        assert figure is not None
        figure.savefig(picture, format="png", dpi=120, metadata={"Software": None})
        return picture.getvalue()


def drawn(
    ax: Axes | None, draw: Callable[[Axes], object], size_in: tuple[float, float] = (COLUMN_IN * 1.4, COLUMN_IN)
) -> Axes:
    """``draw`` onto ``ax`` in its own style; without one onto new axes in the package's style, known to nobody else."""
    if ax is not None:
        draw(ax)
        return ax
    with style():
        new: Axes = Figure(figsize=size_in).add_subplot(axes_class=NotebookAxes)
        draw(new)
    return new


def plain(value: Any) -> Any:
    """Values as JSON and YAML know them: numpy's numbers and arrays, tuples and ranges become Python's numbers and lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple | range):
        return [plain(each) for each in value]
    return value
