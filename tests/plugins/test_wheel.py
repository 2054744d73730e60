"""The package of docs/extending.md as `pip install .` has it: its YAML files are in it, not only beside an editable one."""

import subprocess
import sys
import zipfile

from tests.plugins.package import blocks


def test_a_wheel_of_the_pages_package_holds_every_file_of_it(tmp_path):
    for name, content in blocks().items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(content)
    (tmp_path / "rover_parts" / "__init__.py").write_text("")
    words = ["wheel", "--quiet", "--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", "made", "."]
    subprocess.run([sys.executable, "-m", "pip", *words], cwd=tmp_path, check=True, capture_output=True)
    [wheel] = (tmp_path / "made").glob("*.whl")
    assert set(blocks()) - {"pyproject.toml"} <= set(zipfile.ZipFile(wheel).namelist())
