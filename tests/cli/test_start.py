"""How a command starts: it loads nothing that it does not need, and Ctrl-C is one line from the beginning on."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from support import SMALL, Write
from support.processes import python

HEAVY = {"numba", "llvmlite", "xarray", "pandas", "netCDF4", "dask", "distributed", "matplotlib", "scipy"}
"""Each takes from a tenth of a second to a whole one."""

HELP = [["--help"], ["--version"], ["run", "--help"], ["body", "--help"], ["run", "--colour"], ["run"], ["colour"]]

REFUSED = {
    "not YAML": ("run", "body: {b: 3\n"),
    "not measured": ("run", "friction: {mu: 60}\nmeasure: [colour]\n"),
    "off the body": ("run", "friction: {mu: 60}\nstart: {x0: 50}\n"),
    "too long a step": ("run", "friction: {mu: 60}\nintegrator: {step: 5}\n"),
    "no setting": ("trajectory --set mu", SMALL),
    "no parameter": ("trajectory --at colour=1", SMALL),
}
"""Commands and configurations."""

_IMPORT = re.compile(r"import time:.*\| +(\S+)")


COMPLETED = {
    "run c.yaml --set integrator.t": "integrator.tolerance= integrator.t_end=",
    "run c.yaml --set friction.mu_":
        "friction.mu_static= friction.mu_viscous= friction.mu_rolling= friction.mu_spinning=",
    "trajectory c.yaml --at d": "delta= density=",
    "run c.yaml --dry": "--dry-run",
    "traj": "trajectory",
}  # fmt: skip
"""What is typed, and how the shell may go on."""


@pytest.mark.parametrize("typed", COMPLETED)
def test_the_shell_completes_and_loads_nothing_heavy(typed: str) -> None:
    words = f"sweep {typed}".split(" ")
    asked = {"_SWEEP_COMPLETE": "bash_complete", "COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    done = python("-X", "importtime", "-m", "sweep", **asked)
    assert [line.removeprefix("plain,") for line in done.stdout.split()] == COMPLETED[typed].split()
    assert {name.partition(".")[0] for name in _IMPORT.findall(done.stderr)} & HEAVY == set()


PROGRAM = """
import json, sys
from sweep.cli import main

codes = []
for words in json.loads(sys.argv[1]):
    try:
        main(words, prog_name="sweep")
    except SystemExit as end:
        codes.append(end.code)
print(json.dumps([codes, [*sys.modules]]))
"""


def loaded(commands: list[list[str]]) -> tuple[list[int], set[str]]:
    """The exit codes of commands, one after another in a process of their own, and the packages that they load."""
    codes, modules = json.loads(python("-c", PROGRAM, json.dumps(commands)).stdout.splitlines()[-1])
    return codes, {name.partition(".")[0] for name in modules}


def test_help_loads_next_to_nothing() -> None:
    codes, packages = loaded(HELP)
    assert codes == [0 if {"--help", "--version"} & {*words} else 2 for words in HELP]
    assert "click" in packages
    assert packages & (HEAVY | {"numpy", "pydantic", "ruamel", "rich"}) == set()


def test_a_request_is_refused_before_anything_heavy_is_loaded(write: Write) -> None:
    files = enumerate(REFUSED.values())
    codes, packages = loaded([[*command.split(), str(write(text, f"{i}.yaml"))] for i, (command, text) in files])
    assert codes == [2] * len(REFUSED)
    assert packages & HEAVY == set()


def test_the_package_loads_what_is_asked_for() -> None:
    program = """
import sys, sweep
assert dir(sweep) == sorted(sweep.__all__)
for name, loaded in (("run", set()), ("load_config", {"numpy"}), ("plot", {"numpy", "xarray"})):
    getattr(sweep, name)
    assert {"numpy", "xarray"} & set(sys.modules) == loaded
"""
    python("-c", program)


@pytest.mark.parametrize(
    "moment",
    [
        pytest.param("click", id="before there is a command"),
        pytest.param("pydantic", id="while the configuration is read"),
        pytest.param("numba", id="before the run"),
    ],
)
def test_an_interrupt_during_start_is_one_line(moment: str, write: Write, tmp_path: Path) -> None:
    command = [sys.executable, "-X", "importtime", "-m", "sweep", "run", write(SMALL), "--output", tmp_path / "out"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr
        printed = []
        for line in process.stderr:
            printed.append(line)
            if _IMPORT.fullmatch(line.rstrip()) and line.split()[-1] == moment:
                process.send_signal(signal.SIGINT)
                printed += process.stderr.readlines()
        assert process.wait() == 130
    assert [line for line in printed if not line.startswith("import time:")] == ["interrupted\n"]
    assert not (tmp_path / "out").exists()
