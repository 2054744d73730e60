"""The slow twins of the compiled kernels, in plain Python and numpy, as the equations read.

Nothing here is used by a run: tests hold the kernels against it. Floating point is double precision unless said otherwise,
so a kernel agrees to single precision; whatever is a choice among whole numbers (draws, parents, cuts) agrees exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bns.engine.breeding import DEFAULT, Operators
from bns.engine.evolution import CommandBounds, Population
from bns.engine.philox import Key, Purpose
from bns.engine.rprop import GROW, INITIAL_STEP, LARGEST_STEP, SHRINK, SMALLEST_STEP
from bns.engine.snn import INPUTS, PER_NEURON

_WORD = 2**32
Words = tuple[int, int, int, int]
_Numbered = tuple[np.ndarray, np.ndarray]
"""Commands of one controller and their numbers, counted through all parents."""


def philox4x32_10(counter: Words, key: tuple[int, int]) -> Words:
    """Ten rounds of Philox4x32 over Python's whole numbers (Salmon et al., SC 2011, section 3.3)."""
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * c0, _WORD)
        high1, low1 = divmod(0xCD9E8D57 * c2, _WORD)
        c0, c1, c2, c3 = high1 ^ c1 ^ k0, low1, high0 ^ c3 ^ k1, low0
        k0, k1 = (k0 + 0x9E3779B9) % _WORD, (k1 + 0xBB67AE85) % _WORD
    return c0, c1, c2, c3


def draw(key: Key, purpose: Purpose, step: int, individual: int, slot: int) -> Words:
    """The four words of one block of a run."""
    return philox4x32_10((slot, individual, step, int(purpose)), (key.seed, key.study))


