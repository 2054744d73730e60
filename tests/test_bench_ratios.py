"""A ratio that got worse by more than 15 % is said; one that got better, or is new, is not."""

import json

import pytest

from tests.bench import ratios
from tests.bench.line import Line, at_least, at_most, without_target


def table(path, *lines, quick=False):
    path.write_text(json.dumps({"quick": quick, "lines": [line.as_dict() for line in lines]}))
    return str(path)


@pytest.fixture
def kept(tmp_path, monkeypatch):
    path = tmp_path / "ratios.csv"
    monkeypatch.setattr(ratios, "KEPT", path)
    monkeypatch.setattr(ratios.read, "__defaults__", (path,))
    monkeypatch.setattr(ratios.write, "__defaults__", (path,))
    return path


def test_the_committed_table_is_of_lines_that_are_measured():
    assert len(ratios.read()) >= 10
    assert all(value > 0 for value in ratios.read().values())


def test_only_ratios_are_compared(kept, tmp_path, capsys):
    first = [
        at_least("against a peer", 5.0, 4),
        at_most("a run", 2.0, 5, "s", floor=1.0),
        at_most("a time", 3.0, 5, "s"),
        without_target("a diagnosis over another", 2.0, "x"),
    ]
    assert ratios.main([table(tmp_path / "a.json", *first), "--write"]) == 0
    assert kept.read_text().splitlines()[1:] == ["against a peer,5", '"a run, over its floor",2', "a diagnosis over another,2"]
    assert ratios.main([table(tmp_path / "a.json", *first)]) == 0
    assert "3 ratios, 0 worse" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (at_least("against a peer", 4.2, 4), "WORSE by 19%"),
        (at_least("against a peer", 4.4, 4), ""),
        (at_least("against a peer", 9.0, 4), ""),
        (at_most("a run", 2.4, 5, "s", floor=1.0), "WORSE by 20%"),
        (at_most("a run", 4.4, 5, "s", floor=2.0), ""),
        (Line("new", 1.0, None, "x", True), ""),
    ],
)
def test_what_is_worse(kept, tmp_path, capsys, line, said):
    kept.write_text('name,ratio\nagainst a peer,5\n"a run, over its floor",2\n')
    assert ratios.main([table(tmp_path / "b.json", line)]) == (1 if said else 0)
    assert ("WORSE" in (out := capsys.readouterr().out)) == bool(said)
    assert said in out


def test_nothing_to_compare(kept, tmp_path, capsys):
    assert ratios.main([str(tmp_path / "none.json")]) == 2
    assert "make bench" in capsys.readouterr().err
    assert ratios.main([table(tmp_path / "q.json", at_least("a", 1.0, 1), quick=True), "--write"]) == 2
    assert not kept.exists()
