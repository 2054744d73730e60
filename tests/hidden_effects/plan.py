"""The worlds: which effects, how strong, how measured. Weak is about what a lab would still want to know of."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from tests.hidden_effects.camera import Camera, Layout
from tests.hidden_effects.plan_further import further
from tests.hidden_effects.world import USUAL, Parameters, World

FINE, COARSE = Camera(0.0005, 0.005, 0.0001), Camera(0.003, 0.009, 0.001)
ROUGH = Camera(0.0015, 0.007, outliers=0.01, stamp_s=0.002)
LEVELS = ("weak", "medium", "strong")

STRENGTHS: dict[str, tuple[Parameters, Parameters, Parameters]] = {
    "speed-gain": ({"gain": 0.98}, {"gain": 1.05}, {"gain": 0.88}),
    "wheel-mismatch": ({"ratio": 1.01}, {"ratio": 0.975}, {"ratio": 1.06}),
    "wheelbase": ({"factor": 1.02}, {"factor": 0.95}, {"factor": 1.12}),
    "motor-lag": ({"tau_s": 0.04}, {"tau_s": 0.09}, {"tau_s": 0.2}),
    "dead-zone": ({"width_m_s": 0.002}, {"width_m_s": 0.005}, {"width_m_s": 0.012}),
    "speed-limit": ({"max_m_s": 0.18}, {"max_m_s": 0.16}, {"max_m_s": 0.12}),
    "acceleration-limit": ({"max_m_s2": 0.8}, {"max_m_s2": 0.4}, {"max_m_s2": 0.2}),
    "turn-slip": ({"slip_s": 0.02}, {"slip_s": 0.05}, {"slip_s": 0.12}),
    "side-slip": ({"slip_s": 0.02}, {"slip_s": -0.05}, {"slip_s": 0.12}),
    "battery-sag": ({"rate_per_s": 3e-5}, {"rate_per_s": 6e-5}, {"rate_per_s": 1.3e-4}),
    "floor-slope": (
        {"x_m_s": 0.0015, "y_m_s": 0.0008},
        {"x_m_s": -0.003, "y_m_s": 0.003},
        {"x_m_s": 0.009, "y_m_s": -0.004},
    ),
    "yaw-bias": ({"rate_rad_s": 0.01}, {"rate_rad_s": -0.025}, {"rate_rad_s": 0.07}),
    "tether-pull": (
        {"anchor_x_m": 0.3, "anchor_y_m": 1.4, "pull_per_s": 0.003},
        {"anchor_x_m": 1.2, "anchor_y_m": 0.1, "pull_per_s": 0.008},
        {"anchor_x_m": 0.6, "anchor_y_m": 0.8, "pull_per_s": 0.02},
    ),
    "clock-offset": ({"offset_s": -0.04}, {"offset_s": -0.08}, {"offset_s": -0.15}),
    "marker-offset": (
        {"forward_m": 0.005, "left_m": -0.003},
        {"forward_m": -0.012, "left_m": 0.006},
        {"forward_m": 0.03, "left_m": 0.015},
    ),
    "camera-scale": ({"factor": 1.02}, {"factor": 0.96}, {"factor": 1.1}),
    "camera-rotation": ({"angle_rad": 0.015}, {"angle_rad": -0.04}, {"angle_rad": 0.12}),
}
"""Of the Khepera. The wide robot is 2.4 times as fast, and what is a speed grows with it."""

SPEEDS = {"width_m_s", "max_m_s", "max_m_s2", "x_m_s", "y_m_s"}
WIDE = 2.4

PAIRS = (
    ("speed-gain", "wheel-mismatch"), ("speed-gain", "motor-lag"), ("wheelbase", "side-slip"),
    ("wheelbase", "motor-lag"), ("turn-slip", "wheel-mismatch"), ("floor-slope", "speed-gain"),
    ("yaw-bias", "wheelbase"), ("marker-offset", "speed-gain"), ("camera-rotation", "motor-lag"),
    ("dead-zone", "wheelbase"), ("speed-limit", "side-slip"), ("acceleration-limit", "wheel-mismatch"),
    ("battery-sag", "wheelbase"), ("tether-pull", "yaw-bias"), ("clock-offset", "turn-slip"),
    ("camera-scale", "wheel-mismatch"), ("camera-scale", "motor-lag"), ("floor-slope", "side-slip"),
    ("marker-offset", "yaw-bias"), ("speed-limit", "motor-lag"), ("battery-sag", "camera-rotation"),
    ("dead-zone", "wheel-mismatch"), ("turn-slip", "camera-rotation"), ("side-slip", "motor-lag"),
    ("tether-pull", "speed-gain"), ("yaw-bias", "wheel-mismatch"), ("battery-sag", "motor-lag"),
    ("marker-offset", "turn-slip"), ("clock-offset", "camera-rotation"), ("yaw-bias", "speed-limit"),
)  # fmt: skip

UNLISTED: dict[str, tuple[Parameters, Parameters]] = {
    "quadratic-gain": ({"share": -0.12, "fastest_m_s": 0.208}, {"share": 0.3, "fastest_m_s": 0.208}),
    "left-turn-slip": ({"slip_s": 0.06}, {"slip_s": 0.15}),
    "left-dead-zone": ({"width_m_s": 0.004}, {"width_m_s": 0.01}),
    "heading-walk": ({"spread_rad_s": 0.03, "time_s": 4.0}, {"spread_rad_s": 0.08, "time_s": 6.0}),
    "session-drag": (
        {"loss": 0.06, "middle_s": 700.0, "width_s": 250.0},
        {"loss": 0.2, "middle_s": 600.0, "width_s": 200.0},
    ),
    "whirl": (
        {"x_m": 0.8, "y_m": 0.5, "speed_m_s": 0.004, "reach_m": 0.3},
        {"x_m": 0.6, "y_m": 0.4, "speed_m_s": 0.012, "reach_m": 0.25},
    ),
    "carpet-nap": ({"share": 0.04, "along_rad": 0.7}, {"share": 0.12, "along_rad": -2.0}),
    "seam": (
        {"x_m": 0.8, "width_m": 0.03, "turn_rad_m": 1.5},
        {"x_m": 0.7, "width_m": 0.04, "turn_rad_m": 4.0},
    ),
    "reverse-loss": ({"loss": 0.05}, {"loss": 0.15}),
    "swing": ({"rate_rad_s": 0.06, "period_s": 2.0}, {"rate_rad_s": 0.15, "period_s": 1.3}),
    "kicks": ({"rate_per_s": 0.08, "turn_rad": 0.06}, {"rate_per_s": 0.05, "turn_rad": 0.15}),
    "lost-pulses": ({"from_m_s": 0.1, "lost": 0.06}, {"from_m_s": 0.08, "lost": 0.15}),
    "left-overshoot": ({"frequency_hz": 3.0, "damping": 0.6}, {"frequency_hz": 2.0, "damping": 0.35}),
    "speed-lag": ({"tau_s": 0.12, "fastest_m_s": 0.208}, {"tau_s": 0.3, "fastest_m_s": 0.208}),
    "stalls": ({"rate_per_s": 0.05, "time_s": 0.15}, {"rate_per_s": 0.05, "time_s": 0.4}),
    "loose-wheel": ({"loss": 0.03, "from_s": 800.0}, {"loss": 0.1, "from_s": 500.0}),
    "weak-supply": ({"loss": 0.06, "fastest_m_s": 0.208}, {"loss": 0.15, "fastest_m_s": 0.208}),
}
REVERSING = {"left-dead-zone", "reverse-loss"}
"""Effects that show only where wheels reverse or stand."""

TIES: dict[str, dict[str, Parameters]] = {
    "delay-weak": {"command-delay": {"delay_s": 0.04}},
    "delay-medium": {"command-delay": {"delay_s": 0.1}},
    "delay-strong": {"command-delay": {"delay_s": 0.22}},
    "late-clock-weak": {"clock-offset": {"offset_s": 0.05}},
    "late-clock-strong": {"clock-offset": {"offset_s": 0.12}},
    "gain-base": {"speed-gain": {"gain": 0.95}, "wheelbase": {"factor": 1.06}},
    "gain-scale": {"speed-gain": {"gain": 1.06}, "camera-scale": {"factor": 1.04}},
    "base-scale": {"wheelbase": {"factor": 0.94}, "camera-scale": {"factor": 1.05}},
    "base-scale-strong": {"wheelbase": {"factor": 1.1}, "camera-scale": {"factor": 1.12}},
    "delay-and-gain": {"command-delay": {"delay_s": 0.08}, "speed-gain": {"gain": 0.94}},
    "delay-and-mismatch": {"command-delay": {"delay_s": 0.12}, "wheel-mismatch": {"ratio": 1.04}},
    "late-clock-and-base": {"clock-offset": {"offset_s": 0.09}, "wheelbase": {"factor": 1.06}},
    "delay-and-side-slip": {"command-delay": {"delay_s": 0.1}, "side-slip": {"slip_s": 0.07}},
}


QUICK = {"single": 6, "pair": 3, "none": 3, "unlisted": 3, "tie": 3, "single-hard": 2}
QUICK |= {"new": 4, "removed": 3, "triple": 2, "size": 3}
"""How many worlds of each family a quick look takes, evenly spread over it."""


FAR_TETHERS: dict[str, dict[str, Parameters]] = {
    "far-tether": {"tether-pull": {"anchor_x_m": -6.0, "anchor_y_m": 5.0, "pull_per_s": 0.00015}},
    "far-tether-east": {"tether-pull": {"anchor_x_m": 9.0, "anchor_y_m": 3.0, "pull_per_s": 0.00018}},
}
"""Nobody can tell these from a slope in 20 trials seen at their commands' ends; in dense tracks of 60, one can."""


