"""What an installation without extras, or a system that is not POSIX, gives: an explanation, never a traceback."""

import subprocess
import sys

import pytest

from bns.errors import BnsError
from bns.examples import FOLDER
from bns.extras import LIBRARIES, MissingExtraError, extra

LOG = str(FOLDER / "khepera-log.csv")
POSIX = ("fcntl", "termios", "pty", "resource", "grp", "pwd", "tty")
BLOCKED = """
import sys
for name in {blocked!r}:
    sys.modules[name] = None
from bns.cli.main import main
sys.exit(sum(main(arguments) for arguments in {commands!r}))
"""
IMPORT_ALL = """
import builtins, importlib, pkgutil, signal, warnings
import bns
really = builtins.__import__

def guarded(name, globals=None, *rest, **named):
    importer = (globals or {{}}).get("__name__", "")
    if name in {blocked!r} and importer.split(".")[0] == "bns":
        raise ModuleNotFoundError("No module named " + name, name=name)
    return really(name, globals, *rest, **named)

builtins.__import__ = guarded
for name in ("SIGUSR1", "SIGUSR2", "SIGALRM", "SIGHUP"):
    delattr(signal, name)
imported = 0
for module in pkgutil.walk_packages(bns.__path__, "bns."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
        imported += 1
from bns.store.disk import shared
from bns.hardware.link.terminal_error import TerminalError
assert shared.fcntl is None and TerminalError is OSError, "the block has no effect"
print(imported)
"""


def carried_out(code):
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=600, check=False)


@pytest.mark.slow
def test_every_module_is_imported_where_nothing_of_posix_is_there():
    done = carried_out(IMPORT_ALL.format(blocked=POSIX))
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100


MISSING = {
    "mujoco": ("snake", ["run", "--robot", "snake", "--world", "physics", "--evaluations", "1"]),
    "imageio_ffmpeg": ("snake", ["run", "--robot", "snake", "--world", "physics", "--render", "film.mp4"]),
    "cv2": ("robot", ["calibrate", "--print-board", "board.png"]),
    "dynamixel_sdk": ("robot", ["trial", "--robot", "snake", "--emulated", "--yes"]),
    "serial": ("robot", ["doctor"]),
    "distributed": ("cluster", ["sweep", "khepera-small", "--executor", "dask", "--dry-run"]),
    "panel": ("app", ["explore", "--no-browser"]),
    "submitit": ("cluster", ["sweep", "khepera-small", "--executor", "slurm", "--dry-run"]),
}
ONE_BY_ONE = """
import sys
from bns.cli.main import main
for library, (_, arguments) in {missing!r}.items():
    before = sys.modules.pop(library, None)
    sys.modules[library] = None
    print(library, main(arguments), file=sys.stderr)
    sys.modules.pop(library)
    if before is not None:
        sys.modules[library] = before
"""


@pytest.mark.slow
def test_a_library_that_is_missing_is_named_with_its_extra(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = carried_out(ONE_BY_ONE.format(missing=MISSING))
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    said = done.stderr.splitlines()
    for library, (name, _) in MISSING.items():
        [place] = [number for number, line in enumerate(said) if line == f"{library} 2"]
        assert f"needs the library {library}, which is not installed" in said[place - 1]
        assert f"pip install 'bns[{name}]'" in said[place - 1]
    assert list(tmp_path.iterdir()) == []


def test_networks_as_torch_modules_say_what_to_install(monkeypatch):
    from bns.robots.simulator import load_static_simulator, to_torch

    saved = load_static_simulator("khepera")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingExtraError, match=r"library torch.*pip install 'bns\[torch\]'"):
        to_torch(saved.networks, saved.weights)


@pytest.mark.slow
def test_the_core_needs_no_extra(tmp_path):
    """Runs of both robots, with every library of every extra away."""
    everything = [library for libraries in LIBRARIES.values() for library in libraries]
    quick = ["--evaluations", "1", "--population-size", "8", "--training-iterations-per-evaluation", "1"]
    arguments = ["run", *quick, "--results", str(tmp_path), "--save-snn", str(tmp_path / "nets.safetensors")]
    snake = ["run", "--robot", "snake", *quick, "--results", str(tmp_path)]
    done = carried_out(BLOCKED.format(blocked=everything, commands=[arguments, snake]))
    assert done.returncode == 0, done.stderr


AWAY = """
import sys

class Away:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {blocked!r}:
            raise ModuleNotFoundError("No module named " + name, name=name)

sys.meta_path.insert(0, Away())
from bns.cli.main import main
for arguments in {commands!r}:
    if code := main(arguments):
        sys.exit(code)
"""
DIAGNOSIS = {
    "compare": [],
    "diagnose": [],
    "propose": ["--minutes", "1", "-o", "next.csv"],
    "report": ["--minutes", "1", "-o", "report.html"],
}


def of_the_sample_log(command, model="khepera"):
    return [command, LOG, "--model", model, *DIAGNOSIS[command]]


def without_extras(tmp_path, monkeypatch, *commands):
    monkeypatch.chdir(tmp_path)
    everything = {library for libraries in LIBRARIES.values() for library in libraries}
    return carried_out(AWAY.format(blocked=everything, commands=[list(command) for command in commands]))


@pytest.mark.slow
def test_a_comparison_needs_no_extra_and_that_of_a_body_names_it(tmp_path, monkeypatch):
    done = without_extras(tmp_path, monkeypatch, of_the_sample_log("compare"), of_the_sample_log("compare", "snake"))
    assert "error of predictions" in done.stdout
    assert done.returncode == 2
    assert "pip install 'bns[snake]'" in done.stderr


@pytest.mark.slow
def test_a_diagnosis_needs_no_extra(tmp_path, monkeypatch):
    """All that the first minutes ask of an installation without extras."""
    add = ["add", LOG, "motor-lag", "--model", "khepera", "-o", "extended.yaml"]
    done = without_extras(tmp_path, monkeypatch, *map(of_the_sample_log, ("diagnose", "propose", "report")), add)
    assert done.returncode == 0, done.stderr
    assert "Missing from the model: motor-lag" in done.stdout
    assert {"next.csv", "report.html", "extended.yaml"} <= {path.name for path in tmp_path.iterdir()}


def test_only_a_library_of_that_extra_is_explained():
    with pytest.raises(ModuleNotFoundError, match="no_such_thing"), extra("snake"):
        import no_such_thing  # noqa: F401
    assert issubclass(MissingExtraError, BnsError)
