"""The command line: `python -m sweep VERB`.

Each command imports what it needs when it runs, so that `--help` and faults of the command line come
at once.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from sweep import interrupt
from sweep.interrupt import INTERRUPTED
from sweep.parameters import PARAMETERS, Parameter

if TYPE_CHECKING:
    import xarray as xr
    from click.shell_completion import CompletionItem

    from sweep.config import Config, Fault

DONE, ROWS_FAILED, WRONG_INPUT, TOO_MANY_FAILED = range(4)
CLOSED_PIPE = 141
"""As the shell reports of any command that SIGPIPE ends: what read its output, such as `head`, has enough."""

_TIMES = {"paper": "sqrt(c/g)", "SI": "s", "own": "of time"}
"""The unit in which a progress bar counts time, by the `units` of a configuration."""

_PATH = click.Path(path_type=Path)


def _keys(_context: click.Context, _parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """The keys of a configuration that go on from what was typed."""
    from click.shell_completion import CompletionItem

    from sweep.config.schema import PATHS

    return [CompletionItem(f"{key}=", help=words) for key, words in PATHS.items() if key.startswith(begun)]


def _parameters(_context: click.Context, _parameter: click.Parameter, begun: str) -> list[CompletionItem]:
    """The parameters that go on from what was typed."""
    from click.shell_completion import CompletionItem

    return [CompletionItem(f"{p.name}=", help=p.long_name) for p in PARAMETERS.values() if p.name.startswith(begun)]


CONFIG = click.argument("config", type=_PATH)
FILE = click.argument("file", type=_PATH)
SETTINGS = click.option(
    "--set", "settings", multiple=True, metavar="PATH=VALUE", shell_complete=_keys,
    help="Replace a value of the configuration, e.g. friction.mu=60, or friction.mu=20..60:41 for the range "
    "START..STOP:NUM (repeatable).",
)  # fmt: skip
OUTPUT = click.option("--output", type=_PATH, help="Folder for the results [default: runs/NAME].")
QUIET = click.option("--quiet", is_flag=True, help="Print only errors.")


def report_folder(default: str) -> Callable[[Any], Any]:
    """The option `--output` of a command that writes a report."""
    return click.option("--output", type=_PATH, default=default, show_default=True, help="Folder for the report.")


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="rattleback-sweep", prog_name="sweep")
def main() -> None:
    """Parameter sweeps for the reversals of a rattleback.

    Exit codes: 0 done; 2 a configuration or file is wrong; 3 more cells failed than the
    configuration allows; 130 interrupted, the same command resumes the run; 141 what read its
    output has closed the pipe.
    """


def _parameter_help() -> str:
    """The table of parameters as help text."""
    lines = ["\b", "Parameters (a number, a list, or {start, stop, num, spacing: linear|log}):"]
    for p in PARAMETERS.values():
        default = "required" if p.default is None else f"default {p.default:g}"
        lines.append(f"  {p.path:13} {p.long_name}; {default}; {p.allowed}")
    return "\n".join(lines)


@main.command(epilog=_parameter_help())
@CONFIG
@OUTPUT
@SETTINGS
@click.option("--dry-run", is_flag=True, help="Print cells, steps, memory and estimated time; compute nothing.")
@click.option("--fresh", is_flag=True, help="Discard what an earlier run left instead of resuming it.")
@click.option("--rerun", type=click.Choice(["failed", "limit"]),
              help="Simulate again just the cells that failed, or that reached the time limit.")  # fmt: skip
@click.option("--workers", type=click.IntRange(1, 4096), help="Run in this many processes, each with one thread.")
@click.option("--scheduler", metavar="ADDRESS", help="Run on the workers of this dask scheduler.")
@QUIET
def run(
    config: Path, output: Path | None, settings: tuple[str, ...], dry_run: bool, fresh: bool,
    rerun: str | None, workers: int | None, scheduler: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Run the sweep that CONFIG describes.

    Writes NAME.nc (the dataset) and NAME.png (its maps).  If it is interrupted, finished work is
    kept, and the same command resumes the run.  If CONFIG has grown since its dataset was written,
    by values of axes or to a later t_end, only what is missing is simulated.
    """
    with _explained():
        checked = _load(config, settings)
        folder = output or Path("runs") / checked.name
        if dry_run:
            from sweep.engine.estimate import estimate

            click.echo(estimate(checked))
            return
        if workers and scheduler:
            _refuse("--workers", "given with --scheduler; allowed: one of the two")
        from sweep.engine.cluster import connected
        from sweep.engine.run import run as run_sweep
        from sweep.progress import Terminal
        from sweep.results.summary import failed_fraction, summarize

        interrupt.raise_again()
        before = _stamps(folder, checked.name)
        with Terminal(quiet) as terminal:
            try:
                with connected(workers, scheduler) as cluster:
                    result = run_sweep(checked, folder, fresh=fresh, rerun=rerun, reporter=terminal, cluster=cluster)
            except KeyboardInterrupt:
                done = f"{terminal.last.done} of {terminal.last.cells} cells" if terminal.last else "no cell"
                terminal.note(f"interrupted: {done} finished and kept; the same command resumes the run")
                sys.exit(INTERRUPTED)
        if not quiet:
            click.echo(summarize(result))
            _say(_written(folder, checked.name, before))
        failed = failed_fraction(result)
        if failed > checked.max_failed_fraction:
            allowed = f"max_failed_fraction {checked.max_failed_fraction:.2%}"
            click.echo(f"{failed:.2%} of the cells failed; allowed: {allowed}", err=True)
            sys.exit(TOO_MANY_FAILED)


