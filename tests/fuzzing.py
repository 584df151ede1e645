"""Inputs that are nearly right, and what must hold of whatever comes of them.

Each kind takes a source of randomness and a folder, hands one input in, and returns whether it was
accepted.  It raises `Violation` where neither that nor a proper refusal was the answer.  Shared by
tests/test_fuzz.py, where hypothesis is the source, and scripts/fuzz.py, where a seed is.
"""

from __future__ import annotations

import json
import os
import signal
import warnings
from collections.abc import Callable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import xarray as xr
from click.testing import CliRunner
from conftest import STANDARD

import sweep
from sweep import cli
from sweep.config import ConfigError, load_config
from sweep.config.document import parse_value
from sweep.parameters import PARAMETERS
from sweep.results.store import Checkpoint, Identity, StoreError
from sweep.studies.trajectory import _choose


class Violation(AssertionError):
    """An input that was neither accepted nor refused properly."""


# Scalars, collections and syntax that a file may hold where a value belongs, as they are written.
ODD = (
    "", "~", "null", "true", "yes", "no", "on", "off", "0", "-0.0", "1", "-1", "3.5", "1e-3", "60", "[]", "{}",
    "1_000", "0x10", "0o17", "012", "1:30", "2001-01-01", "2001-12-14t21:59:43.10-05:00", "1e400", "1e-400", "1e308",
    "-1e308", "5e-324", ".inf", "-.inf", ".nan", ".NaN", "+.inf", "9" * 19, "9" * 400, "0." + "3" * 400, "١٢", "1,5",
    "[1, 2, 3]", "[1, 1.0]", "[.nan]", "[[1]]", "[{}]", "[a]", "[1, ]", "[reversals]", "[energy_error]", "[a, {}]",
    "{start: 1, stop: 2, num: 3}", "{start: 1, stop: 2, num: 3, spacing: log}", "{start: 2, stop: 1, num: 2}",
    "{start: 1, stop: 2, num: 1000000000}", "{start: -1e308, stop: 1e308, num: 3}", "{start: 1, stop: 2, num: 2.0}",
    "{start: -1, stop: 1, num: 3, spacing: log}", "{start: 1, stop: 1, num: 2}", "{start: 1, stop: 2, num: -1}",
    "{start: 1e-300, stop: 1e-299, num: 4, spacing: log}", "{start: a, stop: 2, num: 3}", "{step: 1}",
    "{start: {}, stop: 2, num: [3]}", "{? [a] : 1}", "{? {a: 1} : 1}", "{<<: {a: 1}}", "<<", "auto", "adams", "word",
    "dopri5", "slip", "noslip", "averaged", "analytic", "linear", "{mu: 60}", "'60'", '"60"', '"\\U00110000"',
    '"\\UFFFFFFFF"', '"\\uD800"', '"\\0"', '"\\e[31m"', '"a\\nb"', '"\\x85"', "'", '"', "`", "@a", "%a", "|", ">-",
    "!!python/object/apply:os.system [echo]", "!!python/name:os.system ''", "!!binary aGk=", "!!str 60", "!x 1",
    "!<tag:yaml.org,2002:float> 1", "!", "!!set {a, b}", "&a 1", "*a", "&a [*a]", "&a {b: *a}", "? ", "- 1", "-", ":",
    "../../x", "/etc/passwd", "/dev/zero", "/dev/null", "fifo", ".", "..", "loop", "cells.csv", "~root", "a" * 3000,
    "{" * 60, "[" * 400, "[" * 400 + "]" * 400, "{a: " * 300 + "}" * 300, "{at}", "{reason}", "#", "a #b", "\t", "é",
)  # fmt: skip

KEYS = (
    "", "name", "model", "cases", "literal[x]", "mu", "step", "<<", "a b", "~", "1", "null", "é", '"\\n"', "?",
    '"\\uD800"', "k" * 200, "*a", "&a k", "!!str k", "[k]", "{k: 1}", "{}", "at", "config", *PARAMETERS,
)  # fmt: skip

