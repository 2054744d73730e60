"""Faults that a user's machine brings: each ends in a sentence, not in a traceback."""

import io
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from bns.cli.main import main
from bns.cli.streams import usable_streams
from bns.engine import jit
from bns.engine.evolution import tournament_cdf
from bns.engine.philox import Key
from bns.robots import load_robot

QUICK = ["--evaluations", "1", "--population-size", "8", "--training-iterations-per-evaluation", "1",
         "--generations-per-evaluation", "1"]  # fmt: skip


@pytest.mark.parametrize("target", ["/proc/nowhere/nets.safetensors", "."])
def test_place_for_networks_is_tried_before_the_run(target, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["run", *QUICK, "--save-snn", target]) == 2
    assert re.search(r"cannot (make the folder of|write) .*; choose another file", capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []


def test_precompute_into_a_place_that_is_a_file(tmp_path, monkeypatch, capsys):
    from bns.static_simulator import train as precompute

    monkeypatch.setattr(precompute, "ROUNDS", 1)
    monkeypatch.setattr(precompute, "ITERATIONS", 1)
    monkeypatch.setattr(precompute, "TRIALS", 20)
    (tmp_path / "file").write_text("")
    assert main(["precompute", "-o", str(tmp_path / "file" / "x.safetensors")]) == 2
    assert "choose another file" in capsys.readouterr().err


def test_tournament_table_of_a_large_population_needs_no_square_of_it():
    cdf = tournament_cdf(1_000_000, 0.5)
    assert cdf[0] == pytest.approx(0.5)
    assert (np.diff(cdf) >= 0).all()
    assert cdf[-1] == 1.0


def test_longer_shortest_list_begins_longer():
    lengths = load_robot("khepera").initial_population(Key(1, 1), 50, 20, 100).lengths
    assert set(lengths) == {20}


def test_kernels_are_cached_elsewhere_when_the_package_cannot_be_written(tmp_path, monkeypatch):
    monkeypatch.setattr(jit.os, "access", lambda place, mode: str(place).startswith(str(tmp_path)))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert jit.cache_folder().parent == tmp_path / "cache" / "bns"
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nowhere")
    assert jit.cache_folder().parent.parent == Path(tempfile.gettempdir())


@pytest.mark.parametrize("streams", [">&-", "2>&-", ">/dev/full"])
def test_closed_or_full_streams_are_no_traceback(streams, tmp_path):
    assert main(["run", *QUICK, "--results", str(tmp_path)]) == 0
    command = f"{sys.executable} -m bns status --results {tmp_path} {streams}"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == (2 if "full" in streams else 0)
    assert "Traceback" not in done.stderr


class Narrow(io.RawIOBase):
    """Takes four bytes at a time."""

    def __init__(self):
        self.taken = b""

    def writable(self):
        return True

    def write(self, data):
        self.taken += bytes(data[:4])
        return min(len(data), 4)


def test_output_that_is_taken_in_parts_is_written_whole_without_a_buffer_too(monkeypatch):
    narrow = Narrow()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(narrow, "utf-8", write_through=True))
    sys.stdout.write("0123456789\n")
    assert narrow.taken == b"0123"  # Python's own way, with PYTHONUNBUFFERED=1
    narrow.taken = b""
    usable_streams()
    print("0123456789", flush=True)
    assert narrow.taken == b"0123456789\n"


def test_pages_outside_of_the_site_link_to_what_exists():
    """Those inside are checked when the site is built, strictly (tests/test_site.py)."""
    root = Path(__file__).resolve().parent.parent
    for page in [root / "README.md", root / "CONTRIBUTING.md"]:
        text = page.read_text()
        for link in re.findall(r"\]\(([^)]+)\)", text):
            path, _, anchor = link.partition("#")
            target = (page.parent / path) if path else page
            assert target.exists(), f"{page.name}: {link}"
            if anchor:
                titles = re.findall(r"^#+ (.+)$", target.read_text(), re.MULTILINE)
                assert anchor in {re.sub(r"[^a-z0-9 -]", "", t.lower()).replace(" ", "-") for t in titles}, link
