"""What a researcher types after ``import bns``: it works, says what it is in a line, and agrees with the command line."""

import copy
import importlib
import inspect
import json
import pickle
import pydoc
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace
from typing import get_type_hints

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import bns
from bns.api.common.shown import Shown
from bns.api.run import Parameters, _first
from bns.cli.main import main
from bns.measurements import write_measurements
from bns.physics.effects import all_effects, effect_in_file
from bns.spec import FIELDS
from bns.sweep.expand.grid import load_sweep
from bns.sweep.expand.order import ordered_specs
from tests.diagnose.worlds import hidden, measured

SMALL = {"population_size": 20, "evaluations": 4, "generations_per_evaluation": 2}
LIMITS = {"minutes": 2, "arena": (1.6, 1.2), "start": (0.0, 0.0, np.pi / 2), "speeds": (-0.2, 0.2)}


@pytest.fixture(scope="module")
def table():
    return measured(hidden(dead_zone={"width_m_s": 0.006}), trials=12, ends_only=True, speeds=(0.085, 0.115), seed=4)


@pytest.fixture(scope="module")
def log(table, tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "log.csv"
    write_measurements(table, path)
    return path


@pytest.fixture(scope="module")
def found(log):
    return bns.diagnose(log, bns.Model("khepera"))


@pytest.fixture(scope="module")
def results(log, found, tmp_path_factory):
    """One of everything."""
    folder = tmp_path_factory.mktemp("work")
    sweep = bns.Sweep(name="s", robot="khepera", grid={"mutation_rate": [0.1, 0.3]}, fixed={"task": "circle", **SMALL})
    return {
        "log": bns.Measurements(log),
        "model": bns.Model("khepera").with_effect("motor-lag", tau_s=0.1),
        "run": bns.run(robot="khepera", task="infinity", seed=3, keep=folder / "results", **SMALL),
        "sweep": sweep,
        "swept": sweep.run(folder / "results", jobs=1),
        "plan": sweep.plan(folder / "results", jobs=1),
        "compared": bns.compare(log, "khepera"),
        "diagnosed": found,
        "added": bns.add(log, "motor-lag", bns.Model("khepera")),
        "proposed": found.propose(**LIMITS),
        "reported": found.report(folder / "report.html", minutes=2),
        "trial": bns.trial(
            "khepera", emulated=True, results=folder / "results", **{**SMALL, "evaluations": 2, "max_commands": 4}
        ),
    }


def test_importing_loads_nothing_else():
    code = "import sys, bns; print(*sorted({'numpy', 'pandas', 'inspect', 'matplotlib'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_every_name_is_listed_there_and_documented():
    assert set(bns.__all__) <= set(dir(bns))
    assert not {"importlib", "sys"} & set(dir(bns))
    assert [name for name in dir(bns) if name.startswith("_") and not name.endswith("__")] == []
    for name in bns.__all__:
        thing = getattr(bns, name)
        assert name == "__version__" or len(thing.__doc__) > 20, name
        assert name == "__version__" or callable(thing), name
    with pytest.raises(AttributeError, match="no attribute 'evolve'"):
        bns.evolve  # noqa: B018


def test_functions_whose_folder_has_their_name_stay_functions_and_folders():
    import bns.diagnose.data.load as load  # noqa: PLR0402  # the form that walks through the folders
    from bns.trial import folder

    assert callable(bns.diagnose)
    assert callable(bns.trial)
    assert bns.diagnose.data.load is load
    assert folder.JOURNAL
    assert "log" in inspect.signature(bns.diagnose).parameters
    assert "emulated" in inspect.signature(bns.trial).parameters
    assert pickle.loads(pickle.dumps(bns.diagnose)) is bns.diagnose


@pytest.mark.parametrize("name", ["diagnose", "trial"])
def test_help_of_a_function_whose_folder_has_its_name_is_that_of_the_function(name):
    function = getattr(importlib.import_module(f"bns.api.{name}"), name)
    shown = " ".join(pydoc.render_doc(getattr(bns, name), renderer=pydoc.plaintext).split())
    assert " ".join(inspect.getdoc(function).split()).partition(".")[0] in shown
    assert f"Call: bns.{name}({next(iter(inspect.signature(function).parameters))}" in shown


def test_every_result_is_one_line_a_text_and_a_cell(results):
    for name, result in results.items():
        assert "\n" not in repr(result), name
        assert 10 < len(repr(result)) <= 200, name
        assert len(result.summary()) > 20, name
        assert result._repr_html_().startswith("<"), name
        assert isinstance(result, Shown | bns.Model), name


def test_every_result_is_copied_and_pickled(results):
    for name, result in results.items():
        assert repr(copy.deepcopy(result)) == repr(result), name
        assert repr(pickle.loads(pickle.dumps(result))) == repr(result), name


@pytest.mark.parametrize("name", ["run", "compared", "diagnosed", "added", "proposed", "trial", "log"])
def test_plots_are_axes_and_leave_nothing_behind(results, name):
    plot = results[name].plot_paths if name == "log" else results[name].plot
    before = dict(plt.rcParams)
    own = plot()
    assert isinstance(own, Axes)
    assert own.has_data()
    assert own._repr_png_().startswith(b"\x89PNG")
    given = Figure().subplots()
    assert plot(ax=given) is given
    assert given.has_data()
    assert plt.get_fignums() == []
    assert dict(plt.rcParams) == before


def test_a_run_is_the_same_with_and_without_a_store(results):
    run = results["run"]
    again = bns.run(robot="khepera", task="infinity", seed=3, **SMALL)
    kept = bns.load(run.files["path"].parents[1], where={"run_id": run.run_id})
    assert (
        again.evals["fitness_world"].tolist() == run.evals["fitness_world"].tolist() == kept["fitness_world"].tolist()
    )
    assert again.files == {}
    other = bns.run(robot="khepera", task="infinity", seed=4, **SMALL)
    assert other.evals["fitness_world"].tolist() != run.evals["fitness_world"].tolist()


def test_progress_is_a_share_and_a_text():
    told = []
    bns.run(**SMALL, progress=lambda share, text: told.append((share, text)))
    assert [share for share, _ in told] == [0.25, 0.5, 0.75, 1.0]
    assert told[-1][1] == "evaluation 4 of 4"


def test_parameters_that_there_are_none_of_are_refused_by_name():
    assert set(get_type_hints(Parameters)) == set(FIELDS) - {"robot", "task", "world", "seed"}
    with pytest.raises(bns.SpecError, match="mutation_rate is 40"):
        bns.run(mutation_rate=40)
    with pytest.raises(bns.BnsError, match="Did you mean 'mutation_rate'"):
        bns.run(mutation_rat=0.1)


def test_a_sweep_in_python_is_that_of_a_file(tmp_path, results):
    sweep = bns.Sweep(
        "two",
        "khepera",
        grid={"mutation_rate": np.array([0.1, 0.3])},
        zip={"evaluations": range(2, 4), "max_commands": (10, 20)},
        fixed={"task": "infinity"},
        exclude=[{"mutation_rate": 0.3, "evaluations": 3}],
        include=[{"task": "circle"}],
        seeds=3,
        first_seed=5,
    )
    (tmp_path / "two.yaml").write_text(
        "name: two\nrobot: khepera\nseeds: 3\nfirst_seed: 5\ngrid: {mutation_rate: [0.1, 0.3]}\nfixed: {task: infinity}\n"
        "zip: {evaluations: [2, 3], max_commands: [10, 20]}\nexclude: [{mutation_rate: 0.3, evaluations: 3}]\n"
        "include: [{task: circle}]\n"
    )
    ids = [spec.run_id for spec in ordered_specs(load_sweep(tmp_path / "two.yaml"))]
    assert [spec.run_id for spec in ordered_specs(sweep.described)] == ids
    assert [spec.run_id for spec in ordered_specs(bns.Sweep.from_file(tmp_path / "two.yaml").described)] == ids
    assert len(sweep) == len(ids) == 12
    assert results["swept"].finished
    assert results["swept"].load("runs")["status"].tolist() == ["ok", "ok"]
    assert results["sweep"].status(results["swept"].results)["done"].tolist() == [2]
    with pytest.raises(bns.SpecError, match=r"^unknown parameter 'mutation_rat'"):
        bns.Sweep("s", "khepera", grid={"mutation_rat": [0.1]})
    with pytest.raises(bns.SpecError, match="something else"):
        bns.Sweep("s", "khepera", fixed={"task": object()})


def test_models_are_had_by_name_file_and_numbers(tmp_path):
    drawn = bns.Model("khepera")
    assert bns.Model(wheelbase_m=0.2).wheelbase_m == bns.Model("differential-drive", wheelbase_m=0.2).wheelbase_m == 0.2
    other = bns.Model("khepera", wheelbase_m=0.1).with_effect("motor-lag", tau_s=0.1)
    assert isinstance(other, bns.Model)
    again = bns.Model(other.save(tmp_path / "mine.yaml"))
    assert again.sha256 == other.sha256 != drawn.sha256
    assert again.values_of("motor-lag") == {"tau_s": 0.1}
    for wrong, message in (({}, "needs its wheelbase"), ({"wheel_base": 1}, "Did you mean 'wheelbase_m'")):
        with pytest.raises(bns.ModelError, match=message):
            bns.Model(**wrong)
    with pytest.raises(bns.ModelError, match=r"end in \.yaml"):
        other.save(tmp_path / "mine.txt")
    python = replace(other.effects[0].effect, name="own-lag")
    with pytest.raises(bns.ModelError, match="own-lag is an effect in Python, of which a model file can only name the file"):
        other.with_active(python, (0.1,)).save(tmp_path / "python.yaml")
    assert not (tmp_path / "python.yaml").exists()


def test_an_effects_file_in_the_models_folder_is_named_by_its_name(tmp_path):
    (tmp_path / "own.py").write_text(
        "from dataclasses import replace\nfrom bns.physics.effects import effect_named\n"
        "EFFECT = replace(effect_named('motor-lag'), name='own-lag')\n"
    )
    (tmp_path / "elsewhere").mkdir()
    added = bns.Model(wheelbase_m=0.1).with_active(effect_in_file(tmp_path / "own.py"), (0.1,))
    added = replace(added, effects=tuple(replace(a, written={"file": str(tmp_path / "own.py")}) for a in added.effects))
    assert "  file: own.py\n" in added.save(tmp_path / "model.yaml").read_text()
    assert f"  file: {tmp_path / 'own.py'}\n" in added.save(tmp_path / "elsewhere" / "model.yaml").read_text()


def test_measurements_are_the_same_from_a_file_a_table_and_a_mapping(log, table, tmp_path):
    write_measurements(table, tmp_path / "log.parquet")
    from_file, from_table = bns.Measurements(log), bns.Measurements(pd.read_csv(log))
    assert from_file.sha256 == from_table.sha256 == bns.Measurements(tmp_path / "log.parquet").sha256
    assert bns.Measurements(table.assign(x_m=table["x_m"] + 1e-9)).sha256 != from_table.sha256
    assert from_file.trials["commands"].tolist() == [5] * 12
    other = tmp_path / "other.parquet"
    write_measurements(table.assign(x_m=table["x_m"] + 0.5), other)
    assert len(bns.Measurements(log, other)) == len(bns.Measurements([log, other])) == 24
    with pytest.raises(bns.DataError, match="row for row"):
        bns.Measurements([log, tmp_path / "log.parquet"])
    names = {name: {"from": name} for name in ("trial", "t_s", "left_m_s", "right_m_s", "x_m", "y_m")}
    turned = table.assign(yaw=np.degrees(table["heading_rad"])).drop(columns="heading_rad")
    mapped = bns.Measurements(turned, mapping={"columns": {**names, "heading_rad": {"from": "yaw", "unit": "deg"}}})
    assert np.allclose(mapped.frame["heading_rad"], table["heading_rad"])
    with pytest.raises(bns.DataError, match="heading_rad"):
        bns.Measurements(turned)
    with pytest.raises(bns.DataError, match="There is no file"):
        bns.compare("gone.csv", "khepera")


@pytest.mark.parametrize("log", [np.zeros((3, 3)), 3, [np.zeros(3)]])
def test_what_is_no_log_is_refused_in_words(log):
    with pytest.raises(bns.errors.DataError, match=r"cannot be read from .*; give the path of a file"):
        bns.compare(log, "khepera")


def test_a_model_file_without_content_is_said_to_be_empty(tmp_path):
    (tmp_path / "empty.yaml").write_text("")
    with pytest.raises(bns.errors.ModelError, match="The file of model empty is empty"):
        bns.Model(tmp_path / "empty.yaml")


def test_a_table_and_its_file_have_one_diagnosis(found, log):
    from_table = bns.diagnose(pd.read_csv(log), "khepera")
    assert from_table.to_json() == found.to_json()
    assert from_table.summary() == found.summary()


def test_a_diagnosis_in_frames(found):
    best = found.ranking.index[0]
    assert found.verdict == "tie"
    assert found.ranking["rank"].tolist() == list(range(len(found.ranking)))
    assert found.ranking.loc[best, "elpd_diff"] > 3 * found.ranking.loc[best, "dse"] > 0
    assert set(found.parameters["effect"]) == set(found.effects) == {a.effect.name for a in found.model.effects}
    assert (found.errors["after"] <= found.errors["before"]).all()
    few = bns.diagnose(found.ready.log.frame.query("trial < 4"), "khepera")
    assert (few.verdict, few.model.effects, len(few.ranking)) == ("insufficient-data", (), 0)
    with pytest.raises(bns.DataError, match="Nothing was ranked: 4 trials"):
        few.plot()


def test_the_other_explanations_of_a_tie_have_numbers(found):
    answer, text = found.to_json(), found.summary()
    assert sorted(rival["effects"] for rival in answer["rivals"]) == sorted(answer["explanations"][1:]) != []
    for rival in found.rivals:
        assert f"or {' and '.join(rival.names)}:" in text
        said = text.split(f"or {' and '.join(rival.names)}:")[1].split("\nor ")[0].split("cannot be told apart")[0]
        for name, numbers in rival.numbers.items():
            assert name in rival.names
            own = answer["parameters"].get(name, {})
            same = bool(own) and all(own[key]["low"] <= n["value"] <= own[key]["high"] for key, n in numbers.items())
            assert (f"  {name}: as above" in said) is same
            for parameter, number in numbers.items():
                assert number["low"] < number["value"] < number["high"]
                assert (f"    {parameter} = {number['value']:.5g}" in said) is not same


def test_what_is_added_lowers_the_error_step_by_step(log):
    added = bns.add(log, ["dead-zone", bns.effects().index[0]], "khepera")
    assert added.errors.index.tolist() == ["as given", "dead-zone", "acceleration-limit", "tracking noise"]
    assert added.errors.loc["dead-zone", "command"] < added.errors.loc["as given", "command"]
    assert [active.effect.name for active in added.model.effects] == added.to_json()["effects"]
    with pytest.raises(bns.ModelError, match="already has dead-zone"):
        bns.add(log, "dead-zone", added.model)
    lag = bns.Model("khepera").with_effect("motor-lag", basis="measured", tau_s=0.1)
    after = bns.add(log, "dead-zone", lag)
    now = after.model.values_of("motor-lag")["tau_s"]
    said = f"motor-lag was measured (tau_s = 0.1 s); its parameters were fitted again with the others: tau_s = {now:.5g} s."
    assert after.warnings[-1] == said
    assert not any("fitted again" in warning for warning in added.warnings)
    mine = bns.Effect("my-drag", "body", (bns.Parameter("k", "s", -1, 1, (-0.5, 0.5), 0.0, "drag"),), "", "", (), _drag)
    assert bns.add(log, mine, "khepera").errors.index[1] == "my-drag"


def _drag(body, k):
    from dataclasses import replace

    return replace(body, forward_m_s=body.forward_m_s * (1 - k * abs(body.yaw_rad_s)))


def test_a_proposal_is_commands_inside_limits(results, tmp_path):
    proposal = results["proposed"]
    commands = pd.read_csv(proposal.to_csv(tmp_path / "next.csv"))
    assert commands.shape == proposal.commands.shape
    assert commands["left_m_s"].between(-0.2, 0.2).all()
    assert (commands["start_x_m"] == 0).all()
    with pytest.raises(bns.DataError, match="There is no trial 999"):
        proposal.plot(trial=999)
    with pytest.raises(bns.DataError, match="width and height"):
        results["diagnosed"].propose(arena="2x3")


def test_the_catalogue_has_every_effect():
    listed = bns.effects()
    assert listed.index.tolist() == list(all_effects())
    assert listed.loc["motor-lag", "parameters"].startswith("tau_s (s): ")
    assert (listed["meaning"].str.len() > 15).all()


@pytest.mark.parametrize("command", ["compare", "diagnose", "add", "propose"])
def test_the_command_line_prints_what_the_functions_give(command, log, found, results, tmp_path, capsys):
    ours = {
        "compare": lambda: results["compared"],
        "diagnose": lambda: found,
        "add": lambda: results["added"],
        "propose": lambda: results["proposed"],
    }[command]()
    typed = {
        "compare": [str(log)],
        "diagnose": [str(log)],
        "add": ["motor-lag", "--data", str(log), "-o", str(tmp_path / "new.yaml")],
        "propose": [str(log), "--minutes", "2", "--arena", "1.6x1.2", "--start", "0,0,90", "--speeds=-0.2,0.2"],
    }[command]
    assert main([command, *typed, "--model", "khepera", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer == json.loads(json.dumps(ours.to_json()))
    assert answer["provenance"]["bns_version"] == bns.__version__
    assert len(answer["provenance"]["model_sha256"]) == len(answer["provenance"]["data_sha256"]) == 64


@pytest.mark.parametrize("noise", [{"noise_position_m": 0.002}, {"noise_heading_rad": 0.01}])
def test_either_noise_of_a_pose_is_in_the_summary_of_a_model(noise):
    plain = {"noise_position_m": 0.0, "noise_heading_rad": 0.0}
    assert "noise of a pose" in bns.Model(wheelbase_m=0.2, **{**plain, **noise}).summary()
    assert "noise of a pose" not in bns.Model(wheelbase_m=0.2, **plain).summary()


def test_when_goals_were_first_reached_is_said_by_the_first_evaluation():
    assert _first(np.array([False, True, True]), np.array([1, 2, 3])) == "first at evaluation 2, in 67% of the evaluations"
    assert _first(np.array([False, False]), np.array([1, 2])) == "never"


def test_a_sweep_whose_runs_failed_has_finished_and_its_progress_counts_them(tmp_path, monkeypatch):
    told, counts = [], SimpleNamespace(total=4, done=2, failed=1, quarantined=1, remaining=0, stopped_by=None)

    def carry_out(_described, request):
        request.on_progress(SimpleNamespace(total=4, done=1, remaining=1))
        return counts

    monkeypatch.setattr("bns.api.sweep.load_executor", lambda _name: SimpleNamespace(carry_out=carry_out))
    sweep = bns.Sweep("s", "khepera", fixed={"evaluations": 2}, seeds=4)
    assert sweep.run(tmp_path, progress=lambda share, text: told.append((share, text))).finished
    assert told == [(0.75, "1 of 4 runs")]
    counts.remaining = 1
    assert not sweep.run(tmp_path).finished
