"""`bns example` and `bns example --robot` leave a whole folder, or none that is half filled."""

import errno
import os
import shutil

import pytest

from bns import examples
from bns.errors import BnsError
from bns.examples import copy_example, copy_robot


@pytest.mark.parametrize("copied", [copy_example, copy_robot])
def test_a_full_disk_leaves_an_empty_folder_and_names_it(tmp_path, monkeypatch, copied):
    left, usual = [2], shutil.copy

    def copy(source, to):
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(source))
        left[0] -= 1
        return usual(source, to)

    monkeypatch.setattr(examples.shutil, "copy", copy)
    with pytest.raises(BnsError, match=r"^cannot write into .*mine: No space left on device\. Make room there") as said:
        copied(tmp_path / "mine")
    assert said.value.exit_code == 2
    assert list((tmp_path / "mine").iterdir()) == []
    monkeypatch.setattr(examples.shutil, "copy", usual)
    assert copied(tmp_path / "mine")[0].name == "README.md"


def test_the_package_of_a_robot_is_whole(tmp_path):
    made = {file.relative_to(tmp_path / "mine") for file in copy_robot(tmp_path / "mine")}
    there = {file.relative_to(examples.ROBOT) for file in examples.ROBOT.rglob("*") if file.is_file()}
    assert made == {file for file in there if "__pycache__" not in file.parts}
    assert any(len(file.parts) > 1 for file in made)
