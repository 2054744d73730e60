"""A sample of the damages that `python -m tests.store.damages` does by the thousand."""

import json
import os
import warnings

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bns.spec import RunSpec
from bns.store import StoreWarning, Writer, compact, finished, load, query
from bns.store.disk import whole
from bns.store.disk.digest import Memory, digest_in, identity, is_intact
from bns.store.disk.parquet import file_bytes
from bns.store.disk.parts import find_parts
from bns.sweep.status import sweep_status

from .damages import survey
from .synthetic import failed, record, records, specs


def files(results, table):
    return sorted((results / table).rglob("*.parquet"))


def store(results, runs, sweep="s"):
    with Writer(results, sweep, sweep_text="name: s\nrobot: khepera\nseeds: 3\n") as writer:
        for run in runs:
            writer.append(run)


def full(count):
    return [record(spec, ("evals", "paths", "generations", "probes")) for spec in specs(count, 2, record="full")]


@pytest.mark.slow
def test_no_damage_goes_unnoticed_and_a_sweep_makes_up_for_each():
    outcomes = survey(14, 7)
    assert [one for one in outcomes if one.verdict not in {"named", "harmless", "again"}] == []
    assert sum(one.verdict == "named" for one in outcomes) >= 7


def test_a_damaged_file_of_a_sweep_has_no_runs_and_is_written_again(tmp_path):
    store(tmp_path, full(2))
    path = files(tmp_path, "specs")[0]
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.warns(StoreWarning, match=f"{path.name} is skipped: it is .* and the sweep writes it again"):
        assert load(tmp_path, "specs").empty
    with pytest.warns(StoreWarning, match=rf"{path.name} is set aside as .* It is written again"):
        store(tmp_path, [])
    assert len(load(tmp_path, "specs")) == 1
    assert len(finished(tmp_path, "s")) == 2


@pytest.mark.parametrize("table", ["evals", "paths", "generations", "probes"])
def test_what_is_set_aside_is_run_again(tmp_path, table):
    store(tmp_path, full(2))
    path = files(tmp_path, table)[0]
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.warns(StoreWarning, match=f"{path.name} is skipped: it is"):
        assert finished(tmp_path, "s") == {}
    with pytest.warns(StoreWarning, match=f"{path.name} is skipped: it is"):
        assert [row.done for row in sweep_status(tmp_path)] == [0]
    with pytest.warns(StoreWarning, match=rf"{path.name} is set aside as .*set-aside/{table}/.* are repeated"):
        store(tmp_path, full(2))
    assert len(finished(tmp_path, "s")) == 2
    assert not path.exists()
    compact(tmp_path)
    assert len(finished(tmp_path, "s")) == 2
    assert len(files(tmp_path, "runs")) == 1


def test_compaction_does_not_take_runs_with_lost_rows_for_finished(tmp_path):
    runs = full(3)
    store(tmp_path, runs[:2])
    store(tmp_path, runs[1:])
    path = files(tmp_path, "paths")[0]
    path.unlink()
    for _ in range(2):
        compact(tmp_path)
        with pytest.warns(StoreWarning, match="gone, though"):
            known = finished(tmp_path, "s")
        assert len(known) == 2
    store(tmp_path, [run for run in runs if run.spec.run_id not in known])
    compact(tmp_path)
    assert len(finished(tmp_path, "s")) == 3
    assert len(load(tmp_path, "paths")) == sum(len(run.tables["paths"]["step"]) for run in runs)


