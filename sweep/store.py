"""Files of a run: the checkpoint it resumes from and the dataset it ends with.

One writer, one way to write: a temporary file in the same folder, flushed to the disk, then renamed
over the old one.  A file with its final name is complete.
"""

from __future__ import annotations

import json
import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from sweep.grid import Array


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

    def difference(self, other: Identity) -> str:
        """Why a run of `other` cannot go on from this one; "" if it can."""
        if self.config_hash != other.config_hash:
            old, new = (c.config.splitlines() for c in (self, other))
            changed = [f"- {line.strip()}" for line in old if line not in new]
            changed += [f"+ {line.strip()}" for line in new if line not in old]
            return "another configuration:\n  " + "\n  ".join(changed or ["the table of cases differs"])
        if self.source_hash != other.source_hash:
            return "other sources of the model or kernel, or other versions of numpy or numba"
        return ""


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

    def save_checkpoint(self, tables: Mapping[str, Array], identity: Identity, seconds: float) -> None:
        """Write the whole state of an unfinished run: its tables of images by method."""
        note = json.dumps(identity.__dict__ | {"seconds": seconds})
        named: dict[str, Any] = {"note": np.array(note), **tables}
        with replacing(self.checkpoint) as temporary, temporary.open("wb") as stream:
            np.savez(stream, **named)

    def load_checkpoint(self, identity: Identity, tables: Mapping[str, Array]) -> float | None:
        """Fill `tables` with what an unfinished run of `identity` left; the seconds it spent, None without one.

        Raises
        ------
        StoreError
            where the checkpoint is of another run, or damaged.
        """
        try:
            with self.checkpoint.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                note = json.loads(str(archive["note"]))
                found = {name: archive[name] for name in archive.files if name != "note"}
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise StoreError(f"{self.checkpoint}: damaged checkpoint ({error}); start again with --fresh") from None
        seconds = note.pop("seconds")
        self._refuse_other(self.checkpoint, Identity(**note), identity)
        if {name: images.shape for name, images in found.items()} != {name: t.shape for name, t in tables.items()}:
            raise StoreError(f"{self.checkpoint}: damaged checkpoint (other tables); start again with --fresh")
        for name, table in tables.items():
            table[:] = found[name]
        return float(seconds)

    def load_dataset(self, identity: Identity) -> xr.Dataset | None:
        """The finished dataset of `identity`; None where there is none.

        Raises
        ------
        StoreError
            where the file is of another run, or not a dataset of this program.
        """
        if not self.dataset.exists():
            return None
        dataset = open_dataset(self.dataset)
        found = Identity(*(str(dataset.attrs.get(key, "")) for key in ("config", "config_hash", "source_hash")))
        self._refuse_other(self.dataset, found, identity)
        return dataset

    def save_dataset(self, dataset: xr.Dataset) -> None:
        """Write the finished dataset; the checkpoint has then served."""
        filled = {name for name, variable in dataset.data_vars.items() if variable.dtype.kind == "f"}
        encoding = {name: {"_FillValue": None} for name in set(dataset.variables) - filled}
        with replacing(self.dataset) as temporary:
            try:
                dataset.to_netcdf(temporary, format="NETCDF4", engine="netcdf4", encoding=encoding)
            except RuntimeError as error:  # netCDF's own, of a full disk for one
                raise StoreError(f"{self.dataset}: cannot be written: {error}") from None
        self.checkpoint.unlink(missing_ok=True)

    def save_result(self, dataset: xr.Dataset, figure: Figure) -> None:
        """Write a dataset that no run resumes from, and its picture."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self.save_dataset(dataset)
        self.save_picture(figure)

    def save_picture(self, figure: Figure) -> None:
        with replacing(self.picture) as temporary:
            figure.savefig(temporary, format="png")

    def discard(self) -> None:
        for path in (self.dataset, self.picture, self.checkpoint):
            path.unlink(missing_ok=True)

    def _refuse_other(self, path: Path, found: Identity, wanted: Identity) -> None:
        if reason := found.difference(wanted):
            raise StoreError(
                f"{path}: not resumed, it comes from {reason}\n"
                "  allowed: the same configuration, another --output, or --fresh to discard that run"
            )


def open_dataset(path: Path) -> xr.Dataset:
    """Read a dataset into memory; `StoreError` if it is none."""
    try:
        with xr.open_dataset(path, engine="netcdf4") as dataset:
            return dataset.load()
    except (OSError, ValueError, RuntimeError) as error:
        reason = "no such file" if not path.exists() else f"not a netCDF dataset: {error}"
        raise StoreError(f"{path}: {reason}") from None


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
    finally:
        temporary.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
