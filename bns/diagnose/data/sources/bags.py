"""Recordings of ROS as tables: `.bag`, `.mcap`, `.db3`, and folders of ROS 2. A row a message, a column a number of a topic.

Columns are called after topic and field: ``/cmd_vel.linear.x``, ``/joint_states.velocity.left_wheel``,
``/tf.map>base_link.translation.x``. ``t_s`` counts from the first message, by the stamps in the messages where they go by the
recorder's clock. Pictures, scans and other long messages are left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError
from bns.extras import extra

ENDINGS = (".bag", ".mcap", ".db3")
LARGEST_BYTES = DEFAULTS.data.bag_largest_bytes
_LONGEST_LIST = DEFAULTS.data.bag_longest_list
_CLOCKS_APART_S = DEFAULTS.data.bag_clocks_apart_s
TIME = "t_s"


def is_bag(path: Path) -> bool:
    """Does the name mean a recording? A folder does if it has metadata.yaml, or holds nothing but recordings of ROS 2."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file() or any(path.glob("*.mcap")) or any(path.glob("*.db3"))
    return path.suffix in ENDINGS


def read_bag(path: Path) -> pd.DataFrame:
    """All numbers of a recording, in the order of time; messages of one moment are one row.

    Raises:
        DataError: it does not read, or holds no numbers.
        MissingExtraError: rosbags is not installed.
    """
    with extra("bags"):
        from rosbags.highlevel import AnyReader, AnyReaderError  # noqa: PLC0415  # only bags need it
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415

    topics: dict[str, list[dict[str, float]]] = {}
    too_long: set[str] = set()
    try:
        with AnyReader([_openable(path)], default_typestore=get_typestore(Stores.LATEST)) as reader:
            for connection, received_ns, raw in reader.messages():
                if len(raw) > LARGEST_BYTES or connection.topic in too_long:
                    too_long.add(connection.topic)
                    continue
                try:
                    message = reader.deserialize(raw, connection.msgtype)
                except (KeyError, AnyReaderError):  # of a type that nobody described
                    too_long.add(connection.topic)
                    continue
                for row in _rows(connection.topic, message, received_ns):
                    topics.setdefault(connection.topic, []).append(row)
    except (AnyReaderError, OSError, ValueError, KeyError, IndexError) as fault:
        raise DataError(f"{path} does not read as a recording of ROS: {fault}.") from fault
    tables = [pd.DataFrame(rows) for rows in topics.values()]
    tables = [table for table in tables if table.shape[1] > 2]
    if not tables:
        raise DataError(f"{path} holds no numbers in messages of at most {LARGEST_BYTES} bytes.")
    return _joined(tables)


def _openable(path: Path) -> Path:
    """The recording itself: of a folder without metadata the one file in it."""
    if not path.is_dir() or (path / "metadata.yaml").is_file():
        return path
    found = sorted([*path.glob("*.mcap"), *path.glob("*.db3")])
    if len(found) > 1:
        raise DataError(f"{path} holds {len(found)} recordings and no metadata.yaml; give one: {found[0]}.")
    return found[0]


def _joined(tables: list[pd.DataFrame]) -> pd.DataFrame:
    """One table of all topics in the order of time."""
    timed = [table.assign(**{TIME: _clock(table)}).drop(columns=["stamp_ns", "received_ns"]) for table in tables]
    whole = pd.concat(timed, ignore_index=True).sort_values(TIME, kind="stable")
    whole = whole.groupby(TIME, as_index=False, sort=True).first()
    began = int(whole[TIME].iloc[0])
    seconds = (whole[TIME] - began).to_numpy(dtype=float) * 1e-9
    return pd.concat([pd.Series(seconds, name=TIME), whole.drop(columns=TIME)], axis=1)


def _clock(table: pd.DataFrame) -> pd.Series:
    """Nanoseconds of each message: its own stamp, or when it was received where the stamps go by another clock or lack."""
    apart = (table["stamp_ns"] - table["received_ns"]).abs()
    return table["stamp_ns" if float(apart.median()) < 1e9 * _CLOCKS_APART_S else "received_ns"]


def _rows(topic: str, message: Any, received_ns: int) -> Iterator[dict[str, float]]:
    """One row a message; one a transform where it holds several, each with a stamp of its own."""
    parts = getattr(message, "transforms", None)
    if parts is None:
        yield {**_times(message, received_ns), **dict(_numbers(topic, message))}
        return
    for part in parts:
        name = f"{topic}.{part.header.frame_id.lstrip('/')}>{part.child_frame_id.lstrip('/')}"
        yield {**_times(part, received_ns), **dict(_numbers(name, part.transform))}


def _times(message: Any, received_ns: int) -> dict[str, int]:
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    own = 0 if stamp is None else int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)
    return {"stamp_ns": own, "received_ns": int(received_ns)}


def _numbers(name: str, value: Any) -> Iterator[tuple[str, float]]:
    """Names and numbers of a message, fields within fields; texts and long lists are left out."""
    if isinstance(value, bool | int | float | np.number):
        yield name, float(value)
    elif is_dataclass(value):
        labels = _labels(value)
        for one in fields(value):
            if one.name.startswith("__") or one.name == "header":
                continue
            inner = getattr(value, one.name)
            if labels and isinstance(inner, list | np.ndarray) and len(inner) == len(labels):
                named = zip(labels, inner, strict=True)
                yield from ((f"{name}.{one.name}.{label}", float(v)) for label, v in named if _number(v))
            else:
                yield from _numbers(f"{name}.{one.name}", inner)
    elif isinstance(value, list | tuple | np.ndarray) and 0 < len(value) <= _LONGEST_LIST:
        for index, inner in enumerate(value):
            yield from _numbers(f"{name}.{index}", inner)


def _labels(message: Any) -> list[str]:
    """The names that a message gives to the elements of its lists (joints)."""
    names = getattr(message, "name", None)
    return list(names) if isinstance(names, list) and all(isinstance(n, str) for n in names) else []


def _number(value: Any) -> bool:
    return isinstance(value, bool | int | float | np.number)