@pytest.mark.parametrize("status", ["failed", "quarantined"])
def test_a_failed_run_beside_lost_rows_lacks_nothing_once_those_were_run_again(tmp_path, status):
    broken, good = specs(2, 3)
    store(tmp_path, [failed(broken, status), record(good)])
    files(tmp_path, "evals")[0].unlink()
    with pytest.warns(StoreWarning, match="gone, though"):
        assert good.run_id not in finished(tmp_path, "s")
    store(tmp_path, [record(good)])
    compact(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert finished(tmp_path, "s") == {broken.run_id: status, good.run_id: "ok"}
        assert len(load(tmp_path)) == 3
    assert len(files(tmp_path, "runs")) == 1


def test_damaged_spec_file_is_written_again(tmp_path):
    store(tmp_path, records(1))
    path = files(tmp_path, "specs")[0]
    path.write_bytes(bytes(len(path.read_bytes())))
    with pytest.warns(StoreWarning, match=f"{path.name} is set aside"):
        store(tmp_path, [])
    assert load(tmp_path, "specs")["text"].tolist() == ["name: s\nrobot: khepera\nseeds: 3\n"]


def test_one_bit_of_a_columns_name_makes_no_traceback(tmp_path):
    store(tmp_path, records(3))
    path = files(tmp_path, "evals")[0]
    data = path.read_bytes()
    path.write_bytes(data.replace(b"mutation_rate", b"\xedutation_rate", 1))
    for read in (
        load,
        lambda folder: query(folder, "SELECT * FROM runs"),
        lambda folder: finished(folder, "s"),
        sweep_status,
    ):
        with pytest.warns(StoreWarning, match=f"{path.name} is skipped: it is damaged"):
            read(tmp_path)
    assert [moved.name for moved in compact(tmp_path).set_aside] == [path.name]


def test_the_same_in_a_file_from_before_digests(tmp_path, monkeypatch):
    monkeypatch.setattr("bns.store.disk.parts.is_sealed", lambda path: False)
    store(tmp_path, records(3))
    path = files(tmp_path, "evals")[0]
    data = path.read_bytes()
    path.write_bytes(data.replace(b"mutation_rate", b"\xedutation_rate", 1))
    with pytest.warns(StoreWarning, match=f"{path.name} is skipped: "):
        load(tmp_path)


def test_run_with_some_of_its_evaluations_is_not_finished(tmp_path):
    store(tmp_path, records(2, evaluations=4))
    assert list(finished(tmp_path, "s").values()) == ["ok", "ok"]
    with_more(files(tmp_path, "runs")[0], [4, 5])
    with pytest.warns(StoreWarning, match="has lost rows .*: 1 of its runs"):
        assert len(finished(tmp_path, "s")) == 1


def with_more(path, evaluations):
    """The runs file at ``path`` says that its runs had this many evaluations, under a digest that is right."""
    table = pq.read_table(path, partitioning=None)
    known = json.loads(table.schema.metadata[b"bns"])
    at = table.schema.get_field_index("evaluations")
    changed = table.set_column(at, table.schema.field(at), pa.array(evaluations, pa.int32()))
    path.write_bytes(file_bytes("runs", changed, json.dumps(known).encode()))


def test_second_look_reads_no_file_again_and_a_changed_one_is_read(tmp_path, monkeypatch):
    results = tmp_path / "results"
    store(results, records(3))
    find_parts(results, "evals")
    path = files(results, "evals")[0]
    with monkeypatch.context() as patch:
        patch.setattr("bns.store.disk.parts.is_intact", lambda path: pytest.fail(f"{path} was read again"))
        assert len(find_parts(results, "evals")[0]) == 1
    data, times = bytearray(path.read_bytes()), path.stat()
    data[500] ^= 1
    path.write_bytes(data)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))  # as a copy that keeps the times
    assert find_parts(results, "evals")[0] == []


def test_a_part_larger_than_what_is_read_at_once_is_verified_wherever_its_digest_stands(tmp_path, monkeypatch):
    """In several pieces, in a later one, where one begins, half in one and half in the next."""
    store(tmp_path, records(3))
    path = files(tmp_path, "evals")[0]
    data = path.read_bytes()
    at = data.index(digest_in(data).encode())
    for chunk in (7, 64, 100, at, at + 32):
        monkeypatch.setattr("bns.store.disk.digest._CHUNK", chunk)
        path.write_bytes(data)
        assert is_intact(path), chunk
        for place in (10, at - 30, at + 64, len(data) - 1):
            path.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
            assert not is_intact(path), (chunk, place)


def test_large_stores_are_remembered_by_the_next_process(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr("bns.store.disk.digest._REMEMBER_FROM", 1)
    path = tmp_path / "a.parquet"
    path.write_bytes(b"x" * 10)
    now, memory = identity(path.stat()), Memory(tmp_path)
    memory.add(path, now)
    memory.save()
    assert Memory(tmp_path).has(path, now)
    assert not Memory(tmp_path).has(path, (*now[:3], now[3] + 1))
    for kept in (tmp_path / "cache" / "bns").iterdir():
        kept.write_text("no JSON")
    assert not Memory(tmp_path).has(path, now)


@pytest.mark.parametrize(
    ("kept", "wanted"),
    [
        ("evals", ("evals",)),
        ("paths", ("evals", "paths")),
        ("full", ("evals", "paths", "generations", "probes")),
    ],
)
def test_beside_runs_from_before_digests_stands_what_they_were_asked_to_record_if_they_went_well(tmp_path, kept, wanted):
    spec = RunSpec(evaluations=3, record=kept)
    for sweep, run in (("well", record(spec, wanted)), ("badly", failed(spec))):
        with Writer(tmp_path, sweep) as writer:
            writer.append(run)
    well, badly = (next((tmp_path / "runs" / f"sweep={sweep}").rglob("*.parquet")) for sweep in ("well", "badly"))
    assert set(whole._wanted_by_record(well)) == set(wanted)
    assert whole._wanted_by_record(badly) == ()
