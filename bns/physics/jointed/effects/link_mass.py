"""One link is heavier than in the model, or lighter: a battery, a board, a load. The effect's name ends in the link."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerLink
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, link: int, factor: float) -> Plant:
    """Mass and inertia of one link, as a multiple."""
    return plant.with_link("mass", link, factor)


EFFECT = PerLink(
    Effect(
        name="link-mass",
        stage="mechanics",
        parameters=(
            Parameter("factor", "1", 0.1, 12.0, (0.25, 6.0), 1.0, "mass of the link, as a multiple of that in the model"),
        ),
        equation="m' = factor * m of one link, about the same centre of mass",
        residuals="The robot turns about this link, since it presses harder on the floor; a link that hangs sags more.",
        lookalikes=("uneven-mass", "link-friction", "weak-joint", "payload"),
        sentence="{link} is heavier or lighter than the model says",
        measurement="weigh the robot, or take {link} off and weigh it with all that is fixed to it",
        apply=apply,
    ),
    on_floor=False,
)
