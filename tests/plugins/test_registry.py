"""The one registry: names without imports, two of one name, packages that are broken."""

import subprocess
import sys
from dataclasses import replace

import pytest

from bns.errors import HardwareError, ModelError, SpecError
from bns.physics.effects import effect_named
from bns.registry import EFFECTS, FIGURES, ROBOTS, TRACKERS, Registry
from bns.robots.base import Robot
from bns.tasks import TASKS
from tests.plugins.package import announce


@pytest.fixture
def effects(tmp_path, monkeypatch):
    """A registry of effects that sees what a test announces: effects(name, package={entry: value}, source=...)."""
    monkeypatch.syspath_prepend(str(tmp_path))

    def registry(package, parts, **modules):
        for name, source in modules.items():
            (tmp_path / f"{name}.py").write_text(source)
        announce(tmp_path, package, {"bns.effects": parts})
        return Registry("effect", "effects", "bns.physics.effects", "EFFECT = ", "EFFECT", ("name", "stage", "apply"), ModelError)

    yield registry
    for name in ("gone", "broken", "twin", "wind_part"):
        sys.modules.pop(name, None)


WIND = """
from dataclasses import replace
from bns.physics.effects import effect_named
EFFECT = replace(effect_named("floor-slope"), name="wind", sentence="")
"""


def test_a_package_s_part_comes_after_ours_and_is_found_by_module_or_object(effects):
    registry = effects("windy", {"wind": "wind_part"}, wind_part=WIND)
    assert registry.names() == (*EFFECTS.own, "wind")
    assert registry.is_plugin("wind")
    assert not registry.is_plugin("motor-lag")
    assert registry.load("wind").in_words == "the effect “wind”"
    assert registry.load("motor-lag") is effect_named("motor-lag")


def test_an_unknown_name_lists_the_valid_ones_and_what_was_meant(effects):
    registry = effects("windy", {"wind": "wind_part:EFFECT"}, wind_part=WIND)
    with pytest.raises(ModelError, match=r"unknown effect 'wimd'\. Did you mean 'wind'\? Valid: .*motor-lag.*wind"):
        registry.load("wimd")
    with pytest.raises(SpecError, match=r"unknown robot 'kepera'\. Did you mean 'khepera'"):
        ROBOTS.load("kepera")
    with pytest.raises(HardwareError, match=r"unknown kind of tracker 'aruko'\. Did you mean 'aruco'"):
        TRACKERS.load("aruko")


def test_two_parts_of_one_name_are_refused_naming_both(effects):
    registry = effects("twin", {"motor-lag": "twin:EFFECT"}, twin=WIND)
    with pytest.raises(ModelError, match=r"bns\.physics\.effects\.motor_lag and the package twin 1\.0 \(twin:EFFECT\)"):
        registry.load("motor-lag")
    assert registry.names().count("motor-lag") == 1
    registry.load("speed-gain")


@pytest.mark.parametrize(
    ("parts", "modules", "said"),
    [
        ({"gone": "gone:EFFECT"}, {}, r"effect 'gone' of the package p 1\.0 .*ModuleNotFoundError: No module named 'gone'"),
        ({"gone": "broken"}, {"broken": "1 / 0"}, r"package p 1\.0 .*ZeroDivisionError: division by zero\. Fix or uninstall"),
        ({"gone": "broken"}, {"broken": "EFFECT = 3"}, r"package p 1\.0 .*it lacks name, stage, apply; docs/extending\.md"),
        ({"breeze": "wind_part"}, {"wind_part": WIND}, r"package p 1\.0 .*it calls itself 'wind'; the entry point must have"),
    ],
)
def test_a_package_that_cannot_be_used_is_named_and_harms_nothing_else(effects, parts, modules, said):
    registry = effects("p", parts, **modules)
    (name,) = parts
    assert name in registry.names()
    assert registry.load("motor-lag").name == "motor-lag"
    with pytest.raises(ModelError, match=said):
        registry.load(name)


def test_effects_of_packages_that_share_a_place_act_by_name(monkeypatch):
    from bns.physics.model import Model

    wind = replace(effect_named("floor-slope"), name="b-wind")
    gust = replace(wind, name="a-gust")
    model = Model(wheelbase_m=0.1)
    as_found = model.with_active(wind, (0.0, 0.0)).with_active(gust, (0.0, 0.0))
    assert [a.effect.name for a in as_found.effects] == ["b-wind", "a-gust"]
    monkeypatch.setitem(EFFECTS.__dict__, "announced", {"a-gust": (), "b-wind": ()})
    assert [a.effect.name for a in as_found.arranged().effects] == ["a-gust", "b-wind"]


def test_listing_names_imports_no_part():
    command = (
        "import sys; from bns.registry import *; "
        "names = [r.names() for r in (EFFECTS, WORLDS, ROBOTS, EXECUTORS, TRACKERS, PLATFORMS, FIGURES)]; "
        "assert all(names), names; print(*(m for m in sys.modules if m in {'numpy', 'numba', 'cv2', 'matplotlib'}))"
    )
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_figures_are_called_as_they_say_not_as_their_files():
    assert FIGURES.own["paths"][0].module == "analysis.paths"
    assert all(module.replace("_", "-").endswith(name) for name, (part,) in FIGURES.own.items() for module in [part.module])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("khepera.ring", r"task 'khepera\.ring' of the package tasks-of-mine 1\.0 .*it calls itself 'hoop'; .*ROBOT\.hoop"),
        ("khepera.gap", r"task 'khepera\.gap' of the package tasks-of-mine 1\.0 .*it is no bns\.tasks\.Task"),
    ],
)
def test_a_task_that_is_none_is_refused_by_its_package(tmp_path, monkeypatch, name, said):
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "mine.py").write_text("from bns.tasks import Task\nRING, GAP = Task('hoop', 'a', 'b', None), 3\n")
    announce(tmp_path, "tasks-of-mine", {"bns.tasks": {"khepera.ring": "mine:RING", "khepera.gap": "mine:GAP"}})
    registry = type(TASKS)("task", "tasks", "bns.tasks", "", "", (), SpecError)
    assert registry.load("khepera.circle").name == "circle"
    with pytest.raises(SpecError, match=said):
        registry.load(name)


def test_a_robot_is_asked_for_a_few_things_at_a_time():
    parts = [base for base in Robot.__mro__ if base.__module__ == Robot.__module__ and base is not Robot]
    asked = {part.__name__: [name for name, one in vars(part).items() if callable(one) and name[0] != "_"] for part in parts}
    assert len(parts) == 9
    assert all(1 <= len(methods) <= 5 for methods in asked.values()), asked
    declared = {name for part in (Robot, *parts) for name in part.__annotations__}
    for name in ROBOTS.own:
        robot = ROBOTS.load(name)
        assert all(hasattr(robot, one) for one in (*declared, *(m for methods in asked.values() for m in methods))), name
