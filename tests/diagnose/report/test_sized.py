"""An effect's sentence says how much, and to which side."""

from dataclasses import replace
from string import Formatter

import pytest

from bns.diagnose.report.sized import sized_sentence
from bns.physics.effects import all_effects, effect_named
from bns.registry import JOINT_EFFECTS

LISTED = {
    **all_effects(),
    **{f"jointed {name}": getattr(part, "effect", part) for name in JOINT_EFFECTS.names() for part in [JOINT_EFFECTS.load(name)]},
}


def number(value, low=None, high=None, **more):
    return {"value": value, "low": low, "high": high, **more}


JOINTS = {name: number(0.01) for name in ("across_rad", "at_m", "over_m")}


@pytest.mark.parametrize(
    ("name", "numbers", "said"),
    [
        ("speed-gain", {"gain": number(0.93, 0.92, 0.94)}, "both wheels turn 7 % slower than commanded"),
        ("speed-gain", {"gain": number(1.125)}, "both wheels turn 12.5 % faster than commanded"),
        ("wheel-mismatch", {"ratio": number(1.0296, 1.0282, 1.031)}, "the right wheel's diameter is 3 % larger than the left"),
        ("wheelbase", {"factor": number(2.5)}, "the effective wheelbase is longer by a factor of 2.5 than that of the model"),
        ("wheelbase", {"factor": number(0.4)}, "the effective wheelbase is shorter by a factor of 2.5 than that of the model"),
        ("wheelbase", {"factor": number(2.5412, 2.541, 2.5414)}, "the effective wheelbase is longer by a factor of 2.541 than"),
        ("wheelbase", {"factor": number(0.4012, 0.4011, 0.4013)}, "the effective wheelbase is shorter by a factor of 2.493 than"),
        ("wheelbase", {"factor": number(0.4012, 0.39, 0.41)}, "the effective wheelbase is shorter by a factor of 2.5 than"),
        ("yaw-bias", {"rate_rad_s": number(-0.05)}, "the robot turns 2.9°/s to the right whenever it moves"),
        ("reverse-gain", {"gain": number(0.9)}, "wheels turn 10 % slower backwards than forwards"),
        (
            *("dead-zone-mismatch", {"width_m_s": number(0.01), "left_share": number(0.3, 0.2, 0.4)}),
            "friction takes 10 mm/s of speed from a wheel on average, more from the right one",
        ),
        (
            *("speed-limit-mismatch", {"max_m_s": number(0.1), "left_spare": number(0.3)}),
            "the right wheel runs no faster than 100 mm/s, the other one may run faster",
        ),
        (
            *("backlash-mismatch", {"gap_m": number(0.003), "crossed_share": number(1.0), "left_share": number(0.5, 0.4, 0.6)}),
            "play in the gears stops the right wheel for 4.5 mm of its way whenever it changes direction, and",
        ),
        (
            *("backlash-mismatch", {"gap_m": number(0.003), "crossed_share": number(1.0), "left_share": number(1.98, 1.9, 2.0)}),
            "play in the gears stops the left wheel for 5.9 mm of its way whenever it changes direction, and t",
        ),
        (
            *("backlash-start", {"gap_m": number(0.003), "crossed_share": number(0.5)}),
            "play in the gears stops a wheel for 3 mm of its way whenever it changes direction, and for 1.5 mm when a trial",
        ),
        (
            "floor-joints",
            JOINTS | {"spacing_m": number(0.3302), "loss_m": number(0.003)},
            "a wheel loses 3 mm of its way at each of the lines on the floor that lie 0.33 m apart",
        ),
        (
            "floor-tiles",
            JOINTS | {"spacing_m": number(0.5), "loss_m": number(-0.004), "second_at_m": number(0), "second_share": number(0.5)},
            "a wheel gains 4 mm of its way at each joint between tiles that are 0.5 m wide (2 mm at those of the second row)",
        ),
        ("motor-lag", {"tau_s": number(0.2001)}, "the motors follow their commands with a lag of 200 ms"),
        ("motor-lag", {"tau_s": number(0.24491, 0.2447, 0.2452)}, "the motors follow their commands with a lag of 245 ms"),
        ("motor-lag", {"tau_s": number(0.24491, 0.23, 0.26)}, "the motors follow their commands with a lag of 240 ms"),
        ("wheelbase", {"factor": number(1.02481, 1.0247, 1.0249)}, "the effective wheelbase is 2.48 % longer than that of"),
        ("wheelbase", {"factor": number(1.02481, 1.024, 1.0256)}, "the effective wheelbase is 2.5 % longer than that of"),
        ("clock-offset", {"offset_s": number(-1.25)}, "the tracker's clock is 1.25 s behind the clock of the commands"),
        ("clock-drift", {"rate": number(0.003)}, "the tracker's clock runs 0.3 % faster than the clock of the commands"),
        ("pivot-slip", {"loss": number(0.07)}, "turns on the spot are 7 % smaller, and bends fit"),
        ("turn-asymmetry", {"share": number(-0.025)}, "left turns are 2.5 % smaller, and right turns larger by as much"),
        ("understeer", {"loss_s_m": number(-0.2)}, "the robot turns more the faster it drives"),
        ("mass-offset", {"lead_m_s": number(-0.002)},
         "the robot's mass lies behind its axle: it turns more when it drives forward, and less backward"),
        ("battery-sag", {"rate_per_s": number(-0.001)}, "the robot becomes faster in the course of the session"),
        ("battery-sag", {"rate_per_s": number(0.0), "per_volt": number(0.2)}, "the robot becomes slower (or faster) in"),
        ("dead-zone", {"width_m_s": number(0.0060564)}, "every wheel loses 6.1 mm/s of its speed to friction"),
        (
            *("friction-warm-up", {"width_m_s": number(0.01), "cold_m_s": number(0.02), "time_s": number(240.0)}),
            "friction takes 10 mm/s of its speed from every wheel, 20 mm/s more when the session begins",
        ),
        (
            *("friction-warm-up", {"width_m_s": number(0.01), "cold_m_s": number(-0.005), "time_s": number(240.0)}),
            "friction takes 10 mm/s of its speed from every wheel, 5 mm/s less when the session begins",
        ),
        ("speed-limit", {"max_m_s": number(0.42)}, "no wheel runs faster than 420 mm/s"),
        (
            *("marker-offset", {"forward_m": number(0.011), "left_m": number(-0.006)}),
            "the tracked point is not the point about which the robot turns, but 11 mm ahead of it and 6 mm to its right",
        ),
        (
            *("marker-offset", {"forward_m": number(-0.02, -0.021, -0.019), "left_m": number(0.0004, -0.001, 0.001)}),
            "the tracked point is not the point about which the robot turns, but 20 mm behind it and at most 1 mm to its left or "
            "to its right",
        ),
        (
            "gear-friction",
            {"tau_s": number(0.0602), "turn_ratio": number(1.0), "friction_m_s": number(0.0125), "loss_m_s": number(0.01197)},
            "the motors follow their commands with a lag of 60.2 ms on straight lines, and friction in the gears, which takes "
            "12.5 mm/s from a wheel that coasts, ends a motion sooner; at a steady command 12 mm/s are missing",
        ),
        ("start-delay", {"wait_s": number(0.1502)}, "a wheel at rest starts 150 ms late"),
        (
            *("breakaway", {"threshold_m_s": number(0.075), "stop_ratio": number(0.47)}),
            "a wheel at rest starts at 75 mm/s, and one that turns stops at 47 % of that",
        ),
        (
            "controller-overshoot",  # 1 Hz and a damping ratio of 0.35 in turns
            {"tau_s": number(0.0792), "lead_s": number(0.0351), "swing_s": number(0.0523), "turn_ratio": number(9.7)},
            "the wheels answer a command as a drive of the second order does, and swing before they settle: in turns with a "
            "natural frequency of 0.98 Hz and a damping ratio of 0.35",
        ),
        (
            "controller-overshoot",
            {"tau_s": number(0.04), "lead_s": number(0.06), "swing_s": number(0.1), "turn_ratio": number(4.0)},
            "the wheels answer a command as a drive of the second order does, and swing before they settle: on straight "
            "lines with a natural frequency of 1.6 Hz and a damping ratio of 0.5, in turns with a natural frequency of 0.8 Hz "
            "and a damping ratio of 0.25",
        ),
        (
            "controller-overshoot",  # the mean of the last 0.3 s: no resonance
            {"tau_s": number(0.15), "lead_s": number(0.0), "swing_s": number(0.0866), "turn_ratio": number(1.0)},
            "the wheels answer a command in two stages",
        ),
        (
            "controller-overshoot",
            {"tau_s": number(0.0, cancels=True), "lead_s": number(0.0), "swing_s": number(0.0866), "turn_ratio": number(1.0)},
            "the wheels answer a command in two stages",
        ),
        ("command-timeout", {"timeout_s": number(0.7)}, "the robot stops 700 ms after its last new command"),
        (
            *("overload-trip", {"step_m_s": number(0.45), "off_s": number(0.2)}),
            "a motor is switched off for 200 ms after a change of its command by more than 450 mm/s, as by a protection",
        ),
        (
            *("supply-trip", {"step_m_s": number(0.6), "off_s": number(0.2)}),
            "both motors are switched off for 200 ms after changes of their commands by more than 600 mm/s in all, as where the",
        ),
    ],
)
def test_a_sentence_follows_the_numbers(name, numbers, said):
    assert sized_sentence(effect_named(name), numbers).startswith(said)


