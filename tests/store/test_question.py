"""SQL from outside: only SELECT, only the results, nothing written."""

import os

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bns.errors import StoreError
from bns.store import StoreWarning, Writer, load, query
from bns.store.read import question

from .synthetic import records

ONLY = "only SELECT is allowed: one SELECT statement, or EXPLAIN of one"


@pytest.fixture
def store(tmp_path, monkeypatch):
    """Two runs of three evaluations, and a working folder of one's own."""
    with Writer(tmp_path / "results", "s") as writer:
        for run in records(2):
            writer.append(run)
    (tmp_path / "secret.csv").write_text("a\n1\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "results"


def everything(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("place", ["out.csv", "results/out.csv", "PART"])
@pytest.mark.parametrize(
    "statement",
    [
        "COPY evals TO '{}'",
        "EXPLAIN ANALYZE COPY evals TO '{}'",
        "explain (analyze) COPY evals TO '{}'",
        "EXPLAIN /* */ ANALYZE COPY evals TO '{}'",
        "WITH a AS (COPY (SELECT 1) TO '{}') SELECT 1",
        "EXPLAIN ANALYZE WITH a AS (COPY (SELECT 1) TO '{}') SELECT 1",
        "SELECT * FROM (WITH a AS (COPY (SELECT 1) TO '{}') SELECT 1)",
        "SELECT 1; COPY evals TO '{}'",
        "ATTACH '{}' AS other",
        "EXPORT DATABASE '{}'",
    ],
)
def test_nothing_is_written(store, statement, place):
    part = next((store / "evals").rglob("*.parquet"))
    before = everything(store.parent)
    with pytest.raises(StoreError):
        query(store, statement.format(part if place == "PART" else place))
    assert everything(store.parent) == before


@pytest.mark.parametrize(
    ("sql", "found"),
    [
        ("COPY evals TO 'out.csv'", "is COPY; "),
        ("WITH a AS (COPY (SELECT 1) TO 'results/x') SELECT 1", "is a SELECT that writes"),
        ("WITH a AS (DELETE FROM store.evals) SELECT 1", "is a SELECT that writes"),
        ("ATTACH 'x.db'", "is ATTACH; "),
        ("INSTALL httpfs", "is LOAD; "),
        ("SET threads = 1", "is SET; "),
        ("DROP VIEW evals", "is DROP; "),
        ("SELECT 1; SELECT 2", "is SELECT, SELECT; "),
        ("", "is no statement; "),
        ("-- nothing", "is no statement; "),
        ("EXPLAIN COPY evals TO 'x'", "is COPY; "),
    ],
)
def test_anything_but_one_select_is_refused(store, sql, found):
    with pytest.raises(StoreError, match=f"{found}.*{ONLY}" if found.endswith("writes") else f"{found}{ONLY}"):
        query(store, sql)


def test_condition_of_load_is_no_way_round(store):
    with pytest.raises(StoreError, match=ONLY):
        load(store, where="true); COPY evals TO 'out.csv' --")


@pytest.mark.parametrize(
    ("sql", "rows"),
    [
        ("SELECT count(*) AS n FROM evals;", 1),
        ("FROM evals -- all of them", 6),
        ("SELECT 1; -- done", 1),
        ("WITH a AS (SELECT * FROM runs) SELECT * FROM a", 2),
        ("VALUES (1), (2)", 2),
        ("DESCRIBE probes", 8),
        ("EXPLAIN SELECT * FROM evals", 1),
        ("explain analyze SELECT * FROM evals", 1),
        ("SELECT run_id FROM evals WHERE fitness_world > 2", 0),
    ],
)
def test_questions_that_are_answered(store, sql, rows):
    assert len(query(store, sql)) == rows


def test_order_is_kept(store):
    values = query(store, "SELECT diversity FROM evals ORDER BY diversity DESC")["diversity"].tolist()
    assert values == sorted(values, reverse=True)


@pytest.mark.parametrize(
    ("sql", "line"),
    [
        ("SELECT * FROM nope", "LINE 1: SELECT * FROM nope\n" + 22 * " " + "^"),
        ("SELECT *\nFROM nope", "LINE 2: FROM nope\n" + 13 * " " + "^"),
    ],
)
def test_a_mistake_is_shown_in_the_words_of_the_statement(store, sql, line):
    with pytest.raises(StoreError) as told:
        query(store, sql)
    assert line in str(told.value)
    assert "EXPLAIN" not in str(told.value)


def test_files_outside_the_results_and_python_variables_are_out_of_reach(store):
    mine = pa.table({"a": [1]})
    assert mine.num_rows == 1
    with pytest.raises(StoreError, match="Table with name mine does not exist"):
        query(store, "SELECT * FROM mine")
    for place in ("secret.csv", store.parent / "secret.csv", store / ".." / "secret.csv"):
        with pytest.raises(StoreError, match="disabled by configuration"):
            query(store, f"SELECT * FROM read_csv('{place}')")
    with pytest.raises(StoreError, match="DuckDB cannot answer"):
        query(store, "SELECT * FROM 'https://localhost/a.parquet'")


def test_results_named_relatively_or_oddly_can_still_be_asked(store, tmp_path):
    odd = tmp_path / "it's [a] *str?nge* folder"
    store.rename(odd)
    (tmp_path / "link").symlink_to(odd)
    (tmp_path / "inner").mkdir()
    for place in (odd.name, "link", f"./{odd.name}", f"inner/../{odd.name}", odd):
        assert len(query(place, "FROM evals")) == 6
    os.chdir(odd)
    assert len(query(".", "FROM evals")) == 6


def test_columns_that_share_a_name_are_numbered(store):
    twice = query(store, "SELECT e.success, f.success FROM evals e JOIN evals f USING (run_id)")
    assert list(twice.columns) == ["success", "success_1"]
    assert len(twice) == 18
    assert list(query(store, "SELECT 1 a, 2 a, 3 a_1, 4 a").columns) == ["a", "a_2", "a_1", "a_3"]


def test_damage_is_hinted_at_for_files_of_the_results_only(store):
    with pytest.raises(StoreError, match="no-such") as caught:
        query(store, f"SELECT * FROM '{store}/no-such.parquet'")
    assert "damaged" not in str(caught.value)
    bad = store / "bad.parquet"
    bad.write_bytes(b"PAR1")
    with pytest.raises(StoreError, match=rf"bad.parquet.*damaged, bns compact --results {store}"):
        query(store, f"SELECT * FROM '{bad}'")
    with pytest.raises(StoreError, match=r"DuckDB cannot answer .*nonsense") as caught:
        query(store, "SELECT nonsense FROM evals")
    assert "damaged" not in str(caught.value)


def test_damaged_page_is_named_and_not_read(store):
    path = next((store / "evals").rglob("*.parquet"))
    data = bytearray(path.read_bytes())
    at = pq.read_metadata(path).row_group(0).column(20).data_page_offset
    data[at : at + 20] = bytes([255]) * 20
    path.write_bytes(data)
    with pytest.warns(StoreWarning, match=f"{path.name} is skipped: it is damaged: its digest is not .* bns compact"):
        assert load(store).empty


def test_rows_are_counted_over_all_batches(store, monkeypatch):
    monkeypatch.setattr(question, "MOST_ROWS", 4000)
    monkeypatch.setattr(question, "_ROWS_AT_ONCE", 2048)
    assert len(query(store, "SELECT * FROM range(3900)")) == 3900
    with pytest.raises(StoreError, match="more than 2048 rows; 4000 rows"):
        query(store, "SELECT * FROM range(6000)")


def test_bytes_are_counted_over_all_batches(store, monkeypatch):
    """A whole number takes eight bytes and a bit: a MiB holds 129,055 of them."""
    monkeypatch.setattr(question, "MOST_BYTES", 1 << 20)
    assert len(query(store, "SELECT * FROM range(120000)")) == 120000
    with pytest.raises(StoreError, match=r"more than 12\d{4} rows; 5000000 rows or 1 MiB are fetched"):
        query(store, "SELECT * FROM range(140000)")


@pytest.mark.parametrize(("memory_mib", "said"), [(4096, "2.0 GiB"), (300, "256.0 MiB")])
def test_a_question_works_with_half_of_the_memory_and_no_less_than_it_needs(store, monkeypatch, memory_mib, said):
    pages = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": memory_mib << 8}
    monkeypatch.setattr(question.os, "sysconf", pages.__getitem__)
    assert query(store, "SELECT current_setting('memory_limit') AS most")["most"].tolist() == [said]
