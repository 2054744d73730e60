"""What several tests share."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile

import hypothesis
import matplotlib as mpl
import pytest

mpl.use("Agg")
hypothesis.settings.register_profile("any machine", deadline=None)  # how long an example takes says how busy the machine is
hypothesis.settings.load_profile("any machine")
os.environ["BNS_CACHE"] = "off"  # a test that changes a number in memory must not be answered from before
ANSWERS = "BNS_TEST_ANSWERS"
"""The folder in which processes of their own, whose program is the one on disk, remember what this run of the tests asked."""
if ANSWERS not in os.environ:  # the workers of pytest-xdist inherit it
    os.environ[ANSWERS] = tempfile.mkdtemp(prefix="bns-answers-")
    atexit.register(shutil.rmtree, os.environ[ANSWERS], ignore_errors=True)


def remembering():
    """For the environment of a process that asks what others may have asked before, as a user's commands do."""
    return {"BNS_CACHE": os.environ[ANSWERS]}


@pytest.fixture
def bns():
    """Run the command line in a process of its own: bns("run", "--seed", "3") -> completed process."""

    def call(*arguments, cwd=None, timeout=600, **environment):
        return subprocess.run(
            [sys.executable, "-m", "bns", *map(str, arguments)],
            cwd=cwd, env=os.environ | remembering() | environment, capture_output=True, text=True, timeout=timeout, check=False,
        )  # fmt: skip

    return call
