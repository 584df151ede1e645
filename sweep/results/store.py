"""Files of a run: the checkpoint it resumes from and the dataset it ends with.

The dataset is netCDF4 with one chunk a tile, written at the end from the tiles that the checkpoint
keeps as files of their own.  An HDF5 file that a killed process was writing can be lost as a whole,
a folder of finished files cannot; and the user gets one file that opens without this program, which
a zarr folder written in place would not be before it is complete.

One writer, one way to write: a temporary file in the same folder, flushed to the disk, then renamed
over the old one.  A file with its final name is complete.
"""

from __future__ import annotations

import fcntl
import json
import os
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from sweep.config import files
from sweep.config.faults import printable
from sweep.grid import Array

_PROBE = 1 << 22
"""Bytes; more than HDF5 writes at once."""


class StoreError(Exception):
    """A file of the run that cannot be used; the message says which, why, and what to do."""


@dataclass(frozen=True)
class Identity:
    """What the numbers of a run depend on.  Runs of one identity can go on from each other."""

    config: str
    """The resolved configuration, as YAML."""
    config_hash: str
    source_hash: str
    """Of the numeric sources and of the libraries that compile them."""
    versions: str
    """Of this program and of those libraries."""

    @classmethod
    def of(cls, raw: Any) -> Identity:
        """The identity that a file says; `ValueError` if it says none."""
        if not isinstance(raw, dict) or {str} != set(map(type, raw.values())) or set(raw) != set(cls.__annotations__):
            raise ValueError("no identity of a run")
        return cls(**raw)

    def difference(self, other: Identity) -> str:
        """Why a run of `other` cannot go on from this one; "" if it can."""
        if self.config_hash != other.config_hash:
            old, new = (c.config.splitlines() for c in (self, other))
            changed = [f"- {printable(line.strip())}" for line in old if line not in new]
            changed += [f"+ {printable(line.strip())}" for line in new if line not in old]
            return "another configuration:\n  " + "\n  ".join(changed or ["the table of cases differs"])
        if self.versions != other.versions:
            return f"other versions: {self.versions or 'unknown'}, now {other.versions}"
        return "other sources of the model or kernel" if self.source_hash != other.source_hash else ""


class Checkpoint:
    """What a run keeps until it is finished: a folder of finished tiles and the images of unfinished ones.

    A file that cannot be read is as good as none: its cells are computed again.
    """

    def __init__(self, folder: Path, identity: Identity, note: Callable[[str], None]) -> None:
        """Go on from what is in `folder`; `StoreError` if that is of another run."""
        self.folder, self.note, self.identity = folder, note, identity
        head = folder / "identity.json"
        if head.exists():
            try:
                found = Identity.of(json.loads(files.read(head, files.MIB)))
            except (OSError, ValueError, RecursionError) as error:
                raise StoreError(f"{head}: damaged ({error}); start again with --fresh") from None
            _refuse_other(folder, found, identity)
        else:
            folder.mkdir(exist_ok=True)
            with replacing(head) as temporary:
                temporary.write_text(json.dumps(identity.__dict__), encoding="utf-8")
        for left in folder.glob(".*.part"):
            left.unlink()
        numbered = [path for path in folder.iterdir() if re.fullmatch(r"\d{6,}\.npz", path.name)]
        self.done = {int(path.stem) for path in numbered if self._read(path) is not None}

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        """Keep the results of a tile."""
        self._write(self.folder / f"{tile:06d}.npz", arrays)
        self.done.add(tile)

    def load(self, tile: int) -> dict[str, Array]:
        path = self.folder / f"{tile:06d}.npz"
        arrays = self._read(path)
        if arrays is None:
            raise StoreError(f"{path}: damaged while the run went on; the same command computes it again")
        return arrays

    def save_running(self, tiles: list[int], tables: Mapping[str, Array], seconds: float) -> None:
        """Keep the tables of images of the `tiles` that are being computed."""
        head = {"tiles": np.array(tiles), "seconds": np.array(seconds)}
        self._write(self.folder / "running.npz", {**head, **tables})

    def load_running(self) -> tuple[list[int], dict[str, Array], float] | None:
        """Tiles, tables and seconds spent of the last `save_running`, unless these tiles are done."""
        tables = self._read(self.folder / "running.npz")
        if tables is None or not {"tiles", "seconds"} <= set(tables):
            return None
        numbers, spent = tables.pop("tiles"), tables.pop("seconds")
        if (numbers.ndim, numbers.dtype.kind, spent.ndim, spent.dtype.kind) != (1, "i", 0, "f"):
            return None
        tiles, seconds = numbers.tolist(), float(spent)
        if not tiles or len(set(tiles)) < len(tiles) or any(table.dtype.kind != "f" for table in tables.values()):
            return None
        return None if self.done & set(tiles) else (tiles, tables, seconds)

    def _stamp(self, path: Path, names: Iterable[str]) -> str:
        """What a file carries that tells it from other files and other runs', and from one with arrays lost."""
        run = self.identity
        return f"{path.stem}: {', '.join(names)}; {run.config_hash} {run.source_hash}, {run.versions}"

    def _write(self, path: Path, arrays: Mapping[str, Array]) -> None:
        named: dict[str, Any] = {**arrays, "stamp": np.array(self._stamp(path, arrays))}
        with replacing(path) as temporary, temporary.open("wb") as stream:
            np.savez(stream, **named)

    def _read(self, path: Path) -> dict[str, Array] | None:
        """The arrays in a file of this run, whose checksums have been looked at; None where it cannot be read."""
        try:
            if path.exists() and not path.is_file():
                raise OSError("not a file")  # opening a pipe would wait for its other end
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                if damaged := archive.zip.testzip():  # numpy's reading ends where a damaged header says
                    raise ValueError(f"checksum of {damaged}")
                arrays = {name: archive[name] for name in archive.files}
            if arrays.pop("stamp", None) != self._stamp(path, arrays):
                raise ValueError("not a file of this run")
            return arrays
        except FileNotFoundError:
            return None
        except Exception as error:  # what a damaged archive makes zipfile and numpy raise is not listed anywhere
            self.note(f"{path}: damaged ({error}); its cells are computed again")
            path.unlink()
            return None


