"""The same drives as labs would have logged them: absolute stamps, quaternions, speeds of the body, topics, one long log."""

import numpy as np
import pandas as pd

from tests.diagnose.worlds import BASE_M

EPOCH_NS = 1_780_000_000_000_000_000
PAUSE_S = 4.0


def continuous(table, pause_s=PAUSE_S, frame_s=0.04):
    """All trials one after the other, the robot standing (and tracked, told 0) for a pause before each and at the end.

    Each trial goes on from where the last one ended: its path is moved there.
    """
    parts, now, place = [], 0.0, None
    for _, rows in table.groupby("trial", sort=False):
        moved = _moved(rows, place)
        first = moved.iloc[[0]].assign(left_m_s=0.0, right_m_s=0.0)
        frames = round(pause_s / frame_s)
        still = first.loc[first.index.repeat(frames)].assign(t_s=now + frame_s * np.arange(frames))
        now += pause_s
        parts += [still, moved.assign(t_s=now + moved["t_s"])]
        now = float(parts[-1]["t_s"].iloc[-1]) + frame_s
        place = moved[["x_m", "y_m", "heading_rad"]].iloc[-1].to_numpy()
    last = parts[-1].iloc[[-1]]
    tail = last.loc[last.index.repeat(50)].assign(t_s=now + frame_s * np.arange(50), left_m_s=0.0, right_m_s=0.0)
    return pd.concat([*parts, tail], ignore_index=True).drop(columns="trial").fillna({"left_m_s": 0.0, "right_m_s": 0.0})


def _moved(rows, place):
    """A path that begins at a pose."""
    if place is None:
        return rows
    x, y, heading = rows[["x_m", "y_m", "heading_rad"]].to_numpy().T
    turn = place[2] - heading[0]
    way = ((x - x[0]) + 1j * (y - y[0])) * np.exp(1j * turn) + complex(place[0], place[1])
    return rows.assign(x_m=way.real, y_m=way.imag, heading_rad=heading + turn)


def ros(table):
    """A bag's tables, (poses, commands): nanoseconds, quaternions, names of messages, speeds of the body at changes alone."""
    stamp = EPOCH_NS + np.round(table["t_s"].to_numpy() * 1e9).astype(np.int64)
    half = table["heading_rad"].to_numpy() / 2
    poses = pd.DataFrame(
        {
            "stamp": stamp,
            "pose.position.x": table["x_m"],
            "pose.position.y": table["y_m"],
            "pose.orientation.x": 0.0,
            "pose.orientation.y": 0.0,
            "pose.orientation.z": np.sin(half),
            "pose.orientation.w": np.cos(half),
        }
    )
    told = table[["left_m_s", "right_m_s"]].fillna(0.0)
    changed = told.diff().abs().max(axis=1).fillna(1.0) > 0
    body = pd.DataFrame(
        {
            "stamp": stamp - 1_000_000,  # a message comes shortly before the frame that it is first seen in
            "linear.x": told.mean(axis=1),
            "angular.z": (told["right_m_s"] - told["left_m_s"]) / BASE_M,
        }
    )
    return poses.reset_index(drop=True), body[changed].reset_index(drop=True)
