"""The page as Markdown, from a study's numbers and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill, indent

import pandas as pd

from analysis.labels import source_position
from analysis.outcomes import COMBINATIONS, RUNS
from analysis.replication.numbers import VERDICTS, Study

WAITS = "no "
"""How the reason begins where a finding cannot be measured yet: no combination, no run has enough."""
TEMPLATE = Path(__file__).with_name("page.md")
ROBOTS = {"khepera": "Khepera", "snake": "Snake"}
UNFINISHED = (
    f"It requires {RUNS} runs of each of the {COMBINATIONS} combinations; the table below says how many there are. Runs are "
    "made seed by seed: where all combinations have the same number of runs, the design is balanced, and only the intervals are "
    "wider than they will be. A number without an interval comes from fewer than five seeds and is a first estimate. The largest "
    "of several gaps is partly due to chance, and shrinks as runs are added. Findings about the best and the worst combinations "
    "are the last to be decided: with few runs of each, the ten that look best are partly lucky. Where fewer than "
    f"{COMBINATIONS} combinations are listed, a smaller sweep was run, which does not vary all parameters."
)


def page(
    studies: Sequence[Study],
    either: pd.DataFrame | None,
    readings: pd.DataFrame | None,
    worlds: Sequence[pd.DataFrame],
    advice: Sequence[pd.DataFrame],
    random: pd.DataFrame | None,
    trials: Sequence[pd.DataFrame],
    pictures: Mapping[str, str],
    origin: Sequence[str],
) -> str:
    """The whole page.

    Args:
        studies: one a robot.
        either: findings by either reading of success (`by_either_reading`); None if there are none.
        readings: table of the paired runs; None if there are none.
        worlds: tables of the influence of parameters in two worlds, one a robot; empty if there are no runs.
        advice: tables of what the dissertation's advice costs, one a robot; empty if there are too few runs.
        random: table of simulators on random behaviour; None if there are no runs.
        trials: tables of the prototype trials in two worlds, one a robot; empty if there are no runs.
        pictures: "figure 4.7" -> path of a picture, relative to the page.
        origin: lines that say where the numbers come from.
    """
    parts = {
        "STATE": _state(studies),
        "LOOK": "\n\n".join(_look(one) for one in studies),
        "FINDINGS": "\n\n".join(_findings(one, pictures) for one in studies),
        "EITHER": "There are no such findings yet." if either is None or either.empty else _either(either),
        "READINGS": "There are no runs of other readings yet." if readings is None else table(readings),
        "WORLDS": "\n\n".join(map(table, worlds)) or "There are no runs of two worlds yet.",
        "ADVICE": "\n\n".join(map(table, advice)) or "There are too few runs yet.",
        "RANDOM": "There are no runs of this yet." if random is None else table(random),
        "TRIALS": "\n\n".join(map(table, trials)) or "There are no runs of this yet.",
        "ORIGIN": "\n".join(fill(f"- {line}", 120, subsequent_indent="  ", break_on_hyphens=False) for line in origin),
    }
    text = TEMPLATE.read_text(encoding="utf-8")
    for name, part in parts.items():
        text = text.replace(f"{{{name}}}", part)
    return text


def table(rows: pd.DataFrame) -> str:
    """Rows as a table in Markdown."""
    lines = [list(map(str, rows.columns)), ["---"] * rows.shape[1], *rows.astype(str).to_numpy().tolist()]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)


def _either(rows: pd.DataFrame) -> str:
    """How many verdicts there are by either reading, and a row a finding."""
    counts = pd.DataFrame(
        {"success": ["now", "so far"]}
        | {word: [int((rows[column] == word).sum()) for column in ("verdict", "verdict so far")] for word in VERDICTS.values()}
    )
    shown = pd.DataFrame({
        "task": rows.task, "where": rows["where"], "the dissertation": rows["the dissertation"],
        "success now": [f"{ours}; **{word}**" for ours, word in zip(rows["these results"], rows.verdict, strict=True)],
        "success so far": [
            f"{ours}; **{word}**" for ours, word in zip(rows["these results so far"], rows["verdict so far"], strict=True)
        ],
    })  # fmt: skip
    return f"{table(counts)}\n\n{table(shown)}"


def _state(studies: Sequence[Study]) -> str:
    """Which robots have all runs that the study asks for, and what follows where one has not."""
    lacking = [one for one in studies if one.tasks.least.min() < RUNS or one.tasks.combinations.min() < COMBINATIONS]
    whole = [ROBOTS.get(one.chosen.robot, one.chosen.robot) for one in studies if one not in lacking]
    complete = f"{RUNS} runs of each of the {COMBINATIONS} combinations on each task"
    lines = [fill(f"The study of the {name} is complete: {complete}.", 120) for name in whole]
    if lacking:
        names = " and the ".join(ROBOTS.get(one.chosen.robot, one.chosen.robot).lower() for one in lacking)
        lines.append(f'!!! warning "The study of the {names} is not complete"\n{indent(fill(UNFINISHED, 116), "    ")}')
    return "\n\n".join(lines)


def _look(one: Study) -> str:
    """How much there is and how it was decided."""
    amount = one.tasks.merge(one.counts, on="task", how="left").fillna(0)
    each = [str(row.most) if row.least == row.most else f"{row.least} to {row.most}" for row in amount.itertuples()]
    shown = pd.DataFrame({
        "task": amount.task, "runs": [f"{runs:,}" for runs in amount.runs],
        f"combinations of {COMBINATIONS}": amount.combinations, "runs of each": each,
        **{word: amount[word].astype(int) for word in VERDICTS.values()},
    })  # fmt: skip
    return f"**{ROBOTS.get(one.chosen.robot, one.chosen.robot)}**\n\n{table(shown)}"


def _findings(one: Study, pictures: Mapping[str, str]) -> str:
    """A heading a figure or section of the dissertation, a row a finding and task."""
    sections = [f"### {ROBOTS.get(one.chosen.robot, one.chosen.robot)}"]
    places = sorted(set(one.findings["where"]) | _drawn_of(one, pictures), key=lambda where: (*source_position(where), where))
    runs = one.tasks.set_index("task").runs
    waits = one.findings["these results"].str.startswith(WAITS)
    for where in places:
        own = one.findings[(one.findings["where"] == where) & ~waits]
        if own.empty and where not in pictures:
            continue
        rows = pd.DataFrame({
            "task": own.task, "the dissertation": own["the dissertation"], "here (95 % interval)": own["these results"],
            "n": [f"{count:,.0f}" for count in own.runs.fillna(own.task.map(runs))],
            "verdict": [f"**{word}**" for word in own.verdict],
        })  # fmt: skip
        sections.append(f"#### {where[:1].upper()}{where[1:]}")
        sections += [table(rows)] if len(rows) else []
        sections += [f"![{where}]({pictures[where]})"] if where in pictures else []
    return "\n\n".join([*sections, *_waiting(one.findings[waits])])


def _waiting(rows: pd.DataFrame) -> list[str]:
    """Findings that nothing can be said of yet, a row each, with the reason."""
    if rows.empty:
        return []
    keys = ["where", "the dissertation", "these results"]
    numbers = rows.assign(task=rows.task.str.partition(",")[0])
    each = numbers.groupby(keys, sort=False).task.agg(", ".join).reset_index()
    each = each.sort_values("where", key=lambda places: places.map(source_position), kind="stable")
    shown = each[["where", "task", *keys[1:]]].set_axis(["where", "tasks", "the dissertation", "why not yet"], axis=1)
    return ["#### Not measured yet (undecided)", table(shown)]


def _drawn_of(one: Study, pictures: Mapping[str, str]) -> set[str]:
    """Figures without a finding of their own that belong to this robot's chapter."""
    chapter = 4.0 if one.chosen.robot == "khepera" else 5.0
    return {where for where in pictures if source_position(where)[0] == chapter}
