"""What effects of a camera's picture have in common."""

from __future__ import annotations

from bns.physics.effect import Parameter

HEADINGS = Parameter(
    "headings",
    "1",
    0.0,
    1.0,
    (0.0, 1.0),
    1.0,
    "fraction of the distortion that headings show: 1 if they come from the picture, 0 if from a gyro, a compass or a corrected "
    "picture",
    reached=(0.0, 1.0),
    otherwise=1.0,
)


def both_ways(*starts: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
    """Each start with headings from the picture, and with headings from elsewhere."""
    return tuple((*start, share) for share in (1.0, 0.0) for start in starts)