SCRAPS = (
    b"\0", b"\xff", b"\xef\xbb\xbf", b"\xff\xfe", b"\r", b"\r\n", b"\t", b"\n", b"---\n", b"...\n", b"%YAML 1.1\n",
    b"\xc2\x85", b"\xe2\x80\xa8", b"\xed\xa0\x80", b"\xf4\x90\x80\x80", b"\x1b[2J", b": ", b"- ", b"? ", b"[",
    b"]", b"{", b"}", b",", b"#", b"&a ", b"*a ", b"!!", b"|\n", b">\n", b"'", b'"', b"\\", b"<<", b"1e999", b"\x7f",
)  # fmt: skip

FILE_LIKE = ("name: x", "verify: 0.0", "max_failed_fraction: 0.01", "measure: [reversals, energy_error]")


def tree(random: Random) -> list[list[Any]]:
    """A configuration that loads: pairs of keys and either text or pairs."""
    choose = random.choice
    axis = ("[2.0, 3.0, 5.0]", "{start: 2, stop: 5, num: 4}", "{start: 2, stop: 5, num: 3, spacing: log}", "3", "4.5e0")
    pairs = [
        ["body", [["a", choose(("10.0", "[9, 10]"))], ["b", choose(axis)], ["delta", choose(("0.03", "[0, .01]"))]]],
        ["friction", [["mu", choose(("60", "[40, 60]", "{start: 20, stop: 200, num: 3}"))]]],
        ["start", [["n0", choose(("0.05", "[0.02, -0.05]"))], ["x0", choose(("0.01", "[0.0, 0.01]"))], ["y0", "1e-2"]]],
        ["integrator", [["t_end", "1500"], ["method", choose(("dopri5", "auto"))], ["tolerance", "1e-6"]]],
        *([key, value] for key, value in (text.split(": ") for text in FILE_LIKE)),
        ["model", choose(("slip", "slip", "noslip", "analytic"))],
    ]  # fmt: skip
    kept = [pair for pair in pairs if pair[0] == "friction" or random.random() < 0.7]
    random.shuffle(kept)
    return kept


def _mutate_tree(random: Random, pairs: list[list[Any]]) -> None:
    inner = [value for _, value in pairs if isinstance(value, list) and value]
    level = random.choice([pairs, *inner])
    if not level:
        return
    pair = random.choice(level)
    match random.randrange(8):
        case 0:
            level.remove(pair)
        case 1:
            level.insert(random.randrange(len(level) + 1), list(pair))
        case 2:
            pair[0] = random.choice(KEYS)
        case 3:
            pair[1] = [[random.choice(KEYS), pair[1]]]
        case 4:
            level.append([random.choice(KEYS), random.choice(ODD)])
        case 5 if isinstance(pair[1], str):
            pair[1] = f"[{pair[1]}, {random.choice(ODD)}]"
        case _:
            pair[1] = random.choice(ODD)


def _flow(pairs: list[list[Any]]) -> str:
    return "{" + ", ".join(f"{key}: {_flow(v) if isinstance(v, list) else v}" for key, v in pairs) + "}"


def _block(pairs: list[list[Any]], random: Random, indent: str = "") -> str:
    lines = []
    for key, value in pairs:
        if not isinstance(value, list):
            lines.append(f"{indent}{key}: {value}\n")
        elif random.random() < 0.5:
            lines.append(f"{indent}{key}: {_flow(value)}\n")
        else:
            lines.append(f"{indent}{key}:\n{_block(value, random, indent + '  ')}")
    return "".join(lines)


def near_valid(random: Random) -> bytes:
    """A configuration with none to three parts of its tree changed."""
    pairs = tree(random)
    for _ in range(random.choice((0, 1, 1, 1, 2, 3))):
        _mutate_tree(random, pairs)
    return _block(pairs, random).encode()


