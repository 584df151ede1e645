"""How a command ends: a user's error is one line, before anything is computed; a bug shows its traceback."""

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
from support.runs import same_numbers

import sweep
from sweep.cli import environment

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
def test_an_error_of_the_program_shows_its_traceback(
    error: Exception, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def _without_locks(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    monkeypatch.setattr("fcntl.flock", Mock(side_effect=OSError(number, "No locks available")))


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, 524])
def test_a_run_on_a_disk_without_locks_says_so_in_a_line(
    number: int, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = sweep.run(write(TEXT))
    _without_locks(monkeypatch, number)
    result = invoke("run", write(TEXT), "--output", tmp_path / "out")
    assert result.exit_code == 0
    said = f"{tmp_path / 'out'}: its file system has no locks; do not start another run of this name there\n"
    assert result.stderr.count(said) == 1
    same_numbers(sweep.open_dataset(tmp_path / "out" / "quick.nc"), expected)
    assert not (tmp_path / "out" / ".quick.lock").exists()


LOCKS = "its file system has no locks, which HDF5 needs; set HDF5_USE_FILE_LOCKING=FALSE in the environment"


@pytest.mark.usefixtures("_no_work")
@pytest.mark.parametrize("verb", VERBS)
def test_a_disk_where_hdf5_needs_locks_is_refused_at_once(
    verb: str, write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the error that netCDF raises there."""
    _without_locks(monkeypatch, errno.ENOLCK)
    monkeypatch.setattr("netCDF4.Dataset", Mock(side_effect=PermissionError(errno.EACCES, "Permission denied")))
    refused(invoke(*verb.split(), write(TEXT), "--output", tmp_path / "out"), f".nc: {LOCKS}")
    assert not (tmp_path / "out").exists()


def test_a_sound_file_on_a_disk_without_locks_is_not_called_damaged(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _without_locks(monkeypatch, errno.ENOLCK)
    monkeypatch.setattr(xr, "open_dataset", Mock(side_effect=OSError(-101, "NetCDF: HDF error")))
    refused(invoke("info", file), f"{file}: {LOCKS}")


@pytest.mark.usefixtures("_no_work")
def test_a_checkpoint_that_is_a_link_is_refused(write: Write, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "mine").mkdir()
    for target in ("../mine", "nowhere"):
        (tmp_path / "out" / "quick.checkpoint").symlink_to(target)
        refused(invoke("run", write(TEXT), "--output", tmp_path / "out", "--fresh"), "quick.checkpoint: a link, where")
        (tmp_path / "out" / "quick.checkpoint").unlink()
    (tmp_path / "out" / ".quick.lock").symlink_to("../mine/lock")
    refused(invoke("run", write(TEXT), "--output", tmp_path / "out"), "cannot be locked: Too many levels of symbolic")
    assert list((tmp_path / "mine").iterdir()) == []


def test_the_configuration_of_a_fit_is_written_whole_or_not_at_all(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In place of the one before, not into it."""
    monkeypatch.setattr("sweep.studies.laws.fitted", lambda *_: xr.Dataset(attrs={"config": "new: 1\n"}))
    monkeypatch.setattr("sweep.cli.runs._save", lambda *_: None)
    (tmp_path / "film.csv").write_text("t,spin\n")
    (tmp_path / "mine.yaml").write_text("old: 1\n")
    (tmp_path / "quick_fit.yaml").symlink_to("mine.yaml")
    words = ("fit", write(TEXT), tmp_path / "film.csv", "--free", "mu", "--output", tmp_path, "--quiet")
    assert invoke(*words).exit_code == 0
    assert (tmp_path / "quick_fit.yaml").read_text() == "new: 1\n"
    assert (tmp_path / "mine.yaml").read_text() == "old: 1\n"


def test_a_picture_needs_a_free_name_in_a_folder_that_is_there(file: Path, tmp_path: Path) -> None:
    (tmp_path / "folder.png").mkdir()
    for target in ("folder.png", "nowhere/x.png"):
        refused(invoke("plot", file, "--output", tmp_path / target), "cannot be written: ")


def test_a_missing_file_that_has_the_name_of_an_example_says_how_to_get_it(tmp_path: Path) -> None:
    for name in ("quick", "quick.yaml"):
        refused(invoke("run", tmp_path / name), f"{name}: no such file; `sweep examples quick` copies the example of")
    refused(invoke("animate", tmp_path / "quick"), "`sweep examples quick`")


CUTS: dict[str, tuple[Callable[[xr.Dataset], xr.Dataset], str]] = {
    "no spin": (lambda d: d.drop_vars("spin"), "lacks the variable spin; it was cut or averaged"),
    "averaged": (lambda d: d.mean("time", keep_attrs=True), "lacks the variable time and 1 other thing; it was cut"),
    "bare": (lambda d: d.drop_attrs(), "not a dataset of sweep, or sweep_kind was dropped; keep it with"),
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
