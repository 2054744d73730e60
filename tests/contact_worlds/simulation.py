"""Trials of a robot in its world: random commands, the drive between command and motor, contact, and the tracker."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np

from tests.contact_worlds.robots import GRAVITY, TIMESTEP_S, Robot, build

TRIALS, ROWS, ROW_S = 60, 200, 0.05
TICK_S = 0.005
STEPS = round(TICK_S / TIMESTEP_S)
TICKS_PER_ROW = round(ROW_S / TICK_S)
SETTLE_S = 0.25


@dataclass(frozen=True)
class Drive:
    """What happens between the logged command and the speed that the controllers are asked for."""

    lag_s: float = 0.0
    # With both of these the mean speed and the difference of the wheels lag by times of their own.
    lag_straight_s: float = 0.0
    lag_turning_s: float = 0.0
    acceleration_ms2: float = np.inf
    latency_s: float = 0.0
    gain_left: float = 1.0
    gain_right: float = 1.0
    dead_zone_ms: float = 0.0
    # The controllers give no torque while the wheel is this close to its set speed.
    dead_band_ms: float = 0.0
    # An integral part of the controllers: what is asked of the proportional part grows by this share of the error a second.
    integral_per_s: float = 0.0


@dataclass(frozen=True)
class Patch:
    """A round piece of floor with its own grip, and a torque that it takes from a wheel that rolls on it."""

    x_m: float
    y_m: float
    radius_m: float
    friction: float | None = None
    rolling_nm: float = 0.0


@dataclass(frozen=True)
class Ground:
    """What the floor and the wheels' surroundings do."""

    slope_rad: float = 0.0
    # The direction in which the floor falls.
    downhill_rad: float = 0.0
    patch: Patch | None = None
    # A torque on the left wheel over this part of each turn.
    rub_nm: float = 0.0
    rub_width_rad: float = 0.0
    obstacle_trials: tuple[int, ...] = ()


