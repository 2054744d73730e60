"""What must hold of every effect in the folder, also of one that is added later."""

import inspect
import pkgutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from bns.errors import ModelError
from bns.physics import effects
from bns.physics.effect import STAGES, number
from bns.physics.effects import all_effects, effect_named
from bns.physics.model import Model
from bns.physics.order import FRICTION, ORDER, RAMPS
from bns.physics.signals import Body, Conditions, Flow, Stamps, View, Wheels
from bns.physics.wheels.differential_drive import observe, simulate
from bns.physics.wheels.scans import delayed
from bns.registry import EFFECTS

SIGNALS = dict(zip(STAGES, (Wheels, Body, Flow, Stamps, View), strict=True))
PLACES = {"x_m": 0.0, "y_m": 0.0, "spacing_m": 0.1, "at_m": 0.0, "second_at_m": 0.0}
"""Of a place: any may be."""
IDEAL = Model(wheelbase_m=0.0884)
LEFT = np.array([[0.09, 0.20, -0.05, 0.02], [0.15, 0.0, 0.07, 0.0], [0.2, 0.2, 0.1, 0.15]])
RIGHT = np.array([[0.20, 0.05, 0.10, 0.02], [0.15, 0.1, -0.07, 0.0], [0.2, 0.1, 0.2, 0.15]])
DURATION = np.array([[1.0031, 0.5, 0.7507, 0.301], [0.31, 0.9, 0.42, 0.0], [0.5, 0.25, 0.333, 0.444]])

every_effect = pytest.mark.parametrize("effect", all_effects().values(), ids=all_effects())


def plausible_model(effect):
    """The effect at the plausible end that is farther from neutral."""
    ends = {p.name: max(p.plausible, key=lambda v, p=p: abs(v - p.neutral)) for p in effect.parameters}
    ends |= {p.name: PLACES[p.name] for p in effect.parameters if p.name in PLACES}
    limits = [p for p in effect.parameters if np.isinf(p.neutral)]
    ends |= {p.name: min(p.plausible) for p in limits}
    return IDEAL.with_effect(effect.name, **ends)


def seen(model, rows=slice(None)):
    poses = simulate(model, LEFT[rows], RIGHT[rows], DURATION[rows], start=(0.3, 0.1, 0.4))
    return observe(poses, None, model)


def test_one_effect_a_file_under_its_own_name():
    files = {m.name.replace("_", "-") for m in pkgutil.iter_modules(effects.__path__)}
    assert files == set(EFFECTS.own)
    assert len(files) >= 13
    assert all(effect.name == name for name, effect in all_effects().items())


def test_effects_act_in_the_order_of_one_tuple_and_stage_by_stage():
    listed = [name for name in ORDER if name in EFFECTS.own]
    assert len(listed) >= 20
    assert len(set(ORDER)) == len(ORDER)
    model = Model(wheelbase_m=0.1)
    for name in sorted(listed):
        model = model.with_effect(name, **effect_named(name).neutral)
    behind = [name for name in listed if name not in FRICTION]  # a tuple that begins with a ramp has friction behind all of them
    last_ramp = behind.index(RAMPS[-1]) + 1
    behind[last_ramp:last_ramp] = FRICTION
    assert [active.effect.name for active in model.arranged().effects] == behind
    assert [active.effect.name for active in model.arranged().with_friction_moved().effects] == listed
    stages = [STAGES.index(effect_named(name).stage) for name in listed]
    assert stages == sorted(stages)


def test_an_effect_of_a_user_has_a_place_and_words_without_saying_so():
    gain = effect_named("speed-gain")
    own = replace(gain, name="own", sentence="", measurement="")
    assert effect_named("speed-limit").place < own.place < effect_named("acceleration-limit").place
    assert own.in_words == "the effect “own”"
    assert gain.in_words == gain.sentence != ""
    late = replace(own, after="motor-lag")
    assert effect_named("motor-lag").place < late.place < effect_named("wheelbase").place
    model = IDEAL.with_active(late, (1.1,)).with_active(effect_named("motor-lag"), (0.1,)).with_active(gain, (1.2,))
    assert [active.effect.name for active in model.effects] == ["speed-gain", "motor-lag", "own"]
    with pytest.raises(ModelError, match=r"effect own: unknown place of an effect 'motor-lug'\. Did you mean 'motor-lag'"):
        replace(own, after="motor-lug")
    with pytest.raises(ModelError, match="effect own: unknown stage"):
        replace(own, stage="wheels")


@every_effect
@pytest.mark.parametrize("diagonal_m", [0.03, 0.3, 30.0])
def test_on_a_floor_of_any_size_the_neutral_values_are_allowed(effect, diagonal_m):
    fitting = effect.within(np.zeros(2), diagonal_m * np.array([0.6, 0.8]))
    assert fitting.checked(fitting.neutral)


@every_effect
def test_declared_completely(effect):
    assert effect.stage in STAGES
    assert effect.parameters
    assert all(text.strip() for text in (effect.equation, effect.residuals))
    assert set(effect.lookalikes) <= set(all_effects()) - {effect.name}
    assert set(effect.beside) <= set(all_effects()) - {effect.name}
    assert bool(effect.explained_by) == bool(effect.caveat)
    assert list(inspect.signature(effect.apply).parameters)[1:] == [p.name for p in effect.parameters]


