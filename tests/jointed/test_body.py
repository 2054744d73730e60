"""Bodies on joints: the simulation in rows is the one of the world, effects change what they say, files are read back."""

import dataclasses

import numpy as np
import pytest

import bns
from bns.cli.main import main
from bns.errors import DataError, ModelError
from bns.physics.jointed.drives import at_times, through_postures, told_speed_rad_s
from bns.physics.jointed.effects.floor_patch import tent
from bns.physics.jointed.mechanism import Mechanism, machine
from bns.physics.jointed.model_files import load_body
from bns.physics.jointed.pieced import PiecedEffect
from bns.physics.jointed.plant import Plant, Rough, Sighting
from bns.physics.jointed.simulate import Simulator
from bns.physics.model import load_model
from bns.physics.snake.body import Body
from bns.physics.snake.gait import cycle_angles
from bns.physics.snake.parameters import shipped_parameters
from tests.jointed.arm import JOINTS, log, xml

SNAKE = load_body("snake")
GAITS = (
    (0.68, 0.38, 4.64, 6.01),
    (0.47, 0.33, 4.54, 1.37),
    (0.9, 0.1, 1.0, 2.0),
    (0.45, 0.28, 4.37, 1.84),
    (0.13, 0.03, 5.03, 3.66),
)


def simulated(plant=None):
    """Markers (gaits, 2, 2, 2) at the begin and end of each gait, driven from straight."""
    body = machine(SNAKE.mechanism)
    begin = np.array([0.3, 0.1, 0.5])
    drives = [
        through_postures(SNAKE.mechanism, np.vstack([np.zeros(12), cycle_angles(gait)]), body.model.opt.timestep, begin)
        for gait in GAITS
    ]
    simulator = Simulator(body, drives, 2)
    return simulator.sightings(plant or body.plant, simulator.at_rest()).point_m.reshape(-1, 2, 2, 2)


@pytest.fixture(scope="module")
def sound():
    return simulated()


def gaps(markers):
    """Distances of the markers (gaits, 2), m."""
    return np.hypot(*(markers[:, :, 1] - markers[:, :, 0]).transpose(2, 0, 1))


def moved(markers):
    """Way of the middle along and beside the markers' line, m, and its turn, rad; (gaits, 3)."""
    lines = markers[:, :, 1] - markers[:, :, 0]
    heading = np.arctan2(lines[..., 1], lines[..., 0])
    way = np.diff(markers.mean(axis=2), axis=1)[:, 0]
    c, s = np.cos(heading[:, 0]), np.sin(heading[:, 0])
    turn = np.angle(np.exp(1j * (heading[:, 1] - heading[:, 0])))
    return np.column_stack([c * way[:, 0] + s * way[:, 1], c * way[:, 1] - s * way[:, 0], turn])


def test_rows_move_as_the_world_s_body_does(sound):
    """Friction by pairs, servos as arrays, MuJoCo's threads: within millimetres, but for gaits in which luck decides."""
    there = []
    for gait in GAITS:
        body = Body(shipped_parameters())
        body.lay_straight()
        driven = body.drive_cycle(gait)
        there.append([driven.before_m, driven.after_m])
    there = np.array(there)
    off = np.abs(moved(sound) - moved(there))
    assert (np.median(off, axis=0) < [1e-3, 3e-3, 8e-3]).all(), off
    # distances of the markers show the joints whatever the floor does: 0.4 mm apart, 3 mm with servos 0.7 times as stiff
    assert np.abs(gaps(sound) - gaps(there)).max() < 1e-3


def test_servos_that_are_less_stiff_show_in_the_markers_distances(sound):
    plant = machine(SNAKE.mechanism).plant
    soft = simulated(dataclasses.replace(plant, stiffness=0.7 * plant.stiffness))
    assert np.abs(gaps(soft) - gaps(sound)).max() > 2e-3


def test_uneven_grip_moves_the_body_and_an_even_one_is_friction(sound):
    plant = machine(SNAKE.mechanism).plant
    even = simulated(dataclasses.replace(plant, grip=np.full(len(plant.grip), 1.5)))
    rough = simulated(dataclasses.replace(plant, friction_along=1.5, friction_across=1.5))
    assert moved(even) == pytest.approx(moved(rough), abs=1e-9)
    head = simulated(dataclasses.replace(plant, grip=np.r_[3.0, plant.grip[1:]]))
    assert np.abs(moved(head) - moved(sound))[:, :2].max() > 5e-3


