"""The sample log of `bns example`: a world of the hidden effects, as a lab might log it. Anew: python -m tests.sample_log"""

import numpy as np
import pandas as pd

from bns.examples import FOLDER
from tests.hidden_effects.camera import Layout
from tests.hidden_effects.world import World

LOG = FOLDER / "khepera-log.csv"
WORLD = World("sample-log", "single", hidden={"motor-lag": {"tau_s": 0.2}}, trials=14, layout=Layout(rows="frames"))


def written() -> str:
    """The log's text: milliseconds, millimetres, and degrees clockwise from north."""
    table = WORLD.table()
    log = pd.DataFrame(
        {
            "drive": table["trial"] + 1,
            "time_ms": (1000 * table["t_s"]).round().astype(int),
            "left_mm_s": (1000 * table["left_m_s"]).round(1),
            "right_mm_s": (1000 * table["right_m_s"]).round(1),
            "x_mm": (1000 * table["x_m"]).round(1),
            "y_mm": (1000 * table["y_m"]).round(1),
            "compass_deg": ((90 - np.degrees(table["heading_rad"])) % 360).round(1) % 360,
        }
    )
    return log.to_csv(index=False)


if __name__ == "__main__":
    LOG.write_text(written())