def worlds(seed: int) -> list[World]:
    """All of them, in families."""
    made = [*singles(), *pairs(), *nothing(), *unlisted(), *ties(), *further()]
    return [replace(world, seed=seed) for world in made]


def singles() -> Iterator[World]:
    """Every effect at three strengths under the conditions of the targets, and at medium strength under others."""
    for number, (name, strengths) in enumerate(STRENGTHS.items()):
        for level, parameters in zip(LEVELS, strengths, strict=True):
            plan = ("forward", "mixed")[(number + LEVELS.index(level)) % 2]
            camera = ROUGH if (number + LEVELS.index(level)) % 3 == 0 else USUAL
            world = World(f"single-{name}-{level}", "single", {name: parameters}, plan=plan, camera=camera)
            yield replace(world, layout=_layout(number + LEVELS.index(level), name))
    for number, (name, strengths) in enumerate(STRENGTHS.items()):
        medium = World(f"single-{name}", "single-hard", {name: strengths[1]}, plan=("mixed", "forward")[number % 2])
        yield replace(medium, name=f"{medium.name}-20-trials", trials=20, layout=_layout(number, name))
        yield replace(medium, name=f"{medium.name}-ends", layout=Layout("ends"))
        yield replace(medium, name=f"{medium.name}-coarse", camera=COARSE, layout=_layout(number + 1, name))
        yield replace(medium, name=f"{medium.name}-fine", camera=FINE, jitter=0.002, layout=_layout(number + 2, name))
        yield replace(medium, name=f"{medium.name}-wide", robot="wide", hidden={name: _wide(strengths[1])})
    distant = {"tether-pull": {"anchor_x_m": -3.5, "anchor_y_m": 3.0, "pull_per_s": 0.0008}}
    yield World("single-tether-pull-distant", "single-hard", distant)
    volts = World("single-battery-sag-volts", "single", {"battery-sag": {"per_volt": 0.08}}, layout=Layout(voltage=True))
    yield volts


