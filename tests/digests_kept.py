"""What `tests.digests` keeps: values that a user gets from the command line, as {item: {column: [text, ...]}}.

Only the command line is used, and the generated worlds of `tests.hidden_effects`: modules of the package may move.
Names in what is read stand here and nowhere else: where one changes, it is changed here or told in `RENAMED`.
A number is kept as the text that Python or the product's own CSV writes of it, which is all of its digits.

An emulated trial is run with ``--speed inf --most-rounds 1``. Its clock then counts what the drivers do, not seconds,
and one round of training and evolution goes on while a controller drives, however fast the computer is. So all of its
journal can be kept but the time on the wall. Given commands (``--commands``) are driven likewise.
"""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from tests.hidden_effects.plan import worlds
from tests.hidden_effects.world import write

Columns = dict[str, list[str]]
Items = dict[str, Columns]

DATA = Path(__file__).parent.parent / ".." / "shared" / "data"
RENAMED: dict[str, str] = {}
"""Name of a column or key now -> its name when the digests were written."""
PASSING = {"started_at", "peak_memory_mib", "git_sha", "git_clean", "bns_version", "host", "versions"}
"""Columns of time, machine and version; in the tables of runs, those whose names end in _s tell how long they took."""
IDENTITY = {"run_id", "spec", "world_digest"}
"""What a run is called. Kept in an item of their own: they may change where numbers do not."""
ORDER = (
    *("sweep", "robot", "task", "seed", "population_size", "tournament_size", "mutation_rate"),
    *("real_world_selection_size", "evaluation"),
)
"""Of rows, whichever run was done first."""
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1")
EMULATED = ("trial", "--robot", "khepera", "--emulated", "--yes", "--speed", "inf", "--no-figures")
SMALL_TRIAL = ("--population-size", "50", "--training-iterations-per-evaluation", "100", "--evaluations", "4")
GIVEN = "trial,left_m_s,right_m_s,duration_s\n1,0.1,0.1,1.0\n1,0.05,0.1,0.5\n2,0.15,0.1,2.0\n3,0.02,0.12,1.5\n"


@dataclass(frozen=True)
class Plan:
    """The sweeps, the worlds, and whether logs of real robots and emulated trials are kept too."""

    sweeps: Sequence[Mapping[str, Any]]
    worlds: Sequence[str]
    robots: bool


def _sweep(name: str, robot: str, fixed: Mapping[str, Any], grid: Mapping[str, Any], seeds: int) -> dict[str, Any]:
    return {"name": name, "robot": robot, "seeds": seeds, "fixed": {"record": "full", **fixed}, "grid": grid}


SOME = {"evaluations": 30, "training_iterations_per_evaluation": 500}
FEW = {
    "evaluations": 3,
    "training_iterations_per_evaluation": 25,
    "generations_per_evaluation": 3,
    "population_size": 30,
}
FULL = Plan(
    (
        _sweep(
            "kept-khepera",
            "khepera",
            SOME | {"task": "circle", "population_size": 100},
            {"tournament_size": [0.1, 0.5], "mutation_rate": [0.1, 0.5, 0.9]},
            seeds=2,
        ),
        _sweep(
            "kept-snake",
            "snake",
            SOME | {"task": "two-regions"},
            {"population_size": [50, 100], "real_world_selection_size": [0.1, 0.4, 0.7]},
            seeds=2,
        ),
        {"name": "full-khepera", "robot": "khepera", "seeds": 1, "grid": {"task": ["infinity", "circle"]}},
        {"name": "full-snake", "robot": "snake", "seeds": 1, "grid": {"task": ["two-regions"]}},
    ),
    (
        *(
            "single-wheelbase-20-trials",
            "single-battery-sag-20-trials",
            "single-speed-gain-ends",
            "single-turn-slip-wide",
        ),
        *("pair-speed-gain-motor-lag", "pair-floor-slope-side-slip", "tie-far-tether", "tie-gain-base"),
        *("none-04", "none-07", "unlisted-seam-strong", "unlisted-carpet-nap-and-motor-lag"),
    ),
    robots=True,
)
QUICK = Plan(
    (
        _sweep("quick-khepera", "khepera", FEW | {"task": "circle"}, {"mutation_rate": [0.1, 0.9]}, seeds=1),
        _sweep("quick-snake", "snake", FEW | {"task": "two-regions"}, {"mutation_rate": [0.1, 0.9]}, seeds=1),
    ),
    ("single-wheelbase-20-trials", "tie-far-tether"),
    robots=False,
)


