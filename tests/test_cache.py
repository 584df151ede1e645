"""Compiled kernels are found again, and never when a source they are made of has changed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT

SCRIPT = """
import sweep
from sweep.engine.plan import plan
told = []
plan(sweep.load_config("c.yaml"), compiling=lambda: told.append(True))
print("compiled" if told else "found")
print(repr(float(sweep.run("c.yaml").spin_final)))
"""


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "sweep", tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "c.yaml").write_text("friction: {mu: 60}\nintegrator: {t_end: 20, step: 0.02}\n", encoding="utf-8")
    return tmp_path


def once(folder: Path) -> tuple[str, float]:
    command = [sys.executable, "-c", SCRIPT]
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    compiled, spin = result.stdout.split()
    return compiled, float(spin)


def test_second_process_finds_the_kernel_and_an_edit_makes_a_new_one(copy: Path) -> None:
    first = once(copy)
    assert first[0] == "compiled"
    assert once(copy) == ("found", first[1])

    # An edit of a helper in another file than the kernel's, of the same length, its times kept.
    file = copy / "sweep" / "models" / "slip.py"
    times = file.stat()
    text = file.read_text(encoding="utf-8")
    edited = text.replace("g1, g2, g3 = u1 - mu * v1", "g1, g2, g3 = u1 - mu * v2", 1)
    assert edited != text
    assert len(edited) == len(text)
    file.write_text(edited, encoding="utf-8")
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))
    changed = once(copy)
    assert changed[0] == "compiled"
    assert changed[1] != first[1]


def test_kernels_of_two_processes_keep_apart_in_a_third(copy: Path) -> None:
    """Each compiled in a process of its own; together they once called each other's loops."""
    run = "import sweep; print([float(sweep.run('c.yaml', measure=m).spin_final) for m in {}])"
    measures = ([], ["reversals"], ["reversals", "energy_error"])

    def spins(*asked: list[str]) -> list[float]:
        command = [sys.executable, "-c", run.format(list(asked))]
        result = subprocess.run(command, cwd=copy, capture_output=True, text=True, check=True)
        return [float(spin) for spin in result.stdout.strip("[]\n").split(",")]

    alone = [spins(measure)[0] for measure in measures]
    assert spins(*measures) == alone
    assert spins(*measures[::-1]) == alone[::-1]
