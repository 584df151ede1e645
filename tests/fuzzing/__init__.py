"""Inputs that are nearly right, and what must hold for each of them.

A kind takes a source of randomness and a folder, makes one input, hands it in, and returns whether it was accepted.
It raises `Violation` where the input was neither accepted nor properly refused.  tests/test_fuzz.py tries some inputs
of each kind with hypothesis, and among the campaigns many.
"""

import os
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import click
import numpy as np
from click.testing import CliRunner

from sweep.cli import main
from sweep.cli.options import _values, loaded
from sweep.config import InputError, load_config
from sweep.config.document import dump
from sweep.config.schema import PATHS
from sweep.faults import FileError
from sweep.parameters import PARAMETERS

from .text import KEYS, ODD, block, damage, near_valid, tree


class Violation(AssertionError):
    """An input that was neither accepted nor properly refused."""


PHRASES = ("input should", "should be", "a valid ", "pydantic", "instance of", "field required", "extra inputs")
"""Words of pydantic's."""


def check_refusal(error: Exception, *files: str) -> None:
    """Every line of a refusal names a file, is short and printable, and says more than the name."""
    text = str(error)
    if spoken := [phrase for phrase in PHRASES if phrase in text.lower()]:
        raise Violation(f"a library's words, {spoken[0]!r}: {text!r:.500}")
    for line in text.split("\n"):
        named = [file for file in files if line.startswith(file)] or ([] if not line.startswith("  ") else [""])
        if not named or not line.isprintable() or not 0 < len(line) - len(named[0]) < 1500 or ": " not in line + ": ":
            raise Violation(f"a useless refusal: {line!r:.500} of {text!r:.500}")
    for fault in getattr(error, "faults", ()):
        if fault.line is not None and (fault.line < 1 or not fault.message):
            raise Violation(f"a fault without place or message: {fault!r:.500}")


def _refused(call: Callable[[], Any], *files: str) -> Any:
    """What `call` returns, or None if it refuses the input."""
    try:
        return call()
    except (InputError, FileError) as error:
        check_refusal(error, *files)
        return None


def round_trip(config: Any, folder: Path) -> None:
    """A configuration is the same when it is written to a file and read again, and its name stays in the folder."""
    again = folder / "again.yaml"
    again.write_text(dump(config.document()), encoding="utf-8")
    other = load_config(again)
    if (other.fingerprint(), list(other.axes)) != (config.fingerprint(), list(config.axes)):
        raise Violation(f"read again, another configuration:\n{config.label()}\n{other.label()}")
    if Path(os.path.normpath(folder / config.name)).parent != folder or not config.name.isprintable():
        raise Violation(f"a name that leaves the folder: {config.name!r}")


def prepare(folder: Path) -> Path:
    """Put the files that fuzzed configurations may name into `folder`."""
    if not (folder / "fifo").exists():
        folder.mkdir(exist_ok=True)
        os.mkfifo(folder / "fifo")
        (folder / "loop").symlink_to("loop")
        (folder / "cells.csv").write_text("n0,y0\n0.1,0\n0.2,0\n", encoding="utf-8")
        (folder / "base.yaml").write_text("friction: {mu: 60}\n", encoding="utf-8")
    return folder


def _configuration(data: bytes, folder: Path) -> bool:
    file = folder / "fuzzed.yaml"
    file.write_bytes(data)
    tables = [str(folder / "cells.csv"), "/etc/passwd", "."]
    config = _refused(lambda: load_config(file), str(file), *tables)
    if config is not None:
        round_trip(config, folder)
    return config is not None


def yaml_tree(random: Random, folder: Path) -> bool:
    return _configuration(near_valid(random), folder)


def yaml_bytes(random: Random, folder: Path) -> bool:
    return _configuration(damage(random, block(tree(random), random).encode()), folder)


def setting(random: Random, folder: Path) -> bool:
    """`--set PATH=VALUE`, alone or several."""
    paths = (*PARAMETERS, "friction.mu", "body.a", "integrator.step", "step", "t_end", "measure", "cases",
             "name", "model", "integrator", "friction", "mu.start", "name.x", ".", "a..b", *KEYS)  # fmt: skip
    given = []
    for _ in range(random.choice((1, 1, 2))):
        text = f"{random.choice(paths)}={random.choice(ODD)}"
        if random.random() < 0.3:
            text = damage(random, text.encode()).decode("utf-8", "surrogateescape")
        given.append(text)
    file = folder / "base.yaml"
    names = (str(file), "--set", str(folder / "cells.csv"), "/etc/passwd")
    config = _refused(lambda: loaded(file, _values(None, SETTING, tuple(given))), *names)
    if config is not None:
        round_trip(config, folder)
    return config is not None