def damage(random: Random, data: bytes, scraps: tuple[bytes, ...] = SCRAPS) -> bytes:
    """`data` with a few bytes changed, lost, doubled or put in, or in another encoding."""
    if random.random() < 0.05:
        text = data.decode("utf-8", "replace")
        ends = (text.replace("\n", "\r\n"), text.replace("\n", "\r"), text.replace(" ", "\t"), "", text * 2)
        return random.choice((text.encode("utf-16"), text.encode("utf-8-sig"), *map(str.encode, ends)))
    out = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 4, 16))):
        at = random.randrange(len(out) + 1)
        match random.randrange(6):
            case 0:
                out[at : at + 1] = bytes([random.randrange(256)])
            case 1:
                del out[at : at + random.choice((1, 1, 4, 64))]
            case 2:
                out[at:at] = random.choice(scraps)
            case 3:
                end = at + random.choice((1, 8, 64))
                out[at:at] = out[at:end] * random.choice((1, 1, 50))
            case 4:
                out[at : at + 1] = bytes([(out[at] if at < len(out) else 0) ^ (1 << random.randrange(8))])
            case _ if random.random() < 0.2:
                del out[at:]
    return bytes(out)


def check_refusal(error: Exception, *files: str) -> None:
    """Every line names a file, and is short, printable and more than the name."""
    text = str(error)
    for line in text.split("\n"):
        named = [file for file in files if line.startswith(file)] or ([] if not line.startswith("  ") else [""])
        if not named or not line.isprintable() or not 0 < len(line) - len(named[0]) < 1500 or ": " not in line + ": ":
            raise Violation(f"a refusal of no use: {line!r:.500} of {text!r:.500}")
    for fault in getattr(error, "faults", ()):
        if fault.line is not None and (fault.line < 1 or not fault.message):
            raise Violation(f"a fault without place or message: {fault!r:.500}")


def _refused(call: Callable[[], Any], *files: str) -> Any:
    """What `call` returns, or None if it refused."""
    try:
        return call()
    except (ConfigError, StoreError) as error:
        check_refusal(error, *files)
        return None


def _round_trip(config: Any, folder: Path) -> None:
    again = folder / "again.yaml"
    again.write_text(config.to_yaml(), encoding="utf-8")
    other = load_config(again)
    if (other.fingerprint(), list(other.axes)) != (config.fingerprint(), list(config.axes)):
        raise Violation(f"read again, another configuration:\n{config.to_yaml()}\n{other.to_yaml()}")
    if Path(os.path.normpath(folder / config.name)).parent != folder or not config.name.isprintable():
        raise Violation(f"a name that leaves the folder: {config.name!r}")


def prepare(folder: Path) -> Path:
    """A folder with the files that configurations here may name."""
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
        _round_trip(config, folder)
    return config is not None


def yaml_tree(random: Random, folder: Path) -> bool:
    return _configuration(near_valid(random), folder)


def yaml_bytes(random: Random, folder: Path) -> bool:
    return _configuration(damage(random, _block(tree(random), random).encode()), folder)


def setting(random: Random, folder: Path) -> bool:
    """`--set PATH=VALUE`, alone or several."""
    paths = (*PARAMETERS, "friction.mu", "body.a", "integrator.step", "step", "t_end", "verify", "measure", "cases",
             "name", "model", "integrator", "friction", "mu.start", "name.x", ".", "a..b", *KEYS)  # fmt: skip
    given = []
    for _ in range(random.choice((1, 1, 2))):
        text = f"{random.choice(paths)}={random.choice(ODD)}"
        if random.random() < 0.3:
            text = damage(random, text.encode()).decode("utf-8", "surrogateescape")
        given.append(text)
    file = folder / "base.yaml"
    values = _refused(lambda: cli._parse_settings(tuple(given)), "--set")
    if values is None:
        return False
    config = _refused(lambda: load_config(file, values), str(file), "--set", *(str(folder / n) for n in ("cells.csv",)),
                      "/etc/passwd")  # fmt: skip
    if config is not None:
        _round_trip(config, folder)
    return config is not None


