from __future__ import annotations

import os
import time
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from analysis import __main__ as command
from analysis.publish import captions
from analysis.rendering import Renderer
from bns.plotting.style import rendered


def figure(upto: int = 3) -> Figure:
    drawn = Figure(figsize=(3, 2), layout="constrained")
    ax = drawn.subplots()
    ax.plot(range(upto), label="ways")
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.1f} m"))  # of no module: it must travel all the same
    ax.legend()
    return drawn


def process_of(_: Figure) -> int:
    return os.getpid()


def fail(_: Figure) -> None:
    raise ZeroDivisionError("nothing to divide")


def leave_a_mark(drawn: Figure) -> None:
    Path(str(drawn.get_label())).touch()
    time.sleep(0.2)


def test_another_process_renders_the_same_bytes():
    with Renderer(jobs=2) as beside, Renderer(jobs=1) as here:
        assert beside.submit(process_of, figure()).result() != os.getpid()
        assert here.submit(process_of, figure()).result() == os.getpid()
        assert beside.submit(rendered, figure()).result() == here.submit(rendered, figure()).result() == rendered(figure())


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_goes_wrong_is_told_to_whoever_asks_for_the_content(jobs):
    with Renderer(jobs) as renderer:
        failed, fine = renderer.submit(fail, figure()), renderer.submit(rendered, figure())
        with pytest.raises(ZeroDivisionError, match="nothing to divide"):
            failed.result()
        assert len(fine.result()) == 2


def drawn_until_ctrl_c(folder: Path) -> None:
    with Renderer(jobs=2) as renderer:
        for number in range(20):
            one = figure()
            one.set_label(str(folder / f"{number}"))
            renderer.submit(leave_a_mark, one)
        raise KeyboardInterrupt


def test_leaving_by_ctrl_c_renders_no_more_than_what_has_begun(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        drawn_until_ctrl_c(tmp_path)
    assert len(list(tmp_path.iterdir())) < 10


def test_a_figure_that_cannot_be_rendered_is_told_and_costs_no_other(tmp_path, real_results, monkeypatch, capsys):
    monkeypatch.setattr(command, "Renderer", lambda jobs: Renderer(1))
    calls = iter(range(100))

    def second_fails(drawn: Figure) -> tuple[bytes, bytes]:
        if next(calls) == 1:
            raise ValueError("a glyph is missing")
        return rendered(drawn)

    monkeypatch.setattr(command, "rendered", second_fails)
    wanted = {name: module for name, module in command.figures().items() if name in {"success-by-mutation", "budget"}}
    monkeypatch.setattr(command, "figures", lambda _: wanted)
    assert command.main(["--results", str(real_results), "--out", str(tmp_path)]) == 1
    told = capsys.readouterr()
    assert "ValueError: a glyph is missing" in told.err
    assert "could not be drawn; the others are" in told.err
    assert [line for line in told.out.splitlines() if "n = " in line]
    skipped = [one["skipped"] for one in captions(tmp_path) if "skipped" in one]
    assert skipped == ["its script failed: ValueError: a glyph is missing"]