@every_effect
def test_plausible_and_neutral_lie_inside_the_bounds(effect):
    for p in effect.parameters:
        assert p.low <= p.plausible[0] < p.plausible[1] <= p.high
        assert np.isfinite(p.plausible).all()
        assert p.low <= p.neutral <= p.high
        assert p.unit
        assert p.text


@every_effect
def test_neutral_changes_nothing(effect):
    neutral = IDEAL.with_effect(effect.name, **effect.neutral)
    np.testing.assert_allclose(seen(neutral), seen(IDEAL), rtol=0, atol=1e-12)


@every_effect
def test_plausible_value_shows(effect):
    change = np.abs(seen(plausible_model(effect)) - seen(IDEAL))
    assert change.max() > 1e-3
    assert np.isfinite(change).all()


@every_effect
def test_batch_equals_single_trials(effect):
    model = plausible_model(effect)
    together = seen(model)
    for row in range(len(LEFT)):
        np.testing.assert_allclose(together[[row]], seen(model, [row]), rtol=0, atol=1e-13)


@every_effect
def test_apply_returns_the_signal_of_its_stage_and_leaves_its_input(effect):
    arrays = np.full((1, 3), 0.1)
    given = {
        "wheel": Wheels(arrays, arrays, arrays, 0.1),
        "body": Body(arrays, arrays, arrays, arrays, arrays, arrays, arrays),
        "world": Flow(),
        "clock": Stamps(arrays),
        "measure": View(np.full((1, 3), 0.1)),
    }[effect.stage]
    values = plausible_model(effect).values_of(effect.name)
    assert type(effect.apply(given, **values)) is SIGNALS[effect.stage]
    assert (arrays == 0.1).all()


@every_effect
def test_values_beyond_the_bounds_are_refused(effect):
    for p in effect.parameters:
        beyond = effect.neutral | {p.name: p.low - 1e-6}
        with pytest.raises(ModelError, match=f"{effect.name}: {p.name} is .* must be a number from"):
            effect.checked(beyond)
        with pytest.raises(ModelError, match=p.name):
            effect.checked(effect.neutral | {p.name: float("nan")})


def test_unknown_missing_and_misspelt_names():
    with pytest.raises(ModelError, match=r"unknown effect 'motor-lug'\. Did you mean 'motor-lag'\?"):
        effect_named("motor-lug")
    with pytest.raises(ModelError, match=r"unknown parameter of motor-lag 'tau'\. Did you mean 'tau_s'"):
        effect_named("motor-lag").checked({"tau": 0.1})
    with pytest.raises(ModelError, match="floor-slope lacks y_m_s"):
        effect_named("floor-slope").checked({"x_m_s": 0.0})


@pytest.mark.parametrize(
    ("value", "hint"),
    [
        ("1e-3", "exponent with a point"),
        (True, "must be a number"),
        (None, "must be a number"),
        ("fast", "must be a number"),
    ],
)
def test_what_is_no_number_is_refused(value, hint):
    with pytest.raises(ModelError, match=hint):
        number("tau_s", value, 0.0, 1.0)


@pytest.mark.parametrize("name", sorted(all_effects()))
def test_every_effect_says_how_to_confirm_it_on_the_bench(name):
    effect = all_effects()[name]
    assert len(effect.measurement.split()) >= 4
    assert effect.sentence


@pytest.mark.parametrize("tracked", [False, True])
def test_what_varies_within_a_step_is_late_as_it_varies_only_where_tracks_are_followed(tracked):
    """Runs keep their numbers: worlds are driven in steps so short that it makes no difference."""
    steps, ramp = np.full((1, 8), 0.1), 0.05 * np.arange(1.0, 9.0)[None]
    seen = np.zeros((1, 8, 3)) if tracked else None
    late = effect_named("command-delay").apply(Wheels(steps, ramp, -ramp, 0.1, Conditions(seen=seen)), delay_s=0.04)
    np.testing.assert_array_equal(late.left_m_s, delayed(ramp, steps, 0.04, tracked))
    np.testing.assert_array_equal(late.right_m_s, -late.left_m_s)
    assert (delayed(ramp, steps, 0.04, True) != delayed(ramp, steps, 0.04, False)).any()


def test_a_users_kernels_that_are_cached_load_in_the_next_process(tmp_path):
    """Numba imports the module that a cached kernel calls into by its name."""
    (tmp_path / "half.py").write_text(
        "from dataclasses import replace\n"
        "from numba import njit\n"
        "from bns.physics.effect import Effect, Parameter\n"
        "@njit(cache=True)\n"
        "def part(x, k):\n    return x * (1 - k)\n"
        "@njit(cache=True)\n"
        "def twice(x, k):\n    return part(part(x, k), k)\n"
        "def apply(wheels, k):\n    return replace(wheels, left_m_s=twice(wheels.left_m_s, k))\n"
        "EFFECT = Effect('half', 'wheel', (Parameter('k', '1', 0.0, 1.0, (0.0, 0.9), 0.0, 'share lost'),), 'x', 'y', (), apply)\n"
    )
    code = (
        "from pathlib import Path; from bns.physics.effects import effect_in_file; from bns.physics.model import Model;"
        "from bns.physics.wheels.differential_drive import simulate;"
        "model = Model(wheelbase_m=0.1).with_active(effect_in_file(Path('half.py')), (0.5,));"
        "print(simulate(model, [[0.1]], [[0.1]], [[1.0]])[0, -1, 0])"
    )
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", code], check=False, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert float(done.stdout) < 0.09
