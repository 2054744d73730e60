"""Pages of the effects: one for each, and one that lists them by stage."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

from bns.physics.effect import STAGES, Effect, Parameter
from bns.physics.effects import all_effects
from bns.registry import JOINT_EFFECTS
from site_pages.drives import Demonstration, demonstrate
from site_pages.pictures import picture

FOLDER = "gallery/effects"
STAGE_TEXT = {
    "wheel": "Wheels: commanded speed to wheel speed",
    "body": "Body: wheel speeds to the robot's velocity",
    "world": "World: floor and cable",
    "clock": "Clock: when a pose was measured",
    "measure": "Measurement: what the tracker reports",
}
_LIST_HEAD = """\
# Gallery of effects

Every effect that `bns diagnose` can name, grouped by the stage of the simulation on which it acts. The list and the
pictures are made from the catalogue when this site is built; `bns effects` prints the same list in a terminal.

Each picture shows one drive of a Khepera III, predicted twice: by the plain model and by the model with the effect.
The parameters are larger than on a fault-free robot, so that you can see the difference.
"""

_JOINTS_HEAD = """\
## Bodies on joints

For robots such as the snake, whose model is a body of links and servos in MuJoCo. An effect of one joint or marker
counts once for each of them.
"""


def pages() -> Iterator[tuple[str, str | bytes]]:
    """Path and content of every generated page and picture."""
    effects = sorted(all_effects().values(), key=lambda effect: (STAGES.index(effect.stage), effect.name))
    for effect in effects:
        shown = demonstrate(effect)
        yield f"{FOLDER}/{effect.name}.svg", picture(effect.name, shown)
        yield f"{FOLDER}/{effect.name}.md", page(effect, shown)
    yield "gallery/effects.md", overview(effects)


def overview(effects: list[Effect]) -> str:
    """The list of all effects, a table a stage."""
    parts = [_LIST_HEAD]
    for stage, group in groupby(effects, key=lambda effect: effect.stage):
        rows = [f"| [{e.name}](effects/{e.name}.md) | {e.in_words} | {_code(e.equation)} |" for e in group]
        parts.append(
            "\n".join(
                [
                    f"## {STAGE_TEXT.get(stage, stage)}\n",
                    "| effect | what happens | equation |",
                    "|---|---|---|",
                    *rows,
                    "",
                ]
            )
        )
    return "\n".join([*parts, joints()])


def joints() -> str:
    """The effects of bodies on joints: a table without pictures."""
    loaded = [(name, JOINT_EFFECTS.load(name)) for name in JOINT_EFFECTS.names()]
    parts = [(name, getattr(part, "anywhere", part)) for name, part in loaded]
    rows = [
        f"| {name} | {_cell(e.in_words)} | {_code(e.equation)} | {_cell(e.measurement)} |" for name, e in parts
    ]
    head = ["| effect | what happens | equation | confirm it on the bench |", "|---|---|---|---|"]
    return "\n".join([_JOINTS_HEAD, *head, *rows, ""])


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _code(text: str) -> str:
    """Code in a cell of a table: a bar would end the cell, and between backticks its escape would be shown."""
    for there, here in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("|", "&#124;"), ("*", "&#42;"), ("_", "&#95;")):
        text = text.replace(there, here)
    return f"<code>{text}</code>"


def page(effect: Effect, shown: Demonstration) -> str:
    """One effect: sentence, equation, picture, numbers, look-alikes, how to confirm it."""
    names = ", ".join(f"[{name}]({name}.md)" for name in effect.lookalikes) or "none is known"
    return "\n".join(
        [
            f"# {effect.name}\n",
            f"**{effect.in_words[:1].upper()}{effect.in_words[1:]}.**\n",
            f"Stage: {effect.stage}. Equation: `{effect.equation}`\n",
            f"![Path with and without {effect.name}]({effect.name}.svg)\n",
            f"Drawn with {_drawn_with(effect, shown)}; the commands are the same on every page of this gallery."
            f"{' The path is the one that its headings add up to; the robot drives the plain one.' * shown.by_heading}\n",
            "## In a log\n",
            f"{effect.residuals}\n",
            "## Parameters\n",
            "| parameter | unit | meaning | no effect at | plausible | allowed |",
            "|---|---|---|---|---|---|",
            *(_row(p) for p in effect.parameters),
            "",
            "## Look-alikes\n",
            f"These effects leave nearly the same traces: {names}.",
            *(f"\n**Compared with {other}.** {text}" for other, text in effect.beside.items()),
            *_of_robot(effect),
            "\n## Confirm it on the bench\n",
            _bench(effect),
            "\n## Use it\n",
            "```sh",
            f"bns add log.csv {effect.name} --model khepera -o extended.yaml",
            "```\n",
        ]
    )


def _of_robot(effect: Effect) -> list[str]:
    said = _sentence(effect.or_of_robot, begin=False)
    return [f"\n**Or the robot itself.** The same log results if {said}"] if said else []


def _drawn_with(effect: Effect, shown: Demonstration) -> str:
    units = {p.name: p.unit for p in effect.parameters}
    return ", ".join(f"`{name}` = {value:g}{_unit(units[name])}" for name, value in shown.values.items())


def _unit(unit: str) -> str:
    return "" if unit == "1" else f" {unit}"


def _row(p: Parameter) -> str:
    column = f" (needs the column `{p.column}`)" if p.column else ""
    text = p.text.replace("|", "\\|")
    low, high = p.plausible
    return f"| `{p.name}` | {p.unit} | {text}{column} | {p.neutral:g} | {low:g} to {high:g} | {p.low:g} to {p.high:g} |"


def _bench(effect: Effect) -> str:
    if effect.measurement:
        text = f"{effect.measurement[:1].upper()}{effect.measurement[1:]}."
    else:
        text = (
            "No measurement is known that shows this effect alone. Let `bns propose` plan the drive that separates it "
            "from its look-alikes, then run `bns diagnose` on the old and the new log together (`--more`)."
        )
    columns = " or ".join(f"`{name}`" for name in effect.explained_by)
    text += f"\n\nLog the column {columns}. {_sentence(effect.caveat)}" if columns else ""
    return text + (f"\n\n{_sentence(effect.assumes)}" if effect.assumes else "")


def _sentence(text: str, begin: bool = True) -> str:
    """With its full stop; ``begin``: and a capital letter."""
    first = text[:1].upper() if begin else text[:1]
    return f"{first}{text[1:]}{'' if text.endswith('.') else '.'}" if text else ""
