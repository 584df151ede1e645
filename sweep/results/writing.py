"""Writes every file completely or not at all.

The bytes go to a temporary file in the same folder, are flushed to disk, and the file is then renamed over the old one.
A file with its final name is complete.
"""

from __future__ import annotations

import errno
import fcntl
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile

from sweep.faults import FileError

_PROBE = 1 << 22
"""Buffer size in bytes, larger than any HDF5 write."""

_BLOCK = 1 << 12
"""Number of bytes that fit unless the disk is full."""


NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, 524}
"""Errors of file systems without locks; Python has no name for 524, Linux's ENOTSUPP."""


def lacks_locks(path: Path) -> bool:
    """Return whether the file system of a file or a folder has no locks."""
    handle = os.open(path, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno in NO_LOCKS
    finally:
        os.close(handle)
    return False


def require_writable(path: Path) -> None:
    """Raise a `FileError` before anything is computed if a file cannot be written.

    A missing folder may be created later; nothing is left on the disk.
    """
    if path.is_dir():
        raise FileError(f"{path}: cannot be written: a folder")
    folder = next(each for each in path.absolute().parents if each.exists())
    try:
        with TemporaryFile(dir=folder) as stream:
            stream.write(bytes(_BLOCK))
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror}; choose another --output") from None


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path that is renamed to `path` if the block succeeds.

    Raises
    ------
    FileError
        if the file cannot be written.
    """
    if path.is_dir() or not path.parent.is_dir():
        raise FileError(f"{path}: cannot be written: {'a folder' if path.is_dir() else f'no folder {path.parent}'}")
    # As `mkstemp` does, but with the usual permissions: nobody can foresee the name and put a link there.
    temporary = path.with_name(f".{path.name}.{secrets.randbits(64)}.part")
    try:
        os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
        yield temporary
        _flush(temporary)
        os.replace(temporary, path)
        _flush(path.parent)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with suppress(OSError):  # a read-only disk raises this even for a file that does not exist
            temporary.unlink()


def remove_unfinished(path: Path) -> None:
    """Remove temporary files of `path` left by killed processes."""
    for left in path.parent.glob(f".{path.name}.*.part"):
        if left.suffixes[-2][1:].isdigit():  # otherwise the file belongs to another whose name begins like this one
            left.unlink()


def probe(path: Path) -> None:
    """Write to a file that another library failed to write, to get the system's own error."""
    with path.open("ab") as stream:
        stream.write(bytes(_PROBE))
        os.fsync(stream.fileno())


def _flush(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