@main.command()
@CONFIG
@click.option("--at", "cells", multiple=True, metavar="NAME=VALUE", shell_complete=_parameters,
              help="Which cell, e.g. --at mu=60 --at b=3; a parameter given again adds a trajectory.")  # fmt: skip
@OUTPUT
@SETTINGS
@click.option("--dry-run", is_flag=True, help="Print trajectories, steps and estimated time; compute nothing.")
@QUIET
def trajectory(
    config: Path, cells: tuple[str, ...], output: Path | None, settings: tuple[str, ...], dry_run: bool, quiet: bool
) -> None:
    """Follow single cells of CONFIG densely in time.

    Writes NAME_trajectory.nc and .png: spin with reversals and critical spins, contact point, slip,
    normal force, energy and the work of friction.  Several trajectories are drawn over each other.
    """
    with _explained():
        checked = _load(config, settings)
        at = _cells(cells, checked.table)
        if dry_run:
            from sweep.studies.trajectory import estimate

            with _of_option("--at", checked.table):
                click.echo(estimate(checked, at))
            return
        from sweep.plots import trajectories as plots
        from sweep.progress import Terminal
        from sweep.results.folder import RunFiles
        from sweep.studies.trajectory import trajectory as follow

        interrupt.raise_again()
        with Terminal(quiet, _TIMES[checked.units]) as terminal, _of_option("--at", checked.table):
            result = follow(checked, reporter=terminal, **at)
        files = RunFiles(output or Path("runs") / checked.name, f"{checked.name}_trajectory")
        files.save_result(result, plots.draw(result))
        if not quiet:
            _say(f"wrote {files.dataset} and .png")


@main.command()
@CONFIG
@click.option("--width", type=click.FloatRange(1e-12, 0.5), default=1e-3, show_default=True,
              help="Relative width of the brackets from simulation.")  # fmt: skip
@OUTPUT
@SETTINGS
@click.option("--dry-run", is_flag=True, help="Print bodies, simulations and estimated time; compute nothing.")
@click.option("--fresh", is_flag=True, help="Discard what an earlier search left instead of resuming it.")
@QUIET
def critical(
    config: Path, width: float, output: Path | None, settings: tuple[str, ...], dry_run: bool, fresh: bool, quiet: bool
) -> None:
    """Find the critical spins over all axes of CONFIG except n0.

    They come from the paper's formulas, from the model's linear stability, and from simulation.
    Writes NAME_critical.nc and .png.  If it is interrupted, finished simulations are kept, and the
    same command resumes the search.
    """
    with _explained():
        checked = _load(config, settings)
        if dry_run:
            from sweep.studies.critical import estimate

            click.echo(estimate(checked))
            return
        from sweep.progress import Terminal
        from sweep.studies.critical import critical as search
        from sweep.studies.critical import remarks

        folder = output or Path("runs") / checked.name
        name = f"{checked.name}_critical"
        before = _stamps(folder, name)
        interrupt.raise_again()
        with Terminal(quiet, "bodies") as terminal:
            try:
                result = search(checked, width, folder, fresh=fresh, reporter=terminal)
            except KeyboardInterrupt:
                done = f"{terminal.last.done:.0f} of {terminal.last.cells} bodies" if terminal.last else "no body"
                terminal.note(f"interrupted: {done} settled, all simulations kept; the same command resumes the search")
                sys.exit(INTERRUPTED)
        if found := remarks(result):
            _say("\n".join(found), err=quiet)
        if not quiet:
            _say(_written(folder, name, before))


