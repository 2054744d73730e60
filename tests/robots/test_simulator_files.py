"""Networks to torch, to files and back."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from safetensors.numpy import load_file, save_file

from bns.engine.philox import Key
from bns.engine.snn import initial_weights, predict
from bns.errors import ModelError
from bns.robots.simulator import (
    StaticSimulator,
    from_tensors,
    from_torch,
    load_simulator,
    load_static_simulator,
    save_simulator,
    tensors,
    to_torch,
)

NAMES = ("dx", "dy", "dtheta")
X = np.random.default_rng(0).uniform(-1, 1, (5, 200)).astype(np.float32)


def weights(hidden=20, seed=0):
    return initial_weights(Key(seed, 1), 3, hidden)


def simulator(seed=0):
    return StaticSimulator(NAMES, weights(seed=seed), np.array([0.01, 0.02, 0.03]), {"seed": seed, "why": "test"})


@pytest.mark.parametrize("hidden", [4, 20])
def test_torch_modules_give_the_same_outputs(hidden):
    modules = to_torch(NAMES, weights(hidden))
    assert list(modules) == list(NAMES)
    with torch.no_grad():
        theirs = np.stack([modules[name](torch.from_numpy(X.T.copy())).numpy()[:, 0] for name in NAMES])
    np.testing.assert_allclose(predict(weights(hidden), X), theirs, rtol=0, atol=hidden * 5e-7)


def test_torch_round_trip_is_exact_and_trained_modules_come_back():
    modules = to_torch(NAMES, weights())
    np.testing.assert_array_equal(from_torch(modules), weights())
    with torch.no_grad():
        modules["dy"].output.bias += 1
    np.testing.assert_allclose(
        predict(from_torch(modules), X) - predict(weights(), X), [[0], [1], [0]] * np.ones(200), atol=1e-6
    )


def test_changing_a_module_leaves_the_weights():
    ours = weights()
    modules = to_torch(NAMES, ours)
    with torch.no_grad():
        for parameter in modules.parameters():
            parameter.zero_()
    np.testing.assert_array_equal(ours, weights())


def test_file_round_trip_is_exact(tmp_path):
    save_simulator(simulator(), tmp_path / "new" / "a.safetensors")
    back = load_simulator(tmp_path / "new" / "a.safetensors")
    np.testing.assert_array_equal(back.weights, weights())
    np.testing.assert_array_equal(back.noise_sd, [0.01, 0.02, 0.03])
    assert (back.networks, back.provenance, back.digest) == (NAMES, {"seed": 0, "why": "test"}, simulator().digest)


def test_other_tools_find_the_tensors_under_torchs_names(tmp_path):
    save_simulator(simulator(), tmp_path / "a.safetensors")
    named = load_file(tmp_path / "a.safetensors")
    module = to_torch(NAMES, np.zeros_like(weights()))["dtheta"]
    module.load_state_dict(
        {k.removeprefix("dtheta."): torch.tensor(v) for k, v in named.items() if k.startswith("dtheta.")}
    )
    with torch.no_grad():
        theirs = module(torch.from_numpy(X.T.copy())).numpy()[:, 0]
    np.testing.assert_allclose(predict(weights(), X)[2], theirs, atol=1e-5)


def test_the_digest_is_of_what_the_world_answers():
    one = simulator()
    assert replace(one, provenance={}).digest == one.digest
    assert replace(one, noise_sd=one.noise_sd * 2).digest != one.digest
    assert simulator(1).digest != one.digest


def test_a_missing_tensor_is_named():
    named = tensors(NAMES, weights())
    del named["dy.output.bias"]
    with pytest.raises(ModelError, match=r"no tensor 'dy\.output\.bias'; found: .*dy\.hidden\.bias"):
        from_tensors(NAMES, named)


@pytest.mark.parametrize(
    ("name", "shape"), [("dx.hidden.weight", (20, 4)), ("dx.hidden.weight", (18, 5)), ("dx.output.bias", (2,))]
)
def test_a_tensor_of_another_shape_is_refused(name, shape):
    named = tensors(NAMES, weights()) | {name: np.zeros(shape, np.float32)}
    with pytest.raises(ModelError, match=r"network 'dx' has a tensor of shape .*expected 5 inputs.*multiple of 4"):
        from_tensors(NAMES, named)


def test_files_that_are_none_say_so(tmp_path):
    with pytest.raises(ModelError, match=r"there is no network file .*nowhere\.safetensors"):
        load_simulator(tmp_path / "nowhere.safetensors")
    (tmp_path / "text.safetensors").write_bytes(b"not a network at all")
    with pytest.raises(ModelError, match=r"text\.safetensors is no safetensors file"):
        load_simulator(tmp_path / "text.safetensors")
    save_file({"a": np.zeros(3, np.float32)}, tmp_path / "foreign.safetensors")
    with pytest.raises(ModelError, match=r"foreign\.safetensors .*which networks.*--save-snn"):
        load_simulator(tmp_path / "foreign.safetensors")


def test_the_shipped_simulator_cannot_be_changed_by_accident():
    with pytest.raises(ValueError, match="read-only"):
        load_static_simulator("khepera").weights[0, 0] = 1


def test_a_robot_without_a_static_simulator_says_how_to_make_one():
    with pytest.raises(ModelError, match=r"make it: bns precompute --robot snake\+rigid"):
        load_static_simulator("snake+rigid")


def test_what_a_run_was_trained_on_comes_along(tmp_path):
    saved = StaticSimulator(NAMES, weights(), np.empty(0), {}, X)
    save_simulator(saved, tmp_path / "a.safetensors")
    back = load_simulator(tmp_path / "a.safetensors")
    np.testing.assert_array_equal(back.learned_from, X)
    assert back.digest == StaticSimulator(NAMES, weights(), np.empty(0)).digest
