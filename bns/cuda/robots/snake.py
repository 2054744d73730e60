"""The snake on a GPU: its noisy rollouts on networks, and the substitute world with all that is judged and learnt there."""

from __future__ import annotations

import math

import numpy as np
from numba import cuda, float32, float64

from bns.cuda.on_device.driving import chosen, keep, normals_of
from bns.cuda.on_device.networks import squashed_output
from bns.engine.philox import Purpose, philox
from bns.engine.snn import weight_count
from bns.robots.snake import ROBOT
from bns.robots.snake.cycles import CYCLES, breed_pair
from bns.robots.snake.path import LEAST_STABLE, START_M
from bns.robots.snake.rules import (
    BOUNDS,
    HALF,
    JOINT_SPEED_RAD_S,
    MIDDLE,
    MOST_REPEATS,
    NOISE_SD_M,
    NOISY_EVALUATIONS,
    REACH_M,
    REPEATS,
    SETTLE_S,
    STEP_RAD,
    arrived,
    ended,
    moved_on,
    normalised,
    worth,
)

_NETWORKS, _WIDTH = len(ROBOT.networks), weight_count(ROBOT.hidden)
_LOW, _HIGH, _SPAN = BOUNDS.low, BOUNDS.high, BOUNDS.mutation_span
(_YX, _YY), (_GX, _GY) = START_M
_ROLLOUT_NOISE, _FIRST, _SECOND = np.uint32(Purpose.ROLLOUT_NOISE), np.uint32(0), np.uint32(1)
_NOTHING = np.float32(0)
_SEEN, _BOTH = (CYCLES, _NETWORKS), (2, CYCLES, _NETWORKS)
_WARP = 32
_REST_MS, _MS_A_RAD = 12_000.0 * SETTLE_S, 12_000.0 * STEP_RAD / JOINT_SPEED_RAD_S
_SHARE = ROBOT.parent_share
"""Of a child's components, how many are the first parent's."""
_DISPLACEMENTS = 4
"""The networks that learn from stable cycles alone; after them comes stability, which learns from all."""

DRIVEN = ("fitness_simulation", "fitness_world", "goals_reached", "commands", "driven_ms", "success")
"""What is kept of one controller that was driven, in this order; commands are the cycles driven, every repeat counted."""
STEPS = MOST_REPEATS
_ROW = CYCLES * MOST_REPEATS * _DISPLACEMENTS
DRAWS = NOISY_EVALUATIONS * _ROW
_ALL = CYCLES * MOST_REPEATS


def driving_grid(runs: int) -> tuple[int, int]:
    """Blocks and threads of `drive`: a warp a run."""
    return runs, _WARP