SETTING = click.Option(["--set"])

LEAVES = (
    None, True, 60, -1, 10**400, 1e13, 1e-400, float("nan"), 1j, b"x", "", "slip", "a/b", "\ud800", [], {}, (), [[1]],
    np.ones((2, 2)), np.float32(3), Path("x"), range(3), {"start": 1, "stop": 2, "num": 3}, {"start": "x", "num": None},
    {"reversals": 3}, object, {1: {2: 3}}, [1, "x", None], ["reversals", {"reversal_times": 0}],
)  # fmt: skip


def mapping(random: Random, folder: Path) -> bool:  # noqa: ARG001
    """Values from Python, as a mapping and as overrides."""
    said: dict[str, Any] = {"friction": {"mu": 60}}
    if random.random() < 0.5:
        said |= {random.choice(("body", "start", "model", "mu", "a b")): random.choice(LEAVES)}
    given = {random.choice(sorted(PATHS.keys() - {"cases"})): random.choice(LEAVES) for _ in range(random.randrange(3))}
    return _refused(lambda: load_config(said, given), "") is not None


CELLS = (
    "1", "2.5", "0.01", "", " ", "nan", "inf", "-inf", "1_000", "1,000", "1.000,5", '"1,5"', "٣", "²", "1e400", "0x1",
    "-1", "'1'", '"', '""', '"1\n2"', "1;2", "1\t2", "é", "\0", "\x1b[2J", "x" * 500, "1e-3", "=1+1", "\ufeff1",
)  # fmt: skip


def table(random: Random, folder: Path) -> bool:
    """A table of cases with cells, bytes or both changed."""
    names = random.sample(sorted(PARAMETERS), random.randrange(1, 6))
    if random.random() < 0.15:
        names.insert(random.randrange(len(names) + 1), random.choice((*KEYS, *CELLS, *names)))
    values = {parameter.name: parameter.default or 60.0 for parameter in PARAMETERS.values()}
    rows = [[f"{values.get(name, 1)}" for name in names] for _ in range(random.randrange(5))]
    for _ in range(random.choice((0, 1, 2))):
        if rows:
            row = random.choice(rows)
            if row and random.random() < 0.8:
                row[random.randrange(len(row))] = random.choice(CELLS)
            else:
                row[:] = random.choice((row[1:], [*row, "1"], row * (3000 if len(row) < 9 else 1)))
    comma, end = random.choice((*",,,,,,,,,,;\t|",)), random.choice(("\n", "\n", "\r\n", "\r"))
    data = "".join(comma.join(row) + end for row in [names, *rows]).encode()
    if random.random() < 0.3:
        data = damage(random, data)
    (folder / "fuzzed.csv").write_bytes(data)
    given = "" if "mu" in names else "friction: {mu: 60}\n"
    file = folder / "table.yaml"
    file.write_text(f"cases: fuzzed.csv\n{given}", encoding="utf-8")
    config = _refused(lambda: load_config(file), str(file), str(folder / "fuzzed.csv"))
    if config is not None:
        cells = [(name, number) for name, column in config.cases.items() for number in column]
        if wrong := [cell for cell in cells if not (np.isfinite(cell[1]) and PARAMETERS[cell[0]].allows(cell[1]))]:
            raise Violation(f"a case out of bounds: {wrong[0]} of {data!r}")
        round_trip(config, folder)
    return config is not None


def invoke(*line: str) -> int:
    """Run the command line, which ends as it says, and in lines that help where it refuses; return its exit code."""
    result = CliRunner().invoke(main, line)
    if result.exception and not isinstance(result.exception, SystemExit):
        raise Violation(f"{line}: {result.exception!r:.500}") from result.exception
    # Without progress.
    lines = [line for line in result.stderr.splitlines() if "━" not in line and not line.startswith("compiling")]
    helps = lines and (lines[0].startswith("Usage: ") or all(": " in line and len(line) < 1500 for line in lines))
    if result.exit_code not in (0, 2, 3) or (result.exit_code == 2 and (result.stdout or not helps)):
        raise Violation(f"{line}: {result.exit_code} {result.stdout!r:.300} {result.stderr!r:.600}")
    return result.exit_code


KINDS: dict[str, Callable[[Random, Path], bool]] = {
    kind.__name__: kind for kind in (yaml_tree, yaml_bytes, setting, mapping, table)
}
