"""A hash of what a function means changes with what it does, and with nothing else."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from sweep.jit import called, compiled, exactly_compiled, fingerprint, inline
from sweep.meaning import Unknown, meaning

PLAIN = """
FACTOR = 2.0

def helper(x):
    return x + FACTOR

def make(limit=3.0):
    def function(x, offset=1.0):
        if x > limit:
            return np.sqrt(helper(x)) + offset
        return 0.0
    return function
"""


def of(text: str, **more: Any) -> Callable[..., Any]:
    """Return what `make` of a text makes."""
    names: dict[str, Any] = {"np": np, **more}
    exec(text, names)
    made: Callable[..., Any] = names["make"]()
    return made


def edited(old: str, new: str) -> str:
    assert old in PLAIN
    return PLAIN.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("FACTOR = 2.0", "FACTOR = 3.0"),  # a number of the module
        ("x + FACTOR", "x - FACTOR"),  # a function that is called
        ("limit=3.0", "limit=4.0"),  # a variable of the enclosing function
        ("offset=1.0", "offset=1.5"),  # a default
        ("return 0.0", "return -0.0"),
        ("np.sqrt", "np.exp"),
        ("x > limit", "x >= limit"),
        ("np.sqrt(helper(x))", "helper(np.sqrt(x))"),
    ],
)
def test_an_edit_changes_the_meaning(old: str, new: str) -> None:
    assert meaning(of(edited(old, new))) != meaning(of(PLAIN))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("FACTOR = 2.0", "FACTOR = 2.0  # a comment\nUNUSED = 1"),
        ("    return x + FACTOR", '    """Return the sum."""\n\n    return x + FACTOR  # a comment'),
        ("def make", "def unused(x):\n    return x\n\n\ndef make"),
        ("        if x", '        """Return a root."""\n        if x'),
    ],
)
def test_comments_docstrings_and_what_is_not_used_do_not(old: str, new: str) -> None:
    assert meaning(of(edited(old, new))) == meaning(of(PLAIN))


class Pair(NamedTuple):
    first: float
    second: float


class Other(NamedTuple):
    second: float
    first: float


USING = "def make():\n    def function(x):\n        return used(x, 1.0)\n    return function\n"


def test_compiled_functions_options_records_and_arrays_count() -> None:
    plain = of(PLAIN)
    ways = [
        *(plain, compiled(plain), exactly_compiled(plain), inline(of(PLAIN)), called(of(PLAIN)), Pair, Other),
        *(np.zeros(2), np.ones(2), np.ones(3), (1, 2), [1, 2], np.float32(1.0), 1.0, {1}, {2}, np.sin, np.cos),
    ]
    assert len({meaning(of(USING, used=way)) for way in ways}) == len(ways)


def test_a_recursive_function_has_a_meaning() -> None:
    text = "def make():\n    def function(x):\n        return function(x - 1) if x else 0.0\n    return function\n"
    assert meaning(of(text)) == meaning(of(text))


def test_where_something_is_unknown_the_sources_of_all_numeric_code_count() -> None:
    one, other = (of(USING, used=object()), of(USING.replace("1.0", "2.0"), used=object()))
    with pytest.raises(Unknown):
        meaning(one)
    assert fingerprint(one) == fingerprint(other)