@main.command()
@report_folder("runs/reproduce")
def reproduce(output: Path) -> None:
    """Compare every number and figure of Takano (2011) with ours, in one HTML report.

    Exit code 0 only if every row holds, 1 otherwise.
    """
    with _explained():
        from sweep.progress import Terminal
        from sweep.reproduce import reproduce as compare

        interrupt.raise_again()
        with Terminal():
            failed = compare(output, click.echo)
        click.echo(f"\nwrote {output / 'reproduce.html'}; {len(failed)} rows do not hold")
        sys.exit(ROWS_FAILED if failed else DONE)


@main.command()
@report_folder("runs/bench")
def bench(output: Path) -> None:
    """Measure the speed and error of each method and model, and run cases that are hard to get right.

    Takes about four minutes on two cores; writes bench.html, bench.png and bench.csv.

    Exit code 1 if a hard case does not hold, else 0: speed and error are reported, not judged.
    """
    with _explained():
        from sweep.bench import bench as measure
        from sweep.progress import Terminal

        interrupt.raise_again()
        with Terminal():
            failed = measure(output, click.echo)
        click.echo(f"\nwrote {output / 'bench.html'}, .png and .csv; {len(failed)} hard cases do not hold")
        sys.exit(ROWS_FAILED if failed else DONE)


@main.command()
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=_PATH)
@click.option(
    "--var", "variable", help="Variable to draw [default: what `measure` named first, or else the reversals]."
)
@click.option("--x", help="Axis drawn across.")
@click.option("--y", help="Axis drawn upwards.")
@click.option("--sel", "cells", multiple=True, metavar="NAME=VALUE",
              help="Draw only the value of an axis nearest to this one, e.g. n0=0.05 (repeatable).")  # fmt: skip
@click.option("--limits", metavar="LOW..HIGH", help="Lowest and highest value of the colour scale.")
@click.option("--cmap", metavar="NAME", help="A colour map of matplotlib.")
@click.option(
    "--output",
    type=_PATH,
    help="Picture to write; its suffix names the format: png, pdf or svg [default: a PNG beside FILE].",
)
def plot(
    files: tuple[Path, ...], variable: str | None, x: str | None, y: str | None, cells: tuple[str, ...],
    limits: str | None, cmap: str | None, output: Path | None,
) -> None:  # fmt: skip
    """Draw a dataset: maps or curves of a run, single trajectories, or critical spins.

    Of several runs, the maps of one variable are drawn side by side, with one scale.
    """
    with _explained():
        sel = dict(_parse_pair(cell, "--sel") for cell in cells)
        span = _parse_span(limits, "--limits") if limits is not None else None
        from sweep.plots import panels, picture

        interrupt.raise_again()
        stem = "-".join(file.stem for file in files)
        target = output or files[0].with_name(f"{stem}{f'_{variable}' if variable else ''}.png")
        if picture.suffix(target) == "html":
            if len(files) > 1:
                _refuse(f"--output {target}", f"a page shows one dataset; allowed: {picture.ALLOWED}")
            _plot_page(files[0], target, variable, x, y, sel, limits, cmap)
            return
        if picture.suffix(target) not in picture.FORMATS:
            _refuse(f"--output {target}", f"unknown format; allowed: {picture.ALLOWED}, .html")
        datasets = [_open(file) for file in files]
        for file, dataset in zip(files, datasets, strict=True):
            with _about(file):
                for name, taken in panels.nearest(dataset, sel).items():
                    _say(f"{name} = {taken:g}" + (f", nearest to {sel[name]:g}" if taken != sel[name] else ""))
        with _about(files[0]):
            picture.plot(datasets, variable, x=x, y=y, sel=sel, limits=span, cmap=cmap, output=target)
        _say(f"wrote {target}")


