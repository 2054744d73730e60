"""Results as axes of matplotlib, which takes half a second to load: only where something is drawn."""

from __future__ import annotations

import io
from collections.abc import Callable

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from bns.errors import BnsError
from bns.plotting.style import COLUMN_IN, style


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
    """``draw`` onto ``ax`` in its own style; without one onto new axes in the package's style, known to nobody else.

    BnsError if ``ax`` is no axes.
    """
    if ax is not None and not isinstance(ax, Axes):
        raise BnsError(f"ax is given as {type(ax).__name__}; give one matplotlib Axes (of several, such as axes[0]), or none.")
    if ax is not None:
        draw(ax)
        return ax
    with style():
        new: Axes = Figure(figsize=size_in).add_subplot(axes_class=NotebookAxes)
        draw(new)
    return new
