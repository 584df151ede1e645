"""Compiled kernels are found again by later processes, and never after an edit of what they are made of."""

import os
import re
import shutil
from pathlib import Path

import pytest
from support import ROOT
from support.processes import python

from sweep.faults import CompileError
from sweep.kernels.layout import Layout
from sweep.kernels.measures.measurement import Measurement

# The averaged model: its kernel compiles fastest.
SCRIPT = """
import sys
import numpy as np
from sweep.engine.executor import execute
from sweep.kernels.methods import make_kernel
from sweep.models import MODELS
from sweep.parameters import PAPER_PARAMETERS

body = {name: np.array([60.0 if name == "mu" else p.default]) for name, p in PAPER_PARAMETERS.items()}
for measure in sys.argv[1:]:
    kernel = make_kernel("dopri5", MODELS["averaged"], measure.split("+"))
    found = kernel.advancing.is_compiled()
    rows = kernel.start(body, np.array([0.1]), 50.0)
    execute(kernel, rows)
    print("found" if found else "compiled", repr(float(kernel.model.energy(*kernel.unpack(rows))[0][0])))
"""


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package without compiled kernels."""
    folder = tmp_path_factory.mktemp("copy")
    shutil.copytree(ROOT / "sweep", folder / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def process(copy: Path, *measures: str) -> list[tuple[str, float]]:
    """Whether a new process finds the kernel of each set of measurements, and the spin that it comes to."""
    lines = python("-c", SCRIPT, *measures, folder=copy, NUMBA_CACHE_DIR="").stdout.splitlines()
    return [(line.split()[0], pytest.approx(float(line.split()[1]), rel=1e-13)) for line in lines]


@pytest.mark.campaign
def test_kernels_are_found_again_kept_apart_and_compiled_anew_after_an_edit(copy: Path) -> None:
    ((how, nothing),) = process(copy, "")
    assert how == "compiled"
    ((how, reversals),) = process(copy, "reversals")
    assert how == "compiled"

    # Kernels compiled by two processes once called each other's loops in a third.
    assert process(copy, "", "reversals") == [("found", nothing), ("found", reversals)]
    assert process(copy, "reversals", "") == [("found", reversals), ("found", nothing)]

    # A comment, a docstring, and the code of a measurement that is not in the kernel.
    measures = copy / "sweep" / "kernels" / "measures"
    edit(measures / "reversals.py", "from __future__", "# A comment.\nfrom __future__")
    edit(measures / "margin.py", "@inline", "@called")
    edit(measures / "margin.py", "import inline", "import called, inline")
    assert process(copy, "", "reversals") == [("found", nothing), ("found", reversals)]

    # An edit of another file than the kernel's, of the same length, its times kept.
    edit(copy / "sweep" / "models" / "ladder" / "averaged.py", "p.half_m4 + n", "p.half_m4 - n")
    ((how, changed),) = process(copy, "")
    assert how == "compiled"
    assert changed != nothing

    # Both versions stay.
    edit(copy / "sweep" / "models" / "ladder" / "averaged.py", "p.half_m4 - n", "p.half_m4 + n")
    assert process(copy, "") == [("found", nothing)]


def edit(file: Path, old: str, new: str) -> None:
    times, text = file.stat(), file.read_text(encoding="utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))


CHECK, MAKE = "        def check(group, lane, seen):\n", "    def make_check(self, layout: Layout):\n"


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("old", "new", "below", "words"),
    [
        (CHECK, f"{CHECK}            gruop[0] = 1.0\n", 1, "does not compile: .*gruop"),
        (CHECK, f"{CHECK}            group[lane] = np.nosuch(seen.spin)\n", 1, "does not compile: .*nosuch"),
        (CHECK, CHECK.replace("seen", "sen"), 9, "does not compile: NameError: name 'seen'"),
        (CHECK, CHECK.replace(", seen", ""), -1, r"does not compile: check\(group, lane\) is called with .*, seen\):"),
        (MAKE, f'{MAKE}        layout.at("dnoe")\n', 1, r"does not compile: no quantity 'dnoe' .*did you mean done\?"),
        (MAKE, MAKE.replace(", layout: Layout", ""), 0, r"Margin.make_check\(\) takes 1 positional argument but 2"),
    ],
    ids=["name", "function", "argument", "missing argument", "quantity", "missing argument of the hook"],
)
def test_a_typo_in_a_hook_is_named_in_two_lines(
    old: str, new: str, below: int, words: str, copy: Path, tmp_path: Path
) -> None:
    margin = copy / "sweep" / "kernels" / "measures" / "margin.py"
    text = (ROOT / margin.relative_to(copy)).read_text(encoding="utf-8")
    margin.write_text(text.replace(old, new), encoding="utf-8")
    line = 1 + text[: text.index(old)].count("\n") + below
    scene = ["-m", "sweep", "run", ROOT / "configs" / "quick.yaml", "--quiet", "--set", "integrator.method=dopri5"]
    said = python(*scene, "--output", tmp_path, folder=copy, code=1, NUMBA_CACHE_DIR="").stderr.splitlines()
    assert len(said) == 2
    assert re.match(f"{re.escape(str(margin))}:{line}: {words}", said[0]), said


def test_a_misspelt_hook_is_refused() -> None:
    """It would never be called, and its quantity would stay zero."""
    with pytest.raises(CompileError, match=r":\d+: .*Own.make_stp is not a hook \(did you mean make_step\?\)"):

        class Own(Measurement):
            def make_stp(self, layout: Layout, at_reversal: object) -> None: ...