@main.command()
@FILE
def info(file: Path) -> None:
    """Show what is in a dataset: axes, counts by status, agreement with the prediction, provenance."""
    with _explained():
        from sweep.results.summary import contents, describe

        dataset = _open(file)
        with _about(file):
            text = "\n".join([str(dataset.attrs.get("title", file.name)), describe(dataset), contents(dataset)])
        _say(text)


@main.command()
@FILE
@click.option("--port", type=click.IntRange(1, 65535), help="Port of the page [default: the first free from 5006].")
@click.option("--no-browser", is_flag=True, help="Print the address and open no browser.")
@click.option("--model", help="File or entry point of the model that a user brought; its code runs.")
def explore(file: Path, port: int | None, no_browser: bool, model: str | None) -> None:
    """Explore the maps of a dataset in the browser.

    A click on a cell runs its trajectory.  The page is served to this machine alone, until Ctrl-C.
    """
    with _explained():
        with _needs_bokeh("explore"):
            from sweep.explore.server import serve
        from sweep.explore.setup import Setup, usable
        from sweep.explore.slices import open_source

        with _about(file):
            source = open_source(file)
        setup = Setup(source, model, _announce) if model else usable(source)
        serve(source, setup, port, browser=not no_browser, say=_say)
        _say("stopped")
        sys.stdout.flush()
        os._exit(DONE)  # a trajectory that is running cannot be interrupted, and nothing is lost with it


def _plot_page(
    file: Path, target: Path, variable: str | None, x: str | None, y: str | None, sel: dict[str, float],
    limits: str | None, cmap: str | None,
) -> None:  # fmt: skip
    """Draw a map as a page of its own."""
    with _needs_bokeh("--output"):
        from sweep.explore.page import save_html
    for option, value in (("--limits", limits), ("--cmap", cmap)):
        if value is not None:
            _refuse(option, "not for a page; allowed: with a png, pdf or svg")
    with _about(file):
        save_html(_open(file), target, variable, x, y, sel)
    _say(f"wrote {target}")


@contextmanager
def _needs_bokeh(what: str) -> Iterator[None]:
    """Make a missing Bokeh a fault that tells how to install it."""
    try:
        yield
    except ModuleNotFoundError as error:
        if error.name not in ("bokeh", "tornado"):
            raise
        _refuse(what, "needs Bokeh, which is not installed: pip install 'rattleback-sweep[explore]'")


def _open(file: Path) -> xr.Dataset:
    """The dataset of a command, of whatever kind."""
    from sweep.results.kind import kind
    from sweep.results.netcdf import open_dataset
    from sweep.results.store import StoreError

    dataset = open_dataset(file)
    if kind(dataset) is None:
        raise StoreError(f"{file}: not a dataset of sweep: no variable of it, such as status")
    return dataset


def _load(config: Path, settings: tuple[str, ...]) -> Config:
    """The configuration of a command, with the values of `--set`."""
    from sweep.config import load_config
    from sweep.config.document import parse_value
    from sweep.config.faults import brief

    parsed = {}
    for setting in settings:
        path, equals, value = setting.partition("=")
        if not (equals and path):
            _refuse(f"--set {brief(setting)}", "not a setting; allowed: PATH=VALUE")
        parsed[path] = parse_value(value, f"--set {brief(path)}")
    return load_config(config, parsed, argument=lambda path: f"--set {path}", announce=_announce)


def _announce(words: str) -> None:
    """Said even with --quiet: code of a user never runs unseen."""
    _say(words, err=True)


def _cells(texts: tuple[str, ...], known: Mapping[str, Parameter]) -> dict[str, Any]:
    """The values of `--at` by parameter."""
    from sweep.config.faults import brief, suggestion

    given: dict[str, list[float]] = {}
    for text in texts:
        name = text.partition("=")[0]
        if name not in known:
            meant = suggestion(name, known)
            _refuse(f"--at {brief(text)}", f"unknown parameter{meant}; allowed: {', '.join(known)}")
        given.setdefault(name, []).append(_parse_pair(text, "--at")[1])
    return {name: values[0] if len(values) == 1 else values for name, values in given.items()}


