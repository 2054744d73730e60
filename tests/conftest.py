"""What several tests share."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile
import zlib

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


def pytest_addoption(parser):
    parser.addoption("--part", metavar="K/N", help="only every N-th test, beginning with the K-th: a part of a long suite")


def pytest_collection_modifyitems(config, items):
    if part := config.getoption("--part"):
        kept = [item for item in items if in_part(item.nodeid, part)]
        config.hook.pytest_deselected(items=[item for item in items if not in_part(item.nodeid, part)])
        items[:] = kept


def in_part(name, part):
    """Whether a test belongs to the K-th of N parts ("K/N"): by its name, so that others come and go beside it."""
    which, of = (int(number) for number in part.split("/"))
    if not 1 <= which <= of:
        raise pytest.UsageError(f"--part {part}: there are the parts 1/{of} to {of}/{of}")
    return zlib.crc32(name.encode()) % of == which - 1


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