def kept(plan: Plan, folder: Path) -> Items:
    """All items of a plan; the runs first, then everything else, two at a time."""
    results = folder / "results"
    _swept(plan, folder, results)
    asked: list[Callable[[], Items]] = [
        lambda: _figures(results),
        *(lambda name=name: _world(name, folder) for name in plan.worlds),
        lambda: _tables(results),
    ]
    if plan.robots:
        asked += [lambda: _evolved(folder), lambda: _given(folder), *_real(folder)]
    with ThreadPoolExecutor(2) as pool:
        found = [item for items in pool.map(lambda ask: ask(), asked) for item in items.items()]
    return dict(sorted(found))


def called(*arguments: object) -> str:
    """Stdout of a Python module; CalledProcessError where it fails, with its last words printed."""
    done = subprocess.run(
        [sys.executable, "-m", *map(str, arguments)],
        capture_output=True, text=True, check=False, env=os.environ | ONE_THREAD,
    )  # fmt: skip
    if done.returncode:
        print(done.stderr[-2000:], file=sys.stderr)
    done.check_returncode()
    return done.stdout


def text_of(value: object) -> str:
    """All digits of a number; nothing for None."""
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def columns_of(rows: Iterable[Mapping[str, Any]], without: Iterable[str] = ()) -> Columns:
    """Rows as columns under their old names; a row that lacks one has no text there."""
    rows = [{RENAMED.get(name, name): text_of(value) for name, value in row.items()} for row in rows]
    names = dict.fromkeys(name for row in rows for name in row if name not in set(without))
    return {name: [row.get(name, "") for row in rows] for name in names}


def _swept(plan: Plan, folder: Path, results: Path) -> None:
    files = [folder / f"{sweep['name']}.yaml" for sweep in plan.sweeps]
    for file, sweep in zip(files, plan.sweeps, strict=True):
        file.write_text(yaml.safe_dump(dict(sweep)))
    called("bns", "sweep", *files, "--jobs", 2, "--results", results)


def _tables(results: Path) -> Items:
    """Evaluations and runs of every sweep; what runs are called apart."""
    items: Items = {}
    for table in ("evals", "runs"):
        said = called("bns", "query", "--csv", "--no-header", f"SELECT to_json(t) FROM {table} t", "--results", results)
        rows = sorted((json.loads(line) for [line] in csv.reader(said.splitlines())), key=_place)
        timed = {name for row in rows for name in row if name.endswith("_s")}
        for sweep in dict.fromkeys(row["sweep"] for row in rows):
            of = [row for row in rows if row["sweep"] == sweep]
            items[f"sweep {sweep}: {table}"] = columns_of(of, PASSING | IDENTITY | timed)
            if table == "runs":
                items[f"sweep {sweep}: identity"] = columns_of([{k: row[k] for k in sorted(IDENTITY)} for row in of])
    return items


def _place(row: Mapping[str, Any]) -> tuple[Any, ...]:
    return tuple(row.get(name, 0) for name in ORDER)


def _figures(results: Path) -> Items:
    """Every CSV that the figures write; rows as they are, without the names of runs."""
    called("analysis", "--results", results)
    return {f"figure {path.stem}": read_csv(path, IDENTITY) for path in sorted((results / "figures").glob("*.csv"))}


def read_csv(path: Path, without: Iterable[str] = ()) -> Columns:
    """The cells as they are written."""
    with path.open(newline="", encoding="utf-8") as file:
        return columns_of(csv.DictReader(file), without)


def _world(name: str, folder: Path) -> Items:
    """The diagnosis of a generated world."""
    [world] = [world for world in worlds(0) if world.name == name]
    return {f"world {name}": _diagnosed(write(world, folder, []), *world.nominal.arguments)}


def _diagnosed(data: Path, *arguments: object) -> Columns:
    """What a reader of a diagnosis is told in numbers and names; its notes are prose, and are not kept."""
    answer = json.loads(called("bns", "diagnose", data, "--json", *arguments))
    found: dict[str, Any] = {name: answer[name] for name in ("verdict", "effects")}
    found["explanations"] = [" + ".join(names) for names in answer["explanations"]]
    found["ties"] = [" = ".join(names) for names in answer["ties"]]
    found |= {f"error {h}": [e[k] for k in ("before", "after", "noise_floor")] for h, e in answer["error"].items()}
    found |= _parameters("fitted", answer["parameters"])
    for one in answer["ranking"]:
        found[f"ranked {one['name']}"] = [one[k] for k in ("elpd_diff", "dse", "p_value")]
        found |= _parameters(f"ranked {one['name']}", {"": one["parameters"]})
    found["ranking"] = [one["name"] for one in answer["ranking"]]
    found["pattern"] = [f"{one['variable']} on {one['velocity']}" for one in answer["residual_dependence"]]
    found["pattern gain"] = [one["elpd_diff"] for one in answer["residual_dependence"]]
    found["formula"] = _formula(answer["formula"])
    found["outbreaks"] = [len(answer["outliers"])]
    return {
        name: [text_of(v) for v in (values if isinstance(values, list) else [values])] for name, values in found.items()
    }


