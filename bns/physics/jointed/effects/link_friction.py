"""One link slides on the floor less easily than the others, or more. The effect's name ends in the link."""

from __future__ import annotations

from bns.physics.effect import Effect, Parameter
from bns.physics.jointed.catalogue_parts import PerLink
from bns.physics.jointed.plant import Plant


def apply(plant: Plant, link: int, factor: float) -> Plant:
    """Friction of one link, in all directions, as a multiple."""
    return plant.with_link("grip", link, factor)


EFFECT = PerLink(
    Effect(
        name="link-friction",
        stage="mechanics",
        parameters=(
            Parameter("factor", "1", 0.1, 12.0, (0.25, 6.0), 1.0, "friction of the link, as a multiple of that in the model"),
        ),
        equation="mu' = factor * mu of one link",
        residuals="The robot turns about this link in cycles in which it presses on the floor; the others fit.",
        lookalikes=("weak-joint", "uneven-mass", "tether-drag", "floor-friction"),
        sentence="{link} slides on the floor less easily than the model says, or more easily",
        measurement="switch the robot off and pull it sideways at {link}, then at its neighbours, with a spring balance",
        beside={
            "floor-friction": "The floor acts on all links alike: wipe the link's underside, and repeat some trials.",
        },
        apply=apply,
    )
)
