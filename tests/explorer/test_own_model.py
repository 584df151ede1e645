"""The explorer and a dataset of a user's model: its code runs only if the user names it, and only if it is the same."""

from pathlib import Path

import pytest
from support import own
from support.own import PENDULUM

import sweep
from sweep.config import InputError
from sweep.explorer import state
from sweep.explorer.runner import Job
from sweep.explorer.setup import Setup, usable, why_still
from sweep.explorer.slices import Source, open_source
from sweep.models.user import loading

FEW = {"damping": [0.3, 0.5, 0.7], "torque": [0.5, 1.0, 1.2, 1.5], "t_end": 60}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the dataset of the pendulum."""
    found = own.write(tmp_path_factory.mktemp("pendulum"))
    sweep.run(found / "pendulum.yaml", found, **FEW)
    return found


@pytest.fixture(scope="module")
def source(folder: Path) -> Source:
    return open_source(folder / "pendulum.nc")


@pytest.fixture(scope="module")
def setup(source: Source, folder: Path) -> Setup:
    return Setup(source, str(folder / "pendulum.py"), lambda _: None)


def test_a_model_is_not_run_unless_it_is_named(source: Source, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.models.user.loading.load", lambda origin: pytest.fail(f"ran {origin.place}"))
    assert usable(source) is None
    with pytest.raises(InputError, match="refusing to run user code named inside a da"):
        Setup(source)
    why = f"Its model is user code, {folder / 'pendulum.py'}; name it to run trajectories: "
    assert why_still(source) == f"{why}sweep explore FILE --model MODEL."
    assert source.values_at({"damping": 0, "torque": 1})


def test_a_named_model_is_announced_and_gives_the_numbers_of_the_run(source: Source, folder: Path) -> None:
    said = list[str]()
    loading.load.cache_clear()
    setup = Setup(source, str(folder / "pendulum.py"), said.append)
    (words,) = said
    assert words.startswith(f"running the code of {folder / 'pendulum.py'} (SHA-256 ")
    index = {"damping": 1, "torque": 2}
    cell = {**setup.base, **source.parameters_at(tuple(setup.base), index)}
    *_, curve = Job(cell, lambda _: None).begin(setup)
    for name in ("reversals", "t_stop", "spin_final"):
        assert curve.dataset[name].item() == source.dataset[name].isel(index).item()
    assert len(curve.reversals) == curve.dataset["reversals"] > 5


def test_no_other_code_is_run(source: Source, folder: Path, tiny: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither another file, nor what is not there, nor the right one beside a dataset without a hash."""
    monkeypatch.setattr("sweep.models.user.loading.load", lambda origin: pytest.fail(f"ran {origin.place}"))
    (folder / "other.py").write_text(PENDULUM.replace("2 / 3", "3 / 4"), encoding="utf-8")
    bare = Source(source.dataset.drop_attrs(deep=False).assign_attrs(config=source.dataset.attrs["config"]), "bare.nc")
    digest = source.dataset.attrs["model_sha256"]
    for dataset, model, message in (
        (source, folder / "other.py", f"--model: .*other.py has the SHA-256 [0-9a-f]{{64}}, not .* {digest};"),
        (source, folder / "missing.py", "--model: .*no such file"),
        (source, "sliip", "--model: .*sliip: no such file"),
        (bare, folder / "pendulum.py", "--model: the model of bare.nc is not a user's; leave the option out$"),
        (open_source(tiny), folder / "pendulum.py", "--model: the model of .* is not a user's; leave the option out$"),
    ):
        with pytest.raises(InputError, match=f"^{message}"):
            Setup(dataset, str(model), lambda words: pytest.fail(words))


def test_what_a_dataset_says_of_its_file_is_not_believed(source: Source, folder: Path, tmp_path: Path) -> None:
    """Its configuration may name any file: the one that the user names is run, no other."""
    sign, trap = tmp_path / "ran", tmp_path / "trap.py"
    trap.write_text(f"open({str(sign)!r}, 'w').close()\n{PENDULUM}", encoding="utf-8")
    text = source.dataset.attrs["config"].replace("model: pendulum.py", f"model: {trap}")
    assert str(trap) in text
    forged = Source(source.dataset.assign_attrs(config=text, model_place=str(trap)))
    setup = Setup(forged, str(folder / "pendulum.py"), lambda _: None)
    assert setup.config.origin.place == str(folder / "pendulum.py")
    assert usable(forged) is None
    assert not sign.exists()


def test_cells_in_an_address_know_its_parameters(source: Source, setup: Setup) -> None:
    known = setup.config.table
    shown, faults = state.read({"cell": ["torque:1.1,angle:0.5"]}, source, setup.base, known)
    assert not faults
    assert shown.cells[0] == {"damping": 0.3, "torque": 1.1, "angle": 0.5}
    _, faults = state.read({"cell": ["torque:-1"]}, source, setup.base, known)
    assert faults == ["cell=torque:-1: torque has to be a finite number >= 0 and < 10"]