def test_every_stretch_begins_where_the_robot_was_seen(sound):
    assert sound[:, 0].mean(axis=1) == pytest.approx(np.tile([0.3, 0.1], (len(GAITS), 1)), abs=2e-4)
    line = sound[:, 0, 1] - sound[:, 0, 0]
    assert np.arctan2(line[:, 1], line[:, 0]) == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize("name", [n for n in SNAKE.catalogue() if n.endswith(("joint3", "green")) or "joint" not in n])
def test_an_effect_does_nothing_at_neutral_and_something_elsewhere(name):
    effect = SNAKE.effect_named(name)
    if effect.stage == "clock":
        return
    points = np.arange(8.0).reshape(2, 2, 2)
    given = machine(SNAKE.mechanism).plant if effect.stage == "mechanics" else Sighting(points, points / 9, points / 7)
    for p in effect.parameters:
        far = max(p.plausible, key=lambda end, p=p: abs(end - p.neutral))
        # where a patch is matters only if its friction is another one
        others = {**effect.neutral, "factor": 2.0} if isinstance(effect, PiecedEffect) else effect.neutral
        changed = effect.apply(given, **{**others, p.name: far})
        assert not same(changed, given), p.name
    assert same(effect.apply(given, **effect.neutral), given)
    assert effect.sentence
    assert effect.measurement
    assert "{" not in effect.sentence


def same(one, other):
    fields = (f.name for f in dataclasses.fields(one if isinstance(one, Plant) else Sighting))
    # a speed limit at what is told, or beyond, is none
    bounded = [(np.minimum(getattr(v, f), 1.0) if f == "speed" else getattr(v, f)) for f in fields for v in (one, other)]
    return all(np.array_equal(np.asarray(a), np.asarray(b)) for a, b in zip(bounded[::2], bounded[1::2], strict=True))


def test_one_link_that_grips_holds_the_body_there(sound):
    plant = machine(SNAKE.mechanism).plant
    effect = SNAKE.effect_named("link-friction-link6")
    assert "link6" in effect.sentence
    held = effect.apply(plant, factor=4.0)
    assert held.grip.tolist() == [4.0 if n == 6 else 1.0 for n in range(13)]
    assert np.abs(moved(simulated(held)) - moved(sound))[:, :2].max() > 5e-3


def test_one_heavy_link_weighs_as_much_more_and_turns_the_body(sound):
    body = machine(SNAKE.mechanism)
    effect = SNAKE.effect_named("link-mass-link8")
    assert "link8" in effect.sentence
    assert "link8" in effect.measurement
    loaded = effect.apply(body.plant, factor=3.0)
    assert loaded.mass.tolist() == [3.0 if n == 8 else 1.0 for n in range(13)]
    before, after = body.model, body.changed(loaded)
    assert (after.body_mass / np.maximum(before.body_mass, 1e-9))[1:].tolist() == pytest.approx(loaded.mass.tolist())
    assert after.body_inertia[9] == pytest.approx(3.0 * before.body_inertia[9])
    assert np.abs(moved(simulated(loaded)) - moved(sound))[:, :2].max() > 5e-3


def test_a_slope_pulls_downhill_in_the_world_s_frame(sound):
    plant = machine(SNAKE.mechanism).plant
    tilted = simulated(SNAKE.effect_named("floor-slope").apply(plant, east_rad=0.0, north_rad=0.05))
    gone = (tilted[:, 1] - tilted[:, 0] - (sound[:, 1] - sound[:, 0])).mean(axis=(0, 1))
    assert gone[1] > 0.01
    assert gone[1] > 2 * abs(gone[0])


def test_a_joint_whose_zero_is_off_bends_the_body(sound):
    plant = machine(SNAKE.mechanism).plant
    bent = simulated(SNAKE.effect_named("joint-zero-joint6").apply(plant, offset_rad=0.3))
    assert (np.abs(gaps(bent) - gaps(sound))[:, 0] > 2e-3).all()


