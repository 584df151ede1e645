"""Runs of a user's model: killed and resumed, in other processes, and never from what another file has left."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from support import own
from support.own import FADING, PENDULUM, ROLLING
from support.runs import Heard, same_numbers, settled

import sweep
from sweep.config import InputError, load_config
from sweep.engine.plan import kernels
from sweep.faults import FileError
from sweep.kernels import build as builder
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.models import MODELS
from sweep.models.theory.stability import stable_ranges
from sweep.plots import labels, trajectories
from sweep.prediction import predict
from sweep.results.summary import describe

FEW = {"damping": [0.3, 0.5, 0.7], "torque": [0.5, 1.0, 1.2, 1.5], "t_end": 60}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return own.write(tmp_path)


@pytest.fixture
def few(folder: Path) -> xr.Dataset:
    """The dataset of the pendulum, which it leaves in `folder` too."""
    return sweep.run(folder / "pendulum.yaml", folder, **FEW)


def test_the_pendulum_swings_as_scipy_says(few: xr.Dataset, folder: Path) -> None:
    def slopes(t: float, y: np.ndarray) -> list[float]:
        return [y[1], 1.2 * np.cos(2 / 3 * t) - np.sin(y[0]) - 0.5 * y[1]]

    one = sweep.trajectory(folder / "pendulum.yaml", t_end=60, every=0.5, damping=0.5, torque=1.2)
    rates = solve_ivp(slopes, (0, 60), [1.0, 0.0], "DOP853", one["time"].values, rtol=1e-12, atol=1e-12).y[1]
    np.testing.assert_allclose(one["spin"], rates, rtol=0, atol=1e-7)
    cell = few.sel(damping=0.5, torque=1.2)
    assert cell["spin_final"].item() == pytest.approx(rates[-1], abs=1e-7)
    assert cell["reversals"].item() == one["reversals"].item() > 5


def test_its_dataset_names_the_file_its_hash_and_its_parameters(few: xr.Dataset, folder: Path) -> None:
    assert few.attrs["model_place"] == str(folder / "pendulum.py")
    assert few.attrs["model_sha256"] == load_config(folder / "pendulum.yaml").origin.digest
    assert few["torque"].attrs == {"long_name": "torque of the drive", "units": "m g length"}
    assert not [name for name in few.data_vars if name.startswith("n_c") or name in ("form_factor", "energy_error")]
    assert not any("units" in v.attrs for v in few.data_vars.values())
    assert few.attrs["title"] == "pendulum: reversals (pendulum.py model)"


@pytest.mark.campaign
def test_pictures_and_summaries_take_its_words(folder: Path) -> None:
    (folder / "pendulum.py").write_text(
        PENDULUM.replace("damping", "mu").replace("drive", "friction"), encoding="utf-8"
    )
    one = sweep.trajectory({"model": str(folder / "pendulum.py"), "integrator": {"t_end": 5}}, torque=[1.0, 1.2])
    assert labels.label(one, "mu") == "mu (√(g/length))"
    assert "  mu = 0.5, torque = 1.2, angle = 1: time_limit at t = 5" in describe(one)
    assert trajectories.draw(one).axes[0].get_lines()
    law = sweep.predict(folder / "fading.yaml")
    assert law["fading"].attrs == {"long_name": "slip velocity that halves friction", "units": "m s-1"}
    assert law["mu"].attrs == {"long_name": "friction μ", "description": "Coefficient of friction."}
    assert labels.words(law, "b") == "short semi-axis b"


@pytest.mark.usefixtures("few")
@pytest.mark.parametrize(
    "more", [{}, {"torque": [0.5, 1.0, 1.2, 1.4, 1.5]}, {"t_end": 70}], ids=["same", "axis", "longer"]
)
def test_another_file_goes_on_with_nothing(folder: Path, more: dict[str, Any]) -> None:
    """Not with the same cells, nor by taking over those that a larger run shares."""
    (folder / "pendulum.py").write_text(PENDULUM.replace("2 / 3", "3 / 4"), encoding="utf-8")
    with pytest.raises(FileError) as refusal:
        sweep.run(folder / "pendulum.yaml", folder, **FEW | more)
    assert re.search(r"text of the model's file differs|another text of \S+pendulum.py", str(refusal.value))


def test_a_larger_run_of_the_same_file_takes_its_cells_over(few: xr.Dataset, folder: Path) -> None:
    (folder / "moved").mkdir()
    (folder / "pendulum.py").rename(folder / "moved" / "same.py")
    reporter = Heard()
    more = FEW | {"torque": [0.5, 1.0, 1.2, 1.4, 1.5]}
    larger = sweep.run(folder / "pendulum.yaml", folder, model="moved/same.py", progress=reporter, **more)
    assert any(note.startswith("12 of 15 cells are reused") for note in reporter.notes)
    assert reporter.notes[0].startswith("running the code of ")
    same_numbers(larger.sel(torque=few["torque"]), few)


def test_kernels_depend_on_what_the_file_says_not_on_where_it_lies(folder: Path) -> None:
    def compiled(file: str) -> bool:
        config = load_config(folder / "pendulum.yaml", {"model": file})
        return all(kernel.advancing.is_compiled() for kernel in kernels(config))

    sweep.run(folder / "pendulum.yaml", **FEW)
    (folder / "copy.py").write_text(PENDULUM, encoding="utf-8")
    assert compiled("copy.py")
    (folder / "edited.py").write_text(PENDULUM.replace("return y[1], 0.0, 1.0", "return y[1], 0.0, 2.0"), "utf-8")
    assert not compiled("edited.py")
    law = load_config(folder / "fading.yaml")
    (folder / "other.py").write_text(FADING.replace("1.0 + square", "2.0 + square"), encoding="utf-8")
    other = load_config(folder / "fading.yaml", {"model": "other.py"})
    assert law.equations.name == other.equations.name
    assert law.equations.key != other.equations.key


@pytest.mark.usefixtures("few")
def test_the_process_that_compiles_gets_the_text_of_the_file(folder: Path) -> None:
    config = load_config(folder / "pendulum.yaml")
    (folder / "pendulum.py").unlink()
    piece = ("failing", "dopri5", config.equations.key)
    with builder._start(piece, config.origin) as process:
        assert process.wait() == 0
    with builder._start(piece, replace(config.origin, text="1 / 0")) as process:
        assert process.wait() != 0


@pytest.mark.campaign
def test_workers_need_no_file(few: xr.Dataset, folder: Path, client: distributed.Client) -> None:
    """They get its text with the configuration."""
    config = load_config(folder / "pendulum.yaml", FEW)
    (folder / "pendulum.py").unlink()
    same_numbers(sweep.run(config, client=client), few)


def test_an_error_in_a_worker_names_its_line(folder: Path, threaded: distributed.Client) -> None:
    (folder / "pendulum.py").write_text(ROLLING, encoding="utf-8")
    for where in (None, threaded):
        with pytest.raises(InputError, match=r"pendulum.py:\d+: ValueError: too much") as error:
            sweep.run(folder / "pendulum.yaml", client=where, **FEW)
        assert 'raise ValueError("too much")' in ROLLING.splitlines()[error.value.faults[0].line - 1]


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("pendulum", "    angle, rate, phase = y\n", "    angle, rate, phase = half(y)\n",
         "does not compile: Untyped global name 'half'"),
        ("fading", "    return p.mu /", "    return half(p.mu) /", "does not compile: Untyped global name 'half'"),
    ],
    ids=["helper", "law"],
)  # fmt: skip
def test_what_does_not_compile_is_reported_with_its_line(
    folder: Path, file: str, old: str, new: str, message: str
) -> None:
    text = own.SHOWN[f"{file}.py"].replace(old, new, 1) + "\n\ndef half(x):\n    return x\n"
    (folder / f"{file}.py").write_text(text, encoding="utf-8")
    line = text[: text.index(new)].count("\n") + 1
    with pytest.raises(InputError) as error:
        sweep.run(folder / f"{file}.yaml")
    (fault,) = error.value.faults
    assert (fault.file, fault.line) == (str(folder / f"{file}.py"), line), fault
    assert fault.message.startswith(message)


@pytest.mark.campaign
def test_a_body_with_a_users_law_settles_and_reverses_no_more(folder: Path) -> None:
    """The page's law of friction, where the couple alone would stop it after minutes."""
    asked = {"fading": [0.1, 1.0], "omega3": [-5.0, -1.0, 0.5, 5.0]}
    ends, later, _ = settled(folder / "fading.yaml", 1.0, t_end=120, **asked)
    assert (ends["t_stop"] < 0.5 * later["t_stop"]).all()
    assert ends["reversals"].sum() > 0


