"""The store of a run that can be stopped at any moment and resumed."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from sweep.faults import FileError
from sweep.grid import Array
from sweep.results.provenance import Identity, require_same
from sweep.results.store import Running, Store
from sweep.results.writing import replacing

_IDENTITY = TypeAdapter(Identity)


class Checkpoint(Store):
    """A folder with a file for each finished tile and one for the running tiles.

    A file that cannot be read counts as missing: its cells are computed again.
    """

    def __init__(self, folder: Path, identity: Identity, note: Callable[[str], None]) -> None:
        """Resume from `folder`, or create it.

        Parameters
        ----------
        note : called with a line for each damaged file

        Raises
        ------
        FileError
            if `folder` belongs to another run.
        """
        self.folder, self.note, self.identity = folder, note, identity
        head = folder / "identity.json"
        if head.exists():
            try:
                found = _IDENTITY.validate_json(head.read_bytes())
            except (OSError, ValueError):
                raise FileError(f"{head}: damaged; start again with --fresh") from None
            require_same(folder, found, identity)
        else:
            folder.mkdir(exist_ok=True)
            with replacing(head) as temporary:
                temporary.write_bytes(_IDENTITY.dump_json(identity))
        for left in folder.glob(".*.part"):
            left.unlink()
        numbered = [path for path in folder.iterdir() if re.fullmatch(r"\d{6,}\.npz", path.name)]
        self.done: set[int] = {int(path.stem) for path in numbered if self._read(path) is not None}

    def save(self, tile: int, arrays: Mapping[str, Array]) -> None:
        self._write(self.folder / f"{tile:06d}.npz", arrays)
        self.done.add(tile)

    def load(self, tile: int) -> dict[str, Array]:
        path = self.folder / f"{tile:06d}.npz"
        arrays = self._read(path)
        if arrays is None:
            raise FileError(f"{path}: damaged during the run; the same command computes it again")
        return arrays

    def save_running(self, running: Running) -> None:
        head = {"tiles": np.array(running.tiles), "seconds": np.array(running.seconds)}
        self._write(self.folder / "running.npz", {**head, **running.tables})

    def load_running(self) -> Running | None:
        tables = self._read(self.folder / "running.npz")
        if tables is None:
            return None
        tiles, seconds = tables.pop("tiles").tolist(), float(tables.pop("seconds"))
        return None if self.done & set(tiles) else Running(tiles, tables, seconds)

    def _stamp(self, path: Path, names: Iterable[str]) -> str:
        """Return the text that identifies a file, which differs for another tile or run, or if an array is lost."""
        run = self.identity
        return f"{path.stem}: {', '.join(names)}; {run.config_hash} {run.source_hash}, {run.versions}"

    def _write(self, path: Path, arrays: Mapping[str, Array]) -> None:
        named: dict[str, Any] = {**arrays, "stamp": np.array(self._stamp(path, arrays))}
        with replacing(path) as temporary, temporary.open("wb") as stream:
            np.savez(stream, **named)

    def _read(self, path: Path) -> dict[str, Array] | None:
        """Return the arrays of a file, with checksums verified; None if it is missing or unusable."""
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                if damaged := archive.zip.testzip():  # numpy stops reading where a damaged header ends the data
                    raise ValueError(f"checksum of {damaged}")
                arrays = {name: archive[name] for name in archive.files}
            if arrays.pop("stamp", None) != self._stamp(path, arrays):
                raise ValueError("not a file of this run")
            return arrays
        except FileNotFoundError:
            return None
        except Exception as error:  # the errors that zipfile and numpy raise for a damaged archive are undocumented
            self.note(f"{path}: damaged ({error}); its cells are computed again")
            path.unlink()
            return None
