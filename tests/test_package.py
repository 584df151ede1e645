"""The package as a user installs it: a wheel in a fresh environment, every verb run from another folder."""

import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from support import ROOT

pytestmark = pytest.mark.campaign

CONFIG = """\
name: small
body: {b: [2.0, 3.0]}
friction: {mu: [40, 60]}
integrator: {t_end: 100}
"""

ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "NUMBA"))}
"""Without what could lead to this checkout or to its compiled kernels."""


def checkout(folder: Path) -> Path:
    """A copy of what the package is made of, in a folder that is named as the package is."""
    copy = folder / "sweep"
    shutil.copytree(ROOT / "sweep", copy / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md"):
        shutil.copy(ROOT / name, copy)
    return copy


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy: setuptools leaves a `build` folder, whose old files would get into the next wheel."""
    source, target = checkout(tmp_path_factory.mktemp("source")), tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", target, source]
    subprocess.run(command, check=True, env=ENVIRONMENT)
    (path,) = target.glob("*.whl")
    return path


def call(folder: Path, *command: str | Path) -> str:
    """The standard output of a command run in `folder`, which has to succeed."""
    done = subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_wheel_holds_every_file_of_the_package_and_the_configurations(wheel: Path) -> None:
    listed = call(ROOT, "git", "ls-files", "--cached", "--others", "--exclude-standard", "sweep", "configs").split()
    expected = {re.sub("^configs/", "sweep/examples/", name) for name in listed if name != "sweep/examples"}
    with zipfile.ZipFile(wheel) as archive:
        assert {name for name in archive.namelist() if name.startswith("sweep/")} == expected


VERBS = {
    "run small.yaml": ["runs/small/small.nc", "runs/small/small.png"],
    "run small.yaml --dry-run": [],
    "trajectory small.yaml --at mu=60 --at b=3": [
        "runs/small/small_trajectory.nc", "runs/small/small_trajectory.png",
    ],
    "critical small.yaml --bracket 0.1": ["runs/small/small_critical.nc", "runs/small/small_critical.png"],
    "plot runs/small/small.nc --variable energy_error": ["runs/small/small_energy_error.png"],
    "info runs/small/small.nc": [],
    "body --mass 30g --length 12cm --width 3cm --height 15mm": [],
    "examples tippe_top": ["tippe_top.yaml", "tippe_top.py"],
    "reproduce --help": [],
    "bench --help": [],
}  # fmt: skip
"""Commands, and the files they must write."""


def test_the_folder_above_an_editable_install_hides_nothing(tmp_path: Path) -> None:
    """Python finds the checkout there as a namespace without any name, unless a path leads to the package first."""
    python = tmp_path / "environment" / "bin" / "python"
    call(tmp_path, sys.executable, "-m", "venv", "environment")
    call(tmp_path, python, "-m", "pip", "install", "-q", "--no-deps", "-e", checkout(tmp_path))
    assert call(tmp_path, python, "-c", "import sweep; print(sweep.__all__)")


USER = """\
import numpy as np
import sweep

reveal_type(sweep.run({"friction": {"mu": 60}}, mu=np.array([1.0]), progress=False))
reveal_type(sweep.predict("x.yaml"))
reveal_type(sweep.load_config("x.yaml").axes)
sweep.run(3)
sweep.run("x.yaml", fresh="yes")
sweep.nothing
"""
"""A user's program, and what a type checker has to say of its lines."""

TYPES = [
    *['Revealed type is "xarray.core.dataset.Dataset"'] * 2,
    'Revealed type is "dict[str, tuple[float, ...]]"',
    'Argument 1 to "run" has incompatible type "int"',
    'Argument "fresh" to "run" has incompatible type "str"',
    'Module has no attribute "nothing"',
]


def test_in_a_fresh_environment_every_verb_runs_and_type_hints_arrive(wheel: Path, tmp_path: Path) -> None:
    """With the wheel and what it depends on, and nothing else."""
    python = tmp_path / "environment" / "bin" / "python"
    call(tmp_path, sys.executable, "-m", "venv", "environment")
    call(tmp_path, python, "-m", "pip", "install", "-q", wheel)
    (tmp_path / "small.yaml").write_text(CONFIG, encoding="utf-8")
    for command, files in VERBS.items():
        call(tmp_path, python, "-m", "sweep", *command.split())
        assert [name for name in files if not (tmp_path / name).is_file()] == [], command
    assert call(tmp_path, python.parent / "sweep", "--version").startswith("sweep, version ")
    (tmp_path / "user.py").write_text(USER, encoding="utf-8")
    checked = [sys.executable, "-m", "mypy", "--strict", "--python-executable", python, "user.py"]
    done = subprocess.run(checked, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    said = [line for line in done.stdout.splitlines() if line.startswith("user.py:")]
    assert [words in line for words, line in zip(TYPES, said, strict=True)] == [True] * len(TYPES), done.stdout
