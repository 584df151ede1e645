"""Find the place of an error raised by the code of a user's model."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from os.path import abspath

from sweep.faults import InputError, fault_of, refusing
from sweep.jit import compiler_said
from sweep.models.origin import Origin


@contextmanager
def blamed(origin: Origin | None, *, always: bool = False) -> Iterator[None]:
    """Turn errors raised by the code of a user's model, or all errors, into an `InputError` that gives the place."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        line = _line(error, origin) if origin else None
        if origin is None or (line is None and not always):
            raise
        raise fault_of(_words(error), file=origin.place, line=line) from None


def _line(error: Exception, origin: Origin) -> int | None:
    """Line in the user's code, from Python's traceback or Numba's message; None if the error comes from elsewhere."""
    chain = filter(None, (error, error.__cause__))
    lines = [(f.f_code.co_filename, n) for each in chain for f, n in traceback.walk_tb(each.__traceback__)]
    lines = [*filter(None, [refusing(error)]), *lines, *compiler_said(error)[0]]
    found = [n for file, n in lines if abspath(file) == abspath(origin.place)]
    return found[-1] if found else None


def _words(error: Exception) -> str:
    arithmetic = (
        "inline functions are plain arithmetic and NumPy's functions of numbers, such as np.sqrt and np.minimum"
    )
    if reason := compiler_said(error)[1]:
        return f"does not compile: {reason}; {arithmetic}, and call only others marked sweep.jit.inline"
    if "truth value of an array" in str(error):
        return f"a branch on arrays; {arithmetic}"
    first, *_ = str(error).strip().splitlines() or [""]
    return f"{type(error).__name__}: {first.strip()}"