def _parameters(what: str, effects: Mapping[str, Mapping[str, Mapping[str, Any]]]) -> dict[str, list[Any]]:
    """Value, standard error and interval of every parameter."""
    return {
        " ".join(filter(None, (what, effect, name))): [number.get(k) for k in ("value", "se", "low", "high")]
        for effect, parameters in effects.items()
        for name, number in parameters.items()
    }


def _formula(formula: Mapping[str, Any] | None) -> list[Any]:
    return [] if formula is None else [formula["on"], formula["term"], *formula["values"].values(), formula["elpd_diff"]]


def _evolved(folder: Path) -> Items:
    """A trial that evolves: its journal, its measurements, and the rows of its replay."""
    results = folder / "evolved"
    called("bns", *EMULATED, *SMALL_TRIAL, "--most-rounds", 1, "--results", results)
    [journal] = results.glob("trials/*/journal.jsonl")
    called("bns", "trial", "--replay", journal, "--results", folder / "replayed")
    tables = {f"emulated replay: {name}": columns for name, columns in _tables(folder / "replayed").items()}
    return _driven("emulated trial", journal) | tables


def _given(folder: Path) -> Items:
    """A trial of given commands: its journal and its measurements."""
    file = folder / "given.csv"
    file.write_text(GIVEN)
    called("bns", *EMULATED, "--commands", file, "--results", folder / "driven")
    [journal] = (folder / "driven").glob("trials/*/journal.jsonl")
    return _driven("emulated commands", journal)


def _driven(name: str, journal: Path) -> Items:
    """What went over the wire, what was seen, and the table that came of it."""
    events = [json.loads(line) for line in journal.read_text().splitlines()]
    of = {
        kind: [event for event in events if event["kind"] == kind] for kind in ("sent", "received", "seen", "command")
    }
    wire = {
        f"{kind} {key}": [text_of(e[key]) for e in of[kind]] for kind in ("sent", "received") for key in ("t_s", "data")
    }
    seen = {f"seen {n}": [text_of(e["pose"] and e["pose"][i]) for e in of["seen"]] for i, n in enumerate("xyh")}
    commands = columns_of([{k: v for k, v in e.items() if k not in ("wall_s", "kind")} for e in of["command"]])
    return {
        f"{name}: journal": wire | seen | {f"command {k}": v for k, v in commands.items()},
        f"{name}: measurements": read_csv(journal.parent / "measurements.csv"),
    }


def _real(folder: Path) -> list[Callable[[], Items]]:
    """The diagnoses of two real robots; none, and why, where the logs are not there."""
    if not DATA.is_dir():
        print(f"skipped: logs of real robots, for there is no folder {DATA}")
        return []
    return [lambda: _optitrack(folder), lambda: _grass(folder)]


def skipped(item: str) -> bool:
    """Whether an item cannot be made here."""
    return item.startswith("real ") and not DATA.is_dir()


def _optitrack(folder: Path) -> Items:
    table = pd.read_parquet(DATA / "diff_drive_optitrack.parquet")
    table = table[table["trial"].isin(table["trial"].unique()[::10])]
    return {"real optitrack": _log(folder / "optitrack.parquet", table, {"columns": {}}, 0.2)}


def _grass(folder: Path) -> Items:
    table = pd.read_parquet(DATA / "skid_steer_terrains.parquet")
    before = {f"before_{side}_m_s": {"from": f"{side}_m_s"} for side in ("left", "right")}
    mapping = {"columns": before, "repeated_poses": "lost"}
    return {"real grass": _log(folder / "grass.parquet", table[table["run"] == "warthog_grass_a"], mapping, 2.0)}


def _log(path: Path, table: pd.DataFrame, mapping: Mapping[str, Any], wheelbase_m: float) -> Columns:
    table.reset_index(drop=True).to_parquet(path, index=False)
    path.with_name(f"{path.name}.import.yaml").write_text(yaml.safe_dump(dict(mapping)))
    return _diagnosed(path, "--model", "differential-drive", "--wheelbase", wheelbase_m)