def value(random: Random, folder: Path) -> bool:  # noqa: ARG001
    """The text of a value alone."""
    text = random.choice(ODD)
    for _ in range(random.randrange(3)):
        text = random.choice((f"[{text}, {random.choice(ODD)}]", f"{{a: {text}}}", text + random.choice(ODD)))
    data = damage(random, text.encode()) if random.random() < 0.5 else text.encode()
    found: list[Any] = []
    _refused(lambda: found.append(parse_value(data.decode("utf-8", "surrogateescape"), "--set x")), "--set x")
    if found:
        json.dumps(found)  # plain data, whatever was written
    return bool(found)


@cache
def _config_at(path: Path) -> Any:
    return load_config(path)


def at(random: Random, folder: Path) -> bool:
    """`--at NAME=VALUE`."""
    texts = [
        f"{random.choice((*PARAMETERS, *PARAMETERS, *KEYS))}={random.choice((*ODD, '0.01', '0.02'))}"
        for _ in range(random.choice((1, 2, 3, 40)))
    ]
    if random.random() < 0.3:
        texts.append(damage(random, texts.pop().encode()).decode("utf-8", "surrogateescape"))

    def choose() -> Any:
        pairs: dict[str, list[float]] = {}
        for name, number in (cli._parse_pair(text, "--at") for text in texts):
            pairs.setdefault(name, []).append(number)
        known = {name: numbers for name, numbers in pairs.items() if name in PARAMETERS}
        return _choose(_config_at(folder / "base.yaml"), known)

    return _refused(choose, "--at") is not None


CELLS = (
    "1", "2.5", "0.01", "", " ", "nan", "inf", "-inf", "1_000", "1,000", "1.000,5", '"1,5"', "٣", "²", "1e400", "0x1",
    "-1", "'1'", '"', '""', '"1\n2"', "1;2", "1\t2", "é", "\0", "\x1b[2J", "x" * 500, "1e-3", "=1+1", "\ufeff1",
)  # fmt: skip


def table(random: Random, folder: Path) -> bool:
    """A table of cases: its parts changed, its bytes, or both."""
    names = random.sample(sorted(PARAMETERS), random.randrange(1, 6))
    if random.random() < 0.15:
        names.insert(random.randrange(len(names) + 1), random.choice((*KEYS, *CELLS, *names)))
    rows = [[f"{STANDARD.get(name, 1)}" for name in names] for _ in range(random.randrange(5))]
    for _ in range(random.choice((0, 1, 2))):
        if rows:
            row = random.choice(rows)
            if row and random.random() < 0.8:
                row[random.randrange(len(row))] = random.choice(CELLS)
            else:
                row[:] = random.choice((row[1:], [*row, "1"], row * 3000))
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
        _round_trip(config, folder)
    return config is not None


