"""A first mapping for a log that has none, guessed from the names of its columns: to be read and corrected, never used unseen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from bns.diagnose.data.far_origin import PLACE, offsets_towards_origin
from bns.diagnose.data.guess.clocks import Clocks, clocks
from bns.diagnose.data.guess.columns import METRES_A_COUNT, RADIUS, motions_of, of_columns, rank_of_commands
from bns.diagnose.data.guess.numbers import (
    LARGEST_M,
    LENGTHS,
    SCALE,
    cut_into_trials,
    in_si,
    metres_a_unit,
    spread_of_positions,
)
from bns.diagnose.data.guess.topics import of_topic_columns
from bns.diagnose.data.guess.words import rank, unit_of, words_of
from bns.diagnose.data.mapping import FORWARD, TURN
from bns.diagnose.data.merge_topics import of_topics
from bns.diagnose.data.odd_commands import count_lost
from bns.diagnose.settings import DEFAULTS
from bns.measurements import COMMANDS, POSE

Entries = dict[str, Any]
FREE_SHOWN = DEFAULTS.data.guess_free_shown
METRES = "METRES"
"""Stands where the wheelbase of the robot's own controller is."""
CONTROLLERS_BASE = (
    "the distance in metres between the middles of the two wheels that the robot's own controller reckons with (often called "
    "wheel_separation, wheelbase or track); if nobody knows it, measure it on the robot"
)
_SERVE_COMMANDS = (
    "speeds of both wheels (m/s; rad/s with the wheel's radius), counters of encoders, or forward and turning speed of the body "
    "(a topic of geometry_msgs/Twist or TwistStamped such as /cmd_vel, sensor_msgs/JointState of the wheels)"
)
_SERVE_POSE = (
    "x, y and heading (or a quaternion) from motion capture, a camera or a lidar (a topic of geometry_msgs/PoseStamped, "
    "nav_msgs/Odometry of a tracker, a transform in /tf)"
)


@dataclass(frozen=True)
class Blank:
    """A number that no log tells, for which a word stands in the mapping.

    ``word``: stands in its place; ``where``: in which line, or in which key of which entries; ``what``: what to measure or to
    look up.
    """

    word: str
    where: str
    what: str

    def __str__(self) -> str:
        return f"Fill in {self.word} ({self.where}): {self.what}."


