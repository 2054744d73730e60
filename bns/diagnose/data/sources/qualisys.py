"""Exports of Qualisys Track Manager (QTM) as tables: tab-separated files of rigid bodies (6DOF).

A file begins with lines of a name in capitals and its value (``NO_OF_FRAMES``, ``FREQUENCY``, ``BODY_NAMES``), then names its
columns: of each body X, Y, Z (mm), three angles (degrees), the residual, and the rotation matrix by columns (``Rot[0]`` to
``Rot[8]``). Angles may follow any convention that was set in QTM, so the rotation is taken from the matrix where there is one.
"""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from bns.diagnose.data.sources.motion_capture import TIME, cells_of, number_of, opened_text
from bns.diagnose.settings import DEFAULTS
from bns.errors import DataError

_FIRST = ("FILE_VERSION", "NO_OF_FRAMES")
_BODIES, _RATE, _FRAME = "BODY_NAMES", "FREQUENCY", "Frame"
_AXES = ("X", "Y", "Z")
_MOST_HEAD = DEFAULTS.data.head_lines
_AGAIN = "In QTM, define a 6DOF body and export 6D data as TSV, with header and column names"


def is_qualisys(path: Path) -> bool:
    """Whether the file begins as those of QTM do."""
    with opened_text(path) as file:
        return file.readline(max(map(len, _FIRST)) + 1).split("\t")[0].strip() in _FIRST


def read_qualisys(path: Path) -> pd.DataFrame:
    """One row a frame: the time, then position (mm) and rotation (a quaternion) of each body. Lost frames are NaN.

    Without a rotation matrix in the file, the third angle is kept (degrees). DataError where the file holds no body, does not
    name its columns, or has neither times nor a frequency.
    """
    with opened_text(path) as file:
        rows = [cells_of(line, "\t") for line in islice(file, _MOST_HEAD)]
    at = next((number for number, row in enumerate(rows) if row and row[0] == _FRAME), None)
    said = {row[0]: [cell for cell in row[1:] if cell] for row in rows[:at] if row}
    bodies = said.get(_BODIES, [])
    if not bodies:
        raise DataError(f"{path} holds no rigid body, and the heading of a robot needs one. {_AGAIN}.")
    if at is None:
        raise DataError(f"{path} does not name its columns: none of its first {_MOST_HEAD} lines begins with Frame. {_AGAIN}.")
    names = rows[at]
    table = pd.read_csv(path, sep="\t", header=None, skiprows=at + 1, usecols=range(len(names)), encoding="utf-8-sig")
    columns = [pd.to_numeric(table[number], errors="coerce").to_numpy(float) for number in range(len(names))]
    found = {TIME: _times(path, names, columns, said)}
    for body in bodies:
        begin = next((number for number, name in enumerate(names) if name in (f"{body} X", f"{body}.X")), None)
        if begin is None:
            raise DataError(f"{path} has no column {body} X, though it names the body {body}. {_AGAIN}.")
        found |= _poses(body, names, columns, begin)
    return pd.DataFrame(found)


def _times(path: Path, names: list[str], columns: list[NDArray[np.float64]], said: dict[str, list[str]]) -> NDArray[np.float64]:
    """Those of the file, or frames by its frequency, s."""
    if "Time" in names:
        return columns[names.index("Time")]
    rate_hz = number_of("".join(said.get(_RATE, [])[:1]))
    if not rate_hz > 0:
        raise DataError(f"{path} has neither a column Time nor a FREQUENCY above 0. {_AGAIN}.")
    return (columns[0] - 1.0) / rate_hz


def _poses(body: str, names: list[str], columns: list[NDArray[np.float64]], begin: int) -> dict[str, NDArray[np.float64]]:
    """Position and rotation of a body, whose columns begin there and end where those of the next do."""
    after = next((n for n in range(begin + 1, len(names)) if re.search(r"[ .]X$", names[n])), len(names))
    own = {name: columns[number] for number, name in enumerate(names[:after]) if number > begin}
    place = [columns[begin], *columns[begin + 1 : begin + 3]]
    parts = [own[name] for number in range(9) if (name := f"Rot[{number}]") in own]
    if len(parts) == 9:
        matrix = np.stack(parts, axis=1).reshape(-1, 3, 3).transpose(0, 2, 1)
        seen = np.linalg.det(np.nan_to_num(matrix)) > 0.5  # 1 of a rotation; a lost body has zeros
        turned = np.full((len(seen), 4), np.nan)
        if seen.any():
            turned[seen] = Rotation.from_matrix(matrix[seen]).as_quat()
        rotation = {f"{body}.rotation.{axis}": turned[:, number] for number, axis in enumerate("xyzw")}
    else:
        seen = np.any([values != 0.0 for values in columns[begin : begin + 6]], axis=0)
        rotation = {f"{body}.yaw [deg]": np.where(seen, columns[begin + 5], np.nan)}
    position = zip(_AXES, place, strict=True)
    return {f"{body}.position.{a.lower()} [mm]": np.where(seen, values, np.nan) for a, values in position} | rotation
