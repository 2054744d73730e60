"""Where a result cannot be written is found before it is worked out, and looking there leaves nothing behind."""

import errno
import tempfile

import pytest

import bns
from bns.cli.main import main
from bns.errors import BnsError
from bns.targets import obstacle


def test_a_place_is_refused_with_its_reason_and_left_as_it_was(tmp_path, monkeypatch):
    (tmp_path / "there.csv").write_text("old")
    assert obstacle(tmp_path / "new.csv") == obstacle(tmp_path / "there.csv") == ""
    assert [path.name for path in tmp_path.iterdir()] == ["there.csv"]
    assert (tmp_path / "there.csv").read_text() == "old"
    assert obstacle(tmp_path) == "it is a folder"
    assert obstacle(tmp_path / "none" / "new.csv") == f"there is no folder {tmp_path / 'none'}"

    def read_only(**_):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(tempfile, "TemporaryFile", read_only)
    assert obstacle(tmp_path / "new.csv") == f"no file can be made in {tmp_path} (Read-only file system)"


@pytest.mark.parametrize(
    "words",
    [
        ["diagnose", "LOG", "--model", "khepera", "-o", "none/x.yaml"],
        ["add", "LOG", "motor-lag", "--model", "khepera", "-o", "none/x.yaml"],
        ["propose", "LOG", "--model", "khepera", "-o", "none/x.csv"],
        ["report", "LOG", "--model", "khepera", "-o", "none/x.html"],
        ["import", "LOG", "-o", "none/x.csv"],
        ["run", "--measurements", "none/x.csv"],
    ],
)
def test_commands_refuse_a_place_before_they_read_or_run_anything(words, tmp_path, monkeypatch, capsys):
    """The log is missing, too; had it been looked for first, the message would be about it."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "there is no folder none; choose another place." in said
    assert not list(tmp_path.iterdir())


def test_so_does_python(tmp_path):
    with pytest.raises(BnsError, match=r"Measurements cannot be written to .*: there is no folder"):
        bns.run(evaluations=1, measurements=tmp_path / "none" / "x.csv")
