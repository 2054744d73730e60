"""Which folds a compaction puts together, and a share of a lock that nobody has taken."""

import os
from types import SimpleNamespace

import pytest

from bns.store.disk.shared import SharedLock
from bns.store.write import merge


def folds(*sizes, must_go=False):
    return [SimpleNamespace(kept=range(n), whole=True, must_go=must_go, old_files=()) for n in sizes]


@pytest.mark.parametrize(
    ("sizes", "groups"),
    [
        ((4, 4, 4), [[4, 4, 4]]),
        ((10, 4, 4), [[4, 4]]),  # a fold that is large enough stays as it is
        ((6, 6, 6, 6, 3), [[6, 6], [6, 6, 3]]),  # what is too little at the end goes to those before it, if they have room
        ((6, 6, 9, 9, 3), [[6, 6], [9, 9]]),  # and no other two count: 3 and 3 would have room
    ],
)
def test_small_folds_are_put_together_up_to_a_size(monkeypatch, sizes, groups):
    monkeypatch.setattr(merge, "FEWEST_RUNS", 10)
    monkeypatch.setattr(merge, "MOST_RUNS", 20)
    assert [[len(fold.kept) for fold in group] for group in merge._groups(folds(*sizes))] == groups


def test_a_share_that_is_not_held_is_given_back_without_effect(monkeypatch, tmp_path):
    closed = []
    monkeypatch.setattr(os, "close", closed.append)
    SharedLock(tmp_path / "lock").release()
    assert not closed