class Memory:
    """In the place of a `Checkpoint` where nothing is to be written."""

    def __init__(self) -> None:
        self.done: set[int] = set()
        self._tiles: dict[int, dict[str, Array]] = {}

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        self._tiles[tile] = dict(arrays)

    def load(self, tile: int) -> dict[str, Array]:
        return self._tiles[tile]

    def save_running(self, tiles: list[int], tables: Mapping[str, Array], seconds: float) -> None:
        """Nothing outlives this process."""

    def load_running(self) -> None:
        return None


@dataclass(frozen=True)
class RunFiles:
    """The files of the run `name` in `folder`."""

    folder: Path
    name: str

    @property
    def dataset(self) -> Path:
        return self.folder / f"{self.name}.nc"

    @property
    def picture(self) -> Path:
        return self.folder / f"{self.name}.png"

    @property
    def checkpoint(self) -> Path:
        return self.folder / f"{self.name}.checkpoint"

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other runs of this name out of the folder; `StoreError` if one is in it.

        The lock is the kernel's and ends with the process, however it ends.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f".{self.name}.lock"
        while True:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(handle)
                raise StoreError(
                    f"{self.folder / self.name}: another run is at work there; allowed: wait, or another --output"
                ) from None
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), path.stat()):
                    break
            os.close(handle)  # of a file that the run before has just removed
        try:
            self._sweep_up()
            yield
        finally:
            path.unlink(missing_ok=True)
            os.close(handle)

    def _sweep_up(self) -> None:
        """Remove the unfinished files of a run that was killed."""
        for target in (self.dataset, self.picture):
            for path in self.folder.glob(f".{target.name}.*.part"):
                if path.suffixes[-2][1:].isdigit():  # else it is of a run whose name begins like this one's
                    path.unlink()

    def has_dataset(self, identity: Identity) -> bool:
        """Whether the finished dataset of `identity` is there.

        Raises
        ------
        StoreError
            where the file is of another run, or not a dataset of this program.
        """
        if not self.dataset.exists():
            return False
        with open_dataset(self.dataset, load=False) as dataset:
            found = Identity(*(str(dataset.attrs.get(key, "")) for key in Identity.__dataclass_fields__))
        _refuse_other(self.dataset, found, identity)
        return True

    def save_tiles(
        self,
        frame: xr.Dataset,
        variables: Mapping[str, tuple[xr.Variable, tuple[int, ...]]],
        blocks: Iterable[tuple[str, Any, Array]],
    ) -> None:
        """Write the finished dataset, block by block: it need not fit into memory.

        Parameters
        ----------
        frame : coordinates, attributes and small variables
        variables : what is filled from `blocks`: empty variables with their attributes, and the
            chunks in which they are stored
        blocks : name, place in the array, values
        """
        with replacing(self.dataset) as temporary:
            try:
                write_frame(frame, temporary)
                with netCDF4.Dataset(temporary, "a") as file:
                    for name, (variable, chunks) in variables.items():
                        fill = np.nan if variable.dtype.kind == "f" else None
                        target = file.createVariable(
                            name,
                            variable.dtype,
                            tuple(map(str, variable.dims)),
                            fill_value=fill,
                            chunksizes=chunks or None,
                        )
                        target.setncatts(variable.attrs)
                    for name, place, values in blocks:
                        file[name][place] = values
            except RuntimeError as error:  # netCDF's own, which does not tell what the system said
                _probe(temporary)
                raise StoreError(f"{self.dataset}: cannot be written: {error}") from None

    def save_result(self, dataset: xr.Dataset, figure: Figure) -> None:
        """Write a dataset that no run resumes from, and its picture."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.save_tiles(dataset, {}, [])
        self.save_picture(figure)

    def save_picture(self, figure: Figure) -> None:
        with replacing(self.picture) as temporary:
            figure.savefig(temporary, format="png")

    def discard(self) -> None:
        # The picture first: without its dataset it would pass for the next one's.
        for path in (self.picture, self.dataset):
            path.unlink(missing_ok=True)
        self.discard_checkpoint()

    def discard_checkpoint(self) -> None:
        if self.checkpoint.exists():
            shutil.rmtree(self.checkpoint)


def write_frame(frame: xr.Dataset, path: Path) -> None:
    filled = {name for name, variable in frame.data_vars.items() if variable.dtype.kind == "f"}
    encoding = {name: {"_FillValue": None} for name in set(frame.variables) - filled}
    frame.to_netcdf(path, format="NETCDF4", engine="netcdf4", encoding=encoding)


def _refuse_other(path: Path, found: Identity, wanted: Identity) -> None:
    if reason := found.difference(wanted):
        raise StoreError(
            f"{path}: not resumed, it comes from {reason}\n"
            "  allowed: the same configuration, another --output, or --fresh to discard that run"
        )


def open_dataset(path: Path, *, load: bool = True) -> xr.Dataset:
    """Read a dataset, into memory or as it is asked for; `StoreError` if it is none."""
    if not path.is_file():
        raise StoreError(f"{path}: {'not a file' if path.exists() else 'no such file'}")
    try:
        if load:
            _refuse_larger_than_memory(path)
        dataset = xr.open_dataset(path, engine="netcdf4", decode_times=False)
        if load:
            with dataset:
                dataset.load()
        return dataset
    except StoreError:
        raise
    except Exception as error:  # what damaged files make HDF5, netCDF and xarray raise is not listed anywhere
        raise StoreError(f"{path}: not a netCDF dataset: {error}") from None


def _refuse_larger_than_memory(path: Path) -> None:
    """A file of a few bytes can declare any number of values."""
    with netCDF4.Dataset(path) as file:
        size = sum(variable.size * np.dtype(variable.dtype).itemsize for variable in file.variables.values())
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if size > memory:
        raise StoreError(f"{path}: {size / 2**30:.3g} GiB of data; allowed: at most {memory / 2**30:.3g}, the memory")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path that becomes `path`, all at once, if the block succeeds."""
    if path.is_dir() or not path.parent.is_dir():
        raise StoreError(f"{path}: cannot be written: {'a folder' if path.is_dir() else f'no folder {path.parent}'}")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        _flush(temporary)
        os.replace(temporary, path)
        _flush(path.parent)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        temporary.unlink(missing_ok=True)


def _probe(path: Path) -> None:
    """Write to a file that another library failed to write, for the system's own error."""
    with path.open("ab") as stream:
        stream.write(bytes(_PROBE))
        os.fsync(stream.fileno())


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
