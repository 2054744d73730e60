"""The connection to a Dask scheduler, which may go away and come back."""

from __future__ import annotations

import logging
import re
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, Self

from bns.errors import ClusterError
from bns.extras import extra
from bns.sweep.jobs.dask_job import LeavesSignals
from bns.sweep.jobs.executor import ATTEMPTS
from bns.sweep.jobs.trackers import without_complaints

with extra("cluster"):
    import dask
    from distributed import Client, Future, LocalCluster

PATIENCE_S = 600.0
"""How long a sweep waits for a scheduler that went away, or for the first worker."""

_ADDRESS = re.compile(r"((tcp|tls|ws|wss|ucx|ucxx|inproc)://.+|[\w.-]+:\d{1,5}|\[[0-9a-fA-F:.%]+\]:\d{1,5})")
_FIRST_S, _TRY_S = 30.0, 5.0
_CLOSE_S = 10.0
_LOOK_S = 2.0
_STARTS = 2


class DaskLink:
    """A client of the scheduler at ``address``, or of one with ``workers`` processes on this machine.

    ``deaths`` counts by key of a future how many workers died that were at it, or had its result and nobody had fetched it.
    """

    def __init__(self, address: str | None, workers: int, patience_s: float) -> None:
        self.address, self._workers, self._patience_s = address, workers, patience_s
        self.deaths: Counter[str] = Counter()
        self._cluster: LocalCluster | None = None
        self._client: Client | None = None
        self._lost_at: float | None = None
        self._looked_at, self._threads = float("-inf"), 1

    def open(self) -> Self:
        """Connect and wait for a worker; ClusterError if there is no scheduler or none comes."""
        if self.address is None:
            self._cluster = _own_cluster(self._workers)
            self.address = self._cluster.scheduler_address
        elif not _ADDRESS.fullmatch(self.address):
            raise ClusterError(
                f"{self.address!r} is no address of a Dask scheduler; write HOST:PORT or tcp://HOST:PORT, as 'dask scheduler' "
                "prints it, or leave --scheduler out to use this machine."
            )
        try:
            self._connect(min(_FIRST_S, self._patience_s))
        except (OSError, ValueError, TypeError, RuntimeError, ImportError) as error:
            raise ClusterError(
                f"no Dask scheduler answers at {self.address}: {error}. Start one with 'dask scheduler' and give the "
                "address that it prints, as --scheduler tcp://HOST:8786, or leave --scheduler out to use this machine."
            ) from error
        try:
            self.client.wait_for_workers(1, timeout=self._patience_s)
        except TimeoutError as error:
            raise ClusterError(
                f"no worker has joined the Dask scheduler at {self.address} for {self._patience_s:.0f} s. On every "
                f"machine start: dask worker {self.address} --nworkers auto --nthreads 1"
            ) from error
        return self

    @property
    def client(self) -> Client:
        """The client; only while the link is open."""
        assert self._client is not None
        return self._client

    def threads_by_worker(self) -> dict[str, int]:
        """Threads of every worker that is there, by address."""
        return dict(self.client.nthreads())

    @property
    def slots(self) -> int:
        """Runs that the workers can do at once, at least 1; looked up now and then."""
        if time.monotonic() - self._looked_at > _LOOK_S and self._client is not None and self.client.status == "running":
            self._looked_at = time.monotonic()
            try:
                self._threads = max(1, sum(self.threads_by_worker().values()))
            except OSError:
                return self._threads  # the scheduler is just going away: `is_up` deals with it
        return self._threads

    def is_up(self) -> bool:
        """Whether there is a scheduler now; tries to come back to it.

        Raises:
            ClusterError: it has been away for longer than the patience.
        """
        if self.client.status == "running":
            self._lost_at = None
            return True
        self._lost_at = self._lost_at or time.monotonic()
        if time.monotonic() - self._lost_at > self._patience_s:
            raise ClusterError(
                f"the Dask scheduler at {self.address} has been away for {self._patience_s:.0f} s. What was finished is "
                "stored; start the scheduler and its workers again and repeat the command, which continues from here."
            )
        if self.client.status == "closed":
            self._try_again()
        return self.client.status == "running"

    def submit(self, function: Any, *arguments: Any, key: str) -> Future:
        """A future of ``function(*arguments)``."""
        return self.client.submit(function, *arguments, key=key, pure=False)

    def close(self, futures: list[Future]) -> None:
        """Give up ``futures`` and leave; a scheduler of our own ends with its workers."""
        if self._client is not None:
            if self._client.status == "running":
                self._client.cancel(futures)
                self._client.unsubscribe_topic("all")  # or the scheduler tells a closed client that it has left
            self._client.close(timeout=_CLOSE_S)
        if self._cluster is not None:
            self._cluster.close(timeout=_CLOSE_S)
        self._client = self._cluster = None

    def _connect(self, timeout_s: float) -> None:
        try:
            self._client = Client(self.address, timeout=timeout_s, set_as_default=False)
        except AssertionError:  # distributed gives its own thread ten seconds to start, on a busy machine too few
            self._client = Client(self.address, timeout=timeout_s, set_as_default=False)
        self._client.subscribe_topic("all", self._note)
        if self._cluster is not None:
            self._client.register_plugin(LeavesSignals())

    def _try_again(self) -> None:
        try:
            self._connect(_TRY_S)
        except OSError:
            time.sleep(1.0)

    def _note(self, event: tuple[float, Mapping[str, Any]]) -> None:
        if event[1].get("action") in {"add-worker", "remove-worker"}:
            for lost in ("processing-tasks", "lost-computed-tasks"):
                self.deaths.update(event[1].get(lost, ()))
            self._looked_at = float("-inf")


def _own_cluster(workers: int) -> LocalCluster:
    """A scheduler and workers of our own, tried again where a worker dies before it has begun; ClusterError."""
    without_complaints()
    fault: Exception | None = None
    for _ in range(_STARTS):
        try:
            with dask.config.set({"distributed.scheduler.allowed-failures": ATTEMPTS - 1}):
                return LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                )
        except (OSError, RuntimeError) as error:
            fault = error
    causes = [str(each) for each in _chain(fault) if str(each)]
    raise ClusterError(
        f"{workers} Dask workers could not be started on this machine, {_STARTS} times: {'; '.join(causes)}. Something kills "
        "them as they begin, most often because memory is short: try fewer --jobs, or leave --executor out."
    ) from fault


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__
