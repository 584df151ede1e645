"""A debugger stops in the equations, and the source of a kernel says what it is bound to."""

import json
from collections.abc import Callable
from inspect import getsourcelines
from typing import Any

import numpy as np
import pytest
from support.processes import python

import sweep
from sweep.kernels import source
from sweep.models import symbols
from sweep.models.ladder import slip
from sweep.models.stiff import slip as stiff_slip

SCENE = {"body": {"b": 3.0}, "friction": {"mu": 60.0}, "start": {"n0": [0.05, -0.02]}}

DEBUGGED = """
import bdb, json, sys
import sweep

class Debugger(bdb.Bdb):
    def user_line(self, frame):
        if self.break_here(frame):
            way.clear()
            caller = frame
            while caller := caller.f_back:
                way.append(caller.f_code.co_name)
            if wanted in way:
                self.clear_all_breaks()
        self.set_continue()

way, (scene, method, file, line, wanted) = [], json.loads(sys.argv[1])
debugger = Debugger()
debugger.set_break(file, line)
found = debugger.runeval("sweep.run(scene, method=method, t_end=3)")
print(json.dumps([way, *(found[name].values.tolist() for name in ("spin_final", "energy_error", "step"))]))
"""


@pytest.mark.parametrize(
    ("method", "function", "wanted"),
    [
        ("dopri5", slip.equations(slip.MODEL.variant), "step"),
        pytest.param("adams", stiff_slip._compliance, "body", marks=pytest.mark.campaign),
    ],
)
def test_a_debugger_stops_in_the_equations(method: str, function: Callable[..., Any], wanted: str) -> None:
    """Without compilation a run takes the same steps in plain Python, to numbers that are the same to rounding."""
    file, head = function.__code__.co_filename, getsourcelines(function)[1] + 1
    line = min(line for *_, line in function.__code__.co_lines() if line and line > head)
    request = json.dumps([SCENE, method, file, line, wanted])
    way, spin, violation, step = json.loads(python("-c", DEBUGGED, request, NUMBA_DISABLE_JIT="1").stdout)
    assert wanted in way
    compiled = sweep.run(SCENE, method=method, t_end=3)
    np.testing.assert_array_equal(step, compiled.step)
    np.testing.assert_allclose(spin, compiled.spin_final, rtol=1e-12)
    np.testing.assert_allclose(violation, compiled.energy_error, rtol=1e-3)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (lambda y: np.arctan(y[0]), "arctan is not known to a trace; it knows whole powers and np.negative, np.sqrt"),
        (lambda y: y[0] if y[0] > y[1] else y[1], "cannot follow a branch; instead of `if`, write np.minimum"),
        (lambda y: y[0] or y[1], "cannot follow a branch; instead of `if`"),
        (lambda y: y[2], "tuple index out of range"),
    ],
    ids=["function", "comparison", "truth", "state"],
)
def test_equations_that_cannot_be_written_out_say_what_can(function: Callable[..., Any], said: str) -> None:
    with pytest.raises((TypeError, IndexError), match=said):
        symbols.specialised(function, y=2)


@pytest.mark.parametrize("interpreted", [False, True])
def test_a_state_vector_of_another_length_is_refused(interpreted: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbols, "INTERPRETED", interpreted)

    def scaled(y: tuple[float, ...], scale: float) -> float:
        return scale * y[0] + y[1]

    total = symbols.specialised(scaled, y=2, scale=None)
    assert total((1.0, 2.0), 3.0) == 5.0
    for states in ((1.0,), (1.0, 2.0, 3.0)):
        with pytest.raises(ValueError, match="values"):
            total(states, 3.0)


def test_the_printed_source_names_where_its_functions_are(capsys: pytest.CaptureFixture[str]) -> None:
    source.main("dopri5", "slip", "reversals")
    text = capsys.readouterr().out
    step = f"#   rhs: {slip.MODEL.rhs.__code__.co_filename}:1\ndef step(y, p, h):\n    k0, m0 = rhs(y, p)\n"
    rhs = f"#   rhs: {slip.__file__}:{getsourcelines(slip.equations(slip.MODEL.variant))[1]}\ndef rhs(y, p):\n"
    assert step in text
    assert rhs in text
    assert "Record\ndef load(group, lane):\n" in text
