"""What several tests share."""

import os
import subprocess
import sys

import matplotlib as mpl
import pytest

mpl.use("Agg")
os.environ["BNS_CACHE"] = "off"  # a test that changes a number in memory must not be answered from before


@pytest.fixture
def bns():
    """Run the command line in a process of its own: bns("run", "--seed", "3") -> completed process."""

    def call(*arguments, cwd=None, timeout=240, **environment):
        return subprocess.run(
            [sys.executable, "-m", "bns", *map(str, arguments)],
            cwd=cwd, env=os.environ | environment, capture_output=True, text=True, timeout=timeout, check=False,
        )  # fmt: skip

    return call
