"""Says where an error comes from that the code of a user's model has raised."""

from __future__ import annotations

import re
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from os.path import abspath

from sweep.faults import ConfigError, fault_of
from sweep.models.origin import Origin


@contextmanager
def blamed(origin: Origin | None, *, always: bool = False) -> Iterator[None]:
    """Turn errors that come from the code of a user's model, or all errors, into a `ConfigError` that says where."""
    try:
        yield
    except ConfigError:
        raise
    except Exception as error:
        place, line = _place(error, origin) if origin else ("", None)
        if origin is None or not (place or always):
            raise
        raise fault_of(_words(error), file=place or origin.place, line=line) from None


def _place(error: Exception, origin: Origin) -> tuple[str, int | None]:
    """File and line of the user's code, by Python's traceback or by what Numba tells; "" if it comes from elsewhere."""
    known = {abspath(file): file for file in origin.files}
    chain = filter(None, (error, error.__cause__))
    lines = [(f.f_code.co_filename, n) for each in chain for f, n in traceback.walk_tb(each.__traceback__)]
    if where := getattr(error, "loc", None):
        lines.append((where.filename, where.line))
    lines += [(file, int(line)) for file, line in _FILE.findall(str(error))]
    found = [(known[abspath(file)], n) for file, n in lines if abspath(file) in known]
    return found[-1] if found else ("", None)


_FILE = re.compile(r'File "(.+?)", line (\d+)')


def _words(error: Exception) -> str:
    arithmetic = (
        "inline functions are plain arithmetic and NumPy's functions of numbers, such as np.sqrt and np.minimum"
    )
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    if type(error).__module__.startswith("numba"):
        # Numba tells, from the outermost function inwards: that it failed, and why.
        why = [after for before, after in pairwise(lines) if "Failed in" in before]
        return f"does not compile: {(why or lines)[-1]}; {arithmetic}, and call only others marked sweep.jit.inline"
    if "truth value of an array" in str(error):
        return f"a branch on arrays; {arithmetic}"
    return f"{type(error).__name__}: {lines[0] if lines else ''}"
