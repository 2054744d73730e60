"""Shards: many writers, one folder, every run once."""

import errno
import warnings
from datetime import UTC, datetime, timedelta

import pandas as pd
import pytest
import sweep_jobs
from sweep_jobs import make_sweep

import bns.store.read.snapshot as snapshots
from bns.errors import SpecError, StoreError, SweepWarning
from bns.store import StoreWarning, Writer, compact, load
from bns.store.disk.journal import journals
from bns.sweep.expand.order import ordered_specs
from bns.sweep.expand.shard import Shard
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.runner import run_sweep


def carry_out(folder, shard=None, **options):
    return run_sweep(make_sweep(), folder, job=sweep_jobs.ok, executor=SerialExecutor(sweep_jobs.ok), shard=shard, **options)


def assert_same_evals(one, other):
    pd.testing.assert_frame_equal(load(one), load(other))


@pytest.mark.parametrize(("runs", "count"), [(8, 1), (8, 3), (8, 8), (3, 5), (0, 2)])
def test_shares_are_disjoint_and_make_up_the_whole(runs, count):
    shares = [Shard(number, count).share(range(runs)) for number in range(1, count + 1)]
    assert sorted(run for share in shares for run in share) == list(range(runs))
    assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_every_share_goes_through_the_seeds_in_order():
    share = Shard(2, 4).share(ordered_specs(make_sweep(combos=8, seeds=5)))
    assert [spec.seed for spec in share] == [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]


@pytest.mark.parametrize(
    ("text", "message"),
    [("0/4", "there is no shard 0/4"), ("5/4", "goes from 1 to the second"), ("3of4", "written K/N"), ("", "K/N")],
)
def test_what_is_no_shard_is_explained(text, message):
    with pytest.raises(SpecError, match=message):
        Shard.parse(text)
    assert Shard.parse("3/40") == Shard(3, 40)


def test_shards_together_give_what_one_machine_gives(tmp_path):
    carry_out(tmp_path / "whole")
    with warnings.catch_warnings():
        warnings.simplefilter("error", SweepWarning)  # the runs of other shards are no strangers
        summaries = [carry_out(tmp_path / "shards", Shard(number, 3)) for number in (3, 1, 2)]
    assert [(s.total, s.new, s.done, s.remaining) for s in summaries] == [(2, 2, 2, 0), (3, 3, 3, 0), (3, 3, 3, 0)]
    assert_same_evals(tmp_path / "shards", tmp_path / "whole")
    assert carry_out(tmp_path / "shards").new == 0
    assert carry_out(tmp_path / "shards", Shard(1, 2)).new == 0  # other shares of the same runs


def test_a_shard_that_lists_nothing_of_what_is_there_does_no_harm(tmp_path, monkeypatch):
    carry_out(tmp_path / "whole")
    carry_out(tmp_path / "a")
    monkeypatch.setattr("bns.sweep.runner.recorded", lambda *_: {})  # a shared folder may list files late
    assert carry_out(tmp_path / "a", Shard(1, 2)).new == 4
    assert_same_evals(tmp_path / "a", tmp_path / "whole")
    assert compact(tmp_path / "a").dropped_copies == 4
    assert_same_evals(tmp_path / "a", tmp_path / "whole")


def test_runs_whose_rows_are_listed_late_are_done_again_and_count_once(tmp_path):
    carry_out(tmp_path / "whole")
    carry_out(tmp_path / "a")
    (rows,) = (tmp_path / "a" / "evals").rglob("*.parquet")
    rows.rename(tmp_path / "late.parquet")
    with pytest.warns(StoreWarning, match=f"{rows.name}: gone, .* 8 runs do not count as finished"):
        assert carry_out(tmp_path / "a", Shard(1, 1)).new == 8
    (tmp_path / "late.parquet").rename(rows)
    assert len(load(tmp_path / "a", "runs")) == 8
    assert_same_evals(tmp_path / "a", tmp_path / "whole")


