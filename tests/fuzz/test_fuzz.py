"""Every reader of users' files, given files that nobody would write: an explanation or a result, at once, in little memory.

BNS_FUZZ_EXAMPLES sets how many a reader; the draws are the same in every run (BNS_FUZZ_SEED takes others).
"""

from __future__ import annotations

import os
import resource
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, seed, settings

from bns.cli.main import main
from bns.diagnose.data.apply_mapping import applied
from bns.diagnose.data.load import load_measured
from bns.diagnose.data.mapping import load_mapping
from bns.diagnose.data.sources.read import read_table
from bns.errors import BnsError
from bns.hardware.emulators.faults import load_plan
from bns.hardware.rig import load_rig
from bns.physics.formula import formula_effect
from bns.physics.model import load_model
from bns.physics.signals import Body
from bns.sweep.expand.grid import load_sweep

from . import files

EXAMPLES = int(os.environ.get("BNS_FUZZ_EXAMPLES", "150"))
SEED = int(os.environ.get("BNS_FUZZ_SEED", "0"))
LONGEST_S, MOST_MIB = 10.0, 1024


def fuzzed(strategy, share=1.0):
    """A test of that many examples, with draws that are the same in every run."""

    def of(test):
        rules = settings(
            max_examples=max(1, int(EXAMPLES * share)),
            deadline=None,
            database=None,
            suppress_health_check=list(HealthCheck),
        )
        return seed(SEED)(rules(given(strategy)(test)))

    return of


def grown_mib():
    """The most memory that this process ever had."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def explained(work):
    """Carry out ``work``: it ends well, or with an explanation; soon, and in little memory."""
    began, before = time.process_time(), grown_mib()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            work()
    except BnsError as error:
        said = str(error)
    else:
        said = "nothing was wrong"
    assert 10 < len(said) < 6000
    assert time.process_time() - began < LONGEST_S
    assert grown_mib() - before < MOST_MIB


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


def written(folder, name, data):
    path = Path(folder) / name
    path.write_bytes(data)
    return path


READERS = {
    "sweep": (files.SWEEP, "x.yaml", load_sweep),
    "model": (files.MODEL, "m.yaml", load_model),
    "mapping": (files.MAPPING, "map.yaml", load_mapping),
    "rig": (files.RIG, "rig.yaml", lambda path: load_rig(path, "khepera")),
    "faults": (files.FAULTS, "plan.yaml", load_plan),
    "measurements": (files.CSV, "log.csv", load_measured),
}


@pytest.mark.parametrize("kind", READERS)
def test_sound_files_are_read(folder, kind):
    text, name, read = READERS[kind]
    read(written(folder, name, text.encode()))


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.slow
def test_spoilt_files_are_read_or_explained(folder, kind):
    text, name, read = READERS[kind]

    @fuzzed(files.spoilt(text))
    def check(data):
        path = written(folder, name, data)
        explained(lambda: read(path))

    check()


@fuzzed(files.formulas(), share=5)
def test_formulas_are_calculated_or_explained(term):
    ones = np.linspace(-1, 1, 6).reshape(2, 3)

    def work():
        effect = formula_effect("f", term, "v")
        body = Body(ones, ones, ones, np.ones((2, 3)), ones, ones, ones + 2, np.zeros((2, 3, 3)))
        effect.apply(body, **{p.name: 0.5 for p in effect.parameters})

    explained(work)


@pytest.mark.parametrize("term", ["v / (k - k)", "(0 * k) ** -1 * v", "(-k) ** 0.5", "log(-k) * v"])
def test_formulas_that_fail_for_their_numbers_alone_are_explained(term):
    ones = np.full((2, 3), 0.5)

    def work():
        effect = formula_effect("f", term, "v")
        body = Body(ones, ones, ones, np.ones((2, 3)), ones, ones, ones + 2, np.zeros((2, 3, 3)))
        effect.apply(body, **{p.name: 0.5 for p in effect.parameters})

    explained(work)
    with pytest.raises(BnsError):
        work()


def test_logs_under_spoilt_mappings_are_read_or_explained(folder):
    log = written(folder, "foreign.csv", files.CSV.replace("t_s", "time").replace("x_m", "X").encode())
    mapping = files.MAPPING.split("also:")[0].replace("{from: yaw", "{from: heading_rad").replace("{from: l,", "{from: left_m_s,")

    @fuzzed(files.spoilt(mapping))
    def check(data):
        path = written(folder, "foreign.yaml", data)
        explained(lambda: applied(read_table(log), load_mapping(path), log.parent, read_table))

    check()


def test_commands_end_with_0_or_2_a_message_and_nothing_half_written(folder, capsys):
    output = Path(folder) / "out.csv"

    @fuzzed(files.spoilt(files.CSV), share=0.3)
    def check(data):
        log = written(folder, "command.csv", data)
        mapping = written(folder, "command.yaml", b"columns:\n  t_s: {from: t_s, unit: s}\n")
        output.unlink(missing_ok=True)
        code = main(["import", str(log), "--map", str(mapping), "-o", str(output)])
        said = capsys.readouterr()
        assert code in {0, 2}
        assert "Traceback" not in said.err
        assert (code == 0) == output.exists()
        if code == 2:
            assert str(log) in said.err or str(mapping) in said.err

    check()
    assert not list(Path(folder).glob(".*"))
