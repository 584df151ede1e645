"""Reads and writes datasets as netCDF4 files: written piece by piece, read whole or on demand.

A dataset is one file that opens without this program, stored tile by tile. It is written at the end of a run, from the
tiles in the store: an HDF5 file can be lost as a whole if the process writing it is killed, and a zarr folder written
in place can be opened before it is complete. Checksums reveal a changed bit when the values are read.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import netCDF4
import numpy as np
import xarray as xr

from sweep.faults import FileError
from sweep.grid import Array
from sweep.interrupt import deferred
from sweep.results.writing import lacks_locks, probe, replacing

_CHECKED = 1 << 17
"""Size in bytes above which a variable that is written as a whole has checksums, which take 3 kB for each variable."""


def write(
    path: Path,
    dataset: xr.Dataset,
    sizes: Mapping[str, tuple[int, ...]] | None = None,
    pieces: Iterable[tuple[str, Any, Array]] = (),
) -> None:
    """Write a dataset, some of whose variables may be larger than memory.

    Parameters
    ----------
    sizes : chunk shapes of the variables that are filled from `pieces`, by name
    pieces : name, place in the array, values
    """
    with replacing(path) as temporary:
        try:
            _write_frame(dataset.drop_vars(sizes or ()), temporary)
            with netCDF4.Dataset(temporary, "a") as file:
                for name, size in (sizes or {}).items():
                    variable = dataset[name]
                    fill = np.nan if variable.dtype.kind == "f" else None
                    dims = tuple(map(str, variable.dims))
                    target = file.createVariable(
                        name, variable.dtype, dims, fill_value=fill, chunksizes=size or None, fletcher32=bool(size)
                    )
                    target.setncatts(variable.attrs)
                for name, place, values in pieces:
                    file[name][place] = values
        except (OSError, RuntimeError, UnicodeError) as error:  # netCDF's own error hides the system's
            try:
                probe(temporary)
            finally:
                os.truncate(temporary, 0)  # HDF5 keeps a file open that it cannot finish, and with it a full disk
            raise FileError(f"{path}: cannot be written: {error}") from None


def _write_frame(frame: xr.Dataset, path: Path) -> None:
    filled = {name for name, variable in frame.data_vars.items() if variable.dtype.kind == "f"}
    encoding = {
        name: {"fletcher32": variable.nbytes > _CHECKED} | ({} if name in filled else {"_FillValue": None})
        for name, variable in frame.variables.items()
    }
    # If Ctrl-C arrived while xarray took its HDF5 lock, the lock stayed locked and closing the file waited for ever (1
    # in 60 runs interrupted while they wrote their dataset).
    with deferred():
        frame.to_netcdf(path, format="NETCDF4", engine="netcdf4", encoding=encoding)


def open_dataset(path: Path, *, load: bool = True) -> xr.Dataset:
    """Read a dataset into memory, or on demand with `load=False`; raise a `FileError` if it is not one."""
    if not path.is_file():
        raise FileError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    try:
        dataset = xr.open_dataset(path, engine="netcdf4", decode_times=False)
        if load:
            with dataset:
                dataset.load()
        return dataset
    except Exception as error:  # the errors that HDF5, netCDF and xarray raise for damaged files are undocumented
        if lacks_locks(path):
            raise _lockless(path) from None
        reason = getattr(error, "strerror", None) or error
        raise FileError(f"{path}: not a netCDF dataset, or damaged: {reason}") from None


def require_usable(path: Path) -> None:
    """Raise a `FileError` if HDF5 refuses to write at `path` because its file system has no locks."""
    existing = next(each for each in path.absolute().parents if each.exists())
    if lacks_locks(existing):
        with TemporaryDirectory(dir=existing) as folder:
            try:
                netCDF4.Dataset(Path(folder) / "probe.nc", "w").close()
            except OSError:
                raise _lockless(path) from None


def _lockless(path: Path) -> FileError:
    words = "its file system has no locks, which HDF5 needs; set HDF5_USE_FILE_LOCKING=FALSE in the environment"
    return FileError(f"{path}: {words}")
