"""A wheelbase of what has no wheels is refused, not ignored, wherever it can be given."""

import pytest

import bns
from bns.cli.main import main
from bns.errors import ModelError


@pytest.mark.parametrize("named", ["snake", "arm.xml", "arm.yaml"])
def test_a_body_has_no_wheelbase(tmp_path, monkeypatch, named):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.xml").write_text(
        '<mujoco><worldbody><body><joint name="j" axis="0 1 0"/><geom size="0.01"/><site name="tip"/></body></worldbody>'
        '<actuator><position joint="j" kp="1"/></actuator></mujoco>'
    )
    bns.Model("arm.xml").save("arm.yaml")
    with pytest.raises(ModelError, match=rf"The model {named} has no wheels: leave --wheelbase .* out"):
        bns.Model(named, wheelbase_m=0.1)


def test_a_model_of_a_body_is_given_none_either():
    with pytest.raises(ModelError, match="The model snake has no wheels"):
        bns.Model(bns.Model("snake"), wheelbase_m=0.1)


@pytest.mark.parametrize("command", ["diagnose", "compare", "explore"])
@pytest.mark.parametrize("model", ["snake", "snake-networks"])
def test_commands_say_so(tmp_path, capsys, command, model):
    (tmp_path / "log.csv").write_text("trial,t_s,x_m,y_m,heading_rad\n")
    assert main([command, str(tmp_path / "log.csv"), "--model", model, "--wheelbase", "0.1"]) == 2
    said = capsys.readouterr().err
    assert f"The model {model} has no wheels: leave --wheelbase" in said
    assert len(said.splitlines()) == 1
