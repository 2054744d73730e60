"""The peer of a generation: evosax's simple genetic algorithm with the same rollout written in JAX."""

from __future__ import annotations

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from evosax.algorithms import SimpleGA

from bns.robots.khepera import GOAL_RADIUS_M, MISSED_GOAL_M, START
from bns.robots.simulator import tensors

SCALE = jnp.array([0.2, 0.3, 3.0])
STANDING = -16500 / 13500
Fitness = Callable[[jax.Array], jax.Array]


def fitness_of(weights: np.ndarray, goals_m: np.ndarray) -> Fitness:
    """Fitness (n,) of controllers (n, commands, 3), components -1..1, on networks (3, W); vectorised over everything."""
    names = ("dx", "dy", "dtheta")
    named = tensors(names, weights)
    into = jnp.stack([named[f"{name}.hidden.weight"] for name in names])
    bias = jnp.stack([named[f"{name}.hidden.bias"] for name in names])
    to_output = jnp.stack([named[f"{name}.output.weight"][0] for name in names])
    output_bias = jnp.stack([named[f"{name}.output.bias"][0] for name in names])
    goals = jnp.asarray(goals_m, jnp.float32)
    last = len(goals_m) - 1

    def toward(carry: tuple[jax.Array, jax.Array], place: jax.Array) -> tuple[tuple[jax.Array, jax.Array], None]:
        goal, total = carry
        distance = jnp.linalg.norm(place - goals[jnp.minimum(goal, last)])
        goal = jnp.where((goal <= last) & (distance <= GOAL_RADIUS_M), goal + 1, goal)
        return (goal, total + jnp.linalg.norm(place - goals[jnp.minimum(goal, last)])), None

    def one(commands: jax.Array) -> jax.Array:
        before = jnp.concatenate([jnp.full((1, 2), STANDING), commands[:-1, :2]])
        X = jnp.concatenate([before, commands], axis=1)  # (commands, 5)
        hidden = jax.nn.sigmoid(jnp.einsum("nhi,ci->nch", into, X) + bias[:, None])
        right, ahead, turn = (jnp.einsum("nch,nh->cn", hidden, to_output) + output_bias).T * SCALE[:, None]
        heading = START[2] + jnp.concatenate([jnp.zeros(1), jnp.cumsum(turn)[:-1]])
        cos, sin = jnp.cos(heading), jnp.sin(heading)
        places = jnp.stack([jnp.cumsum(ahead * cos + right * sin), jnp.cumsum(ahead * sin - right * cos)], axis=1)
        (goal, total), _ = jax.lax.scan(toward, (0, 0.0), places, unroll=len(commands))
        return 1 / (total + MISSED_GOAL_M * (len(goals_m) - goal))

    return jax.vmap(one)


def check_peer(fitness: Fitness, commands: np.ndarray, expected: np.ndarray) -> None:
    """A peer that computes something else is no peer: (n, c, 3) in -1..1 and the fitness (n,) that they should have."""
    theirs = np.asarray(jax.jit(fitness)(jnp.asarray(commands, jnp.float32)))
    close = np.isclose(theirs, expected, rtol=1e-3)
    if close.mean() < 0.99:  # single precision may decide otherwise on the rim of a goal
        raise AssertionError(f"the peer agrees on {close.mean():.0%} of the controllers only")


def rollouts(fitness: Fitness, population: np.ndarray, count: int) -> Callable[[], object]:
    """`count` times the fitness of the same controllers, one call each."""
    commands, compiled = jnp.asarray(population, jnp.float32), jax.jit(fitness)

    def all_of_them() -> None:
        for _ in range(count):
            jax.block_until_ready(compiled(commands))

    return all_of_them


def generations(fitness: Fitness, population: np.ndarray, count: int) -> Callable[[], object]:
    """`count` generations of ask, fitness and tell in one compiled call, each call going on from the one before."""
    first = jnp.asarray(population, jnp.float32)
    algorithm = SimpleGA(population_size=len(population), solution=first[0])
    params = algorithm.default_params

    def generation(state: object, key: jax.Array) -> tuple[object, None]:
        ask, tell = jax.random.split(key)
        asked, state = algorithm.ask(ask, state, params)
        state, _ = algorithm.tell(tell, asked, -fitness(jnp.clip(asked, -1, 1)), state, params)
        return state, None

    many = jax.jit(lambda state, key: jax.lax.scan(generation, state, jax.random.split(key, count))[0])
    box = [algorithm.init(jax.random.key(0), first, -fitness(first), params)]

    def go_on() -> None:
        box[0] = jax.block_until_ready(many(box[0], jax.random.key(1)))

    return go_on
