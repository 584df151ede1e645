"""What a dataset holds: labels, units, and all sources that decide its numbers; it is written whole or not at all."""

import os
import resource
import shutil
import signal
import stat
from pathlib import Path

import grimp
import numpy as np
import pytest
import xarray as xr
from support import ROOT, Write

import sweep
from sweep.faults import FileError
from sweep.kernels.measures import MEASURES
from sweep.results import netcdf, provenance
from sweep.results.dataset import STATUSES, VARIABLES
from sweep.results.writing import replacing

OF_OTHERS = {"method", "t_first_reversal_predicted", "n_c2_simulated", "n_c2_bracket", "n_c_reason"}
"""Variables of datasets of another kind, or made with other settings."""


def test_dataset_is_labelled(small: xr.Dataset) -> None:
    assert dict(small.sizes) == {"mu": 2, "b": 3, "n0": 2, "sign": 2}
    assert small["reversals"].dims == ("mu", "b", "n0")
    assert (small["n_c1"].dims, small["form_factor"].dims) == (("mu", "b", "sign"), ("mu", "b"))
    assert small["sign"].values.tolist() == [1, -1]
    assert (small["n_c1_linear"] * small["sign"] > 0).all()
    assert set(small.coords) == {"mu", "b", "n0", "sign", "a", "c", "delta", "x0", "y0"}
    for name, variable in small.variables.items():
        assert "long_name" in variable.attrs, name
        assert variable.attrs.get("units") != "1", name  # or xarray's labels would end with "[1]"
    assert small["delta"].attrs["units"] == "radian"
    asked = {name for kind in MEASURES.values() if not kind.by_default for name in kind.variables}
    assert set(small.data_vars) == {*VARIABLES} - asked - OF_OTHERS
    assert {name: str(small[name].dtype) for name in ("reversals", "status", "spin_final", "reversals_predicted")} == {
        "reversals": "int16", "status": "int8", "spin_final": "float64", "reversals_predicted": "int16",
    }  # fmt: skip
    flags = dict(zip(small["status"].attrs["flag_values"], small["status"].attrs["flag_meanings"].split(), strict=True))
    known = ["not_run", "settled", "time_limit", "lift_off", "diverged", "paradox", "toppled"]
    assert flags == STATUSES == dict(enumerate(known)) | {8: "impossible"}


def test_a_dataset_records_where_it_comes_from(small: xr.Dataset) -> None:
    attributes = small.attrs
    assert attributes["Conventions"] == "CF-1.11"
    assert "t_end: 1500" in attributes["config"]
    assert len(attributes["config_hash"]) == len(attributes["source_hash"]) == 16
    assert attributes["git_commit"] != "unknown" or not (ROOT / ".git").exists()
    assert attributes["trajectories_per_second"] == pytest.approx(12 / attributes["wall_time"])
    assert {"numba_version", "numpy_version", "xarray_version", "sweep_version", "integrator", "cpu"} <= set(attributes)


def test_only_what_is_named_is_measured(write: Write, small: xr.Dataset) -> None:
    nothing = sweep.run(write(), measure=[])
    assert not {"reversals", "t_last_reversal", "spin_mean", "energy_error"} & set(nothing.data_vars)
    times = sweep.run(write(), measure=["reversals", {"reversal_times": 3}])
    assert "energy_error" not in times
    xr.testing.assert_equal(times["reversals"], small["reversals"])


def test_cells_without_a_reversal_have_no_time_of_one(small: xr.Dataset) -> None:
    without = small["reversals"] == 0
    assert (np.isnan(small["t_last_reversal"]) == without).all()
    assert (small["t_last_reversal"] < small["t_stop"]).where(~without, True).all()
    assert float(small["t_stop"].max()) <= 1500


def test_a_file_is_on_the_disk_before_it_gets_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, fsync, replace, done = tmp_path / "x.nc", os.fsync, os.replace, list[str]()

    def flush(handle: int) -> None:
        done.append(f"flush {'folder' if stat.S_ISDIR(os.fstat(handle).st_mode) else os.fstat(handle).st_size}")
        fsync(handle)

    def rename(old: Path, new: Path) -> None:
        done.append("rename")
        replace(old, new)

    monkeypatch.setattr(os, "fsync", flush)
    monkeypatch.setattr(os, "replace", rename)
    with replacing(path) as temporary:
        temporary.write_text("whole")
    assert done == ["flush 5", "rename", "flush folder"]


