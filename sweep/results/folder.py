"""The files of a run in its output folder: dataset, picture, checkpoint and lock."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import xarray as xr

from sweep.faults import FileError
from sweep.results import netcdf
from sweep.results.provenance import Identity
from sweep.results.writing import NO_LOCKS, remove_unfinished, replacing, require_writable


class RunFiles:
    """The files of the run `name` in `folder`, with pictures of `variables`."""

    def __init__(self, folder: Path, name: str, variables: Sequence[str] = ()) -> None:
        self.folder, self.name, self._variables = folder, name, variables
        self.dataset, self.picture, self.configuration, self.checkpoint = (
            folder / f"{name}.{suffix}" for suffix in ("nc", "png", "yaml", "checkpoint")
        )
        self.earlier = self.checkpoint / "earlier.nc"
        """The dataset of a smaller run, kept here until the dataset of the larger run replaces it."""

    def pictures(self, variables: Sequence[str]) -> dict[Path, str | None]:
        """Return the pictures of a run that names these variables, each with its variable, or None for the default."""
        further = {self.folder / f"{self.name}_{name}.png": name for name in variables[1:]}
        return {self.picture: variables[0] if variables else None, **further}

    def require_writable(self) -> None:
        """Raise a `FileError` if dataset or picture cannot be written."""
        for path in (self.dataset, self.picture):
            require_writable(path)
        netcdf.require_usable(self.dataset)
        if self.checkpoint.is_symlink():
            raise FileError(f"{self.checkpoint}: a link, where a folder of this run belongs; remove it")

    @contextmanager
    def locked(self, note: Callable[[str], None]) -> Iterator[None]:
        """Keep other runs of this name out of the folder.

        The operating system holds the lock and releases it when the process ends, for whatever reason. Where the file
        system has no locks, `note` is called with a line that says so.

        Raises
        ------
        FileError
            if another run is using the folder, or nothing can be written.
        """
        self.require_writable()
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / f".{self.name}.lock"
        while True:
            try:
                handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o644)
            except OSError as error:
                raise FileError(f"{self.dataset}: cannot be locked: {error.strerror}") from None
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(handle)
                words = "in use by another run; wait for it, or choose another --output"
                raise FileError(f"{self.folder / self.name}: {words}") from None
            except OSError as error:
                if error.errno not in NO_LOCKS:
                    os.close(handle)
                    raise FileError(f"{self.dataset}: cannot be locked: {error.strerror}") from None
                note(f"{self.folder}: its file system has no locks; do not start another run of this name there")
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), path.stat()):
                    break
            os.close(handle)  # a run that has just ended removed this lock file after we opened it
        try:
            for target in (self.dataset, *self.pictures(self._variables)):
                remove_unfinished(target)
            yield
        finally:
            path.unlink(missing_ok=True)
            os.close(handle)

    def identity(self) -> Identity | None:
        """Return the identity of the existing dataset; None if there is none.

        Raises
        ------
        FileError
            if the file is not a dataset.
        """
        if not self.dataset.exists():
            return None
        with self.opened(self.dataset, load=False) as dataset:
            return Identity(*(str(dataset.attrs.get(key, "")) for key in Identity.__dataclass_fields__))

    def opened(self, path: Path, *, load: bool = True) -> xr.Dataset:
        """Open the dataset at `path`, one of these files; raises as `open_dataset`, with advice on how to go on."""
        try:
            return netcdf.open_dataset(path, load=load)
        except FileError as error:
            raise FileError(f"{error}; discard it with --fresh, or choose another --output") from None

    def keep_earlier(self) -> None:
        """Keep the existing dataset while the run that enlarges it goes on."""
        self.checkpoint.mkdir(exist_ok=True)
        with replacing(self.earlier) as temporary:
            temporary.unlink()
            try:
                os.link(self.dataset, temporary)
            except OSError:  # the file system has no links
                shutil.copyfile(self.dataset, temporary)

    def discard(self) -> None:
        """Remove all files that an earlier run left."""
        # Remove the picture first: without its dataset it would be taken for the next one's.
        for path in (self.picture, self.dataset):
            path.unlink(missing_ok=True)
        self.discard_checkpoint()

    def discard_checkpoint(self) -> None:
        if self.checkpoint.exists():
            shutil.rmtree(self.checkpoint)
