"""Compaction makes few files of many and changes nothing that is read."""

import json
import subprocess

import pandas.testing as pdt
import pyarrow.parquet as pq
import pytest

from bns.spec import RunSpec
from bns.store import SCHEMA_VERSION, SCHEMAS, StoreWarning, Writer, compact, load, spec_hash
from bns.store.disk.digest import digest_in
from bns.store.provenance import git_state, provenance

from .synthetic import failed, make_store, record, records, specs


def parts(results, table):
    return sorted((results / table).rglob("*.parquet"))


def rows(path):
    return pq.read_metadata(path).num_rows


@pytest.mark.parametrize(
    ("runs", "each", "expected"),
    [
        (250, 7, [105, 145]),
        (90, 30, [90]),
        (300, 100, [100, 100, 100]),
        (330, 128, [128, 128, 74]),
        (420, 40, [120, 120, 180]),
    ],
)
def test_files_hold_100_to_200_runs_and_the_rows_stay(tmp_path, runs, each, expected):
    make_store(tmp_path, runs, 2, runs_per_file=each)
    before = {table: load(tmp_path, table) for table in ("evals", "runs")}
    summary = compact(tmp_path)
    assert sorted(map(rows, parts(tmp_path, "runs"))) == sorted(expected)
    assert sorted(map(rows, parts(tmp_path, "evals"))) == sorted(2 * count for count in expected)
    for table, frame in before.items():
        pdt.assert_frame_equal(load(tmp_path, table), frame)
    assert (summary.files_after, summary.set_aside) == (2 * len(expected), ())
    names = parts(tmp_path, "evals")
    compact(tmp_path)
    assert parts(tmp_path, "evals") == names, "a second compaction finds nothing to do"


def test_every_table_and_task_is_kept_apart(tmp_path):
    full = ("evals", "paths", "generations", "probes")
    for seed in range(3):
        with Writer(tmp_path, "s", sweep_text="a: 1\n") as writer:
            writer.append(record(RunSpec(seed=seed, evaluations=3, record="full"), full))
            writer.append(record(RunSpec(seed=seed, evaluations=3, task="other")))
            writer.append(failed(RunSpec(seed=seed, evaluations=4)))
    before = {table: load(tmp_path, table) for table in SCHEMAS}
    compact(tmp_path)
    for table, frame in before.items():
        pdt.assert_frame_equal(load(tmp_path, table), frame)
    assert [len(parts(tmp_path, table)) for table in ("evals", "runs", "paths", "specs")] == [2, 2, 1, 1]


def test_files_carry_version_spec_and_commit(tmp_path):
    for runs in (records(2), records(4)[2:]):
        with Writer(tmp_path, "s", sweep_text="a: 1\n") as writer:
            for run in runs:
                writer.append(run)
    expected = {
        "schema_version": SCHEMA_VERSION,
        "sweep": "s",
        "spec_hash": spec_hash("a: 1\n"),
        "git_sha": provenance().git_sha,
        "git_clean": provenance().git_clean,
        "bns_version": provenance().bns_version,
    }
    for _ in range(2):
        for table in ("evals", "runs", "specs"):
            for path in parts(tmp_path, table):
                known = json.loads(pq.read_metadata(path).metadata[b"bns"])
                digest, vouched = known.pop("digest"), known.pop("parts", None)
                assert known == {**expected, "table": table, "task": "" if table == "specs" else "circle"}
                assert digest == digest_in(path.read_bytes())
                if table == "runs":
                    evals = next(one for one in parts(results=tmp_path, table="evals") if one.name == path.name)
                    assert vouched == {"evals": digest_in(evals.read_bytes())}
                assert {"sweep", "task"}.isdisjoint(pq.read_schema(path).names)
        compact(tmp_path)


def test_damaged_page_is_found_and_set_aside(tmp_path):
    make_store(tmp_path, 4, 50, runs_per_file=2)
    path = parts(tmp_path, "evals")[0]
    data = bytearray(path.read_bytes())
    chunk = pq.read_metadata(path).row_group(0).column(20)
    data[chunk.data_page_offset + chunk.total_compressed_size // 2] ^= 0xFF
    path.write_bytes(data)
    summary = compact(tmp_path)
    assert [moved.name for moved in summary.set_aside] == [path.name]
    assert f"set aside: {summary.set_aside[0]}" in str(summary)
    with pytest.warns(StoreWarning, match=f"{path.name}: gone"):
        assert len(load(tmp_path)) == 100


@pytest.mark.parametrize("elsewhere", [True, False])
def test_rows_without_their_run_are_removed_only_where_they_are_elsewhere_as_well(tmp_path, elsewhere):
    """A run in two folds: one has lost its row in runs; the other has all, or has lost its evaluations."""
    spec = next(specs(1, 3))
    for _ in range(2):
        with Writer(tmp_path, "s") as writer:
            writer.append(record(spec))
    orphan, rows_of_other = parts(tmp_path, "evals")
    next(path for path in parts(tmp_path, "runs") if path.name == orphan.name).unlink()
    if not elsewhere:
        rows_of_other.unlink()
    summary = compact(tmp_path)
    assert not orphan.exists()
    assert [(path.name, rows(path)) for path in summary.set_aside] == ([] if elsewhere else [(orphan.name, 3)])
    assert rows_of_other.exists() is elsewhere


def test_journals_left_behind_are_recovered(tmp_path):
    class StopError(Exception):
        pass

    with pytest.raises(StopError), Writer(tmp_path, "s") as writer:  # noqa: PT012
        for run in records(3):
            writer.append(run)
        raise StopError
    before = load(tmp_path)
    assert compact(tmp_path).recovered_runs == 3
    assert not list((tmp_path / "journal").glob("*.journal"))
    pdt.assert_frame_equal(load(tmp_path), before)


def test_failures_that_were_made_good_are_dropped(tmp_path):
    spec = next(specs(1, 3))
    for run in (failed(spec), record(spec)):
        with Writer(tmp_path, "s") as writer:
            writer.append(run)
    before = load(tmp_path, "runs")
    assert compact(tmp_path).dropped_copies == 1
    pdt.assert_frame_equal(load(tmp_path, "runs"), before)
    assert sum(map(rows, parts(tmp_path, "runs"))) == 1


def test_package_outside_a_checkout_has_no_commit(tmp_path):
    (tmp_path / "__init__.py").touch()
    assert git_state(tmp_path) == ("", None)
    assert git_state(tmp_path / "missing") == ("", None)


def test_commit_and_cleanness_of_a_checkout(tmp_path):
    def git(*arguments):
        names = ["-c", "user.name=n", "-c", "user.email=e@x.org"]
        subprocess.run(["git", "-C", str(tmp_path), *names, *arguments], check=True, capture_output=True)

    file = tmp_path / "__init__.py"
    file.write_text("a = 1\n")
    git("init")
    git("add", ".")
    assert git_state(tmp_path) == ("", None), "nothing is committed yet"
    git("commit", "-m", "one")
    sha, clean = git_state(tmp_path)
    assert (len(sha), clean) == (40, True)
    file.write_text("a = 2\n")
    assert git_state(tmp_path) == (sha, False)
