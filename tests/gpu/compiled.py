"""Compile every kernel for an H200 and say what it needs: python -m tests.gpu.compiled

Needs bns[cuda], but no GPU. It finds what the simulator cannot, which knows no types: functions that a GPU's compiler lacks.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from numba import boolean, cuda, float32, float64, from_dtype, int32, int64, uint32
from numba.cuda import compiler, dispatcher
from numba.types import void

from bns.cuda.kernels import kernels_of
from bns.cuda.settings import SETTINGS
from bns.robots import load_robot

CAPABILITY = (9, 0)
ROBOTS = ("khepera", "snake")


def arrays(kind: Any, *dimensions: int) -> list[Any]:
    """Types of C-contiguous arrays."""
    return [kind[(*[slice(None)] * (d - 1), slice(None, None, 1)) if d > 1 else slice(None, None, 1)] for d in dimensions]


def kernels(robot: str) -> dict[str, tuple[Any, Any]]:
    """Name -> kernel and signature, as `bns.cuda.batch` launches it."""
    own = kernels_of(robot)
    of_runs = [int64, *arrays(from_dtype(SETTINGS), 1)]
    weights, lists = arrays(float32, 3)[0], [*arrays(float32, 5), *arrays(int32, 3)]
    flat, counted = arrays(float32, 2)[0], arrays(int32, 1)[0]
    patterns = [*arrays(float32, 4, 4), *arrays(int32, 2)]
    fitness, order, goals = arrays(float64, 2)[0], arrays(int32, 2)[0], arrays(float64, 3)[0]
    found = {
        "merge": (own.merge, void(*of_runs, weights, weights, *[counted] * 2, weights, goals, weights, weights, counted)),
        "train": (own.train, void(*of_runs, *[weights] * 7, counted)),
        "restart": (own.restart, void(*of_runs, *[weights] * 5, counted)),
        "evolve": (
            own.evolve,
            void(*of_runs, weights, *lists, fitness, order, order, order, fitness, goals, counted, counted),
        ),
        "drive": (
            own.drive,
            void(
                *of_runs, uint32, boolean, *arrays(float32, 1), *arrays(float64, 1), flat, *lists, order, fitness, goals,
                *patterns, counted, goals,
            ),
        ),
        "measure": (
            own.measure,
            void(*of_runs, flat, *lists, order, fitness, order, *patterns, counted, counted, goals),
        ),
    }  # fmt: skip
    return found if load_robot(robot).repeats_inputs else {name: pair for name, pair in found.items() if name != "merge"}


def main(ptxas: str) -> int:
    """Print what the assembler says of each; 1 if one spills registers."""
    for module in (compiler, dispatcher):  # helpers are compiled for the GPU at hand, and there may be none
        module.get_current_device = lambda: SimpleNamespace(compute_capability=CAPABILITY)
    spilled = False
    for name, (kernel, signature) in ((f"{r} {name}", pair) for r in ROBOTS for name, pair in kernels(r).items()):
        fast = bool(kernel.targetoptions.get("fastmath"))
        text, _ = cuda.compile_ptx(kernel.py_func, signature, cc=CAPABILITY, fastmath=fast)
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "k.ptx").write_text(text)
            command = [ptxas, "-v", "-arch=sm_90", f"{folder}/k.ptx", "-o", f"{folder}/k.cubin"]
            told = subprocess.run(command, capture_output=True, text=True, check=True).stderr
        lines = [line.strip().removeprefix("ptxas info    : ") for line in told.splitlines() if "Used" in line or "spill" in line]
        spilled |= "0 bytes spill stores, 0 bytes spill loads" not in told
        print(f"{name:16s} {'; '.join(lines)}")
    return int(spilled)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1] if len(sys.argv) > 1 else "ptxas"))
