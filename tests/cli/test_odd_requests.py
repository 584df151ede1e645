"""Odd requests: each ends in an answer, or in one line that says what is allowed."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from support import Write
from support.cli import invoke

import sweep
from sweep.cli import main
from sweep.kernels.status import DIVERGED
from sweep.studies.trajectory import trajectory

TEXT = "name: odd\nfriction: {mu: 60}\nintegrator: {t_end: 30}\n"


def test_an_axis_of_any_parameter_is_drawn(write: Write, tmp_path: Path) -> None:
    for axis in ("c=[1,2]", "a=[9,10]", "b=[2,3,4,5,6]", "delta=[0.01,0.03]"):
        result = invoke("run", write(TEXT), "--output", tmp_path / axis[0], "--set", axis, "--set", "n0=[0.04,0.05]")
        assert result.exit_code == 0
        assert (tmp_path / axis[0] / "odd.png").exists()
    for variable in ("n_c1_plus", "form_factor", "energy_error", "step_rule"):
        assert invoke("plot", tmp_path / "b" / "odd.nc", "--var", variable).exit_code == 0
        assert (tmp_path / "b" / f"odd_{variable}.png").read_bytes().startswith(b"\x89PNG")


def test_a_step_fixed_for_another_method_is_not_used_by_dopri5(write: Write) -> None:
    config = sweep.load_config(write(TEXT), {"method": "adams", "step": 0.1, "mu": 400.0})
    series = trajectory(config)
    assert int(series.status[0]) != DIVERGED
    assert float(series.step[0]) < 0.01
    assert series.attrs["integrator"].startswith("dopri5")


@pytest.mark.parametrize("target", ["folder.png", "nowhere/x.png"])
def test_pictures_that_cannot_be_written(target: str, write: Write, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    invoke("run", write(TEXT), "--output", tmp_path / "o")
    result = invoke("plot", tmp_path / "o" / "odd.nc", "--output", tmp_path / target)
    assert (result.exit_code, "cannot be written" in result.stderr) == (2, True)


def test_brackets_in_a_path_are_not_markup(write: Write, tmp_path: Path) -> None:
    for _ in range(2):
        result = invoke("run", write(TEXT), "--output", tmp_path / "o[/red]")
    assert "o[/red]" in result.stderr
    assert result.exit_code == 0


def test_a_changed_table_is_named(write: Write, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("mu\n60\n")
    file = write("name: odd\ncases: t.csv\nintegrator: {t_end: 10}\n")
    assert invoke("run", file, "--output", tmp_path / "o").exit_code == 0
    (tmp_path / "t.csv").write_text("mu\n61\n")
    result = invoke("run", file, "--output", tmp_path / "o")
    assert (result.exit_code, "the table of cases differs" in result.stderr) == (2, True)


def test_reduced_models_that_blow_up_are_diverged(write: Write) -> None:
    """A rattle far beyond what the averaged equations mean, at a step far too long for it."""
    dataset = sweep.run(write(TEXT), model="averaged", n0=900.0, x0=9.0, step=0.9, t_end=3000.0)
    assert int(dataset.status) == DIVERGED


def test_an_interrupt_outside_a_sweep_is_one_line(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("sweep.config.load_config", interrupt)
    result = CliRunner().invoke(main, ["critical", str(write(TEXT))])
    assert (result.exit_code, result.stderr) == (130, "interrupted\n")
