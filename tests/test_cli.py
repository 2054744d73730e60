"""The command line as a user meets it: what it prints, where it writes, how it ends."""

import re
from argparse import SUPPRESS, ArgumentTypeError, _SubParsersAction
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import bns as package
from bns.cli.main import _parser, main
from bns.cli.options.option_types import duration, interval
from bns.cli.values import pose_of
from bns.errors import BnsError
from bns.robots.simulator import load_static_simulator
from bns.sweep.expand.grid import load_sweep
from bns.sweep.jobs.executor import SerialExecutor
from bns.sweep.runner import run_sweep

QUICK = ["--evaluations", "2", "--population-size", "20", "--generations-per-evaluation", "2",
         "--training-iterations-per-evaluation", "20"]  # fmt: skip
SWEEP = """
name: little
robot: khepera
seeds: 2
fixed: {evaluations: 2, population_size: 20, generations_per_evaluation: 1, training_iterations_per_evaluation: 10}
grid: {mutation_rate: [0.1, 0.9], task: [circle, complex]}
"""


@pytest.fixture
def sweep_file(tmp_path):
    file = tmp_path / "little.yaml"
    file.write_text(SWEEP)
    return file


def test_run_stores_rows_draws_a_path_and_saves_its_networks(tmp_path, capsys):
    asked = ["run", "--task", "infinity", "--seed", "3", *QUICK, "--results", str(tmp_path)]
    assert main([*asked, "--save-snn", str(tmp_path / "n.safetensors")]) == 0
    done = capsys.readouterr()
    assert done.err == ""
    evals = package.load(tmp_path)
    assert list(evals["evaluation"]) == [1, 2]
    assert {
        "run_id",
        "diversity",
        "fitness_error",
        "success_7cm",
        "success_10cm",
        "success_14cm",
        "success_20cm",
    } <= set(evals)
    assert set(evals["task"]) == {"infinity"}
    figure = re.search(r"path: (\S+\.png)", done.out).group(1)
    assert Path(figure).read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "n.safetensors").is_file()


def test_two_runs_by_hand_of_one_spec_count_once(tmp_path, capsys):
    for _ in range(2):
        assert main(["run", *QUICK, "--results", str(tmp_path)]) == 0
    assert len(package.load(tmp_path)) == 2
    assert len(package.load(tmp_path, "runs")) == 1


