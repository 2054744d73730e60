"""The robot carries a load at a tracked point: a tool, a gripper, a camera. The effect's name ends in the point."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerSite
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, site: int, load: float) -> Plant:
    """A point mass at one site, as a multiple of the mass of the whole robot."""
    return plant.with_payload(site, load)


EFFECT = PerSite(
    Effect(
        name="payload",
        stage="mechanics",
        parameters=(
            Parameter("load", "1", 0.0, 3.0, (0.0, 0.5), 0.0, "mass of the load over the mass of the whole robot in the model"),
        ),
        equation="m' = m + load * M of the link at this point; M: mass of the whole robot",
        residuals="Joints between this point and the base sag more, and swing more slowly, the farther the point is from them.",
        lookalikes=("link-mass", "uneven-mass", "compliance"),
        sentence="the robot carries a load at {site}",
        measurement="weigh what is fixed at {site}, or weigh the whole robot",
        starts=((0.03,), (0.1,), (0.4,)),
        apply=apply,
    ),
    carries=True,
)
