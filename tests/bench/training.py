"""Rprop on one 5-20-1 network with 400 patterns, against torch batched and torch.optim.Rprop."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch

from bns.engine.philox import Key
from bns.engine.rprop import Rprop
from bns.engine.snn import initial_weights
from bns.robots.simulator import to_torch
from tests.bench.clock import alternating, one_core
from tests.bench.line import Line, at_least, at_most

PATTERNS, HIDDEN, NETS = 400, 20, 90
UNIT = PATTERNS * HIDDEN * 1e-9
"""Seconds an iteration of one network per ns a pattern, hidden neuron and iteration."""


def problem() -> tuple[np.ndarray, np.ndarray]:
    """Inputs (5, n) and one smooth target (n,)."""
    X = np.random.default_rng(0).uniform(-1, 1, (5, PATTERNS)).astype(np.float32)
    return X, (np.sin(2 * X[0]) * X[4] + 0.3 * X[1] * X[2]).astype(np.float32)


class BatchedRprop:
    """Rprop+ in torch for many networks at once: the same formulas, one bmm instead of many, nothing recorded."""

    def __init__(self, weights: np.ndarray, X: np.ndarray, target: np.ndarray) -> None:
        rows = torch.from_numpy(weights[:, :-1].copy()).reshape(len(weights), -1, 7)
        self.parameters = [
            rows[:, :, :5].contiguous(),  # (nets, H, 5)
            rows[:, :, 5:6].contiguous(),  # (nets, H, 1)
            rows[:, :, 6:7].transpose(1, 2).contiguous(),  # (nets, 1, H)
            torch.from_numpy(weights[:, -1:].copy())[:, :, None],  # (nets, 1, 1)
        ]
        self.steps = [torch.full_like(p, 0.1) for p in self.parameters]
        self.last = [torch.zeros_like(p) for p in self.parameters]
        self.changes = [torch.zeros_like(p) for p in self.parameters]
        self.X = torch.from_numpy(X).expand(len(weights), -1, -1).contiguous()  # (nets, 5, n): each its own patterns
        self.XT = self.X.transpose(1, 2).contiguous()
        self.target = torch.from_numpy(target)

    def gradients(self) -> list[torch.Tensor]:
        """Of half the summed squared error, by the formulas."""
        into, bias, to_output, output_bias = self.parameters
        hidden = torch.baddbmm(bias, into, self.X).sigmoid_()
        error = torch.baddbmm(output_bias, to_output, hidden).sub_(self.target)
        at_hidden = torch.bmm(to_output.transpose(1, 2), error).mul_(hidden).mul_(1 - hidden)
        return [
            torch.bmm(at_hidden, self.XT),
            at_hidden.sum(2, keepdim=True),
            torch.bmm(error, hidden.transpose(1, 2)),
            error.sum(2, keepdim=True),
        ]

    @torch.no_grad()
    def train(self, iterations: int) -> None:
        """Iterate all networks."""
        for _ in range(iterations):
            for p, step, last, change, g in zip(
                self.parameters, self.steps, self.last, self.changes, self.gradients(), strict=True
            ):
                sign = (g * last).sign_()
                step.mul_(torch.where(sign > 0, 1.2, torch.where(sign < 0, 0.5, 1.0))).clamp_(1e-6, 50)
                turned = sign < 0
                change.copy_(torch.where(turned, -change, -g.sign() * step))
                p.add_(change)
                last.copy_(g.masked_fill_(turned, 0))

    def weights(self) -> np.ndarray:
        """(nets, W) in our order."""
        into, bias, to_output, output_bias = self.parameters
        neurons = torch.cat([into, bias, to_output.transpose(1, 2)], dim=2).reshape(len(into), -1)
        return torch.cat([neurons, output_bias[:, :, 0]], dim=1).numpy()


def torch_optim(weights: np.ndarray, X: np.ndarray, target: np.ndarray) -> Callable[[int], None]:
    """torch.optim.Rprop on a module of torch's own layers, with autograd: what one writes first."""
    net = to_torch(("net",), weights)["net"]
    optimiser = torch.optim.Rprop(net.parameters(), lr=0.1, step_sizes=(1e-6, 50))
    inputs, targets = torch.from_numpy(X.T.copy()), torch.from_numpy(target)[:, None]

    def train(iterations: int) -> None:
        for _ in range(iterations):
            optimiser.zero_grad()
            (0.5 * (net(inputs) - targets).square().sum()).backward()
            optimiser.step()

    return train


def check_peer(weights: np.ndarray, X: np.ndarray, target: np.ndarray) -> None:
    """A peer that computes something else is no peer."""
    ours, peer = Rprop.start(weights, "rprop+"), BatchedRprop(weights, X, target)
    ours.train(X, np.tile(target, (len(weights), 1)), PATTERNS, 15)
    peer.train(15)
    np.testing.assert_allclose(peer.weights(), ours.weights, atol=1e-3)


def measure(quick: bool) -> list[Line]:
    """ns a pattern, hidden neuron and iteration, and how many times as much the peers take."""
    torch.set_num_threads(1)
    X, target = problem()
    weights = initial_weights(Key(0, 0), NETS, HIDDEN)
    check_peer(weights[:5], X, target)
    ours = Rprop.start(weights[:1], "rprop+")
    batched, single = BatchedRprop(weights, X, target), torch_optim(weights[:1], X, target)
    with one_core():
        taken = alternating(
            {
                "ours": lambda: ours.train(X, target[None], PATTERNS, 2000),
                "batched": lambda: batched.train(6),
                "optim": lambda: single(40),
            },
            rounds=5 if quick else 15,
        )
    mine, bmm, optim = taken["ours"] / 2000 / UNIT, taken["batched"] / 6 / NETS / UNIT, taken["optim"] / 40 / UNIT
    return [
        at_most("Rprop, ns a pattern, hidden neuron and iteration", mine, 2, "ns"),
        at_least(
            f"  against torch bmm, {NETS} networks at once, same formulas", bmm / mine, 5, note=f"peer {bmm:.1f} ns"
        ),
        at_least("  against torch.optim.Rprop, one network", optim / mine, 50, note=f"peer {optim:.0f} ns"),
    ]
