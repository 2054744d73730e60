"""One run on the GPU."""

from __future__ import annotations

from bns.bootstrap.loop import Progress, RunResult
from bns.cuda.batch import Batch
from bns.cuda.device import OutOfDeviceMemoryError
from bns.errors import DeviceError
from bns.spec import RunSpec


def run(spec: RunSpec, progress: Progress | None = None) -> RunResult:
    """As `bns.bootstrap.loop.run`, in the substitute world; a batch of one, which leaves most of the GPU idle.

    Raises:
        SpecError: a run that only the CPU can do.
        DeviceError: no GPU, it failed, or the run does not fit.
    """
    try:
        batch = Batch([spec])
        while not batch.done:
            batch.step()
            if progress is not None:
                evals = batch.columns(0)
                progress({name: values[-1] for name, values in evals.items()})
        return batch.result()
    except OutOfDeviceMemoryError as error:
        raise DeviceError(
            f"this run does not fit into the GPU's memory now ({error}). Set a smaller --max-commands or --population-size, "
            "wait until other programs release it, or leave --device out."
        ) from error