def _parse_pair(text: str, option: str) -> tuple[str, float]:
    from sweep.config.document import number
    from sweep.config.faults import brief

    name, _, value = text.partition("=")
    if (parsed := number(value)) is None:
        _refuse(f"{option} {brief(text)}", "allowed: NAME=NUMBER")
    return name, parsed


@contextmanager
def _of_option(option: str, known: Mapping[str, Parameter]) -> Iterator[None]:
    """Name `option` in faults of the parameters that it gave."""
    from dataclasses import replace

    from sweep.config.faults import ConfigError

    def named(fault: Fault) -> Fault:
        first, *rest = fault.path or ("",)
        ours = not fault.file and (not first or first in known)
        return replace(fault, path=(f"{option} {first}".rstrip(), *rest)) if ours else fault

    try:
        yield
    except ConfigError as error:
        raise ConfigError(list(map(named, error.faults))) from None


def _parse_span(text: str, option: str) -> tuple[float, float]:
    from sweep.config.document import number
    from sweep.config.faults import brief

    low, dots, high = text.partition("..")
    ends = number(low), number(high)
    if not dots or ends[0] is None or ends[1] is None or not ends[0] < ends[1]:
        _refuse(f"{option} {brief(text)}", "allowed: LOW..HIGH, two numbers, the lower one first")
    return ends[0], ends[1]


def _refuse(option: str, message: str) -> NoReturn:
    """Raise the fault of an option."""
    from sweep.config.faults import ConfigError, Fault

    raise ConfigError([Fault(option, None, None, (), message)])


def _stamps(folder: Path, name: str) -> dict[str, tuple[int, int]]:
    """What tells by their suffixes whether the results `name` in `folder` are written anew."""
    stats = {suffix: path.stat() for suffix in (".nc", ".png") if (path := folder / f"{name}{suffix}").exists()}
    return {suffix: (stat.st_ino, stat.st_mtime_ns) for suffix, stat in stats.items()}


def _written(folder: Path, name: str, before: dict[str, tuple[int, int]]) -> str:
    """Which results were written since `_stamps` returned `before`."""
    new = [suffix for suffix, stamp in _stamps(folder, name).items() if stamp != before.get(suffix)]
    return f"wrote {folder / name}{' and '.join(new)}" if new else "nothing was written"


def _say(text: str, *, err: bool = False) -> None:
    """Print lines that may quote files and their names."""
    from sweep.config.faults import printable

    click.echo("\n".join(map(printable, text.split("\n"))), err=err)


@contextmanager
def _about(file: Path) -> Iterator[None]:
    """Make any error in reading a dataset of another program a fault of that file."""
    from sweep.results.store import StoreError

    try:
        yield
    except (StoreError, OSError):
        raise
    except Exception as error:
        known = isinstance(error, ValueError) and "allowed" in str(error)
        reason = str(error) if known else f"not a dataset of sweep: {type(error).__name__}: {error}"
        raise StoreError(f"{file}: {reason}".splitlines()[0]) from None


class _explained:
    """Turns errors that the user can mend into lines on stderr and exit code 2."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None:
            return
        if isinstance(error, KeyboardInterrupt):
            click.echo("interrupted", err=True)
            sys.exit(INTERRUPTED)
        if isinstance(error, BrokenPipeError):
            # What is left in the buffers when Python ends goes nowhere.
            for stream in (sys.stdout, sys.stderr):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
            sys.exit(CLOSED_PIPE)
        from sweep.config.faults import ConfigError
        from sweep.jit import NotCompiled
        from sweep.results.store import StoreError

        if isinstance(error, ConfigError | StoreError | NotCompiled):
            _say(str(error), err=True)
            sys.exit(WRONG_INPUT)
        if isinstance(error, OSError):
            _say(f"{error.filename or 'a file'}: {error.strerror or error}", err=True)
            sys.exit(WRONG_INPUT)
