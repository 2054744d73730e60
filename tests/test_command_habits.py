"""What the command line does beside its work: help, JSON, old spellings, completion, files to begin with."""

import json
import os
import shutil
import subprocess
import sys
from argparse import Namespace
from pathlib import Path

import pandas as pd
import pytest
import yaml
from store.synthetic import record

import bns as package
from bns.cli.commands import watch as watching
from bns.cli.main import _parser, main
from bns.cli.options.option_types import as_json
from bns.diagnose.data.load import load_measured
from bns.errors import SpecError
from bns.examples import FILES
from bns.physics.effects import all_effects
from bns.plotting import scripts
from bns.spec import RunSpec
from bns.store import Writer
from bns.sweep.expand.grid import load_sweep
from tests.sample_log import LOG, WORLD, written

SWEEPS = Path(__file__).resolve().parent.parent / "sweeps"


@pytest.fixture
def results(tmp_path):
    with Writer(tmp_path, "grid") as writer:
        for seed in (0, 1):
            writer.append(record(RunSpec(seed=seed, evaluations=3)))
    return tmp_path


def answer(capsys, *arguments):
    assert main([str(one) for one in arguments]) == 0
    return json.loads(capsys.readouterr().out)


def test_bare_bns_prints_help(capsys):
    assert main([]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("usage: bns")
    assert "redraw the page of figures" in said.out
    assert said.err == ""


def test_help_loads_no_library():
    slow = {"numpy", "numba", "pandas", "scipy", "matplotlib", "duckdb", "pyarrow", "rich", "shtab", "jinja2", "sklearn"}
    code = "import sys\nfrom bns.cli.main import _parser\n_parser().format_help()\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {name.split(".")[0] for name in done.stdout.split()} & slow == set()


def test_a_run_and_a_sweep_do_not_wait_for_pandas(tmp_path):
    """It takes as long to load as all else that a worker needs together. (Where kernels have to be compiled, numba loads it.)"""
    code = "import sys, bns.sweep.runner\nfrom bns.spec import RunSpec\nfrom bns.sweep.jobs.job import run_job\n"
    code += "record = run_job(RunSpec(evaluations=1, population_size=4, generations_per_evaluation=1))\n"
    code += "assert record.run['status'] == 'ok', record.run['error']\nprint(*sys.modules)"
    for _ in range(2):  # the second time, where it is needed, kernels lie compiled on the disk
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
        loaded = set(done.stdout.split())
        if "pandas" not in loaded:
            break
    assert "numba" in loaded
    assert not {"pandas", "matplotlib"} & loaded


@pytest.mark.slow
def test_a_new_sweep_starts_its_first_run_before_it_loads_pandas(tmp_path):
    """A third of a second, which the first run would wait; it is loaded when the first result is stored."""
    spec = tmp_path / "tiny.yaml"
    spec.write_text(
        "name: tiny\nrobot: khepera\nseeds: 1\ngrid: {task: [circle]}\n"
        "fixed: {evaluations: 1, population_size: 4, generations_per_evaluation: 1}\n"
    )
    code = "import sys\nfrom bns.sweep.jobs.workers import LokyExecutor\nsubmit = LokyExecutor.submit\n"
    code += "def said(self, spec):\n    print('pandas' in sys.modules, 'numba' in sys.modules)\n    submit(self, spec)\n"
    code += "LokyExecutor.submit = said\nfrom bns.cli.main import main\n"
    code += f"main(['sweep', {str(spec)!r}, '--results', {str(tmp_path / 'results')!r}, '--jobs', '2'])"
    for _ in range(2):  # the second time kernels lie compiled on the disk
        shutil.rmtree(tmp_path / "results", ignore_errors=True)
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.split() == ["False", "True"]
    spec.write_text(spec.read_text().replace("seeds: 1", "seeds: 2"))  # one run is there, and one is left
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.split() == ["False", "True"]


def test_a_diagnosis_loads_nothing_that_only_figures_and_formulas_need():
    """Each takes half a second, of the four that a diagnosis of sixty trials takes."""
    code = "import sys, bns.api.add, bns.api.compare, bns.api.diagnose, bns.cli.commands.diagnose\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) & {"matplotlib", "sklearn", "scipy.stats", "torch"} == set()


def test_the_catalogue_is_listed_without_tables_and_special_functions():
    code = "import sys; from bns.cli.main import main; main(['effects', '--json']); print('\\n', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert set(done.stdout.splitlines()[-1].split()) & {"pandas", "scipy.special", "scipy.optimize", "torch"} == set()


def test_status_as_json(results, capsys):
    [row] = answer(capsys, "status", "--json", "--results", results)
    assert (row["sweep"], row["task"], row["done"], row["failed"], row["total"]) == ("grid", "circle", 2, 0, None)
    assert pd.Timestamp(row["last"]) == package.load(results, "runs")["started_at"].max()


def test_plan_as_json(results, capsys):
    told = answer(capsys, "plan", "khepera-small", "--json", "--results", results)
    assert [machine["name"] for machine in told["machines"]] == ["here", "laptop", "server", "cluster"]
    [sweep] = told["sweeps"]
    assert (sweep["sweep"], sweep["total"], sweep["remaining"]) == ("khepera-small", 480, 480)
    assert sweep["core_hours"] == pytest.approx(sweep["seconds_estimate"] / 3600)
    assert sweep["seconds_on"]["cluster"] < sweep["seconds_on"]["laptop"]


def test_query_as_json_and_csv(results, capsys):
    select = "SELECT seed, 0.1 + seed AS x, NULL::DOUBLE AS none, started_at FROM runs ORDER BY seed"
    rows = answer(capsys, "query", "--json", select, "--results", results)
    assert [(row["seed"], row["x"], row["none"]) for row in rows] == [(0, 0.1, None), (1, 1.1, None)]
    assert pd.Timestamp(rows[0]["started_at"]) == package.load(results, "runs")["started_at"].iloc[0]
    for more, lines in (((), ["seed", "0", "1"]), (("--no-header",), ["0", "1"])):
        assert main(["query", "--csv", *more, "SELECT seed FROM runs ORDER BY seed", "--results", str(results)]) == 0
        assert capsys.readouterr().out.split() == lines


def test_json_of_what_is_no_number():
    assert json.loads(as_json({"a": [float("nan"), pd.NaT, pd.NA, Path("x"), True]})) == {"a": [None, None, "<NA>", "x", True]}


def test_measurements_are_named_first_and_the_old_spelling_warns(capsys):
    end = ["--model", "khepera", "-o", "new.yaml"]
    now = _parser().parse_args(["add", "log.csv", "motor-lag", "turn-slip", *end])
    assert capsys.readouterr().err == ""
    for old in (["motor-lag", "turn-slip", "--data", "log.csv"], ["--data=log.csv", "motor-lag", "turn-slip"]):
        assert _parser().parse_args(["add", *old, *end]) == now
        assert "old spelling, not accepted by the next release; write bns add log.csv EFFECT" in capsys.readouterr().err
    assert (now.data, now.effects) == (Path("log.csv"), ["motor-lag", "turn-slip"])


@pytest.mark.parametrize("command", ["watch", "figures"])
def test_results_are_an_option_everywhere_and_the_old_spelling_warns(command, capsys):
    assert _parser().parse_args([command]).results == Path("results")
    now = _parser().parse_args([command, "--results", "there"])
    assert capsys.readouterr().err == ""
    assert _parser().parse_args([command, "there"]) == now
    assert now.results == Path("there")
    assert "write --results there" in capsys.readouterr().err


@pytest.mark.slow
def test_figures_are_drawn_by_their_scripts(results, capfd):
    assert main(["figures", "--results", str(results), "--only", "success-by-mutation"]) in {0, 1}
    assert f"page: {(results / 'figures' / 'index.html').absolute()}" in capfd.readouterr().out
    assert main(["figures", "--results", str(results), "--only", "sucess-by-mutation"]) == 2
    assert "Did you mean 'success-by-mutation'" in capfd.readouterr().err


def test_figures_are_looked_for_inside_the_package_first(tmp_path, monkeypatch):
    package_folder = tmp_path / "site-packages" / "bns"
    (package_folder.parent / "analysis").mkdir(parents=True)
    monkeypatch.setattr("bns.shipped.PACKAGE", package_folder)
    assert scripts.scripts() == package_folder.parent
    (package_folder / "_shipped" / "analysis").mkdir(parents=True)
    assert watching.scripts() == package_folder / "_shipped"


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion(shell, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--print-completion", shell])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert "diagnose" in text
    assert "confirm-top" in text


@pytest.mark.skipif(not Path("/bin/bash").exists(), reason="there is no bash")
def test_bash_completes_a_command_and_an_option(tmp_path):
    script = tmp_path / "bns.bash"
    with script.open("w") as file:
        subprocess.run([sys.executable, "-m", "bns", "--print-completion", "bash"], stdout=file, check=True)
    ask = (
        "source {}; complete_for() {{ COMP_WORDS=(bns \"$@\"); COMP_CWORD=$#; _shtab_bns; echo ${{COMPREPLY[@]}}; }}; "
        "complete_for diag; complete_for sweep --confirm-t"
    )
    done = subprocess.run(["/bin/bash", "-c", ask.format(script)], capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["diagnose", "--confirm-top"], done.stderr


def test_a_shipped_sweep_is_known_by_its_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shipped = load_sweep("khepera")
    assert shipped == load_sweep(SWEEPS / "khepera.yaml")
    own = (SWEEPS / "prototype.yaml").read_text().replace("name: prototype", "name: khepera")
    Path("khepera.yaml").write_text(own)
    Path("khepera").write_text(own)
    assert load_sweep("khepera") == shipped
    assert load_sweep("khepera.yaml").total == 9
    assert load_sweep("./khepera.yaml").total == 9
    with pytest.raises(SpecError, match=r"unknown sweep 'kepera'\. Did you mean 'khepera'\?.*kepera\.yaml"):
        load_sweep("kepera")


@pytest.mark.parametrize("command", ["compare", "diagnose", "add"])
def test_a_file_in_the_place_of_a_folder_for_figures_is_refused_before_anything_is_computed(command, tmp_path, capsys):
    (tmp_path / "junk.csv").write_text("")
    with pytest.raises(SystemExit) as ended:
        main([command, "no.csv", "--model", "khepera", "--figures", str(tmp_path / "junk.csv")])
    assert ended.value.code == 2
    assert "junk.csv' is a file; give a folder" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["propose", "report"])
def test_minutes_say_that_the_last_trial_is_driven_to_its_end(command, capsys):
    with pytest.raises(SystemExit):
        main([command, "--help"])
    assert "minutes of driving to plan, the last trial driven to its end" in " ".join(capsys.readouterr().out.split())


def test_effects_are_listed(capsys):
    rows = answer(capsys, "effects", "--json")
    assert [row["effect"] for row in rows] == list(all_effects())
    assert all(row["equation"] and row["parameters"] for row in rows)
    assert main(["effects"]) == 0
    said = capsys.readouterr().out
    assert "tau_s (s): time constant" in said
    assert "of bodies on joints: camera-scale" in said


def test_an_effect_is_shown_with_all_that_is_known_of_it(capsys):
    [lag] = answer(capsys, "effects", "motor-lag", "--json")
    assert lag["equation"] == all_effects()["motor-lag"].equation
    assert [one["of"] for one in answer(capsys, "effects", "floor-slope", "--json")] == ["wheels", "bodies on joints"]
    assert main(["effects", "weak-joint"]) == 0
    assert "of: bodies on joints" in capsys.readouterr().out
    assert answer(capsys, "effects", "weak-joint-elbow", "--json") == answer(capsys, "effects", "weak-joint", "--json")
    assert main(["effects", "floor-slope-elbow"]) == 2  # a floor is of no joint
    capsys.readouterr()
    assert main(["effects", "motor-lg"]) == 2
    assert "Did you mean 'motor-lag'?" in capsys.readouterr().err


def test_example_fills_a_new_folder_and_no_other(tmp_path, capsys):
    folder = tmp_path / "new" / "folder"
    assert main(["example", str(folder)]) == 0
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    assert yaml.safe_load((folder / "my-sweep.yaml").read_text())["name"] == "my-sweep"
    assert load_sweep(folder / "my-sweep.yaml").total == 12
    (folder / "khepera-log.csv").write_text("mine")
    assert main(["example", str(folder)]) == 2
    assert "is not empty, and nothing is overwritten" in capsys.readouterr().err
    assert (folder / "khepera-log.csv").read_text() == "mine"
    assert main(["example", str(folder / "khepera-log.csv")]) == 2
    assert "is a file" in capsys.readouterr().err


def test_the_sample_log_is_what_its_world_gives_and_small():
    assert LOG.read_text() == written()
    assert LOG.stat().st_size < 300_000
    measured = load_measured(LOG, None, [])
    table = WORLD.table()
    assert measured.table["trial"].nunique() == WORLD.trials
    assert measured.table["x_m"].to_numpy() == pytest.approx(table["x_m"].to_numpy(), abs=6e-5, nan_ok=True)


def test_the_commands_of_the_example_are_understood(tmp_path):
    text = (LOG.parent / "README.md").read_text()
    commands = [line.partition("#")[0].split() for line in text.splitlines() if line.startswith("bns ")]
    assert {words[1] for words in commands} >= {"compare", "diagnose", "add", "report", "sweep", "figures"}
    for words in commands:
        assert isinstance(_parser().parse_args(words[1:]), Namespace)


@pytest.mark.slow
def test_the_script_of_the_example_finds_what_is_hidden(tmp_path):
    assert main(["example", str(tmp_path)]) == 0
    done = subprocess.run(
        [sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False,
        env=os.environ | {"PYTHONPATH": str(SWEEPS.parent)},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "Missing from the model: motor-lag." in done.stdout
    [effect] = yaml.safe_load((tmp_path / "extended.yaml").read_text())["effects"][-1:]
    assert effect["values"]["tau_s"] == pytest.approx(WORLD.hidden["motor-lag"]["tau_s"], abs=0.005)
