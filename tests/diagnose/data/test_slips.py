"""Names of columns with a slip: what was meant is said, and an own column that is like none passes."""

import pytest

import bns
from bns.errors import DataError, one_slip, unknown_name
from tests.diagnose.worlds import NOMINAL, measured

KEPT = ("t_s", "left_m_s", "right_m_s", "x_m", "y_m", "heading_rad")


def mapped(also=(), **columns):
    """A log of three trials, whose trials are in a column Lauf, under entries of its columns and further ones."""
    table = measured(NOMINAL, trials=3, commands=2).rename(columns={"trial": "Lauf", **{name: name.upper() for name in KEPT}})
    rules = {**{name: {"from": name.upper()} for name in KEPT}, **{name: {"from": source} for name, source in columns.items()}}
    return bns.Measurements(table.assign(volt=3.0), mapping={"columns": rules, **dict(also)})


def test_what_differs_in_capitals_alone_was_meant():
    assert "Did you mean 'Soll_L_cms'?" in unknown_name("column", "Soll_l_cms", ["Soll_R_cms", "Soll_L_cms", "Zeit"])
    assert "Did you mean 'Soll_R_cms'?" in unknown_name("column", "soll_r_cms", ["Soll_R_cms", "Soll_L_cms", "Zeit"])
    with pytest.raises(DataError, match=r"left_m_s asks for an unknown column 'left_m_S'\. Did you mean 'LEFT_M_S'"):
        mapped(trial="Lauf", left_m_s="left_m_S")


@pytest.mark.parametrize("name", ["trail", "Trial", "trials", "tril", "trual"])
def test_a_trial_with_a_slip_is_no_column_of_ones_own(name):
    with pytest.raises(DataError, match=f"^the mapping: {name} would be .* nothing gives trial. Did you mean 'trial'"):
        mapped(**{name: "Lauf"})


def test_the_line_of_a_slip_is_named(tmp_path):
    measured(NOMINAL, trials=2, commands=2).rename(columns={"trial": "Lauf"}).to_csv(tmp_path / "log.csv", index=False)
    (tmp_path / "log.csv.import.yaml").write_text("columns:\n  x_m: {from: x_m}\n  trail: {from: Lauf}\n")
    with pytest.raises(DataError, match=r"log\.csv\.import\.yaml, line 3: trail would be"):
        bns.Measurements(tmp_path / "log.csv")


def test_columns_of_ones_own_pass():
    assert len(mapped(trial="Lauf", trials="volt", z_m="volt", battery_v="volt")) == 3
    one = measured(NOMINAL, trials=1, commands=4).drop(columns="trial").assign(volt=3.0)
    rules = {"columns": {"t_s": {"from": "t_s"}, "trail": {"from": "volt"}}}
    with pytest.raises(DataError, match="Did you mean 'trial'"):
        bns.Measurements(one, mapping=rules)
    with pytest.raises(DataError) as cut:  # the trials are cut out, so that none is missing; one drive is not
        bns.Measurements(one, mapping={**rules, "trials": {"gap_s": 2}})
    assert "Did you mean" not in str(cut.value)


@pytest.mark.parametrize(
    ("given", "name", "slip"),
    [
        ("trail", "trial", True),
        ("Trial", "trial", True),
        ("trial", "trial", False),
        ("heading_grad", "heading_rad", True),
        ("heading_deg", "heading_rad", False),
        ("lfet_m_s", "left_m_s", True),
        ("left_m", "left_m_s", False),
        ("rialt", "trial", False),
    ],
)
def test_a_slip_is_of_one_letter(given, name, slip):
    assert one_slip(given, name) is slip
