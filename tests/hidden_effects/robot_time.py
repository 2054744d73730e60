"""Robot time until a decision, proposed commands beside random ones: the sums, how sure they are, and the figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from bns.plotting.style import OKABE_ITO, PAGE_IN, save, style

KINDS = ("proposed", "random")
DRAWS = 5000

Found = Sequence[Mapping[str, object]]


def times(found: Found, most: float) -> np.ndarray:
    """(worlds, 2) minutes for proposed and random commands; what was never decided counts as ``most``."""
    return np.minimum([[float(str(one[kind])) for kind in KINDS] for one in found], most)


def ratios(minutes: np.ndarray) -> dict[str, float]:
    """Random over proposed: of the totals, of the medians, and the median of the worlds' own."""
    proposed, plain = minutes.T
    return {
        "of the totals": float(plain.sum() / proposed.sum()),
        "of the medians": float(np.median(plain) / np.median(proposed)),
        "median of the ratios": float(np.median(plain / proposed)),
    }


def intervals(minutes: np.ndarray, seed: int = 0) -> dict[str, tuple[float, float]]:
    """95 % bootstrap intervals of `ratios`, worlds drawn."""
    rng = np.random.default_rng(seed)
    drawn = [ratios(minutes[rng.integers(0, len(minutes), len(minutes))]) for _ in range(DRAWS)]
    ends = {name: np.quantile([one[name] for one in drawn], [0.025, 0.975]) for name in drawn[0]}
    return {name: (float(low), float(high)) for name, (low, high) in ends.items()}


def summary(found: Found, most: float) -> str:
    """All of it in lines of words."""
    minutes = times(found, most)
    proposed, plain = minutes.T
    middle, ends = ratios(minutes), intervals(minutes)
    never = [int((column >= most).sum()) for column in (proposed, plain)]
    lines = [
        f"{len(found)} worlds; minutes of driving until decided: proposed {proposed.sum():.1f} in all, median "
        f"{np.median(proposed):.2f}, never in {never[0]}; random {plain.sum():.1f}, {np.median(plain):.2f}, never in {never[1]}",
        *(f"ratio {name}: {value:.2f} (95 % {ends[name][0]:.2f} to {ends[name][1]:.2f})" for name, value in middle.items()),
        f"random sooner in {int((plain < proposed).sum())}, half the time or less in {int((2 * proposed <= plain).sum())}",
    ]
    return "\n".join(lines)


@style()
def figure(found: Found, most: float, stem: Path) -> Path:
    """Minutes of driving, proposed against random, one dot a world."""
    pairs = list(dict.fromkeys((str(f["truth"]), str(f["rival"])) for f in found))
    drawn_ = Figure(figsize=(PAGE_IN, 0.34 * len(pairs) + 1.3))
    axes = drawn_.subplots()
    shown = {"random": (0.14, OKABE_ITO[1], "s"), "proposed": (-0.14, OKABE_ITO[0], "o")}
    for row, pair in enumerate(pairs[::-1]):
        for kind, (shift, colour, marker) in shown.items():
            values = [float(str(f[kind])) for f in found if (f["truth"], f["rival"]) == pair]
            late = [most * 1.25 if np.isinf(v) else v for v in values]
            axes.plot(late, [row + shift] * len(late), marker, color=colour, label=kind if row == 0 else None)
            axes.plot([np.median(late)] * 2, [row + shift - 0.12, row + shift + 0.12], color=colour)
    axes.set_yticks(range(len(pairs)), [f"{truth}, not {rival}" for truth, rival in pairs[::-1]])
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlabel(f"minutes of driving until decided (dots beyond {most:g}: not decided; strokes: medians)")
    axes.legend(title="commands", loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return save(drawn_, stem)[0]