def test_set_points_at_times_hold_until_the_next():
    t, told = np.array([0.0, 1.0, 2.0]), np.array([[0.0], [1.0], [2.0]])
    drive = at_times(t, told, (1.0, 2.5), 0.1, np.zeros(3), looks=4)
    assert drive.frames.tolist() == [10, 15, 20, 25]
    assert drive.set_points[[0, 9, 10, 19, 20], 0].tolist() == [0, 0, 1, 1, 2]
    assert told_speed_rad_s([drive], 0.1) == pytest.approx(2.0)  # a jump of 1 rad, over half a second
    began = at_times(t, told, (1.0, 2.5), 0.1, np.zeros(3), began=np.array([-5.0]))
    assert began.set_points[:2, 0].tolist() == [-5, 0]
    assert told_speed_rad_s([began], 0.1) == pytest.approx(2.0)  # of what it was told: nobody told it to begin there


def test_a_model_file_names_body_and_effects(tmp_path):
    model = bns.Model("snake").with_effect("weak-joint-joint5", strength=0.5).with_effect("camera-scale", scale=0.02)
    path = model.save(tmp_path / "mine.yaml")
    again = bns.Model(path)
    assert isinstance(again, bns.Model)
    assert again.canonical_json() == load_model(path).canonical_json() == model.canonical_json()
    assert again.canonical_json() != bns.Model("snake").canonical_json()
    assert "12 joints" in repr(again)


def test_any_mjcf_file_with_servos_and_sites_is_a_model(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text(xml())
    arm = bns.Model(file, sites=["hand"])
    assert machine(arm.mechanism).joints == ("shoulder", "elbow", "wrist")
    assert "floor-friction" not in arm.catalogue()
    assert "weak-joint-elbow" in arm.catalogue()
    assert bns.Model(arm.save(tmp_path / "arm.yaml")).canonical_json() == arm.canonical_json()


@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        ("<mujoco/>", {}, "sites is"),
        (xml(), {"sites": ["nose"]}, "no site 'nose'"),
        (xml().replace("<position", "<motor").replace(' kp="6.0"', ""), {}, "no position servo"),
        ("no xml", {}, "does not read"),
        (xml(), {"delay_s": -1.0}, "delay_s is -1.0"),
        (xml(), {"colour": "red"}, "colour"),
        (xml(), {"sites": ["hand", "elbow", "hand"]}, "sites has hand more than once"),
        (xml().replace('kp="6.0"', 'kp="6.0" gear="2"', 1), {}, "Actuator 0 of the body has gear 2; only servos without a gear"),
        (xml().replace('kp="6.0"', 'kp="6.0" timeconst="0.1"', 1), {}, "Actuator 0 of the body has dynamics of its own"),
    ],
)
def test_a_body_that_cannot_be_used_is_refused_with_what_to_do(tmp_path, text, settings, said):
    file = tmp_path / "robot.xml"
    file.write_text(text)
    with pytest.raises(ModelError, match=said):
        bns.Model(file, **settings).catalogue()


def test_data_of_another_kind_of_robot_are_refused(tmp_path):
    file = tmp_path / "arm.xml"
    file.write_text(xml())
    with pytest.raises(DataError, match="lack elbow_set_rad"):
        bns.compare(_no_elbow(), bns.Model(file))


def test_set_points_of_a_servo_that_the_model_lacks_are_said_to_be_unused(tmp_path, capsys):
    file, measured = tmp_path / "arm.xml", tmp_path / "arm.csv"
    file.write_text(xml())
    log(2).assign(gripper_set_rad=0.1).to_csv(measured, index=False)
    assert main(["compare", str(measured), "--model", str(file)]) == 0
    said = "; gripper_set_rad: the model has no such servo, so what it was told is not used"
    assert said in capsys.readouterr().err
    log(2).to_csv(measured, index=False)
    assert main(["compare", str(measured), "--model", str(file)]) == 0
    assert "no such servo" not in capsys.readouterr().err


def _no_elbow():
    return log(1).drop(columns=["elbow_set_rad"])