def pairs() -> Iterator[World]:
    """Two effects that this data can tell apart, medium or strong."""
    for number, (a, b) in enumerate(PAIRS):
        levels = (1, 1) if number % 2 else (1, 2)
        hidden = {a: STRENGTHS[a][levels[0]], b: STRENGTHS[b][levels[1]]}
        yield World(
            f"pair-{a}-{b}", "pair", hidden, plan=("mixed", "forward")[number % 2], layout=_layout(number, a + b)
        )


def nothing() -> Iterator[World]:
    """Nothing is hidden: honest robots under all conditions."""
    for number in range(24):
        yield World(
            f"none-{number:02d}",
            "none",
            plan=("forward", "mixed")[number % 2],
            camera=(USUAL, ROUGH, USUAL, FINE, USUAL, COARSE)[number % 6],
            layout=_layout(number) if number % 8 != 7 else Layout("ends"),
            jitter=(0.004, 0.006, 0.002)[number % 3],
            robot="wide" if number % 5 == 4 else "khepera",
            trials=20 if number % 6 == 4 else 60,
        )


def unlisted() -> Iterator[World]:
    """One effect that no list holds, noticeable or strong; then some beside a listed one."""
    for number, (name, strengths) in enumerate(UNLISTED.items()):
        for level, parameters in zip(("medium", "strong"), strengths, strict=True):
            plan = "mixed" if name in REVERSING or level == "strong" else "forward"
            hidden = World(f"unlisted-{name}-{level}", "unlisted", unlisted={name: parameters}, plan=plan)
            yield replace(hidden, layout=_layout(number, "session"))
    for name, beside in (("speed-lag", "wheelbase"), ("carpet-nap", "motor-lag"), ("reverse-loss", "wheel-mismatch")):
        both = World(f"unlisted-{name}-and-{beside}", "unlisted", unlisted={name: UNLISTED[name][1]}, plan="mixed")
        yield replace(both, hidden={beside: STRENGTHS[beside][1]})


