"""Loops over lanes are vectorised as widely as the CPU can, and the width changes no bit."""

from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
import pytest
from support import ROOT
from support.processes import python

WIDE = "+avx512f,+avx512vl,+avx512dq,+avx512bw,+avx2,+fma,+avx,+prefer-256-bit"
"""A CPU of the kind for which LLVM prefers vectors narrower than the widest."""


def run(code: str, cache: Path, **environment: str) -> str:
    return python("-c", code, NUMBA_CACHE_DIR=str(cache), **environment).stdout


@pytest.mark.x86
@pytest.mark.parametrize(("called", "wide"), [("full_width()", True), ("pass", False)])
def test_the_widest_vectors_against_the_preference_of_the_compiler(called: str, wide: bool, tmp_path: Path) -> None:
    """The code is looked at, not run, so that any CPU will do."""
    lines = [called, "for i in range(64):", "    y[i] = x[i] * 2.0 + y[i]"]
    code = f"""
import numba
from sweep.jit import compiled, full_width
from sweep.models.generated import compile_inline
add = compiled(compile_inline("add", "x, y", {lines}, {{"full_width": full_width()}}))
add.compile((numba.float64[::1], numba.float64[::1]))
print(next(iter(add.inspect_asm().values())))
"""
    assembly = run(code, tmp_path, NUMBA_CPU_NAME="skylake-avx512", NUMBA_CPU_FEATURES=WIDE)
    assert ("zmm" in assembly) == wide


@pytest.mark.release
@pytest.mark.skipif(not llvm.get_host_cpu_features().get("avx512f"), reason="the CPU has no wider vectors to compare")
def test_the_same_bits_in_narrower_vectors(tmp_path: Path) -> None:
    code = f"""
import sys, numpy as np, sweep
from sweep.jit import vector_bits
for method in ("dopri5", "adams"):
    run = sweep.run({str(ROOT / "configs" / "quick.yaml")!r}, method=method, n0=0.05, b=[1.2, 3.0, 8.5], t_end=1000)
    np.save(f"{tmp_path}/{{vector_bits()}}-{{method}}.npy", np.stack([run.spin_final, run.reversals, run.t_stop]))
"""
    run(code, tmp_path / "512")
    features = ",".join(f"+{name}" for name, has in llvm.get_host_cpu_features().items() if has and "512" not in name)
    run(code, tmp_path / "256", NUMBA_CPU_NAME="haswell", NUMBA_CPU_FEATURES=features)
    for method in ("dopri5", "adams"):
        wide, narrow = (np.load(tmp_path / f"{bits}-{method}.npy") for bits in (512, 256))
        np.testing.assert_array_equal(wide, narrow)