def test_clocks_an_hour_apart_change_nothing(tmp_path, monkeypatch):
    class Behind(datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime.now(tz) - timedelta(hours=1)

    carry_out(tmp_path / "whole")
    carry_out(tmp_path / "a", Shard(1, 2))
    monkeypatch.setattr("bns.store.write.writer.datetime", Behind)
    monkeypatch.setattr("bns.store.disk.lock.datetime", Behind)
    monkeypatch.setattr("sweep_jobs.datetime", Behind)
    assert carry_out(tmp_path / "a", Shard(2, 2)).new == 4
    assert load(tmp_path / "a", "runs")["started_at"].min() < datetime.now(UTC) - timedelta(minutes=50)
    assert_same_evals(tmp_path / "a", tmp_path / "whole")


def test_the_same_shard_twice_at_once_is_refused(tmp_path):
    with Writer(tmp_path, "demo", shard="1-of-2"):
        with pytest.raises(StoreError, match="shard 1-of-2 of sweep 'demo' is being written by process"):
            carry_out(tmp_path, Shard(1, 2))
        assert carry_out(tmp_path, Shard(2, 2)).new == 4


def test_the_whole_sweep_and_its_shards_keep_out_of_each_others_way(tmp_path):
    with Writer(tmp_path, "demo", shard="1-of-2") as writer:
        writer.append(sweep_jobs.ok(ordered_specs(make_sweep())[0]))
        with pytest.raises(StoreError, match=r"being written by shards of it: see .*demo\.shard-\*\.lock\.json"):
            carry_out(tmp_path)
        assert compact(tmp_path).skipped_sweeps == ("demo",)
        assert len(journals(tmp_path)) == 1
    with Writer(tmp_path, "demo"), pytest.raises(StoreError, match="sweep 'demo' is being written by process"):
        carry_out(tmp_path, Shard(1, 2))
    assert carry_out(tmp_path).done == 8


def test_a_shard_leaves_alone_what_it_did_not_make(tmp_path):
    specs = ordered_specs(make_sweep())
    with Writer(tmp_path, "demo", shard="1-of-2") as other:
        other.append(sweep_jobs.ok(specs[0]))
        half_built = tmp_path / "staging" / "demo" / "part-of-the-other.parquet"
        half_built.parent.mkdir(parents=True, exist_ok=True)
        half_built.touch()
        carry_out(tmp_path, Shard(2, 2))
        assert half_built.exists()
        other.append(sweep_jobs.ok(specs[2]))
    assert set(load(tmp_path, "runs")["run_id"]) >= {specs[0].run_id, specs[2].run_id}
    assert not journals(tmp_path)


def test_the_journal_of_a_killed_shard_is_read_and_folded_later(tmp_path):
    carry_out(tmp_path / "whole")
    specs = ordered_specs(make_sweep())
    killed = Writer(tmp_path / "a", "demo", shard="1-of-2").__enter__()
    killed.append(sweep_jobs.ok(specs[0]))
    killed.__exit__(KeyboardInterrupt, KeyboardInterrupt(), None)  # leaves the files as a kill does
    summaries = [carry_out(tmp_path / "a", Shard(number, 2)) for number in (1, 2)]
    assert [(s.new, s.done) for s in summaries] == [(3, 4), (4, 4)]
    assert len(journals(tmp_path / "a")) == 1
    assert_same_evals(tmp_path / "a", tmp_path / "whole")
    assert compact(tmp_path / "a").recovered_runs == 1
    assert_same_evals(tmp_path / "a", tmp_path / "whole")


def test_a_file_system_without_locks_is_warned_of_and_used(tmp_path, monkeypatch):
    def no_locks(*_):
        raise OSError(errno.ENOSYS, "Function not implemented")

    monkeypatch.setattr("bns.store.disk.shared.fcntl.flock", no_locks)
    with pytest.warns(StoreWarning, match="has no file locks.*bns compact must wait"):
        carry_out(tmp_path, Shard(1, 2))
    assert len(load(tmp_path, "runs")) == 4


def test_a_failed_fold_of_a_shard_is_made_up_for(tmp_path, monkeypatch):
    specs = ordered_specs(make_sweep())
    with Writer(tmp_path, "demo", shard="1-of-1", fold_at=2) as writer:
        with monkeypatch.context() as full:
            full.setattr("bns.store.write.fold.publish", lambda *_: (_ for _ in ()).throw(StoreError("disk full")))
            writer.append(sweep_jobs.ok(specs[0]))
            with pytest.raises(StoreError, match="disk full"):
                writer.append(sweep_jobs.ok(specs[1]))
        writer.append(sweep_jobs.ok(specs[2]))
    assert not journals(tmp_path)
    assert len(load(tmp_path, "runs")) == 3


def test_readers_are_not_held_up_by_writers_that_always_fold(tmp_path, monkeypatch):
    for number in (1, 2):
        carry_out(tmp_path, Shard(number, 2))
    true_list, calls = snapshots.list_files, []

    def growing(results, table, sweep=None):
        files = true_list(results, table, sweep)
        calls.append(table)
        return files[:1] if len(calls) == 1 else files  # the second part appears while the first look is taken

    monkeypatch.setattr(snapshots, "list_files", growing)
    assert len(load(tmp_path)) == 4 * 3
    assert len(calls) == 2