def _invoke(folder: Path, *arguments: str) -> bool:
    """Run the command line; a refusal ends with 2, whatever is warned of, and only `plot` writes."""
    before = set(folder.rglob("*"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = CliRunner().invoke(cli.main, list(arguments))
    if result.exception and not isinstance(result.exception, SystemExit):
        raise Violation(f"{arguments}: {result.exception!r:.500}") from result.exception
    if result.exit_code not in (0, 2):
        raise Violation(f"{arguments}: exit code {result.exit_code}")
    if result.exit_code == 2 and (result.stdout or not result.stderr.strip()):
        raise Violation(f"{arguments}: {result.stdout!r:.200} {result.stderr!r:.200}")
    if written := sorted(set(folder.rglob("*")) - before, reverse=True):
        for path in written:  # or the same input would not fail again
            path.rmdir() if path.is_dir() else path.unlink()
        if result.exit_code or written != [folder / "picture.png"]:
            raise Violation(f"{arguments}: written: {written}")
    return result.exit_code == 0


def dry_run(random: Random, folder: Path) -> bool:
    """A configuration through the command line."""
    file = folder / "fuzzed.yaml"
    file.write_bytes(near_valid(random))
    return _invoke(folder, "run", str(file), "--dry-run", "--output", str(folder / "out"))


IDENTITY = Identity("name: x\n", "0" * 16, "1" * 16, "sweep 0")


def identity(random: Random, folder: Path) -> bool:
    """The head of a checkpoint."""
    checkpoint = folder / "x.checkpoint"
    checkpoint.mkdir(exist_ok=True)
    odd = (None, 1, [], {}, "", "x", "\x1b[2J")
    content: Any = asdict(IDENTITY)
    if random.random() < 0.7:
        content[random.choice(("config", "config_hash", "source_hash", "more"))] = random.choice(odd)
    if random.random() < 0.2:
        content.pop(random.choice(list(content)))
    data = json.dumps(random.choice((content, content, content, content, *odd))).encode()
    if random.random() < 0.4:
        data = random.choice((damage(random, data), b"[" * 100_000, b"9" * 5000))
    (checkpoint / "identity.json").write_bytes(data)
    return _refused(lambda: Checkpoint(checkpoint, IDENTITY, lambda _: None), str(checkpoint)) is not None


def archive(random: Random, folder: Path) -> bool:
    """A tile and the running images of a checkpoint; damaged ones are dropped."""
    checkpoint = folder / "y.checkpoint"
    checkpoint.mkdir(exist_ok=True)
    (checkpoint / "identity.json").write_text(json.dumps(asdict(IDENTITY)), encoding="utf-8")
    name = random.choice(("000000.npz", "running.npz", "1abc.npz", "7.npz", "1_0.npz"))
    arrays: dict[str, Any] = {"status": np.ones(4, np.int64), "tiles": np.arange(2), "seconds": np.array(1.5)}
    if random.random() < 0.5:
        odd = (np.array("x"), np.zeros((2, 2)), np.array(1), np.array([], np.int64), np.array([0, 0]), np.array([1.5]))
        arrays[random.choice(sorted(arrays))] = random.choice(odd)
    path = checkpoint / name
    with path.open("wb") as stream:
        np.savez(stream, **arrays)
    if random.random() < 0.7:
        path.write_bytes(damage(random, path.read_bytes()))
    kept = Checkpoint(checkpoint, IDENTITY, lambda _: None)
    running = kept.load_running()
    if running is not None:
        tiles, tables, seconds = running
        if not (
            tiles and all(type(i) is int for i in tiles) and isinstance(seconds, float) and isinstance(tables, dict)
        ):
            raise Violation(f"images of no tiles: {running!r:.300}")
    accepted = bool(kept.done) or running is not None
    path.unlink(missing_ok=True)
    return accepted


@cache
def _datasets(folder: Path) -> tuple[bytes, ...]:
    """Datasets of this program, as bytes: maps and curves, of formulas, which take no time."""
    file = folder / "base.yaml"
    parts = ({"n0": [0.02, 0.05]}, {"mu": list(range(1, 8)), "b": [2, 3, 4, 5, 6]})
    found = []
    for number, overrides in enumerate(parts):
        dataset = sweep.run(file, folder / f"run{number}", model="analytic", **overrides)
        dataset.close()
        found.append((folder / f"run{number}" / "base.nc").read_bytes())
    return tuple(found)


def _in_child(work: Callable[[], bool], seconds: int = 60) -> bool:
    """Run `work` in a process of its own: the HDF5 library may crash on damaged files, which is not ours to mend."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        code = 2
        try:
            signal.signal(signal.SIGALRM, signal.SIG_DFL)  # nothing may wait longer, not even in C
            signal.alarm(seconds)
            code = 0 if work() else 1
        except BaseException as error:
            os.write(writing, repr(error).encode()[:4000])
        finally:
            os._exit(code)
    os.close(writing)
    with os.fdopen(reading, "rb") as stream:
        said = stream.read().decode()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code < 0 and -code in (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE):
        CRASHES.append(-code)
        return False
    if code not in (0, 1):
        raise Violation(said or f"ended by signal {-code}")
    return code == 0


CRASHES: list[int] = []
"""Signals that ended a child: crashes inside of the HDF5 library."""


def _read(random: Random, file: Path, folder: Path) -> bool:
    """`info` on a file, and now and then `plot`."""
    target = folder / "picture.png"
    variable = random.choice((None, None, "status", "mu", "spin_final", "form_factor", "nothing", "../x", ""))
    plot = ["plot", str(file), "--output", str(target), *(("--var", variable) if variable is not None else ())]
    verbs = [["info", str(file)], *([plot] if random.random() < 0.15 else [])]

    def work() -> bool:
        results = [_invoke(folder, *arguments) for arguments in verbs]
        return all(results)

    return _in_child(work)


def damaged(random: Random, folder: Path) -> bool:
    """A dataset of this program with some bytes changed."""
    file = folder / "damaged.nc"
    data = bytearray(random.choice(_datasets(folder)))
    for _ in range(random.choice((1, 2, 8, 32))):
        place = random.randrange(random.choice((512, len(data))))
        data[place : place + 1] = random.choice((bytes([random.randrange(256)]), b"\xff", b"\0"))
    if random.random() < 0.1:
        del data[random.randrange(len(data)) :]
    file.write_bytes(data)
    return _read(random, file, folder)


def foreign(random: Random, folder: Path) -> bool:
    """A dataset of another program, whose variables may have the names of ours."""
    names = ("status", "reversals", "reversals_predicted", "energy_error", "step_rule", "step", "verified_cell",
             "wall_time", "spin_final", "form_factor", "b", "mu", "temperature")  # fmt: skip
    dims = {"b": 6, "mu": random.choice((0, 1, 7)), "time": random.choice((0, 3, 20)), "lat": 2}
    odd: dict[str, Any] = {
        "title": random.choice(("a", "$\\frac", "\x1b[2J", "é\nb", 3, [1, 2])), "flag_values": [1, 2],
        "flag_meanings": "a b",
        "units": random.choice(("days since 2000", "s", 3)), "wall_time": random.choice((1.0, "x")),
        "scale_factor": random.choice((2.0, "x")),
    }  # fmt: skip

    def attributes() -> dict[str, Any]:
        return {key: odd[key] for key in odd if random.random() < 0.15}

    variables = {}
    chosen = {*random.sample(names, random.randrange(len(names))), *random.choice((("status",), ()))}
    for name in sorted(chosen):
        over = tuple(random.sample(sorted(dims), random.randrange(4))) if name not in dims else (name,)
        shape = tuple(dims[d] for d in over)
        kind = random.choice(("int16", "float64", "float32", "int8", "U", "M8[ns]", "uint64"))
        numbers = np.array([random.choice((0, 1, 2, 3, 7)) for _ in range(int(np.prod(shape)))]).reshape(shape)
        filled = numbers.astype(kind)
        if kind.startswith("float") and random.random() < 0.3:
            filled = np.full(shape, random.choice((np.nan, np.inf)), kind)
        variables[name] = (over, filled, {} if kind.startswith("M") else attributes())
    file = folder / "foreign.nc"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            xr.Dataset(variables, attrs=attributes()).to_netcdf(file, engine="netcdf4")
        except (ValueError, TypeError):  # xarray itself does not write this one
            return False
    return _read(random, file, folder)


KINDS: dict[str, Callable[[Random, Path], bool]] = {
    kind.__name__: kind
    for kind in (yaml_tree, yaml_bytes, setting, value, at, table, dry_run, identity, archive, foreign, damaged)
}