@dataclass(frozen=True)
class Guess:
    """A mapping as a tree, and what to know of it: what may not be what it seems, and numbers that nobody has filled in."""

    mapping: dict[str, Any]
    said: tuple[str, ...] = ()
    blanks: tuple[Blank, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """All that is to be known, in sentences."""
        return *self.said, *map(str, self.blanks)

    @property
    def text(self) -> str:
        """The mapping as YAML, the remarks as comments above it."""
        said = "".join(f"# {line}\n" for line in self.remarks)
        return said + yaml.safe_dump(self.mapping, sort_keys=False, default_flow_style=None, width=120)


def guessed(table: pd.DataFrame, others: Mapping[str, pd.DataFrame] | None = None, name: str = "") -> Guess:
    """The guess for one file, or for several of which the first is the one beside which the mapping lies."""
    motions = motions_of(table)
    if motions is not None and not others:
        return Guess({"relative": True, "columns": motions}, blanks=tuple(_blanks(motions)))
    tables = {name: table, **(others or {})}
    found = {file: _entries(one) for file, one in tables.items()}
    poses = _best(found, POSE, truth=True)
    told = _best(found, _commands_in(found), truth=False)
    joined = None
    if poses is not None and told is not None and poses != told:
        joined = clocks((tables[poses], found[poses]), (tables[told], found[told]))
        if joined is not None:
            moved, sign = (told, 1) if poses == name else (poses, -1)
            found[moved] = {**found[moved], "t_s": {**found[moved]["t_s"], "offset": sign * joined.offset_s}}
    kept = {file: _part(entries, file == poses, file == told) for file, entries in found.items()}
    tree: dict[str, Any] = {"columns": kept.pop(name)}
    also = [{"file": file, "columns": entries} for file, entries in kept.items() if set(entries) > {"t_s"}]
    if also:
        tree["also"] = also
    everything = _everything(tree)
    if {FORWARD, TURN} <= set(everything):
        tree["wheelbase_m"] = METRES
    if also or of_topics(table) or _apart(table, everything):
        tree["hold_commands_s"] = float("inf")
    lost = _lost_commands(tables[told], found[told]) if told is not None else 0
    if lost:
        tree["lost_commands"] = "held"
    if "trial" not in everything:
        read = [name, *(str(one["file"]) for one in also)]
        tree["trials"] = cut_into_trials(tables[told or name], found[told or name], [(tables[f], found[f]) for f in read])
    said = [*_remarks(everything, tables), *([_of_clocks(joined)] if joined else []), *_other_bodies(everything, tables)]
    said += [_of_lost_commands(lost)] if lost else []
    return Guess(tree, tuple(said), tuple(_blanks(everything, tables)))


def _of_clocks(joined: Clocks) -> str:
    return (
        f"The clocks of the two files differ by {abs(joined.offset_s):.2f} s, by where the speeds driven fit those commanded "
        f"(correlation {joined.correlation:.2f}). A lag of the robot is part of this number: trust no lag and no clock-offset "
        "that is found later, unless you replace it by a time that both clocks saw."
    )


def _lost_commands(table: pd.DataFrame, entries: Entries) -> int:
    """How many commands of 0 last no longer than a moment, between two that are alike."""
    pair = next((pair for pair in (COMMANDS, (FORWARD, TURN)) if set(pair) <= set(entries)), ())
    if not pair or "t_s" not in entries or entries["t_s"].get("unit") == "date":
        return 0
    columns = [in_si(table, entries[name], with_unit=True) for name in ("t_s", *pair)]
    told = pd.DataFrame(dict(zip(("t_s", *COMMANDS), columns, strict=True)))
    told = told.assign(trial=table[entries["trial"]["from"]].to_numpy() if "trial" in entries else 0).dropna()
    told = told.sort_values("t_s", kind="stable", ignore_index=True)
    return count_lost(told, [np.asarray(rows) for rows in told.groupby("trial").indices.values()])


def _of_lost_commands(count: int) -> str:
    return (
        f"{count} times both commands are 0 for a moment between two that are alike, which no motor follows: "
        "`lost_commands: held` keeps the command before in force. Leave that line out if the robot was really told so."
    )


def _other_bodies(entries: Entries, tables: Mapping[str, pd.DataFrame]) -> Iterator[str]:
    """A remark where the file tracks other rigid bodies, too: columns named alike, but for the name of the body."""
    taken = str(entries.get("x_m", {}).get("from", ""))
    body, dot, rest = taken.partition(".")
    names = [str(c) for table in tables.values() if taken in table for c in table.columns]
    others = [name[: -len(dot + rest)] for name in names if dot and name.endswith(dot + rest) and name != taken]
    if others and not taken.startswith("/"):  # a topic has its own rules
        yield f"The poses are those of {body}; the file has {', '.join(others[:FREE_SHOWN])}, too. Name the robot's."


def lacking(mapping: Mapping[str, Any]) -> tuple[str, ...]:
    """What measurements need and a mapping's columns do not give (times, commands, poses), each with what would serve."""
    return tuple(_lacks(_everything(mapping)))


def blanks_of(mapping: Mapping[str, Any], tables: Mapping[str, pd.DataFrame]) -> tuple[Blank, ...]:
    """The numbers for which words stand in a mapping of these files, by name."""
    return tuple(_blanks(_everything(mapping), tables))


def _everything(mapping: Mapping[str, Any]) -> Entries:
    """The entries of all files."""
    return {**mapping["columns"], **{k: v for one in mapping.get("also", ()) for k, v in one["columns"].items()}}


def _entries(table: pd.DataFrame) -> Entries:
    return _with_offsets(table, of_topic_columns(table) if of_topics(table) else of_columns(table))


def _with_offsets(table: pd.DataFrame, entries: Entries) -> Entries:
    """The entries, those of positions far from the origin with offsets that bring them near it."""
    if any(not isinstance(entries.get(name, {}).get("from"), str) for name in PLACE):
        return entries
    places = np.column_stack([in_si(table, entries[name], with_unit=True) for name in PLACE])
    moved = {name: {**entries[name], "offset": by} for name, by in zip(PLACE, offsets_towards_origin(places), strict=True) if by}
    return {**entries, **moved}


def _commands_in(found: Mapping[str, Entries]) -> tuple[str, ...]:
    """Which pair of commands the files tell: that which the names of some file say was commanded; of equals the wheels."""

    def merit(pair: tuple[str, ...]) -> int:
        return max((_told_rank(file, entries, pair) for file, entries in found.items() if set(pair) <= set(entries)), default=-2)

    return max((COMMANDS, (FORWARD, TURN)), key=merit)


def _told_rank(file: str, entries: Entries, pair: tuple[str, ...]) -> int:
    """What the names of a file and of its columns say of a pair of commands; own names of the table come first."""
    own = rank_of_commands({name: entries[name] for name in pair})
    return own if own > 1 else rank(f"{words_of(Path(file).name)} {_names_of(entries, pair)}", truth=False)


def _names_of(entries: Entries, wanted: tuple[str, ...]) -> str:
    """The words of the columns that these are taken from."""
    return " ".join(words_of(str(entries[name]["from"])) for name in wanted if name in entries)


def _best(found: Mapping[str, Entries], wanted: tuple[str, ...], truth: bool) -> str | None:
    """The file that gives most of the columns; of equals, by what its name and those of its columns say."""

    def merit(file: str) -> tuple[int, int]:
        entries = found[file]
        names = f"{words_of(Path(file).name)} {_names_of(entries, wanted)}"
        return sum(name in entries for name in wanted), rank(names, truth)

    best = max(found, key=merit)
    return best if merit(best)[0] else None


def _part(entries: Entries, poses: bool, commands: bool) -> Entries:
    """What is taken of a file: its time, and what it is the best source of."""
    barred = (set() if poses else {*POSE}) | (set() if commands else {*COMMANDS, FORWARD, TURN})
    return {name: entry for name, entry in entries.items() if name not in barred}


def _apart(table: pd.DataFrame, entries: Entries) -> bool:
    """Do commands stand in rows without poses?"""
    told, seen = (
        [e["from"] for n, e in entries.items() if n in names and isinstance(e["from"], str) and e["from"] in table]
        for names in ({*COMMANDS, FORWARD, TURN}, set(POSE))
    )
    if not told or not seen:
        return False
    rows = table[seen].notna().all(axis=1)
    return bool(rows.any() and table.loc[rows, told].isna().any(axis=1).mean() > 0.5)


def _remarks(entries: Entries, tables: Mapping[str, pd.DataFrame]) -> Iterator[str]:
    gone = list(_lacks(entries))
    yield from gone
    if gone and (free := _free(entries, tables)):
        yield f"Not assigned: {', '.join(free)}. Add an entry for each that is needed."
    heading = entries.get("heading_rad", {})
    if {"clockwise", "zero_deg"} & set(heading):
        yield "How the heading is counted is guessed from where the robot drove: check it."
    left = entries.get(COMMANDS[0], {})
    if "unit" in left and unit_of(words_of(str(left["from"]))) is None:
        yield f"That the commands are in {left['unit']} is guessed from how far the robot went: check it."
    place = entries.get("x_m", {})
    if place.get("unit") in LENGTHS and unit_of(words_of(str(place["from"]))) is None:
        yield f"That the positions are in {place['unit']} is guessed from how far the robot went: check it."
    if "x_m" in entries and not {"unit", "scale"} & set(place):
        far = [spread for table in tables.values() if (spread := spread_of_positions(table, entries)) is not None]
        if far and max(far) > LARGEST_M:
            yield f"The positions spread over {max(far):.0f}: unless these are metres, give x_m and y_m their unit (mm, cm)."
    if any("offset" in entries.get(name, {}) for name in PLACE):
        yield (
            "The positions lie far from the origin, as on a map; the offsets move it to where the robot drives. They hold for "
            "all trials. Give other logs of the same site the same offsets, or places cannot be compared."
        )
    told = _names_of(entries, (*COMMANDS, FORWARD, TURN))
    if told and rank_of_commands(entries) < 0:
        yield "The speeds are measured, not commanded: effects of motors and controller (lag, limits) cannot show."
    if told and rank_of_commands(entries) == 0:
        yield "No name says whether the speeds are commanded or measured: check it. Measured, they hide lag and limits."
    seen = _names_of(entries, POSE)
    if seen and rank(seen, truth=True) < 0:
        yield "These poses are the robot's own odometry: they agree with its wheels whatever it does. Use poses of a tracker."
    if any(str(c).startswith("column_") for table in tables.values() for c in table.columns):
        yield "Columns without a heading are called column_1, column_2, ...; assign each."


def _free(entries: Entries, tables: Mapping[str, pd.DataFrame]) -> list[str]:
    """Columns that no entry takes."""
    taken: set[str] = set()
    for entry in entries.values():
        taken.update([entry["from"]] if isinstance(entry["from"], str) else map(str, entry["from"]))
    return [str(c) for table in tables.values() for c in table.columns if str(c) not in taken][:FREE_SHOWN]


def _has_all(table: pd.DataFrame, entries: Entries) -> bool:
    return all(entry["from"] in table for entry in entries.values() if isinstance(entry["from"], str))


def _lacks(entries: Mapping[str, Any]) -> Iterator[str]:
    if "t_s" not in entries and "duration_s" not in entries:
        yield "No column holds the time; add an entry t_s."
    if not ({*COMMANDS} <= set(entries) or {FORWARD, TURN} <= set(entries) or {"left_m", "right_m"} <= set(entries)):
        yield f"No column holds the commands. Suitable are {_SERVE_COMMANDS}."
    gone = [name for name in POSE if name not in entries]
    if gone:
        yield f"No column holds {', '.join(gone)}. Suitable are {_SERVE_POSE}."


def _blanks(entries: Entries, tables: Mapping[str, pd.DataFrame] | None = None) -> Iterator[Blank]:
    """Numbers that no log tells."""
    scaled = {name: entry.get("scale") for name, entry in entries.items()}
    where = {word: f"scale in the entr{'y' if len(n) == 1 else 'ies'} {' and '.join(n)}" for word, n in _by_value(scaled).items()}
    if RADIUS in where:
        yield Blank(RADIUS, where[RADIUS], "the radius of the wheels in metres; their speeds are in rad/s")
    if METRES_A_COUNT in where:
        counted = "the distance in metres that a wheel drives for one count of its encoder (motor step)"
        yield Blank(METRES_A_COUNT, where[METRES_A_COUNT], counted)
    if SCALE in where:
        ratios = (metres_a_unit(table, entries) for table in (tables or {}).values() if _has_all(table, entries))
        ratio = next(filter(None, ratios), 0.0)
        speed = (
            f"the speed in m/s that one unit of the commands stands for; the robot went about {ratio:.2g} m per unit and second "
            "(of rad/s it is the radius of the wheels in metres, of rpm 0.105 times the radius)"
        )
        yield Blank(SCALE, where[SCALE], speed)
    if {FORWARD, TURN} <= set(entries):
        yield Blank(METRES, "wheelbase_m", CONTROLLERS_BASE)


def _by_value(scaled: Mapping[str, Any]) -> dict[str, list[str]]:
    """Names of entries by the word that stands for their scale."""
    words = dict.fromkeys(value for value in scaled.values() if isinstance(value, str))
    return {word: [name for name, value in scaled.items() if value == word] for word in words}