def split_weights(weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """One network (W,) as input weights (H, 5), hidden biases (H,), output weights (H,) and output bias, float64."""
    row = np.asarray(weights, np.float64)
    neurons = row[:-1].reshape(-1, PER_NEURON)
    return neurons[:, :INPUTS], neurons[:, INPUTS], neurons[:, INPUTS + 1], float(row[-1])


def hidden_activations(weights: np.ndarray, X: np.ndarray) -> np.ndarray:
    """Logistic sigmoids (H, n) of one network for inputs X (5, n)."""
    into, bias, _, _ = split_weights(weights)
    return np.asarray(1.0 / (1.0 + np.exp(-(into @ np.asarray(X, np.float64) + bias[:, None]))))


def predict(weights: np.ndarray, X: np.ndarray, sigmoid_output: bool = False) -> np.ndarray:
    """Outputs (networks, n) of networks (networks, W) for inputs X (5, n) (figures 4.3 and 5.6)."""
    outputs = []
    for row in weights:
        _, _, to_output, bias = split_weights(row)
        outputs.append(to_output @ hidden_activations(row, X) + bias)
    return 1.0 / (1.0 + np.exp(-np.array(outputs))) if sigmoid_output else np.array(outputs)


def gradient(
    weights: np.ndarray,
    X: np.ndarray,
    target: np.ndarray,
    counts: np.ndarray | None = None,
    sigmoid_output: bool = False,
    flat_spot: float = 0.0,
) -> np.ndarray:
    """Backpropagation: gradient (W,) of half the summed squared error over X (5, n) and target (n,), each counts (n,) times.

    ``flat_spot`` is added to the slope of every sigmoid.
    """
    hidden = hidden_activations(weights, X)
    _, _, to_output, _ = split_weights(weights)
    output = predict(weights[None], X, sigmoid_output)[0]
    error = (output - np.asarray(target, np.float64)) * (1.0 if counts is None else counts)
    if sigmoid_output:
        error = error * (output * (1.0 - output) + flat_spot)
    at_hidden = to_output[:, None] * error * (hidden * (1.0 - hidden) + flat_spot)
    neurons = np.column_stack([at_hidden @ np.asarray(X, np.float64).T, at_hidden.sum(axis=1), hidden @ error])
    return np.concatenate([neurons.ravel(), [error.sum()]])


@dataclass
class RpropState:
    """One network under training, all (W,), in the precision that it was started with."""

    weights: np.ndarray
    step: np.ndarray
    last_gradient: np.ndarray
    last_change: np.ndarray

    @classmethod
    def start(cls, weights: np.ndarray) -> RpropState:
        """No gradient seen yet."""
        nothing = np.zeros_like(weights)
        return cls(weights.copy(), np.full_like(weights, INITIAL_STEP), nothing.copy(), nothing.copy())


def update_rprop_plus(state: RpropState, slope: np.ndarray) -> None:
    """One step of Rprop with weight backtracking (Riedmiller and Braun 1993), weight by weight."""
    one = state.weights.dtype.type
    for i, g in enumerate(slope):
        agreement = g * state.last_gradient[i]
        if agreement < 0:
            state.step[i] = max(state.step[i] * one(SHRINK), one(SMALLEST_STEP))
            state.last_change[i] = -state.last_change[i]
            state.last_gradient[i] = 0
        else:
            if agreement > 0:
                state.step[i] = min(state.step[i] * one(GROW), one(LARGEST_STEP))
            state.last_change[i] = -np.sign(g) * state.step[i]
            state.last_gradient[i] = g
        state.weights[i] += state.last_change[i]


def update_irprop_minus(state: RpropState, slope: np.ndarray) -> None:
    """One step of iRprop- (Igel and Hüsken 2000), whole arrays at once: a changed sign is forgotten, not taken back."""
    one = state.weights.dtype.type
    agreement = slope * state.last_gradient
    state.step[agreement > 0] *= one(GROW)
    state.step[agreement < 0] *= one(SHRINK)
    state.step[:] = np.clip(state.step, one(SMALLEST_STEP), one(LARGEST_STEP))
    state.last_gradient[:] = np.where(agreement < 0, one(0), slope)
    state.weights -= np.sign(state.last_gradient) * state.step


UPDATES: dict[str, Callable[[RpropState, np.ndarray], None]] = {
    "rprop+": update_rprop_plus,
    "irprop-": update_irprop_minus,
}


def train(state: RpropState, X: np.ndarray, target: np.ndarray, iterations: int, algorithm: str) -> None:
    """Iterate one network in place on X (5, n) and target (n,)."""
    for _ in range(iterations):
        UPDATES[algorithm](state, gradient(state.weights, X, target).astype(state.weights.dtype))


def rank(fitness: np.ndarray) -> list[int]:
    """Best first; equals in the order they come in; what is no number counts as 0."""
    value = [0.0 if np.isnan(f) or f == -np.inf else float(f) for f in fitness]
    return sorted(range(len(value)), key=lambda i: -value[i])


def tournament(random: np.random.Generator, size: int, share: float) -> int:
    """Rank of the winner of one tournament among distinct members, drawn one by one."""
    entrants = min(size, max(1, int(share * size + 0.5)))
    return int(random.permutation(size)[:entrants].min())


def breed(
    key: Key,
    parents: Population,
    order: list[int],
    cdf: np.ndarray,
    rate: float,
    bounds: CommandBounds,
    shortest: int,
    generation: int,
    operators: Operators = DEFAULT,
) -> tuple[list[np.ndarray], list[np.ndarray], int]:
    """The children as lists of commands, (length, 3) float32 each; their origins, (length,) each; how many were cut short."""
    capacity = parents.commands.shape[1]
    old = [parents.controller(i) for i in range(len(parents))]
    numbers = np.split(np.arange(parents.lengths.sum()), np.cumsum(parents.lengths)[:-1])
    families = [(old[order[0]], numbers[order[0]])]
    for pair in range(len(parents) // 2):
        first, second = _parents(key, order, cdf, generation, pair)
        a, b = (old[first], numbers[first]), (old[second], numbers[second])
        cut_a, cut_b = _cuts(key, len(a[0]), len(b[0]), generation, pair, operators.cuts_inside)
        families += [_crossed(a, b, cut_a, cut_b, shortest), _crossed(b, a, cut_b, cut_a, shortest)]
    families = families[: len(parents)]
    hits = sum(len(child) > capacity for child, _ in families)
    families = [(child[:capacity].copy(), origin[:capacity].copy()) for child, origin in families]
    for i, (child, origin) in enumerate(families[1:], start=1):
        _mutate(key, child, origin, i, rate, bounds, generation, operators)
    return [child for child, _ in families], [origin for _, origin in families], hits


def _parents(key: Key, order: list[int], cdf: np.ndarray, generation: int, pair: int) -> tuple[int, int]:
    words = draw(key, Purpose.PARENTS, generation, pair, 0)
    first, second = (next((r for r, p in enumerate(cdf) if word / _WORD < p), len(cdf) - 1) for word in words[:2])
    return order[first], order[second]


def _cuts(key: Key, length_a: int, length_b: int, generation: int, pair: int, inside: bool) -> tuple[int, int]:
    which, first, second, _ = draw(key, Purpose.CUTS, generation, pair, 0)
    if inside:
        places_a, places_b = (range(1, max(length, 2)) for length in (length_a, length_b))
        both = range(1, max(min(length_a, length_b), 2))
        alike = both[first * len(both) // _WORD]
        apart = places_a[first * len(places_a) // _WORD], places_b[second * len(places_b) // _WORD]
        return (alike, alike) if which / _WORD < 0.8 else apart
    if which / _WORD < 0.8:  # section 4.3, written out here so that the kernel's number is checked too
        cut = first * (min(length_a, length_b) + 1) // _WORD
        return cut, cut
    return first * (length_a + 1) // _WORD, second * (length_b + 1) // _WORD


def _crossed(front: _Numbered, back: _Numbered, cut_front: int, cut_back: int, shortest: int) -> _Numbered:
    if cut_front + len(back[0]) - cut_back < shortest:
        return back
    child, origin = (np.concatenate([f[:cut_front], b[cut_back:]]) for f, b in zip(front, back, strict=True))
    before, before_back = front[0][:cut_front][-1:, :2], back[0][:cut_back][-1:, :2]
    if cut_back < len(back[0]) and not np.array_equal(before, before_back):
        origin[cut_front] = -1
    return child, origin


def _mutate(
    key: Key,
    child: np.ndarray,
    origin: np.ndarray,
    index: int,
    rate: float,
    bounds: CommandBounds,
    generation: int,
    operators: Operators,
) -> None:
    threshold = int(rate * _WORD)
    for j in range(len(child)):
        words = draw(key, Purpose.MUTATION, generation, index, j)
        hit = {c: words[c] for c in range(child.shape[1]) if words[c] < threshold}
        if operators.one_component:
            hit = {words[1] * child.shape[1] // _WORD: words[0]} if words[0] < threshold else {}
        for c, word in hit.items():
            share = 2.0 * word / threshold - 1.0
            if operators.exact[c]:
                share = -1.0 if share < 0 else 1.0
            move = np.float32(share * float(bounds.mutation_span[c]))
            child[j, c] = min(max(child[j, c] + move, bounds.low[c]), bounds.high[c])
            origin[j] = -1
            origin[j + 1 : j + 2] = origin[j + 1 : j + 2] if c == 2 else -1  # the duration is not told to the next


def diversity(population: Population, bounds: CommandBounds) -> float:
    """Equation 4.1: the mean over controllers of the summed normalised distances of their commands from the mean command.

    The mean command at a place is taken over the controllers that are long enough to have one there.
    """
    spread = bounds.high.astype(np.float64) - bounds.low
    controllers = [population.controller(i).astype(np.float64) / spread for i in range(len(population))]
    mean = [np.mean([one[j] for one in controllers if len(one) > j], axis=0) for j in range(max(map(len, controllers)))]
    return float(np.mean([sum(np.abs(c - m).sum() for c, m in zip(one, mean, strict=False)) for one in controllers]))


def innovations(
    body: np.ndarray, drift_m: np.ndarray, pose: np.ndarray, is_first: np.ndarray, way_m: np.ndarray, noise: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Twin of `pose_filter`: the extended Kalman filter with matrices in the world's frame, gains from its own state.

    Whitened by the symmetric root: each frame's squared length is that of any other root.
    """
    white, logdet = np.zeros((len(pose), 3)), np.zeros(len(pose))
    seen = np.diag([noise[0] ** 2, noise[0] ** 2, noise[1] ** 2])
    state, spread = np.zeros(3), np.zeros((3, 3))
    for k in range(len(pose)):
        if is_first[k]:
            state, spread = pose[k].copy(), seen.copy()
            continue
        cos, sin = np.cos(state[2]), np.sin(state[2])
        moved = np.array([cos * body[k, 0] - sin * body[k, 1], sin * body[k, 0] + cos * body[k, 1]])
        change = np.eye(3)
        change[:2, 2] = -moved[1], moved[0]
        state = state + np.append(moved + drift_m[k], body[k, 2])
        cos, sin = np.cos(state[2]), np.sin(state[2])
        turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
        drive = turn @ np.diag(noise[2:] ** 2 * way_m[k]) @ turn.T
        spread = change @ spread @ change.T + drive
        total = spread + seen
        off = pose[k] - state
        off[2] = np.angle(np.exp(1j * off[2]))
        values, vectors = np.linalg.eigh(total)
        white[k] = vectors @ ((vectors.T @ off) / np.sqrt(values))
        logdet[k] = np.log(values).sum() / 2
        gain = spread @ np.linalg.inv(total)
        state = state + gain @ off
        spread = (np.eye(3) - gain) @ spread
    return white, logdet


def displacements(poses: np.ndarray, is_first: np.ndarray) -> np.ndarray:
    """Twin of `pose_filter.displacements`, with complex numbers."""
    place = poses[:, 0] + 1j * poses[:, 1]
    way = np.diff(place, prepend=place[:1]) * np.exp(-1j * np.roll(poses[:, 2], 1))
    out = np.stack([way.real, way.imag, np.diff(poses[:, 2], prepend=poses[:1, 2])], axis=1)
    return np.where(is_first[:, None], 0.0, out)


def expected_walk(
    moved: np.ndarray, noise: np.ndarray, start: tuple[float, float, float], goals: np.ndarray, radius_m: float, penalty_m: float
) -> tuple[float, float, float]:
    """Algorithm 2 on displacements (n, 3), right, ahead and turn, under each row of noise (rows, n, 3), path by path.

    Mean sum of distances with ``penalty_m`` for every goal missed, mean goals reached, share of the rows that reach all.
    """
    sums, reached, places = [], [], [complex(*goal) for goal in goals]
    for row in noise:
        position, heading, todo, total = complex(*start[:2]), start[2], list(places), 0.0
        for right, ahead, turn in np.asarray(moved, np.float64) + row:
            position += complex(ahead, -right) * np.exp(1j * heading)
            heading += turn
            if todo and abs(position - todo[0]) <= radius_m:
                todo.pop(0)
            total += abs(position - (todo or places[-1:])[0])
        sums.append(total + penalty_m * len(todo))
        reached.append(len(places) - len(todo))
    return float(np.mean(sums)), float(np.mean(reached)), float(np.mean(np.array(reached) == len(places)))
