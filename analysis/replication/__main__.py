"""``python -m analysis.replication``: docs/replication.md with its pictures, from the published archive or from runs."""

from __future__ import annotations

import argparse
import io
import re
import sys
from collections.abc import Sequence
from datetime import date
from pathlib import Path

from matplotlib.figure import Figure

from analysis import advice, prototype_worlds, random_behaviour, worlds
from analysis.__main__ import figures
from analysis.intervals import FEWEST_SEEDS
from analysis.readings import compared, in_words
from analysis.rendering import Renderer
from analysis.replication.numbers import Study, by_either_reading, studies
from analysis.replication.page import page
from analysis.results import PUBLISHED, NoDataError, Results
from bns.errors import BnsError
from bns.store.archive.read import archives, described
from bns.store.disk.files import publish

READINGS, WORLDS = "readings.parquet", "worlds.parquet"
"""The archives of the paired runs and of the runs in two worlds, beside that of the study."""
RANDOM = "random-behaviour.csv"
"""What `python -m analysis.random_behaviour` has written down of the runs: an archive keeps no probes."""
_CHAPTER = {"khepera": "4", "snake": "5"}


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the page; 0, or 2 with one line on stderr."""
    wanted = _parser().parse_args(arguments)
    archive = wanted.results / PUBLISHED
    try:
        store = Results(wanted.results) if wanted.fresh else Results(archive, archived=True)
        found = studies(store)
        either = _either(found, Results(store.results, archived=store.archived, so_far=True))
        pictures = drawn(store, found, wanted.out.parent / "figures" / "replication", wanted.out.parent)
        paired = _readings(wanted.results if wanted.fresh else archive.with_name(READINGS), fresh=wanted.fresh)
        elsewhere = _worlds(wanted.results if wanted.fresh else archive.with_name(WORLDS), fresh=wanted.fresh)
        costs, trials = (
            [one.table for one in _of_the_archive(module, store) if one.table is not None]
            for module in (advice, prototype_worlds)
        )
        random = _random(wanted.results, fresh=wanted.fresh)
        origin = _origin(store, archive, fresh=wanted.fresh)
        text = page(found, either, paired, elsewhere, costs, random, trials, pictures, origin)
        publish(text.encode(), wanted.out.with_name(f".{wanted.out.name}.part"), wanted.out)
    except BnsError as fault:
        print(f"bns: {fault}", file=sys.stderr)
        return fault.exit_code
    print(f"{wanted.out}: {sum(len(one.findings) for one in found)} findings, {len(pictures)} pictures")
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m analysis.replication", description="Write the page of what replicates.")
    parser.add_argument("--results", type=Path, default=Path("results"), help="folder of the results (results)")
    parser.add_argument("--fresh", action="store_true", help=f"from the runs there; default: from its {PUBLISHED}")
    parser.add_argument("--out", type=Path, default=Path("docs/replication.md"), help="the page (docs/replication.md)")
    return parser


def drawn(store: Results, found: Sequence[Study], folder: Path, beside: Path) -> dict[str, str]:
    """Draw what the dissertation has a figure of; "figure 4.7" -> path of the picture from the folder ``beside``."""
    pictures, contents = {}, {}
    with Renderer() as renderer:
        for module in figures([]).values():
            numbers = re.findall(r"\b([45])\.(\d+)", module.PAPER) if module.PAPER.startswith("figure") else []
            for one in _of_the_archive(module, store):
                robot = next((study.chosen.robot for study in found if f"-{study.chosen.robot}" in one.name), None)
                own = [f"{chapter}.{number}" for chapter, number in numbers if chapter == _CHAPTER.get(str(robot))]
                if not own or one.figure is None:
                    continue
                place = folder / f"{one.name}.png"
                contents[place] = renderer.submit(_png, one.figure)
                where = f"figure {own[0]}" if len(own) == 1 else f"figures {own[0]} to {own[-1]}"
                pictures.setdefault(where, place.relative_to(beside).as_posix())
        for place, content in contents.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            publish(content.result(), place.with_name(f".{place.name}.part"), place)
    return pictures


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=110, metadata={"Software": None})
    return buffer.getvalue()


def _of_the_archive(module, store: Results) -> list:  # type: ignore[no-untyped-def,type-arg]  # a figure's script
    if module.NAME == "success-so-far":  # another reading of a figure that has its picture
        return []
    try:
        return list(module.draw(store))
    except NoDataError:
        return []


def _readings(place: Path, *, fresh: bool):  # type: ignore[no-untyped-def]  # a table, or None
    import pandas as pd  # noqa: PLC0415

    if not place.exists():
        return None
    try:
        _, rows = compared(Results(place, archived=not fresh))
    except NoDataError:
        return None
    enough = rows[rows.n >= FEWEST_SEEDS]
    return pd.DataFrame([in_words(row) for row in enough.to_dict("records")]) if len(enough) else None


def _either(found: Sequence[Study], so_far: Results):  # type: ignore[no-untyped-def]  # a table, or None
    """The Khepera's findings by either reading of success; the snake's is said to be that of the fittest (section 5.8)."""
    now = next((one for one in found if one.chosen.robot == "khepera"), None)
    other = next((one for one in studies(so_far) if one.chosen.robot == "khepera"), None)
    return None if now is None or other is None else by_either_reading(now, other)


def _random(results: Path, *, fresh: bool):  # type: ignore[no-untyped-def]  # a table, or None
    import pandas as pd  # noqa: PLC0415

    place = (results / PUBLISHED).with_name(RANDOM)
    try:
        runs = random_behaviour.of_each_run(Results(results)) if fresh else pd.read_csv(place)
        return random_behaviour.table(random_behaviour.compared(runs))
    except (NoDataError, FileNotFoundError):
        return None


def _worlds(place: Path, *, fresh: bool):  # type: ignore[no-untyped-def]  # tables, one a robot
    if not place.exists():
        return []
    try:
        rows = worlds.influences(worlds.of_each_run(Results(place, archived=not fresh)))
    except NoDataError:
        return []
    return [worlds.table(own) for _, own in rows.groupby("robot")]


def _gpus(store: Results) -> list[str]:
    """How many of the runs GPUs carried out, a line for each kind of GPU."""
    rows = store.query(
        """SELECT robot, versions->>'$.device' AS device, count(*) AS runs FROM runs
        WHERE versions->>'$.device' IS NOT NULL GROUP BY ALL ORDER BY ALL"""
    )
    said = rows.runs.map("{:,} of the ".format) + rows.robot.replace("khepera", "Khepera")
    return [
        f"Of these runs, {' and '.join(own)} ran on a GPU ({device}). "
        "[Does it give the same as a CPU?](cuda.md#does-it-give-the-same-study)"
        for device, own in said.groupby(rows.device)
    ]


def _origin(store: Results, archive: Path, *, fresh: bool) -> list[str]:
    made = f"Written on {date.today().isoformat()}"  # a day is all that is said
    if fresh:
        return [f"{made} from the runs in `{store.results}` (`make replication FRESH=1`)."]
    said = [described(path) for path in archives(archive)]
    engines = sorted({str(engine) for one in said for engine in one["engine_versions"]})
    commits = sorted({sha[:12] for one in said for sha in one["git_sha"] if sha})
    specs = sorted({text for one in said for text in one["spec_hashes"]})
    versions = sorted({version for one in said for version in one["bns_version"] if version})
    return [
        f"{made} from `results/{PUBLISHED.as_posix()}`, {sum(one['runs'] for one in said):,} runs (`make replication`).",
        *_gpus(store),
        f"Engine version {', '.join(engines)}; bns {', '.join(versions)}; commits {', '.join(commits)}.",
        f"Sweep files {', '.join(specs)}.",
    ]


if __name__ == "__main__":
    sys.exit(main())
