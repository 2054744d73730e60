"""Files as Qualisys Track Manager exports rigid bodies.

How they are laid out, and the rows of ``PUBLISHED``, are from a recording of a model ship that others published
(github.com/shiplab/dt_cv, data/basin/raw/M510A-IRR-EKFPID-020019_6D.tsv), not from this reader.
"""

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from bns.diagnose.data.import_log import import_log, proposal
from bns.diagnose.data.sources.read import read_table
from bns.errors import DataError
from tests.diagnose.data.test_motion_capture import BEGINS_S, commands, same_path
from tests.diagnose.logs import continuous
from tests.diagnose.worlds import NOMINAL, measured

HEAD = (
    "NO_OF_FRAMES\t{frames}\nNO_OF_CAMERAS\t4\nNO_OF_BODIES\t{count}\nFREQUENCY\t100\nNO_OF_ANALOG\t0\nANALOG_FREQUENCY\t0\n"
    "DESCRIPTION\t--\nTIME_STAMP\t2020-01-22, 17:47:17\t22107.99179716\nDATA_INCLUDED\t6D\nBODY_NAMES\t{bodies}\n"
)
COLUMNS = ["Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{n}]" for n in range(9))]
PUBLISHED = (
    HEAD.format(frames=2, count=1, bodies="PSVH")
    + "\t".join(["Frame", "Time", "PSVH X", *COLUMNS, "\n"])
    + "1\t0.00000\t-194.91974\t2.24150\t0.99661\t-0.65630\t0.09391\t0.05772\t4.98536\t1.00000\t0.00099\t-0.00165\t-0.00101\t"
    "0.99993\t-0.01145\t0.00164\t0.01145\t0.99993\t\n"
    "2\t0.01000\t-195.64748\t1.62077\t0.72224\t-0.78772\t0.05832\t0.12055\t4.77517\t1.00000\t0.00209\t-0.00105\t-0.00210\t"
    "0.99990\t-0.01375\t0.00102\t0.01375\t0.99990\t\n"
)


@pytest.fixture(scope="module")
def log():
    return continuous(measured(NOMINAL, trials=8, seed=4))


def qtm(log, path, before=("table",), after=("wand",), time=True, matrix=True):
    """A recording at 100 Hz that begins BEGINS_S late; bodies that stand still beside the robot's; some frames without it."""
    at = np.arange(log["t_s"].iloc[0], log["t_s"].iloc[-1], 0.01)
    x, y, heading = (np.interp(at, log["t_s"], log[name]) for name in ("x_m", "y_m", "heading_rad"))
    turned = Rotation.from_euler("XYZ", np.stack([0 * at + 0.01, 0 * at - 0.02, heading], axis=1))
    own = columns_of(np.stack([1000 * x, 1000 * y, 0 * x + 191.2], axis=1), turned, matrix)
    own[::50] = 0.0  # QTM writes zeros for a body that it has not found
    still = columns_of(np.full((len(at), 3), 12.0), Rotation.from_euler("z", np.full((len(at), 1), 0.4)), matrix)
    bodies = [*before, "my robot", *after]
    frames = np.round((BEGINS_S + at) * 100).astype(int) + 1
    blocks = np.concatenate([own if body == "my robot" else still for body in bodies], axis=1)
    names = ["Frame", *(["Time"] if time else [])]
    for body in bodies:
        names += [f"{body} X", *COLUMNS[: own.shape[1] - 1]]
    lines = ["\t".join([*names, ""])]
    for frame, row in zip(frames, blocks, strict=True):
        cells = [str(frame), *([f"{(frame - 1) / 100:.5f}"] if time else []), *(f"{value:.5f}" for value in row), ""]
        lines.append("\t".join(cells))
    path.write_text(HEAD.format(frames=len(at), count=len(bodies), bodies="\t".join(bodies)) + "\n".join(lines) + "\n")


def columns_of(place_mm, turned, matrix):
    angles = turned.as_euler("XYZ", degrees=True)
    parts = [place_mm, angles, np.full((len(angles), 1), 3.1)]
    return np.concatenate([*parts, turned.as_matrix().transpose(0, 2, 1).reshape(-1, 9)] if matrix else parts, axis=1)


@pytest.mark.parametrize(
    "way", [{}, {"time": False}, {"matrix": False}, {"before": (), "after": ()}], ids=["whole", "no time", "angles", "alone"]
)
def test_a_recording_is_read_by_its_own_proposal(tmp_path, log, way):
    qtm(log, tmp_path / "take.tsv", **way)
    commands(log, tmp_path / "told.csv")
    files = [tmp_path / "take.tsv", tmp_path / "told.csv"]
    out = import_log(files, yaml.safe_load(proposal(files)))
    same_path(out.table, log)
    assert out.trials == 8


def test_what_stood_still_is_not_taken_for_the_robot(tmp_path, log):
    qtm(log, tmp_path / "take.tsv")
    commands(log, tmp_path / "told.csv")
    said = proposal([tmp_path / "take.tsv", tmp_path / "told.csv"])
    assert "The poses are those of my robot; the file has table, wand, too. Name the robot's." in said


def test_the_matrix_is_read_by_columns(tmp_path):
    """Against the angles that the same file gives; by rows, the heading would have the other sign."""
    (tmp_path / "ship.tsv").write_text(PUBLISHED)
    table = read_table(tmp_path / "ship.tsv")
    turned = Rotation.from_quat(table[[f"PSVH.rotation.{axis}" for axis in "xyzw"]].to_numpy())
    angles = turned.as_euler("XYZ", degrees=True)
    assert angles == pytest.approx(np.array([[-0.65630, 0.09391, 0.05772], [-0.78772, 0.05832, 0.12055]]), abs=1e-3)
    assert table["PSVH.position.x [mm]"].tolist() == [-194.91974, -195.64748]
    assert table["time [s]"].tolist() == [0.0, 0.01]


def test_frames_without_the_body_are_lost(tmp_path):
    zeros = "\t".join(["3", "0.02000", *["0.00000"] * 16, "\n"])
    (tmp_path / "ship.tsv").write_text(PUBLISHED + zeros)
    assert read_table(tmp_path / "ship.tsv").iloc[2, 1:].isna().all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("NO_OF_FRAMES\t2\nNO_OF_MARKERS\t1\nMARKER_NAMES\ta\na X\ta Y\ta Z\n1\t2\t3\n", "holds no rigid body"),
        (PUBLISHED.replace("Frame\t", "F\t"), "does not name its columns"),
        (PUBLISHED.replace("PSVH X", "X"), "no column PSVH X"),
        (PUBLISHED.replace("\tTime", "\tT").replace("FREQUENCY\t100", "FREQUENCY\tEXT"), "neither a column Time nor a FREQUENCY"),
    ],
)
def test_a_recording_that_lacks_something_says_what_and_what_to_do(tmp_path, text, said):
    (tmp_path / "bad.tsv").write_text(text)
    with pytest.raises(DataError, match=said) as error:
        read_table(tmp_path / "bad.tsv")
    assert "bad.tsv" in str(error.value)
    assert "export 6D data as TSV" in str(error.value)


def test_frames_without_times_are_counted_by_the_frequency(tmp_path):
    lines = [line.split("\t") for line in PUBLISHED.splitlines()]
    (tmp_path / "ship.tsv").write_text("\n".join("\t".join([*line[:1], *line[2:]] if len(line) > 9 else line) for line in lines))
    assert read_table(tmp_path / "ship.tsv")["time [s]"].tolist() == [0.0, 0.01]