@pytest.mark.parametrize(
    "numbers",
    [
        {},
        {"gain": number(None)},
        {"gain": number(float("nan"))},
        {"gain": number(1.0)},
        {"gain": number(1.01, 0.99, 1.03)},
        {"gain": number(0.93, per_trial=True)},
    ],
)
def test_where_the_side_is_open_the_general_sentence_stands(numbers):
    gain = effect_named("speed-gain")
    assert sized_sentence(gain, numbers) == gain.sentence
    assert sized_sentence(replace(gain, sized="", sentence=""), {"gain": number(0.9)}) == "the effect “speed-gain”"


@pytest.mark.parametrize("name", [name for name, effect in LISTED.items() if effect.sized])
def test_every_listed_sentence_has_numbers_of_its_effect(name):
    effect = LISTED[name]
    fields = [(field, words) for _, field, words, _ in Formatter().parse(effect.sized) if field is not None]
    assert fields
    for field, words in fields:
        assert field in {p.name for p in effect.parameters}
        assert not words or len(words.split("|")) in {2, 3}
    above, below = (
        sized_sentence(effect, {p.name: number(of if p.is_multiple else other) for p in effect.parameters})
        for of, other in ((1.5, 0.1), (0.7, -0.1))
    )
    assert "{" not in above
    assert above != below


def test_a_sentence_that_leaves_a_side_open_is_followed_by_one_with_numbers():
    open_ones = [name for name, effect in LISTED.items() if "faster or slower" in effect.sentence]
    assert open_ones
    assert all(LISTED[name].sized for name in open_ones)


def test_friction_that_is_made_up_for_at_a_steady_command_is_said_to_be_missing_only_while_a_wheel_coasts():
    numbers = {"tau_s": number(0.1), "turn_ratio": number(1.0), "friction_m_s": number(0.03), "loss_m_s": number(0.001)}
    assert sized_sentence(effect_named("gear-friction"), numbers).endswith("from a wheel that coasts, ends a motion sooner")
