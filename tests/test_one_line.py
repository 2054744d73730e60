"""Interrupts, killed helpers and narrow encodings end in a line, not in a traceback."""

import io
import os
import subprocess
import sys
import tempfile
import warnings

import pytest

import bns.__main__ as entry
from bns.cli import streams
from bns.engine import jit
from bns.errors import ClusterError
from bns.sweep.jobs import trackers


class RaisesAtImport:
    def __init__(self, error):
        self.error = error

    def find_spec(self, name, _path=None, _target=None):
        if name == "bns.cli.main":
            raise self.error


@pytest.mark.parametrize("hidden", [False, True])
def test_an_interrupt_during_imports_is_one_line(monkeypatch, capsys, hidden):
    error = KeyboardInterrupt()
    if hidden:
        error = ImportError("numpy.core.multiarray failed to import")
        error.__context__ = KeyboardInterrupt()
    monkeypatch.delitem(sys.modules, "bns.cli.main", raising=False)
    monkeypatch.setattr(sys, "meta_path", [RaisesAtImport(error), *sys.meta_path])
    assert entry.main() == 130
    assert capsys.readouterr().err == "bns: interrupted\n"


def test_an_import_that_fails_by_itself_is_not_called_an_interrupt(monkeypatch):
    monkeypatch.delitem(sys.modules, "bns.cli.main", raising=False)
    monkeypatch.setattr(sys, "meta_path", [RaisesAtImport(ImportError("no such thing")), *sys.meta_path])
    with pytest.raises(ImportError, match="no such thing"):
        entry.main()


@pytest.mark.parametrize("encoding", ["ascii", "latin-1", "utf-8"])
def test_signs_that_an_encoding_lacks_are_spelt(monkeypatch, encoding):
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding, write_through=True) for _ in range(2))
    monkeypatch.setattr(sys, "stdout", out)
    monkeypatch.setattr(sys, "stderr", err)
    streams.usable_streams()
    print("1.5 ± 0.2 µm, 90°, Köln, σ → ☃")
    written = out.buffer.getvalue().decode(encoding)
    plain = {"ascii": "1.5 +/- 0.2 um, 90 deg, Ko?ln, sigma -> ?\n", "latin-1": "1.5 ± 0.2 µm, 90°, Köln, sigma -> ?\n"}
    assert written == plain.get(encoding, "1.5 ± 0.2 µm, 90°, Köln, σ → ☃\n")


def test_a_command_prints_on_an_ascii_stream(bns):
    done = bns("effects", PYTHONIOENCODING="ascii")
    assert done.returncode == 0
    assert "v*omega" in done.stdout


def test_a_killed_tracker_of_shared_names_says_nothing(tmp_path):
    script = """
import os, signal, sys, time
from joblib.externals.loky.backend import resource_tracker as of_loky
from bns.sweep.jobs.workers import LokyExecutor
def main():
    with LokyExecutor(1, abs) as pool:
        pool.submit(-3)
        time.sleep(0.5)
        os.kill(of_loky._resource_tracker._pid, signal.SIGKILL)
        time.sleep(0.2)
        pool._slots[0].future.result()
    print("done")
if __name__ == "__main__":
    main()
"""
    (tmp_path / "sweep.py").write_text(script)
    done = subprocess.run([sys.executable, tmp_path / "sweep.py"], capture_output=True, text=True, timeout=600, check=False)
    assert done.stdout == "done\n", done.stderr
    assert done.stderr == ""


def test_the_error_stream_is_back_after_a_tracker_has_started(capfd):
    with trackers._no_errors():
        os.write(2, b"lost")
    os.write(2, b"kept")
    assert capfd.readouterr().err == "kept"


def test_workers_that_die_before_they_begin_are_tried_again_and_named(monkeypatch):
    dask_link = pytest.importorskip("bns.sweep.jobs.dask_link")
    tried = []

    def cluster(**options):
        tried.append(options)
        if len(tried) in (1, 3, 4):
            raise RuntimeError("Nanny failed to start.") from RuntimeError("the worker was killed")
        return "a cluster"

    monkeypatch.setattr(dask_link, "LocalCluster", cluster)
    assert dask_link._own_cluster(2) == "a cluster"
    with pytest.raises(ClusterError, match=r"2 Dask workers could not .* Nanny failed to start\.; the worker was killed"):
        dask_link._own_cluster(2)
    assert len(tried) == 4


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The temporary folder is this one, and kernels can be kept nowhere else; who runs this is user 4242."""
    monkeypatch.setattr(jit.os, "access", lambda _place, _mode: False)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    return tmp_path / f"bns-{os.getuid()}"


def test_kernels_in_the_temporary_folder_are_this_users_alone(temporary):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        folder = jit.cache_folder()
    assert folder.parent == temporary
    assert temporary.stat().st_mode & 0o077 == 0
    assert "NUMBA_CACHE_DIR" not in os.environ


@pytest.mark.parametrize("how", ["writable", "link", "foreign", "file"])
def test_kernels_of_somebody_else_are_not_run(temporary, tmp_path, monkeypatch, how):
    if how == "file":
        temporary.write_text("")
    elif how == "link":
        (tmp_path / "theirs").mkdir(mode=0o700)
        temporary.symlink_to(tmp_path / "theirs")
    else:
        temporary.mkdir(mode=0o700)
    if how == "writable":
        temporary.chmod(0o777)
    if how == "foreign":
        uid = os.getuid()
        monkeypatch.setattr(jit.os, "getuid", lambda: 4242)
        temporary.rename(tmp_path / "bns-4242")
        temporary = tmp_path / "bns-4242"
        assert temporary.stat().st_uid == uid
    with pytest.warns(UserWarning, match="is not this user's own folder"):
        folder = jit.cache_folder()
    assert temporary not in folder.parents
    assert tmp_path / "theirs" not in folder.parents
    assert folder.parent.stat().st_mode & 0o077 == 0
    assert os.environ.pop("NUMBA_CACHE_DIR") == str(folder)  # for the processes that are started from here


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="there are no pseudo-terminals here")
@pytest.mark.parametrize("code", [3, 4])
def test_a_terminal_that_was_closed_leaves_the_exit_code_as_it_is(code):
    """A trial whose terminal goes tells by it whether its robot stands, and nobody reads what it says."""
    master, slave = os.openpty()
    program = (
        "import os, signal, sys, time; signal.signal(signal.SIGHUP, signal.SIG_IGN)\n"
        "from bns.cli import main as cli; from bns.errors import BnsError\n"
        f"BnsError.exit_code = {code}\n"
        "def ends(options):\n"
        "    print('ready', flush=True)\n"
        "    while os.isatty(1): time.sleep(0.01)\n"
        "    print('out'); print('err', file=sys.stderr)\n"
        "    raise BnsError('the end')\n"
        "cli.take_trust = ends\n"
        "sys.exit(cli.main(['status']))\n"
    )
    with subprocess.Popen([sys.executable, "-c", program], stdin=slave, stdout=slave, stderr=slave) as process:
        os.close(slave)
        said = b""
        while b"ready" not in said:
            said += os.read(master, 4096)
        os.close(master)
        assert process.wait(60) == code