@dataclass(frozen=True)
class Tracker:
    """How the poses are seen. Scale and rotation act on the position alone; the noise is AR(1)."""

    scale: float = 1.0
    rotation_rad: float = 0.0
    # A row shows the pose this much after the time it bears.
    lead_s: float = 0.0
    marker_x_m: float = 0.0
    marker_y_m: float = 0.0
    noise_m: float = 0.001
    noise_rad: float = float(np.deg2rad(0.3))
    correlation: float = 0.0

    def see(self, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """The tracker's rows for the true poses of the axle's centre at the same times."""
        c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        x = pose[:, 0] + c * self.marker_x_m - s * self.marker_y_m
        y = pose[:, 1] + s * self.marker_x_m + c * self.marker_y_m
        c, s = np.cos(self.rotation_rad), np.sin(self.rotation_rad)
        seen = np.column_stack([self.scale * (c * x - s * y), self.scale * (s * x + c * y), pose[:, 2]])
        return seen + self._noise(len(pose), rng)

    def _noise(self, rows: int, rng: np.random.Generator) -> np.ndarray:
        noise = rng.normal(size=(rows, 3))
        for k in range(1, rows):
            noise[k] = self.correlation * noise[k - 1] + np.sqrt(1 - self.correlation**2) * noise[k]
        return noise * [self.noise_m, self.noise_m, self.noise_rad]


@dataclass(frozen=True)
class Setup:
    """A robot, its drive, its ground and the tracker above it."""

    robot: Robot
    drive: Drive = field(default_factory=Drive)
    ground: Ground = field(default_factory=Ground)
    tracker: Tracker = field(default_factory=Tracker)


def commands(top: float, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Wheel speeds for each row: pieces of 0.5 to 2.5 s, ahead, back, in arcs, on one wheel and in place."""
    out = np.zeros((rows, 2))
    row = 0
    while row < rows:
        length = int(rng.integers(10, 51))
        kind = rng.choice(["arc", "arc", "arc", "straight", "place", "pivot", "stop"])
        left, right = rng.uniform(-top, top, 2)
        if kind == "straight":
            right = left
        elif kind == "place":
            right = -left
        elif kind == "pivot":
            left, right = (left, 0.0) if rng.random() < 0.5 else (0.0, right)
        elif kind == "stop":
            left = right = 0.0
        out[row : row + length] = left, right
        row += length
    return out.round(4)


class Shaper:
    """The drive of one trial: takes the command of each tick, gives the set speeds of the wheels."""

    def __init__(self, drive: Drive, per_tick: np.ndarray) -> None:
        late = round(drive.latency_s / TICK_S)
        asked = np.vstack([np.zeros((late, 2)), per_tick])[: len(per_tick)]
        asked = np.where(np.abs(asked) < drive.dead_zone_ms, 0.0, asked)
        self.asked = asked * [drive.gain_left, drive.gain_right]
        self.step = drive.acceleration_ms2 * TICK_S
        times = np.array([drive.lag_straight_s, drive.lag_turning_s])
        self.keep = np.exp(-TICK_S / np.maximum(times, 1e-6))
        self.speeds = np.zeros(2)
        self.modes = np.zeros(2)

    def __call__(self, tick: int) -> np.ndarray:
        """The set speeds of the left and the right wheel (m/s)."""
        left, right = self.asked[tick]
        wanted = np.array([(left + right) / 2, right - left])
        self.modes = wanted + self.keep * (self.modes - wanted)
        mean, difference = self.modes
        change = np.array([mean - difference / 2, mean + difference / 2]) - self.speeds
        self.speeds = self.speeds + np.clip(change, -self.step, self.step)
        return self.speeds


class Stage:
    """The compiled model of a setup, and what of it changes while a trial runs."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        self.model = build(setup.robot, setup.drive.lag_s)
        self.data = mujoco.MjData(self.model)
        self.wheels = [self.model.joint(name) for name in ("left", "right")]
        self.angle = [int(wheel.qposadr[0]) for wheel in self.wheels]
        self.rate = [int(wheel.dofadr[0]) for wheel in self.wheels]
        self.geoms = [self.model.geom(name).id for name in ("left", "right")]

    def place(self, trial: int, rng: np.random.Generator) -> None:
        """The robot at rest near the floor's centre, after its contacts have settled on a level floor."""
        robot, ground = self.setup.robot, self.setup.ground
        mujoco.mj_resetData(self.model, self.data)
        heading = rng.uniform(-np.pi, np.pi)
        self.data.qpos[:2] = rng.normal(0, 0.15, 2).clip(-0.3, 0.3)
        self.data.qpos[3:7] = np.cos(heading / 2), 0, 0, np.sin(heading / 2)
        if robot.caster:
            self.data.qpos[self.model.joint("swivel").qposadr[0]] = rng.uniform(-np.pi, np.pi)
        if ground.rub_nm:
            self.data.qpos[self.angle] = rng.uniform(-np.pi, np.pi, 2)
        if trial in ground.obstacle_trials:
            ahead = rng.uniform(0.65, 0.75) * robot.wheelbase_m * rng.choice([-1, 1])
            x, y = self.data.qpos[:2] + ahead * np.array([np.cos(heading), np.sin(heading)])
            self.data.mocap_pos[0] = x, y, robot.obstacle_height_m / 2
            self.data.mocap_quat[0] = self.data.qpos[3:7]
        self.model.opt.gravity[:] = 0, 0, -GRAVITY
        mujoco.mj_step(self.model, self.data, nstep=round(SETTLE_S / TIMESTEP_S))
        self.data.qvel[:] = 0
        self.data.act[:] = 0
        fall, way = ground.slope_rad, ground.downhill_rad
        level = np.sin(fall)
        self.model.opt.gravity[:] = GRAVITY * np.array([level * np.cos(way), level * np.sin(way), -np.cos(fall)])

    def surroundings(self) -> None:
        """The grip under each wheel and the torque that rubs on it, from where the wheel is now."""
        ground, robot = self.setup.ground, self.setup.robot
        for side in range(2):
            grip, torque = robot.tyre_friction, robot.wheel_friction_nm
            if ground.patch:
                x, y, _ = self.data.geom_xpos[self.geoms[side]]
                if np.hypot(x - ground.patch.x_m, y - ground.patch.y_m) < ground.patch.radius_m:
                    grip = ground.patch.friction or grip
                    torque += ground.patch.rolling_nm
            if side == 0 and self.data.qpos[self.angle[0]] % (2 * np.pi) < ground.rub_width_rad:
                torque += ground.rub_nm
            self.model.geom_friction[self.geoms[side], 0] = grip
            self.model.dof_frictionloss[self.rate[side]] = torque

    def run(self, trial: int, rows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """The true state (MuJoCo's ``qpos``) at each tick of one trial."""
        drive, ground = self.setup.drive, self.setup.ground
        changing = bool(ground.patch or ground.rub_nm)
        radius = self.setup.robot.wheel_radius_m
        shape = Shaper(drive, np.repeat(rows, TICKS_PER_ROW, axis=0))
        self.place(trial, rng)
        states = np.empty((len(rows) * TICKS_PER_ROW, self.model.nq))
        summed = np.zeros(2)
        for tick in range(len(states)):
            states[tick] = self.data.qpos
            speeds = shape(tick) / radius
            if drive.dead_band_ms:
                turning = self.data.qvel[self.rate]
                error = speeds - turning
                speeds = turning + np.sign(error) * np.maximum(np.abs(error) - drive.dead_band_ms / radius, 0)
            if drive.integral_per_s:
                summed += (speeds - self.data.qvel[self.rate]) * TICK_S
                speeds = speeds + drive.integral_per_s * summed
            if changing:
                self.surroundings()
            self.data.ctrl[:] = speeds
            mujoco.mj_step(self.model, self.data, nstep=STEPS)
        return states


def poses(states: np.ndarray) -> np.ndarray:
    """Position of the axle's centre and heading, continuous over the trial."""
    w, x, y, z = states[:, 3:7].T
    heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    return np.column_stack([states[:, :2], heading])


def simulate(setup: Setup, seed: list[int], trials: int = TRIALS, rows: int = ROWS) -> tuple[np.ndarray, np.ndarray]:
    """The log's rows (trial, t, x, y, heading, left, right) and the true poses at the same rows."""
    rng = np.random.default_rng(seed)
    stage = Stage(setup)
    lead = round(setup.tracker.lead_s / TICK_S)
    spare = 1 + lead // TICKS_PER_ROW
    log, true = [], []
    for trial in range(trials):
        asked = commands(setup.robot.top_speed_ms, rows + spare, rng)
        pose = poses(stage.run(trial, asked, rng))[lead::TICKS_PER_ROW][:rows]
        seen = setup.tracker.see(pose, rng)
        head = np.column_stack([np.full(rows, trial), np.arange(rows) * ROW_S])
        log.append(np.hstack([head, seen, asked[:rows]]))
        true.append(pose)
    return np.vstack(log), np.vstack(true)