SEEN = [f"{site}_{axis}_m" for site in ("elbow", "hand") for axis in "xy"]
TOLD = [f"{joint}_set_rad" for joint in JOINTS]


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        (lambda t: t.assign(**1000 * t[SEEN]), r"The sites move over \d+\.\d m, .* must be in metres, .* millimetres"),
        (lambda t: t.assign(**t[TOLD] * 180 / np.pi), r"shoulder_set_rad goes from -\d+\.?\d* to .* must be in radians"),
        (lambda t: t.assign(t_s=1000 * t["t_s"]), r"Rows are 40 s apart; t_s must be in seconds"),
        (lambda t: t.assign(**0 * t[TOLD]), r"Every set point is the same in all rows, and the sites move over 0\.\d+ m"),
        (lambda t: t.drop(columns="hand_y_m"), r"lack hand_y_m: a tracked site has both"),
        (lambda t: t.drop(columns="hand_x_m"), r"lack hand_x_m: a tracked site has both"),
    ],
)
@pytest.mark.parametrize("ranged", [False, True])
def test_a_log_in_other_units_is_refused_with_the_column(tmp_path, changed, said, ranged):
    table, text = log(2), xml()
    file = tmp_path / "arm.xml"
    file.write_text(text.replace('kp="6.0"', 'kp="6.0" ctrlrange="-1.6 1.6"') if ranged else text)
    model = bns.Model(file)
    bns.compare(table, model)
    with pytest.raises(DataError, match=said):
        bns.compare(changed(table), model)


def test_a_comparison_of_a_body_says_why_its_noise_is_not_known(tmp_path):
    (tmp_path / "arm.xml").write_text(xml())
    said = bns.compare(log(1), bns.Model(tmp_path / "arm.xml")).summary()
    assert "(noise not known: of a body only the ends of a stretch are compared)" in said
    assert "tracking noise alone" not in said


def test_a_log_of_joints_is_none_of_wheels_and_needs_no_import(tmp_path, capsys):
    with pytest.raises(DataError, match="holds set points of joints, and the model khepera drives wheels"):
        bns.compare(log(1), "khepera")
    file = tmp_path / "arm.csv"
    log(1).to_csv(file, index=False)
    for more in (["--propose"], ["-o", str(tmp_path / "table.csv")]):
        assert main(["import", str(file), *more]) == 2
        assert "holds set points of joints (JOINT_set_rad), which need no mapping and no import" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [file]


def test_links_that_the_file_keeps_from_touching_the_floor_do_not_touch_it():
    """As in MuJoCo itself: an excluded pair of bodies, and a pair of geoms that the file gives, are not given again."""
    floor = '<geom name="floor" type="plane" size="1 1 0.1"/>'
    touching = xml().replace("<worldbody>", f"<worldbody>{floor}").replace('contype="0" conaffinity="0"', "")
    without = '<contact><exclude body1="world" body2="elbow-link"/></contact>'
    paired = '<contact><pair geom1="floor" geom2="wrist-geom" friction="2 2 0.1 0.1 0.1"/></contact>'

    def pairs(more):
        return machine(Mechanism(touching.replace("<actuator>", more + "<actuator>"), ("hand",)))

    assert [name for name, _ in pairs("").on_the_floor] == ["shoulder-link", "elbow-link", "wrist-link"]
    assert [name for name, _ in pairs(without).on_the_floor] == ["shoulder-link", "wrist-link"]
    own = pairs(paired).model
    assert (own.npair, sorted(own.pair_friction[:, 0])) == (3, [1.0, 1.0, 2.0])


def test_a_joint_without_torque_is_not_put_where_its_servo_was_told_to_bring_it():
    body = machine(SNAKE.mechanism)
    postures = np.vstack([cycle_angles(GAITS[0])[3:5], cycle_angles(GAITS[0])])
    drive = through_postures(SNAKE.mechanism, postures, body.model.opt.timestep, np.zeros(3), before=2)
    simulator, joint = Simulator(body, [drive], 1), 4
    at = 1 + body.joint_at[joint]
    silent = body.plant.with_joint("torque", body.plant.joints[joint], 0.0)
    told = drive.set_points[0, joint]
    assert abs(told) > 0.2
    half = simulator._put_down(body.plant.with_joint("torque", body.plant.joints[joint], 0.4))
    assert half[0, at] == pytest.approx(told, abs=0.03)  # a weak one has brought it there all the same
    assert simulator.settled(body.plant)[0, at] == pytest.approx(told, abs=0.05)
    assert abs(simulator.settled(silent)[0, at]) < 0.1


