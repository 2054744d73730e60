"""Results that are deleted or moved under a writer, and files where a folder is wanted."""

import shutil

import pytest

from bns.errors import StoreError
from bns.store import Writer, compact, finished, load
from bns.store.disk.journal import journals

from .synthetic import failed, record, records, specs

GONE = "is missing: the results were deleted or moved while they were being written"
NEXT = "Run the sweep again: it carries out the missing runs"


def delete(results):
    shutil.rmtree(results)


def move(results):
    results.rename(results.with_name("elsewhere"))


def replace(results):
    shutil.copytree(results, results.with_name("copy"))
    shutil.rmtree(results)
    results.with_name("copy").rename(results)


def delete_journal(results):
    journals(results)[0].path.unlink()


TAKEN = pytest.mark.parametrize("take", [delete, move, replace, delete_journal])


@TAKEN
def test_next_run_is_refused(tmp_path, take):
    results, runs = tmp_path / "results", records(3)
    with (  # noqa: PT012
        pytest.raises(StoreError, match=rf"{GONE}. It held 2 .*{runs[2].spec.run_id} is not stored. {NEXT}"),
        Writer(results, "s") as writer,
    ):
        writer.append(runs[0])
        writer.append(runs[1])
        take(results)
        writer.append(runs[2])
    with Writer(results, "s"):
        pass  # the lock was given back


@pytest.mark.parametrize("take", [delete, move, delete_journal])
def test_fold_at_the_end_does_not_pass_over_it(tmp_path, take):
    results = tmp_path / "results"
    with (  # noqa: PT012
        pytest.raises(StoreError, match=f"{GONE}. 2 runs were written to it and 0 found in it. {NEXT}"),
        Writer(results, "s") as writer,
    ):
        for run in records(2):
            writer.append(run)
        take(results)


@pytest.mark.parametrize("take", [delete, move, replace])
@pytest.mark.parametrize("more", [0, 1])
def test_results_that_go_after_a_fold_are_missed(tmp_path, take, more):
    results, runs = tmp_path / "results", records(3)
    with (  # noqa: PT012
        pytest.raises(StoreError, match=f"{GONE}. The results stored before are gone with it. {NEXT}"),
        Writer(results, "s", fold_at=2) as writer,
    ):
        for run in runs[:2]:
            writer.append(run)
        take(results)
        for run in runs[2 : 2 + more]:
            writer.append(run)


def test_moved_results_can_be_gone_on_with(tmp_path):
    results, runs = tmp_path / "results", records(3)
    with pytest.raises(StoreError, match=GONE), Writer(results, "s") as writer:  # noqa: PT012
        writer.append(runs[0])
        move(results)
        writer.append(runs[1])
    with Writer(tmp_path / "elsewhere", "s") as writer:
        assert writer.recovered == 1
        writer.append(runs[1])
    assert len(finished(tmp_path / "elsewhere", "s")) == 2


def test_run_tried_twice_in_one_journal_is_no_loss(tmp_path):
    spec = next(specs(1, 3))
    with Writer(tmp_path, "s") as writer:
        writer.append(failed(spec))
        writer.append(record(spec))
        assert writer.fold() == 1


@pytest.mark.parametrize("below", ["", "deep"])
def test_file_where_the_results_should_be(tmp_path, below):
    file = tmp_path / "afile"
    file.write_text("not a folder")
    for read in (load, compact):
        with pytest.raises(StoreError, match=rf"no results in {file / below}: {file} is a file, not a folder\."):
            read(file / below)
    with (
        pytest.raises(StoreError, match=rf"{file} is a file\. .*give a folder \(--results DIR"),
        Writer(file / below, "s"),
    ):
        pass
    assert file.read_text() == "not a folder"


def test_file_where_a_folder_of_the_results_should_be(tmp_path):
    (tmp_path / "journal").touch()
    with pytest.raises(StoreError, match=rf"{tmp_path}/journal is a file\. "), Writer(tmp_path, "s"):
        pass
