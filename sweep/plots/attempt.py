"""Draw the picture of a dataset that has been written and is complete without it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import xarray as xr

from sweep.faults import Error, FileError


def attempt(result: xr.Dataset, path: Path, note: Callable[[str], None], variable: str | None = None) -> None:
    """Draw a dataset, or one of its variables, into a file; if it cannot be drawn, say so in a note.

    Raises
    ------
    FileError
        if the file cannot be written, as on a full disk.
    """
    from sweep.plots import picture  # importing matplotlib takes a third of the time of `import sweep`

    try:
        picture.plot(result, variable, output=path)
    except FileError:
        raise
    except Error as error:
        note(f"no picture{f' of {variable}' if variable else ''}: {error}")