def test_no_temporary_file_survives_a_failure(tmp_path: Path) -> None:
    def fill_the_disk() -> None:
        with replacing(tmp_path / "x.nc") as temporary:
            temporary.write_text("half")
            raise OSError("full")

    with pytest.raises(FileError, match="cannot be written: full"):
        fill_the_disk()
    assert list(tmp_path.iterdir()) == []


def test_a_temporary_name_that_is_taken_by_a_link_is_not_followed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "mine").write_text("kept")
    (tmp_path / ".x.nc.7.part").symlink_to("mine")
    monkeypatch.setattr("secrets.randbits", lambda _: 7)
    with pytest.raises(FileError, match="cannot be written: File exists"), replacing(tmp_path / "x.nc") as temporary:
        temporary.write_text("whole")
    assert (tmp_path / "mine").read_text() == "kept"


def test_a_file_that_does_not_fit_leaves_no_data_behind(tmp_path: Path) -> None:
    """HDF5 never closes it, so that its space is free only if it is empty."""
    numbers = np.random.default_rng(0).random(100_000)
    handles, limit = Path("/proc/self/fd"), resource.getrlimit(resource.RLIMIT_FSIZE)
    usual = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, limit[1]))
        with pytest.raises(FileError, match=r"x\.nc: cannot be written: File too large"):
            netcdf.write(tmp_path / "x.nc", xr.Dataset({"a": ("x", numbers)}))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, usual)
    assert list(tmp_path.iterdir()) == []
    removed = [each for each in handles.iterdir() if os.path.islink(each) and str(tmp_path) in os.readlink(each)]
    assert [each.stat().st_size for each in removed] in ([], [0])


@pytest.mark.parametrize("whole", [True, False], ids=["whole", "in pieces"])
def test_a_changed_bit_is_noticed(whole: bool, tmp_path: Path) -> None:
    """One that makes 257 reversals of one."""
    counts, path = np.ones(70_000, "int16"), tmp_path / "x.nc"
    dataset = xr.Dataset({"reversals": ("mu", counts)}, {"mu": np.arange(70_000)})
    if whole:
        netcdf.write(path, dataset)
    else:
        netcdf.write(path, dataset, {"reversals": (70_000,)}, [("reversals", slice(None), counts)])
    assert (netcdf.open_dataset(path).reversals == 1).all()
    data = bytearray(path.read_bytes())
    data[data.index(counts[:1000].tobytes()) + 501] ^= 1
    path.write_bytes(data)
    with pytest.raises(FileError, match=r"x\.nc: not a netCDF dataset, or damaged"):
        netcdf.open_dataset(path)


def test_what_the_makers_of_datasets_import_decides() -> None:
    graph = grimp.build_graph("sweep", cache_dir=None)
    for module in [name for name in graph.modules if name.startswith("sweep.plots")]:
        graph.remove_module(module)
    makers = ["sweep.engine.run", *(name for name in graph.modules if name.startswith("sweep.studies."))]
    imported = set(makers).union(*map(graph.find_upstream_modules, makers))
    decisive = {path.relative_to(ROOT).with_suffix("") for path in provenance.decisive_sources()}
    assert imported - {".".join(path.parts).removesuffix(".__init__") for path in decisive} == set()


def test_an_edit_changes_the_hash_where_it_can_change_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a copy of the package."""
    package = Path(shutil.copytree(ROOT / "sweep", tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__")))
    monkeypatch.setattr(provenance, "_PACKAGE", package)
    read = provenance.sources.__wrapped__  # a process reads them once

    def changed(name: str) -> bool:
        before = read()
        with (package / name).open("a", encoding="utf-8") as stream:
            stream.write("# edited\n")
        return read() != before

    assert not any(map(changed, ("explorer/page.py", "plots/picture.py", "cli/runs.py", "bench/new.py")))
    assert all(map(changed, ("config/schema.py", "engine/local.py", "kernels/adams/new.py", "models/user/loading.py")))


def test_each_status_has_a_mask(small: xr.Dataset) -> None:
    one = small.isel(mu=0, b=0, n0=0).expand_dims(cell=len(STATUSES)).assign(status=("cell", [*STATUSES]))
    for k, name in enumerate(STATUSES.values()):
        assert getattr(one.sweep, name).values.nonzero()[0].tolist() == [k]
