"""What ends a command: a fault of the user is one line, before anything is computed; ours shows its traceback."""

import errno
import sys
from collections.abc import Callable
from pathlib import Path
from unittest.mock import Mock

import pytest
import xarray as xr
from support import ROOT, Write
from support.cli import invoke, refused
from support.processes import python

import sweep
from sweep.cli import environment
from sweep.results.writing import replacing

TEXT = "name: quick\nmodel: averaged\nfriction: {mu: [40, 60]}\nintegrator: {t_end: 40}\n"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """The file of a dataset."""
    sweep.predict({"friction": {"mu": [40, 60]}}).to_netcdf(tmp_path / "quick.nc")
    return tmp_path / "quick.nc"


OURS = [
    KeyError("trajectory"),
    ValueError("min() arg is an empty sequence"),
    OSError("of nothing"),
    OSError(errno.EBADF, "Bad file descriptor"),
    FileNotFoundError(errno.ENOENT, "No such file", str(ROOT / "sweep" / "page.html")),
]


@pytest.mark.parametrize("error", OURS, ids=repr)
def test_an_error_of_ours_shows_its_traceback(error: Exception, file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for verb, target in (("info", "sweep.results.summary.describe"), ("plot", "sweep.plots.picture.plot")):
        monkeypatch.setattr(target, Mock(side_effect=error))
        with pytest.raises(type(error)):
            invoke(verb, file)


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (PermissionError(errno.EACCES, "Permission denied", "mine.stl"), "mine.stl: Permission denied"),
        (OSError(errno.ENOSPC, "No space left on device"), "standard output: No space left on device"),
    ],
)
def test_an_error_of_the_system_that_the_user_can_mend_is_a_line(
    error: OSError, said: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sweep.results.summary.describe", Mock(side_effect=error))
    refused(invoke("info", file), said)


NONSENSE = {
    "NUMBA_NUM_THREADS": ["0", "-1", "abc", "1.5"],
    "NUMBA_DISABLE_JIT": ["yes"],
    "NUMBA_THREADING_LAYER": ["mine"],
}


@pytest.mark.parametrize("name", NONSENSE)
def test_nonsense_in_the_environment_is_a_line(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for value in NONSENSE[name]:
        monkeypatch.setenv(name, value)
        refused(invoke("examples"), f"{name}: must be ", f"not '{value}'")
    monkeypatch.setenv(name, "")
    assert invoke("examples").exit_code == 0


def test_a_threading_layer_whose_library_is_missing_is_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(environment._POOLS, "tbb", "no_such_module")
    monkeypatch.setenv("NUMBA_THREADING_LAYER", "tbb")
    refused(invoke("examples"), "NUMBA_THREADING_LAYER: tbb cannot be loaded: No module named", "unset the variable")


def test_a_backend_that_is_not_installed_is_not_asked_for(file: Path) -> None:
    """Matplotlib takes it from the environment when it is imported, and a notebook sets one that only it has."""
    assert python("-m", "sweep", "plot", file, MPLBACKEND="nobody_has_it").stderr == ""


VERBS = ["run", "trajectory", "critical", "boundaries --x n0 --y mu --set n0=[0.02,0.05]"]


@pytest.fixture
def _no_work(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing may be compiled or computed."""
    for name in ("sweep.engine.plan.build", "sweep.kernels.kernel.Kernel.advance", "sweep.reproduce.reproduce"):
        monkeypatch.setattr(name, Mock(side_effect=AssertionError("computed")))


@pytest.mark.usefixtures("_no_work")
@pytest.mark.parametrize("verb", [*VERBS, "reproduce", "animate"])
def test_a_disk_that_cannot_be_written_is_refused_at_once(
    verb: str, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = OSError(errno.EROFS, "Read-only file system", "/hidden/.tmp")
    monkeypatch.setattr("sweep.results.writing.TemporaryFile", Mock(side_effect=error))
    config = [] if verb == "reproduce" else [write(TEXT)]
    output = tmp_path / ("out.gif" if verb == "animate" else "out")
    result = invoke(*verb.split(), *config, "--output", output)
    refused(result, f"{output}", ": cannot be written: Read-only file system; choose another --output")
    assert "/." not in result.stderr.replace(str(tmp_path), "")
    assert not output.exists()


@pytest.mark.usefixtures("_no_work")
def test_a_lock_that_cannot_be_made_names_the_dataset(write: Write, tmp_path: Path) -> None:
    (tmp_path / "out" / ".quick.lock").mkdir(parents=True)
    refused(invoke("run", write(TEXT), "--output", tmp_path / "out"), "out/quick.nc: cannot be locked: Is a directory")


def test_a_file_that_cannot_be_written_is_named_and_not_its_temporary_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = OSError(errno.EROFS, "Read-only file system", "hidden")
    monkeypatch.setattr(Path, "unlink", Mock(side_effect=error))
    with pytest.raises(sweep.FileError) as refusal, replacing(tmp_path / "x.png"):
        raise error
    assert str(refusal.value) == f"{tmp_path / 'x.png'}: cannot be written: Read-only file system"


def test_a_picture_needs_a_free_name_in_a_folder_that_is_there(file: Path, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    for target in ("folder.png", "nowhere/x.png"):
        refused(invoke("plot", file, "--output", tmp_path / target), "cannot be written: ")


def test_a_missing_file_that_has_the_name_of_an_example_says_how_to_get_it(tmp_path: Path) -> None:
    for name in ("quick", "quick.yaml"):
        refused(invoke("run", tmp_path / name), f"{name}: no such file; `sweep examples quick` copies the example of")
    refused(invoke("animate", tmp_path / "quick"), "`sweep examples quick`")


CUTS: dict[str, tuple[Callable[[xr.Dataset], xr.Dataset], str]] = {
    "one of them": (lambda d: d.isel(trajectory=0), "lacks the axis trajectory of status and 2 other things; it was"),
    "no spin": (lambda d: d.drop_vars("spin"), "lacks the variable spin; it was cut or averaged"),
    "averaged": (lambda d: d.mean("time", keep_attrs=True), "lacks the variable time and 1 other thing; it was cut"),
    "bare": (lambda d: d.drop_attrs(), "not a dataset of sweep, or sweep_kind was dropped; keep it with"),
    "of nothing": (lambda d: d.isel(trajectory=slice(0)), "the axis trajectory has no values; select at least one"),
}
"""What may be done to a dataset of trajectories."""


@pytest.mark.parametrize("change", CUTS)
def test_a_changed_dataset_says_what_it_lacks(change: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changed, said = CUTS[change]
    found = changed(sweep.trajectory({"model": "averaged", "friction": {"mu": [50, 60]}}, t_end=20))
    monkeypatch.setattr("sweep.results.kind.open_dataset", lambda *_, **__: found)  # netCDF does not store all of them
    for verb in ("info", "plot"):
        refused(invoke(verb, tmp_path / "changed.nc"), f"changed.nc: {said}")


def test_a_cluster_without_distributed_says_what_to_install(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(sweep.FileError, match=r"tcp://here:1: needs distributed, which is not installed: pip install"):
        sweep.run(write(TEXT), client="tcp://here:1")
