"""A Dask cluster of processes on loopback, and somebody who kills its workers."""

import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

from distributed import Client


class Cluster:
    """A scheduler and worker processes; a killed worker is started again by its nanny."""

    def __init__(self, workers: int, threads: int = 1) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
        self._workers, self._threads = workers, threads
        self._processes: list[subprocess.Popen] = []

    def start(self) -> None:
        """Start the scheduler, at the same address as before, and the workers."""
        port = self.address.rsplit(":", 1)[1]
        self._begin("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard", "--no-show")
        _wait_for(int(port))  # so that no test's patience is spent on the start of a process
        if self._workers:
            options = "--nworkers", str(self._workers), "--nthreads", str(self._threads), "--no-dashboard"
            self._begin("worker", self.address, *options, "--death-timeout", "60", "--memory-limit", "0")

    def stop(self) -> None:
        """Kill all of them at once."""
        for process in reversed(self._processes):
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        self._processes = []

    def __enter__(self) -> "Cluster":
        self.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self.stop()

    def _begin(self, kind: str, *arguments: str) -> None:
        path = os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")])
        self._processes.append(
            subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.dask_{kind}", *arguments],
                env=os.environ | {"PYTHONPATH": path},
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        )


def _wait_for(port: int, patience_s: float = 60.0) -> None:
    give_up_at = time.monotonic() + patience_s
    while time.monotonic() < give_up_at:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=1.0):
            return
        time.sleep(0.05)
    raise TimeoutError(f"nothing listens at port {port} after {patience_s:.0f} s")


class Killer(threading.Thread):
    """Kills one of the workers every ``every_s`` seconds while its context is open."""

    def __init__(self, address: str, every_s: float) -> None:
        super().__init__(daemon=True)
        self.kills = 0
        self._address, self._every_s, self._over, self._luck = address, every_s, threading.Event(), random.Random(0)

    def run(self) -> None:
        with Client(self._address, set_as_default=False) as client:
            while not self._over.wait(self._every_s):
                pids = sorted(client.run(os.getpid).values())
                if pids:
                    os.kill(self._luck.choice(pids), signal.SIGKILL)
                    self.kills += 1

    def __enter__(self) -> "Killer":
        self.start()
        return self

    def __exit__(self, *exc: object) -> None:
        self._over.set()
        self.join()