def test_a_run_by_hand_is_refused_beside_runs_of_another_simulator(tmp_path, capsys, monkeypatch):
    assert main(["run", *QUICK, "--results", str(tmp_path)]) == 0
    before = package.load(tmp_path)
    static = load_static_simulator("khepera")
    changed = replace(static, weights=static.weights * np.float32(1.01))
    monkeypatch.setattr("bns.worlds.substitute.load_static_simulator", lambda _robot: changed)
    capsys.readouterr()
    assert main(["run", *QUICK, "--results", str(tmp_path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert re.search(rf"made with world {static.digest} .* now one with world {changed.digest}", captured.err)
    pd.testing.assert_frame_equal(package.load(tmp_path), before)
    for elsewhere in (["--world", "physics"], ["--task", "complex"]):  # nothing there to be mixed with
        assert main(["run", *QUICK, *elsewhere, "--results", str(tmp_path)]) == 0


def test_physics_world_answers_otherwise_than_the_substitute(tmp_path):
    for world in ("substitute", "physics"):
        assert main(["run", *QUICK, "--world", world, "--results", str(tmp_path)]) == 0
    fitness = package.load(tmp_path).pivot_table(index="evaluation", columns="world", values="evaluated_fitness_world")
    assert (fitness["physics"] != fitness["substitute"]).all()


def test_sweep_status_query_compact(tmp_path, sweep_file, capsys):
    results = tmp_path / "results"
    assert main(["sweep", str(sweep_file), "--dry-run", "--results", str(results)]) == 0
    assert "little: 8 runs, 0 done, 8 to do" in capsys.readouterr().out
    assert not results.exists(), "a dry run writes nothing"
    assert main(["sweep", str(sweep_file), "--jobs", "1", "--results", str(results)]) == 0
    assert "8 runs now, 8 of 8 done" in capsys.readouterr().err
    assert main(["sweep", str(sweep_file), "--jobs", "1", "--results", str(results)]) == 0
    assert "0 runs now, 8 of 8 done" in capsys.readouterr().err
    assert main(["status", "--results", str(results)]) == 0
    assert re.search(r"little\s+circle\s+4\s+4\s+0\s+0", capsys.readouterr().out)
    assert (
        main(["query", "--csv", "SELECT count(*) AS n, count(DISTINCT run_id) AS runs FROM evals", "--results", str(results)])
        == 0
    )
    assert capsys.readouterr().out == "n,runs\n16,8\n"
    before = package.load(results)
    assert main(["compact", "--results", str(results)]) == 0
    pd.testing.assert_frame_equal(package.load(results), before)


@pytest.mark.slow
def test_one_and_two_jobs_and_a_resumed_sweep_give_the_same_rows(tmp_path, sweep_file):
    frames = []
    part = run_sweep(load_sweep(sweep_file), tmp_path / "resumed", limit=3, executor=SerialExecutor())
    assert 0 < part.done < part.total
    assert len(package.load(tmp_path / "resumed", "runs")) == part.done
    for name, jobs in {"one": "1", "two": "2", "resumed": "2"}.items():
        assert main(["sweep", str(sweep_file), "--jobs", jobs, "--results", str(tmp_path / name)]) == 0
        evals = package.load(tmp_path / name)
        frames.append(evals[[c for c in evals if not c.endswith("_s")]])
    pd.testing.assert_frame_equal(frames[0], frames[1])
    pd.testing.assert_frame_equal(frames[0], frames[2])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "--task", "cirle"], r"robot khepera: unknown task 'cirle'\. Did you mean 'circle'\?"),
        (["run", "--robot", "kepera"], r"unknown robot 'kepera'\. Did you mean 'khepera'\?"),
        (["sweep", "nowhere.yaml"], r"nowhere\.yaml"),
        (["status", "--results", "nowhere"], r"bns sweep khepera-small"),
        (["query", "SELECT 1", "--results", "nowhere"], r"bns sweep"),
        (["precompute", "--robot", "kepera"], r"unknown robot"),
        (["sweep", "khepera-small", "--scheduler", "tcp://10.0.0.1:1"], r"--scheduler: only with --executor dask\. Give"),
        (["sweep", "khepera-small", "--executor", "dask", "--wait"], r"--wait: only with --executor slurm"),
        (
            ["sweep", "khepera-small", "--try-locally", "--time-limit", "4h", "--slurm", "a=b", "--shards", "3"],
            r"--shards and --time-limit and --slurm and --try-locally: only with --executor slurm",
        ),
        (["query", "SELECT 1", "--json", "--csv"], r"--json and --csv exclude each other"),
        (["query", "SELECT 1", "--no-header"], r"--no-header: only with --csv"),
    ],
)
def test_bad_input_is_named_and_ends_with_2(arguments, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert re.search(message, captured.err), captured.err
    assert captured.out == ""
    assert list(tmp_path.iterdir()) == [], "nothing is half-written"


@pytest.mark.parametrize("world", ["nowhere.yaml", "physics>nowhere.yaml@3", "broken.yaml"])
@pytest.mark.parametrize("more", [[], ["--dry-run"]])
def test_a_sweep_in_a_model_file_that_is_missing_or_none_writes_nothing(tmp_path, monkeypatch, capsys, world, more):
    monkeypatch.chdir(tmp_path)
    Path("broken.yaml").write_text("wheelbase_m: wide\n")
    Path("s.yaml").write_text(f"name: s\nrobot: khepera\nseeds: 2\nfixed: {{evaluations: 5, world: '{world}'}}\n")
    assert main(["sweep", "s.yaml", "--results", "r", "--jobs", "1", *more]) == 2
    said = capsys.readouterr()
    assert re.search(r"There is no model file nowhere\.yaml|model broken lacks base", said.err), said.err
    assert (said.out, Path("r").exists()) == ("", False)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["run", "--mutation-rate", "30"], r"For 30 percent write 0\.3"),
        (
            ["run", "--mutation-rte", "0.3"],
            r"^bns: there is no option --mutation-rte\. Did you mean --mutation-rate\? All options: bns run --help\n$",
        ),
        (["run", "--population-size", "many"], r"population_size is 'many'; it must be a whole number"),
        (["sweep", "x.yaml", "--budget", "soon"], r"'soon' is not a time; write 90s, 10m or 1h30m"),
        (["sweep", "x.yaml", "--jobs", "0"], r"whole number of 1 or more"),
        (["run", "--pop", "20"], r"there is no option --pop\. Did you mean --population-size\?"),
        (["run", "circle"], r"^bns: circle: unexpected argument\. All options: bns run --help\n$"),
        (["status", "old"], r"^bns: old: unexpected argument\. Did you mean --results old\? All options: bns status --help\n$"),
        (["diagnose", "log.csv", "--model", "khepera", "--wheelbase", "0,0884"], r"'0,0884' is not a number; .* such as 0\.0884"),
        (["swep", "x.yaml"], r"^bns: there is no command swep\. Did you mean sweep\? .*; its options: bns sweep --help\n$"),
        (["--jsn", "status"], r"there is no option --jsn"),
        (["diagnose", "log.csv", "--modl", "khepera"], r"Did you mean --model\? All options: bns diagnose --help\n$"),
        (["query", "--cvs", "SELECT 1 -- of all"], r"there is no option --cvs\. Did you mean --csv\?"),
        (["status", "--qqqq"], r"there is no option --qqqq\. All"),
        (
            ["add", "log.csv", "drag", "--model", "khepera", "--term", "-u*k"],
            r"expected one argument\. A value that begins with \"-\" is written --term=VALUE, without a space\. All options",
        ),
        (["diagnose"], r"^bns: missing: LOG, --model\. Needed: bns diagnose LOG --model MODEL\. All options: bns diagnose --h"),
        (["add", "log.csv"], r"Needed: bns add LOG EFFECT --output NEW\.yaml --model MODEL\."),
    ],
)
def test_bad_options_end_with_2(arguments, message, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert re.search(message, capsys.readouterr().err)


def commands():
    """The parsers by the names of their commands."""
    (below,) = (action for action in _parser()._actions if isinstance(action, _SubParsersAction))
    return below.choices


@pytest.mark.parametrize(
    "option", ["--also", "--model", "--wheelbase", "--more", "--without", "--trust", "--trust-file", "--robot"]
)
def test_an_option_is_written_and_means_the_same_in_every_command(option):
    said = {}
    for name, command in commands().items():
        for action in command._actions:
            if option in action.option_strings and action.help != SUPPRESS and name != "calibrate-body":
                said.setdefault(action.metavar, set()).add(action.help)
    (texts,) = said.values()  # one word for one thing
    if option not in {"--model", "--robot"}:  # these may have a default, and mean a robot of another kind
        assert len(texts) == 1
    else:
        assert option == "--robot" or len({text.partition("; or networks")[0] for text in texts}) == 1


def test_every_command_calls_a_log_a_log():
    named = {a.metavar for command in commands().values() for a in command._actions if a.dest in {"data", "log", "logs"}}
    assert named == {"LOG"}


def test_what_also_meant_before_is_understood_with_a_warning(capsys):
    for asked in (["compare", "log.csv"], ["add", "log.csv", "motor-lag", "-o", "new.yaml"]):
        options = _parser().parse_args([*asked, "--model", "khepera", "--also", "mine.py"])
        assert options.trust_file == ["mine.py"]
        said = capsys.readouterr().err
        assert said.startswith(f"bns: warning: bns {asked[0]} … --also mine.py is an old spelling")
        assert said.endswith("write --trust-file mine.py\n")
        assert said.count("\n") == 1


@pytest.mark.parametrize(("text", "seconds"), [("90", 90), ("90s", 90), ("10m", 600), ("1h30m", 5400), ("0.5h", 1800)])
def test_times(text, seconds):
    assert duration(text) == seconds


def test_query_says_what_duckdb_says(tmp_path, capsys):
    assert main(["run", *QUICK, "--results", str(tmp_path)]) == 0
    assert main(["query", "SELECT sucess_7cm FROM evals", "--results", str(tmp_path)]) == 2
    assert "success_7cm" in capsys.readouterr().err


def test_output_into_a_closed_pipe_is_no_fault(tmp_path, bns):
    assert main(["run", *QUICK, "--results", str(tmp_path)]) == 0
    import subprocess
    import sys

    shell = f"{sys.executable} -m bns query --csv --no-header 'SELECT i FROM range(200000) t(i)' --results {tmp_path} | head -1"
    done = subprocess.run(["bash", "-c", shell], capture_output=True, text=True, timeout=600, check=False)
    assert done.stdout == "0\n"
    assert done.stderr == ""
    closed = f"{sys.executable} -m bns --print-completion bash | true"
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {closed}"], capture_output=True, text=True, timeout=600, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_error_ends_with_2():
    assert BnsError.exit_code == 2


def test_a_look_every_second_is_the_most_frequent():
    assert interval("1s") == 1.0
    with pytest.raises(ArgumentTypeError, match="look every 1s or less often"):
        interval("0.9s")


def test_a_pose_is_two_metres_and_degrees():
    assert pose_of("1,-2,90") == pytest.approx((1.0, -2.0, np.pi / 2))


def test_a_gpu_has_no_worker_processes_of_its_own(tmp_path, sweep_file, capsys):
    asked = ["sweep", str(sweep_file), "--device", "cuda", "--results", str(tmp_path / "r")]
    assert main([*asked, "--jobs", "2"]) == 2
    assert "--device cuda is the GPU of this machine, and --jobs distributes runs over cores" in capsys.readouterr().err
    assert main([*asked, "--executor", "joblib"]) == 2
    assert "and --executor joblib distributes runs over cores" in capsys.readouterr().err
    assert not (tmp_path / "r").exists()


@pytest.mark.filterwarnings("default::bns.store.StoreWarning")
def test_a_warning_is_printed_once_a_command(tmp_path, sweep_file, capsys):
    run_sweep(load_sweep(sweep_file), tmp_path, executor=SerialExecutor())
    for part in (tmp_path / "evals").rglob("*.parquet"):
        part.write_bytes(part.read_bytes()[:-9])
    for _ in range(2):
        capsys.readouterr()
        assert main(["status", "--results", str(tmp_path)]) == 0
        said = [line for line in capsys.readouterr().err.splitlines() if line.startswith("bns: warning: ")]
        assert said
        assert len(said) == len(set(said))


@pytest.mark.parametrize("given", [["nowhere"], ["--results", "nowhere"]])
def test_archive_takes_its_folder_either_way(given, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["archive", *given, "-o", "x.parquet"]) == 2
    assert "no results in nowhere" in capsys.readouterr().err


def test_a_dry_run_that_compiles_says_so_off_a_terminal(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("bns.engine.jit.compiled", lambda *_: False)
    sweep = tmp_path / "s.yaml"
    sweep.write_text("name: s\nrobot: khepera\nseeds: 1\nfixed: {evaluations: 2}\n")
    main(["sweep", str(sweep), "--dry-run", "--results", str(tmp_path / "r")])
    assert capsys.readouterr().err.count("compiling the kernels") == 1