def test_a_patch_of_floor_acts_in_the_world_on_the_links_that_are_on_it(sound):
    plant = machine(SNAKE.mechanism).plant

    def with_rough(*places):
        return moved(simulated(dataclasses.replace(plant, rough=places)))

    rise = float(np.log(2.0))
    everywhere = with_rough(Rough(0.3, 0.1, 50.0, rise))
    doubled = moved(simulated(dataclasses.replace(plant, friction_along=2.0, friction_across=2.0)))
    assert everywhere == pytest.approx(doubled, abs=1e-3)
    assert with_rough(Rough(5.0, 0.1, 1.0, rise)) == pytest.approx(moved(sound), abs=1e-9)
    # bodies lie along 0.5 rad, so the yellow end is to the south-west of (0.3, 0.1) and the green end to the north-east
    ends = [with_rough(Rough(0.3 + s * 0.5, 0.1 + s * 0.27, 0.25, rise)) - moved(sound) for s in (-1, 1)]
    assert all(np.abs(end).max() > 5e-3 for end in ends)
    assert np.abs(ends[0] - ends[1]).max() > 5e-3


def test_tents_add_up_to_a_level_floor_and_a_patch_to_its_shares_of_them():
    tents = [tent(i, j) for i in range(-2, 3) for j in range(-2, 3)]
    places = np.array([[0.0, 0.0], [0.13, -0.21], [0.5, 0.31]])
    rough = [piece.apply(machine(SNAKE.mechanism).plant, rise=0.7).rough[0] for piece in tents]
    assert sum(one.at(places) for one in rough) == pytest.approx(0.7)
    patch = SNAKE.effect_named("floor-patch")
    wide = {piece.name: amount for piece, amount in patch.pieces(0.0, 0.0, 3.0, 2.0)}
    assert wide["floor-tent-0-0"] == pytest.approx(np.log(2.0), rel=1e-3)
    small = {piece.name: amount for piece, amount in patch.pieces(0.4, 0.0, 0.35, 2.0)}
    assert max(small, key=lambda name: small[name]) == "floor-tent-1-0"
    assert "floor-tent--3-0" not in small


def test_effects_change_what_their_words_say_by_how_much_and_to_which_side():
    plant = machine(SNAKE.mechanism).plant

    def with_effect(name, **values):
        return SNAKE.effect_named(name).apply(plant, **values)

    share = with_effect("uneven-mass", gradient=0.2).mass / plant.mass
    assert share[[0, -1]] == pytest.approx([0.8, 1.2])
    assert share.mean() == pytest.approx(1.0)
    limited = with_effect("servo-speed-limit", share=0.5)
    assert (limited.speed == 0.5).all()
    assert (SNAKE.effect_named("servo-speed-limit").apply(limited, share=0.8).speed == 0.5).all()
    pulled = with_effect("tether-pull", east_n=0.1, north_n=-0.2, return_n_m=0.3)
    assert (pulled.pull_n, pulled.return_n_m) == ((0.1, -0.2), 0.3)
    assert with_effect("floor-slope", east_rad=0.01, north_rad=-0.02).slope == (0.01, -0.02)
    across = with_effect("friction-anisotropy", across=1.5)
    assert (across.friction_along, across.friction_across) == (1.0, 1.5)
    weak = with_effect("weak-joint-joint3", strength=0.4)
    at = plant.joints.index("joint3")
    for values in ("stiffness", "torque", "damping"):
        changed = getattr(weak, values) / getattr(plant, values)
        assert changed[at] == pytest.approx(0.4)
        assert np.delete(changed, at) == pytest.approx(1.0)


def test_what_a_camera_makes_of_points_is_as_its_words_say():
    point, along = np.array([[[0.5, -0.2], [1.0, 2.0]]]), np.array([[[0.0, 1.0], [1.0, 0.0]]])
    seen = Sighting(point, along, np.stack([-along[..., 1], along[..., 0]], axis=-1))
    site = SNAKE.effect_named("marker-offset-green")
    number = site.apply.keywords["site"]
    moved = site.apply(seen, along_m=0.01, left_m=0.02).point_m - point
    expected = ([-0.02, 0.01], [0.01, 0.02])[number]  # one link points north, the other one east
    assert moved[0, number] == pytest.approx(expected)
    assert not moved[0, 1 - number].any()
    tilted = SNAKE.effect_named("tilted-camera").apply(seen, east_1_m=0.1, north_1_m=0.0).point_m
    assert tilted == pytest.approx(point * np.array([1.05, 1.1])[:, None])
    tilted = SNAKE.effect_named("tilted-camera").apply(seen, east_1_m=0.0, north_1_m=0.1).point_m
    assert tilted == pytest.approx(point * np.array([0.98, 1.2])[:, None])
