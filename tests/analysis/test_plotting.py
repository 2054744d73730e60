from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from bns.bootstrap.loop import run
from bns.errors import StoreError
from bns.plotting import style as plotting
from bns.robots import load_robot
from bns.spec import RunSpec
from bns.tasks import load_task

NORTH = np.pi / 2
TINY = RunSpec(
    task="circle",
    evaluations=3,
    population_size=10,
    generations_per_evaluation=2,
    training_iterations_per_evaluation=20,
)


@pytest.mark.parametrize("turn", [0.3, NORTH, np.pi, -NORTH, -5.0])
def test_an_arc_keeps_its_distance_from_the_centre_and_turns_by_the_heading(turn):
    radius = 0.2
    centre = np.array([-radius * np.sign(turn), 0.0])  # a robot that faces north turns left around what lies west
    angle = (0.0 if turn > 0 else np.pi) + turn
    end = centre + radius * np.array([np.cos(angle), np.sin(angle)])
    points = plotting.arcs(np.array([[0, 0, NORTH], [*end, NORTH + turn]]))
    assert np.hypot(*(points - centre).T) == pytest.approx(radius)
    assert np.hypot(*np.diff(points, axis=0).T).sum() == pytest.approx(radius * abs(turn), rel=1e-3)
    assert points[1, 1] > 0  # it sets out forward, not backward around the rest of the circle
    assert points[-1] == pytest.approx(end)


def test_straight_drives_and_full_circles_are_chords():
    poses = np.array([[0, 0, 0], [0.3, 0, 0], [0.3, 0.001, 2 * np.pi], [0.4, 0.1, 50.0]])
    assert plotting.arcs(poses) == pytest.approx(poses[:, :2])


def test_a_path_that_is_not_finite_is_drawn_without_an_error(texts):
    poses = np.array([[0, 0, NORTH], [0.1, 0.1, 1.0], [np.nan, np.nan, np.nan]])
    far = np.array([[0, 0, NORTH], [1e9, 3.0, 1.0]])
    figure = Figure()
    ax = figure.subplots()
    plotting.draw_paths(ax, load_task("khepera", "circle").goals_m, 0.07, poses, far)
    assert texts(figure)
    assert np.abs(ax.get_xlim()).max() < 100  # cm: the runaway simulator does not shrink the picture


def test_a_note_leaves_room_below_the_axis_labels():
    with plotting.style():
        figure, axes = plotting.panels(3, 3.0)
        for ax in axes[:, 0]:
            ax.set(xlabel="x, east (cm)", aspect="equal")
        plotting.note(figure, "said " * 60)
        figure.draw_without_rendering()
    written = figure.findobj(match=lambda one: getattr(one, "get_text", str)().startswith("\nsaid"))[0]
    line = plotting.TEXT_PT / 72 * figure.dpi
    top = written.get_window_extent().y1 - line  # of the first line that is not empty
    assert min(ax.xaxis.label.get_window_extent().y0 for ax in axes[:, 0]) > top + 0.8 * line


def test_goals_are_numbered_in_order_and_one_visited_twice_has_both_numbers(texts):
    figure = Figure()
    ax = figure.subplots()
    task, poses = load_task("khepera", "infinity"), np.array([[0, 0, NORTH], [0.1, 0.2, 1.0]])
    plotting.draw_paths(ax, task.goals_m, 0.07, poses, poses)
    assert {"1", "2", "4", "5", "3, 6"} <= {text for text, _ in texts(figure)}
    assert [patch.radius for patch in ax.patches] == pytest.approx([7.0] * 5)  # cm
    assert {
        line.get_label(): line.get_linestyle() for line in ax.lines if line.get_label() in ("robot", "simulator")
    } == {"robot": "-", "simulator": "--"}
    assert ax.get_aspect() == 1.0


def test_saved_figures_have_the_same_bytes_each_time_and_no_date(tmp_path):
    kept = []
    for folder in ("one", "two"):
        with plotting.style():
            figure, axes = plotting.panels(2, 2.0)
            axes[0, 0].plot([1, 2], [3, 4])
        kept.append([path.read_bytes() for path in plotting.save(figure, tmp_path / folder / "name.with.dots")])
    assert kept[0] == kept[1]
    assert b"<dc:date>" not in kept[0][1]
    assert [path.name for path in sorted((tmp_path / "one").iterdir())] == ["name.with.dots.png", "name.with.dots.svg"]


def test_a_folder_that_is_a_file_is_an_explained_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StoreError, match="cannot"):
        plotting.save(Figure(), tmp_path / "file" / "figure")


def test_the_style_ignores_the_users_settings_and_gives_them_back():
    with mpl.rc_context({"font.size": 3.0, "lines.linewidth": 9.0}):
        with plotting.style():
            assert mpl.rcParams["font.size"] == plotting.TEXT_PT
            assert mpl.rcParams["lines.linewidth"] < 2
        assert mpl.rcParams["font.size"] == 3.0


def test_ordered_styles_differ_in_colour_line_and_marker_and_grow_lighter():
    looks = plotting.ordered_styles(5)
    for what in ("color", "linestyle", "marker"):
        assert len({look[what] for look in looks}) == 5
    light = [mpl.colors.to_rgb(look["color"]) @ np.array([0.3, 0.59, 0.11]) for look in looks]
    assert np.all(np.diff(light) > 0.05)
    assert plotting.ordered_styles(0) == []


def test_the_figure_of_a_run_shows_the_path_that_its_results_speak_of(tmp_path, monkeypatch, texts):
    robot, task, result = load_robot("khepera"), load_task("khepera", "circle"), run(TINY)
    drawn, save = [], plotting.save
    monkeypatch.setattr(plotting, "save", lambda figure, stem: drawn.append(figure) or save(figure, stem))
    png = plotting.path_figure(TINY, task, robot, result, tmp_path / "run")
    written = texts(drawn[0])
    lines = {line.get_label(): line.get_xydata() for line in drawn[0].axes[0].get_lines()}
    for label, poses in (("robot", result.world_poses), ("simulator", result.snn_poses)):
        assert lines[label][0] == pytest.approx([0, 0])
        assert lines[label][-1] == pytest.approx(100 * poses[-1, :2])
    assert png.read_bytes().startswith(b"\x89PNG")
    assert min(size for _, size in written) >= plotting.TEXT_PT
    assert "circle, seed 0\nevaluation 3: not all goals" in {text for text, _ in written}
