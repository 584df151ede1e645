"""One Runge-Kutta step, unrolled from its tableau into straight-line code on scalars.

A loop over stages and states would need arrays, and arrays inside the loop over lanes stop LLVM
from vectorising across trajectories.  So the step is written out once per tableau and number of
states: plain assignments, which dissolve into registers.
"""

from __future__ import annotations

import linecache
from collections.abc import Iterable
from typing import Any

import numba

from sweep.jit import OPTIONS, inline
from sweep.kernels.tableau import Tableau


def make_step(tableau: Tableau, rhs: Any, n_states: int) -> Any:
    """Compiled step (states, constants, h) -> (states, spin, ∫spin, work, sound, airborne, jammed).

    The states after time h; the spin before it; the integrals over the step of spin and dissipated
    power, by the method's own weights; whether in every stage the normal force and the Painlevé
    denominator were positive (`sound`, false also where they are not numbers), whether in some
    stage the force (`airborne`) or the denominator (`jammed`) was not.
    """
    return compile_inline("step", step_source(tableau, n_states), {"rhs": rhs})


def step_source(tableau: Tableau, n_states: int) -> str:
    """The step as Python source."""
    last = tableau.stages - 1
    lines = ["def step(y, p, h):", "    k0, m0 = rhs(y, p)"]
    for stage, row in enumerate(tableau.a, start=1):
        weights = {j: f"h{stage}_{j}" for j, w in enumerate(row) if w}
        lines += [f"    {name} = h * {float(row[j])!r}" for j, name in weights.items()]
        sums = [_sum(f"{name} * k{j}[{i}]" for j, name in weights.items()) for i in range(n_states)]
        lines.append(f"    k{stage}, m{stage} = rhs({_tuple(f'y[{i}] + ({sums[i]})' for i in range(n_states))}, p)")
    b = {j: repr(float(w)) for j, w in enumerate(tableau.b) if w}
    stages = range(last + 1)
    sums = [_sum(f"{w} * k{j}[{i}]" for j, w in b.items()) for i in range(n_states)]
    result = _tuple(f"y[{i}] + h * ({sums[i]})" for i in range(n_states))
    return "\n".join(
        [
            *lines,
            f"    spin_integral = h * ({_sum(f'{w} * m{j}[0]' for j, w in b.items())})",
            f"    work = h * ({_sum(f'{w} * m{j}[1]' for j, w in b.items())})",
            f"    sound = {' & '.join(f'(m{j}[2] > 0.0) & (m{j}[3] > 0.0)' for j in stages)}",
            f"    airborne = {' | '.join(f'(m{j}[2] <= 0.0)' for j in stages)}",
            f"    jammed = {' | '.join(f'(m{j}[3] <= 0.0)' for j in stages)}",
            f"    return {result}, m0[0], spin_integral, work, sound, airborne, jammed",
        ]
    )


def make_load(first: int, count: int, lanes: int) -> Any:
    """Compiled (group, lane) -> tuple of `count` rows of one lane, from row `first` on."""
    rows = _tuple(f"group[{(first + i) * lanes} + lane]" for i in range(count))
    return compile_inline("load", f"def load(group, lane):\n    return {rows}", {})


def make_store(first: int, count: int, lanes: int) -> Any:
    """Compiled (group, lane, keep, new, old): writes `new` where `keep`, else `old`."""
    lines = [f"    group[{(first + i) * lanes} + lane] = new[{i}] if keep else old[{i}]" for i in range(count)]
    return compile_inline("store", "\n".join(["def store(group, lane, keep, new, old):", *lines]), {})


def make_rest(n_states: int, spin_state: int) -> Any:
    """Compiled states -> states: the same spin without rattle."""
    rest = _tuple(f"y[{i}]" if i == spin_state else "0.0" for i in range(n_states))
    return compile_inline("rest", f"def rest(y):\n    return {rest}", {})


def compile_lanes(name: str, arguments: str, lines: Iterable[str], lanes: int, names: dict[str, Any]) -> Any:
    """Compiled (arguments) -> None: `lines` for each lane.  They are the loop body itself: as a function of
    their own LLVM unrolls the lanes before it inlines, and nothing vectorises."""
    source = [f"def {name}({arguments}):", f"    for lane in range({lanes}):", *(f"        {line}" for line in lines)]
    return numba.njit(compile_inline(name, "\n".join(source), names), **OPTIONS)


def _tuple(items: Iterable[str]) -> str:
    return f"({' '.join(item + ',' for item in items)})"


def _sum(terms: Iterable[str]) -> str:
    return " + ".join(terms)


def compile_inline(name: str, source: str, names: dict[str, Any]) -> Any:
    """Compile generated source; tracebacks and debuggers find it by its file name."""
    filename = f"<sweep {name} {hash(source):x}>"
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    exec(compile(source, filename, "exec"), names)
    return inline(names[name])