def test_a_model_with_an_upright_spin_settles_by_the_linear_theory(folder: Path) -> None:
    (folder / "pendulum.py").write_text(ROLLING, encoding="utf-8")
    ends = sweep.run(folder / "pendulum.yaml", torque=[0.0, 1e-4, 0.1, 0.5], damping=0.5, t_end=60)
    assert ends["status"].values.ravel().tolist() == [TIME_LIMIT, SETTLED, SETTLED, SETTLED]
    _, slow, middle, fast = ends["t_stop"].values.ravel()
    assert slow > middle > fast
    assert -np.log(1e-4) < slow < -2 * np.log(1e-4)


def test_the_linear_theory_of_a_users_model_agrees_with_that_of_the_package(folder: Path) -> None:
    (folder / "mine.py").write_text(UPRIGHT, encoding="utf-8")
    scene = {"friction": {"mu": [5.0, 60.0]}, "start": {"n0": [0.03, -0.1]}}
    config = load_config({"model": str(folder / "mine.py"), **scene})
    found = predict(config.equations, config.grid)
    ours = stable_ranges(MODELS["slip"], config.grid.columns())
    np.testing.assert_allclose(found.ranges, ours, rtol=1e-12)
    assert np.isfinite(ours[:2]).all()


UPRIGHT = """\
from dataclasses import replace

from sweep.models.ladder import slip
from sweep.models.model import Offer

MODEL = replace(slip.MODEL, name="mine", offers=frozenset({Offer.COUNT, Offer.SPIN, Offer.ENERGY, Offer.LINEAR}))
"""