def ties() -> Iterator[World]:
    """Sets of effects that nobody can tell apart from outside."""
    for number, (name, hidden) in enumerate(TIES.items()):
        yield World(
            f"tie-{name}", "tie", hidden, plan=("forward", "mixed")[number % 2], layout=_layout(number)
        )
    for name, hidden in FAR_TETHERS.items():
        yield World(f"tie-{name}", "tie", hidden, trials=20, camera=COARSE, jitter=0.006, layout=Layout("ends"))


def _layout(number: int, names: str = "") -> Layout:
    """Layouts in turn. The time of the session is there wherever an effect needs it."""
    rows = ("frames", "frames", "frames", "frames+changes")[number % 4]
    session = number % 3 != 2 or "battery" in names or "session" in names
    return Layout(
        rows,
        blind=number % 8 == 3,
        missing=number % 2 == 1,
        wrapped=number % 5 == 0,
        session=session,
        tail_s=0.6 if number % 6 == 5 else 0.0,
    )


def _wide(parameters: Parameters) -> Parameters:
    return {name: value * WIDE if name in SPEEDS else value for name, value in parameters.items()}


def select(made: Sequence[World], only: str, quick: bool) -> list[World]:
    """A family or worlds of a name; of these, with `quick`, a few evenly spread."""
    chosen = [world for world in made if world.family == only] or [world for world in made if only in world.name]
    if not quick:
        return chosen
    return [world for family, count in QUICK.items() for world in _spread(chosen, family, count)]


def _spread(made: Sequence[World], family: str, count: int) -> list[World]:
    of = [world for world in made if world.family == family]
    step = len(of) / count
    return [of[int((i + 0.5) * step)] for i in range(count)] if len(of) > count else of