@cuda.jit(device=True)
def draw(luck, own, step, thread, threads):  # type: ignore[no-untyped-def]  # compiled
    """Noise of every cycle in ten evaluations, m: evaluation after evaluation, four numbers a cycle."""
    for at in range(thread, DRAWS // _DISPLACEMENTS, threads):
        evaluation, slot = at // (_ROW // _DISPLACEMENTS), at % (_ROW // _DISPLACEMENTS)
        _draw_cycle(luck, _DISPLACEMENTS * at, own, step, evaluation, slot)


@cuda.jit(device=True)
def _draw_cycle(luck, at, own, step, evaluation, slot):  # type: ignore[no-untyped-def]  # compiled
    """Noise of one cycle of an evaluation into luck[at : at + 4]."""
    drawn = philox(np.uint32(slot), np.uint32(evaluation), step, _ROLLOUT_NOISE, own["key0"], own["key1"])
    noise = normals_of(drawn)
    for k in range(_DISPLACEMENTS):
        luck[at + k] = noise[k] * NOISE_SD_M[k]


@cuda.jit(device=True)
def bred(parents, lengths, order, cdf, children, child_lengths, pair, own, step):  # type: ignore[no-untyped-def]  # compiled
    """Uniform crossover and mutation; all lists have one length, so none is cut."""
    longest = own["longest"]
    breed_pair(
        parents[:, :longest], order, cdf, _SHARE, own["mutation_rate"], _LOW, _HIGH, _SPAN, pair, step, own["key0"], own["key1"],
        children[:, :longest],
    )  # fmt: skip
    for child in range(1 + 2 * pair, min(3 + 2 * pair, order.size)):
        child_lengths[child] = longest
    return 0


@cuda.jit(device=True)
def _foretold(w, command, net):  # type: ignore[no-untyped-def]  # compiled
    """What one of the networks w (5 W,) says of a cycle, 0 to 1."""
    x = normalised(command, MIDDLE, HALF)
    return squashed_output(w, net * _WIDTH, _WIDTH, x[0], x[1], x[2], x[3], _NOTHING)


@cuda.jit(device=True)
def _displacement(output):  # type: ignore[no-untyped-def]  # compiled
    return (np.float64(output) - 0.5) * REACH_M


@cuda.jit(device=True)
def _along_path(seen, commands, length, goals, own, luck, first, most):  # type: ignore[no-untyped-def]  # compiled
    """Sum of algorithm 3, goals reached, distinct cycles used and cycles driven, of networks that say ``seen`` (cycles, 5).

    The noise of its first cycle is luck[first : first + 4]; there is none where first is negative. At most ``most`` are driven.
    """
    yx, yy, gx, gy = _YX, _YY, _GX, _GY
    x, y = (yx + gx) / 2, (yy + gy) / 2
    total, goal, step, used = 0.0, 0, 0, 0
    for j in range(length):
        used = j + 1
        unstable = seen[j, 4] < LEAST_STABLE
        x1, y1, x2, y2 = (
            _displacement(seen[j, 0]), _displacement(seen[j, 1]), _displacement(seen[j, 2]), _displacement(seen[j, 3]),
        )  # fmt: skip
        for _ in range(int(commands[j, REPEATS])):
            a, b, c, d = x1, y1, x2, y2
            if first >= 0:
                at = first + _DISPLACEMENTS * step
                a, b, c, d = a + luck[at], b + luck[at + 1], c + luck[at + 2], d + luck[at + 3]
            yx, yy, gx, gy = moved_on(yx, yy, gx, gy, a, b, c, d, -1.0)
            x, y = (yx + gx) / 2, (yy + gy) / 2
            step += 1
            total, goal = arrived(x, y, unstable, total, goal, goals, own["half_region"], own["half_x"], own["half_y"])
            if goal == goals.shape[0]:
                return total, goal, used, step
            if step == most:
                return ended(x, y, total, goal, goals), goal, used, step
    return ended(x, y, total, goal, goals), goal, used, step


@cuda.jit(device=True)
def scored(w, commands, length, goals, own, luck):  # type: ignore[no-untyped-def]  # compiled
    """One controller (cycles, 5) on networks w (5 W,): algorithm 3 as the mean of ten noisy evaluations, as `Snake.score`."""
    seen = cuda.local.array(_SEEN, float32)
    for j in range(length):
        for net in range(_NETWORKS):
            seen[j, net] = _foretold(w, commands[j], net)
    total, goal, used, _ = _along_path(seen, commands, length, goals, own, luck, -1, _ALL)
    mean = 0.0
    for evaluation in range(NOISY_EVALUATIONS):
        total, _, _, _ = _along_path(seen, commands, length, goals, own, luck, evaluation * _ROW, _ALL)
        mean += worth(total)
    mean /= NOISY_EVALUATIONS
    if math.isfinite(mean) and math.isfinite(total):
        return mean, goal, used
    return 0.0, 0, used


@cuda.jit(device=True)
def _needed(seen, commands, length, goals, own, generation):  # type: ignore[no-untyped-def]  # compiled
    """Cycles that are driven: as many as any of the noisy evaluations of this generation needed, as `Snake.plan`."""
    luck, longest = cuda.local.array(_ROW, float64), 0
    for evaluation in range(NOISY_EVALUATIONS):
        for slot in range(_ALL):
            _draw_cycle(luck, _DISPLACEMENTS * slot, own, generation, evaluation, slot)
        _, goal, _, driven = _along_path(seen, commands, length, goals, own, luck, 0, _ALL)
        if goal == goals.shape[0]:
            longest = max(longest, driven)
    return longest if longest > 0 else _ALL


@cuda.jit
def drive(  # type: ignore[no-untyped-def]  # compiled
    evaluation, settings, purpose, learning, static, noise_sd, weights, commands, lengths, order, cdf, goals,
    X, targets, counts, failures, rows,
):  # fmt: skip
    """Drive a controller of each run in the substitute world, as far as simulation with noise needs it to finish the task; a
    block a run.

    While ``learning`` it is the winner of the real-world tournament cdf (runs, n), and what it does joins the patterns X
    (2, runs, 5, capacity), targets (2, runs, 5, capacity), counts (2, runs): those to train on first, those to watch second.
    Otherwise it is the fittest. weights (runs, 5 W) are the networks, static (5 W,) and noise_sd (5,) the world; rows (runs,
    evaluations, 6) takes `DRIVEN`.
    """
    both = cuda.shared.array(_BOTH, float32)  # what the run's networks say, and the world's
    run, thread, threads = cuda.blockIdx.x, cuda.threadIdx.x, cuda.blockDim.x
    if evaluation > settings[run]["evaluations"]:
        return
    own, step = settings[run], np.uint32(evaluation)
    n, aims = own["population"], goals[run, : own["goals"]]
    half = own["generations"] * (evaluation - 1 if learning else evaluation) % 2
    who = chosen(own, learning, order[run, :n], cdf[run, :n], step)
    length, cycles = lengths[half, run, who], commands[half, run, who]
    for task in range(thread, length * _NETWORKS, threads):
        j, net = task // _NETWORKS, task % _NETWORKS
        both[0, j, net] = _foretold(weights[run], cycles[j], net)
        both[1, j, net] = _foretold(static, cycles[j], net)
    cuda.syncthreads()
    if thread > 0:
        return

    generation = np.uint32(own["generations"] * (evaluation - 1 if learning else evaluation))
    planned = _needed(both[0], cycles, length, aims, own, generation)
    total_snn, _, _, _ = _along_path(both[0], cycles, length, aims, own, noise_sd, -1, planned)
    yx, yy, gx, gy = _YX, _YY, _GX, _GY
    x, y = (yx + gx) / 2, (yy + gy) / 2
    total, goal, driven, driven_ms = 0.0, 0, 0, 0.0
    for j in range(length):
        seen = both[1, j]
        for _ in range(int(cycles[j, REPEATS])):
            if driven < planned:
                noise = normals_of(philox(np.uint32(driven), _FIRST, step, purpose, own["key0"], own["key1"]))
                last = normals_of(philox(np.uint32(driven), _SECOND, step, purpose, own["key0"], own["key1"]))
                a, b = _displacement(seen[0]) + noise[0] * noise_sd[0], _displacement(seen[1]) + noise[1] * noise_sd[1]
                c, d = _displacement(seen[2]) + noise[2] * noise_sd[2], _displacement(seen[3]) + noise[3] * noise_sd[3]
                unstable = seen[4] + last[0] * noise_sd[4] < LEAST_STABLE
                yx, yy, gx, gy = moved_on(yx, yy, gx, gy, a, b, c, d, -1.0)
                if learning:
                    inputs = normalised(cycles[j], MIDDLE, HALF)
                    wanted = (
                        np.float32(a / REACH_M + 0.5), np.float32(b / REACH_M + 0.5), np.float32(c / REACH_M + 0.5),
                        np.float32(d / REACH_M + 0.5), np.float32(0.0 if unstable else 1.0),
                    )  # fmt: skip
                    absent = _DISPLACEMENTS if unstable else 0
                    with_last = (inputs[0], inputs[1], inputs[2], inputs[3], _NOTHING)
                    failures[run] += keep(with_last, wanted, absent, driven, own, step, run, X, targets, counts)
                if goal < aims.shape[0]:
                    x, y = (yx + gx) / 2, (yy + gy) / 2
                    total, goal = arrived(
                        x, y, unstable, total, goal, aims, own["half_region"], own["half_x"], own["half_y"]
                    )
                driven += 1
                driven_ms += _REST_MS + _MS_A_RAD * cycles[j, 0]
    row = rows[run, evaluation - 1]
    row[0] = _fitness_of(total_snn)
    row[1] = _fitness_of(ended(x, y, total, goal, aims))
    row[2] = goal
    row[3] = driven
    row[4] = driven_ms
    row[5] = goal == aims.shape[0]


@cuda.jit(device=True)
def _fitness_of(total):  # type: ignore[no-untyped-def]  # compiled
    return worth(total) if math.isfinite(total) else 0.0
