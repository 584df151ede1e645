"""Reads files that a user names: only regular files, and none larger than is sensible."""

from __future__ import annotations

import errno
import stat
from pathlib import Path

MIB = 1 << 20


def read(path: Path, limit: int) -> str:
    """The text of a file of at most `limit` bytes.

    Raises
    ------
    OSError
        if it cannot be read, is too large or is not a regular file; `strerror` says which.
    UnicodeDecodeError
        if it is not UTF-8.
    """
    try:
        mode = path.stat().st_mode
    except ValueError as error:  # the name contains a NUL or half a character
        raise OSError(errno.EINVAL, str(error), str(path)) from None
    # Reading a pipe may wait for ever, and a device may never end.
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a pipe or device"
        raise OSError(errno.EINVAL, f"{what}; allowed: a regular file", str(path))
    with path.open("rb") as stream:
        data = stream.read(limit + 1)
    if len(data) > limit:
        raise OSError(errno.EFBIG, f"too large; allowed: at most {limit // MIB} MiB", str(path))
    return data.decode("utf-8-sig")
