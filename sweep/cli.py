"""The command line: `python -m sweep VERB`."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sweep.config.faults import ConfigError, Fault, brief, printable
from sweep.parameters import PARAMETERS

if TYPE_CHECKING:
    import xarray as xr

    from sweep.config import Config

# Cells from which --dry-run infers the rest, and what a cell's results take on disk.
_SAMPLE, _BYTES_A_CELL = 4096, 130

DONE, WRONG_INPUT, TOO_MANY_FAILED, INTERRUPTED = 0, 2, 3, 130


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="rattleback-sweep", prog_name="sweep")
def main() -> None:
    """Parameter sweeps for the reversals of a rattleback.

    Exit codes: 0 done; 2 a configuration or file is wrong; 3 more cells failed than the
    configuration allows; 130 interrupted, the same command goes on.
    """


def _parameter_help() -> str:
    """The parameters' table as help text."""
    lines = ["\b", "Parameters (a number, a list, or {start, stop, num, spacing: linear|log}):"]
    for p in PARAMETERS.values():
        default = "required" if p.default is None else f"default {p.default:g}"
        lines.append(f"  {p.path:13} {p.long_name}; {default}; {p.allowed}")
    return "\n".join(lines)


@main.command(epilog=_parameter_help())
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--output", type=click.Path(path_type=Path), help="Folder for the results [default: runs/NAME].")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE",
              help="Replace a value of the configuration, e.g. friction.mu=60 (repeatable).")  # fmt: skip
@click.option("--dry-run", is_flag=True, help="Print cells, steps, memory, estimated time; compute nothing.")
@click.option("--fresh", is_flag=True, help="Discard what an earlier run left instead of going on from it.")
@click.option("--workers", type=click.IntRange(1, 4096), help="Run in so many processes of one thread each.")
@click.option("--scheduler", metavar="ADDRESS", help="Run on the workers of this dask scheduler.")
@click.option("--quiet", is_flag=True, help="Print errors alone.")
def run(
    config: Path, output: Path | None, settings: tuple[str, ...], dry_run: bool, fresh: bool,
    workers: int | None, scheduler: str | None, quiet: bool,
) -> None:  # fmt: skip
    """Run the sweep that CONFIG describes.

    Writes NAME.nc (the dataset) and NAME.png (its maps).  Interrupted, it keeps what is finished,
    and the same command goes on from there.
    """
    with _explained():
        from sweep.config import load_config

        checked = load_config(config, _parse_settings(settings))
        folder = output or Path("runs") / checked.name
        if dry_run:
            click.echo(_estimate(checked))
            return
        if workers and scheduler:
            raise ConfigError([Fault("--workers", None, None, (), "beside --scheduler; allowed: one of the two")])
        from sweep.engine.cluster import connected
        from sweep.engine.run import run as run_sweep
        from sweep.progress import Terminal

        with Terminal(quiet) as terminal:
            try:
                with connected(workers, scheduler) as cluster:
                    result = run_sweep(checked, folder, fresh=fresh, reporter=terminal, cluster=cluster)
            except KeyboardInterrupt:
                done = f"{terminal.last.done} of {terminal.last.cells} cells" if terminal.last else "no cell"
                terminal.note(f"interrupted: {done} finished and kept; the same command goes on")
                sys.exit(INTERRUPTED)
        if not quiet:
            click.echo(_summary(result))
            _say(f"wrote {folder / checked.name}.nc and .png")
        failed = _failed_fraction(result)
        if failed > checked.max_failed_fraction:
            allowed = f"max_failed_fraction {checked.max_failed_fraction:.2%}"
            click.echo(f"{failed:.2%} of the cells failed; allowed: {allowed}", err=True)
            sys.exit(TOO_MANY_FAILED)


@main.command()
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--at", "cells", multiple=True, metavar="NAME=VALUE",
              help="Which cell, e.g. --at mu=60 --at b=3; a parameter given again adds a trajectory.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path), help="Folder for the results [default: runs/NAME].")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Replace a value of the configuration.")
def trajectory(config: Path, cells: tuple[str, ...], output: Path | None, settings: tuple[str, ...]) -> None:
    """Follow single cells of CONFIG densely in time.

    Writes NAME_trajectory.nc and .png: spin with reversals and critical spins, contact point, slip,
    normal force, energy and the work of friction.  Several trajectories are laid over each other.
    """
    with _explained():
        from sweep.config import load_config
        from sweep.plots import trajectories as trajectory_plot
        from sweep.results.store import RunFiles
        from sweep.studies.trajectory import trajectory as follow

        checked = load_config(config, _parse_settings(settings))
        at: dict[str, Any] = {}
        for name, value in (_parse_pair(cell, "--at") for cell in cells):
            at.setdefault(name, []).append(value)
        if unknown := [name for name in at if name not in PARAMETERS]:
            message = f"unknown parameter; allowed: {', '.join(PARAMETERS)}"
            raise ConfigError([Fault("--at", None, None, (unknown[0],), message)])
        result = follow(checked, **at)
        files = RunFiles(output or Path("runs") / checked.name, f"{checked.name}_trajectory")
        files.save_result(result, trajectory_plot.draw(result))
        _say(f"wrote {files.dataset} and .png")


@main.command()
@click.argument("config", type=click.Path(path_type=Path))
@click.option("--width", type=click.FloatRange(1e-12, 0.5), default=1e-3, show_default=True,
              help="Relative width of the brackets from simulation.")  # fmt: skip
@click.option("--output", type=click.Path(path_type=Path), help="Folder for the results [default: runs/NAME].")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Replace a value of the configuration.")
@click.option("--quiet", is_flag=True, help="Print errors alone.")
def critical(config: Path, width: float, output: Path | None, settings: tuple[str, ...], quiet: bool) -> None:
    """Critical spins over the axes of CONFIG but n0: by formula, linear stability and simulation.

    Writes NAME_critical.nc and .png.
    """
    with _explained():
        from sweep.config import load_config
        from sweep.plots import maps as plots
        from sweep.results.store import RunFiles
        from sweep.studies.critical import critical as search

        checked = load_config(config, _parse_settings(settings))
        result = search(checked, width, lambda message: None if quiet else click.echo(message, err=True))
        files = RunFiles(output or Path("runs") / checked.name, f"{checked.name}_critical")
        files.save_result(result, plots.draw_critical(result))
        if not quiet:
            _say(f"wrote {files.dataset} and .png")


@main.command()
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default="runs/reproduce",
    show_default=True,
    help="Folder for the report.",
)
def reproduce(output: Path) -> None:
    """Every number and figure of Takano (2011) beside ours, in one HTML report.

    Exit code 0 only if every row holds, 1 otherwise.
    """
    with _explained():
        from sweep.reproduce import reproduce as compare

        failed = compare(output, click.echo)
        click.echo(f"\nwrote {output / 'reproduce.html'}; {len(failed)} rows do not hold")
        sys.exit(1 if failed else DONE)


@main.command()
@click.option(
    "--output",
    type=click.Path(path_type=Path),
    default="runs/bench",
    show_default=True,
    help="Folder for the report.",
)
def bench(output: Path) -> None:
    """Speed against error of each method and model, and cases that are hard to get right.

    Takes about three minutes on two cores; writes bench.html, bench.png and bench.csv.

    Exit code 1 if a hard case does not hold, else 0: no time, and no error at a tolerance, fails.
    """
    with _explained():
        from sweep.bench import bench as measure

        failed = measure(output, click.echo)
        click.echo(f"\nwrote {output / 'bench.html'}, .png and .csv; {len(failed)} hard cases do not hold")
        sys.exit(1 if failed else DONE)


@main.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--var", "variable", help="Variable to draw [default: reversals, simulated beside predicted].")
@click.option("--output", type=click.Path(path_type=Path), help="PNG file [default: beside FILE].")
def plot(file: Path, variable: str | None, output: Path | None) -> None:
    """Draw the maps of a dataset again."""
    with _explained():
        from sweep.plots import maps as plots
        from sweep.results.store import open_dataset, replacing

        dataset = open_dataset(file)
        with _about(file):
            figure = plots.draw(dataset, variable)
            target = output or file.with_name(f"{file.stem}{f'_{variable}' if variable else ''}.png")
            with replacing(target) as temporary:
                figure.savefig(temporary, format="png")
        _say(f"wrote {target}")


@main.command()
@click.argument("file", type=click.Path(path_type=Path))
def info(file: Path) -> None:
    """Tell what is in a dataset: axes, counts by status, agreement with the prediction, provenance."""
    with _explained():
        from sweep.results.store import StoreError, open_dataset

        dataset = open_dataset(file)
        if "status" not in dataset:
            raise StoreError(f"{file}: not a dataset of sweep: no variable status")
        with _about(file):
            lines = [str(dataset.attrs.get("title", file.name)), _summary(dataset)]
            for name, variable in dataset.data_vars.items():
                lines.append(f"  {name} ({', '.join(map(str, variable.dims))}): {variable.attrs.get('long_name', '')}")
            lines += [f"{key}: {dataset.attrs[key]}" for key in sorted(set(dataset.attrs) - {"title", "config"})]
            lines.append(f"config:\n{dataset.attrs.get('config', '')}")
        _say("\n".join(lines))


def _say(text: str, *, err: bool = False) -> None:
    """Print lines that may quote files and their names."""
    click.echo("\n".join(map(printable, text.split("\n"))), err=err)


@contextmanager
def _about(file: Path) -> Iterator[None]:
    """Whatever a dataset of another program makes of what reads it is a fault of the file."""
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
    """Turns errors that are the user's to mend into lines on stderr and exit code 2."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if error is None:
            return
        from sweep.results.store import StoreError

        if isinstance(error, ConfigError | StoreError):
            _say(str(error), err=True)
            sys.exit(WRONG_INPUT)
        if isinstance(error, OSError):
            _say(f"{error.filename or 'a file'}: {error.strerror or error}", err=True)
            sys.exit(WRONG_INPUT)
        if isinstance(error, KeyboardInterrupt):
            click.echo("interrupted", err=True)
            sys.exit(INTERRUPTED)


def _parse_settings(settings: tuple[str, ...]) -> dict[str, Any]:
    from sweep.config.document import parse_value

    parsed = {}
    for setting in settings:
        path, equals, value = setting.partition("=")
        if not (equals and path):
            raise ConfigError([Fault(f"--set {brief(setting)}", None, None, (), "not a setting; allowed: PATH=VALUE")])
        parsed[path] = parse_value(value, f"--set {brief(path)}")
    return parsed


def _parse_pair(text: str, option: str) -> tuple[str, float]:
    from sweep.config.document import number

    name, _, value = text.partition("=")
    if (parsed := number(value)) is None:
        raise ConfigError([Fault(f"{option} {brief(text)}", None, None, (), "allowed: NAME=NUMBER")])
    return name, parsed


def _estimate(config: Config) -> str:
    """What a run would take, from a sample of its cells."""
    from sweep.engine.executor import nominal_seconds
    from sweep.engine.local import GROUP
    from sweep.engine.plan import plan
    from sweep.grid import Grid
    from sweep.models import MODELS

    grid = Grid.of(config)
    axes = " × ".join(f"{d} {n}" for d, n in zip(grid.dims, grid.shape, strict=True)) or "one cell"
    lines = [f"cells:  {grid.size} ({axes})" + (", not all of them simulated" if config.refine else "")]
    if config.model not in MODELS:
        return lines[0]
    sample = plan(config, grid.sample(_SAMPLE))
    share = grid.size / sample.grid.size
    steps = sum(part.images[:, part.kernel.row("goal")].sum() for part in sample.parts) * share
    seconds = sum(nominal_seconds(part.images, part.kernel) for part in sample.parts) * share
    bytes_a_cell = sum(part.images.nbytes for part in sample.parts) / sample.grid.size
    memory, disk = min(grid.size, GROUP) * bytes_a_cell / 2**20, grid.size * _BYTES_A_CELL / 2**20
    return "\n".join(
        [
            *lines,
            f"steps:  at most {steps:.3g}, {steps / grid.size:.3g} a cell",
            f"memory: {memory:.3g} MiB of trajectories, as much on disk beside {disk:.3g} MiB of results",
            f"time:   at most about {seconds:.3g} s, had every cell to go to t_end; cells that settle stop earlier",
        ]
    )


def _failed_fraction(dataset: xr.Dataset) -> float:
    from sweep.kernels.lanes import FAILURES

    return float(dataset["status"].isin(FAILURES).mean())


def _summary(dataset: xr.Dataset) -> str:
    import numpy as np

    from sweep.results.dataset import STATUSES, STEP_RULES

    status = np.ravel(dataset["status"].values)
    dims = " × ".join(f"{d} {n}" for d, n in dataset["status"].sizes.items()) or "one cell"
    ends = ", ".join(f"{(status == code).sum()} {name}" for code, name in STATUSES.items() if code in status)
    lines = [f"{status.size} cells ({dims}): {ends}"]
    if "simulated_share" in dataset.attrs:
        lines.append(f"simulated: {dataset.attrs['simulated_share']:.1%} of the cells; the others are inferred")
    if "reversals" in dataset:
        valid = np.isin(status, (1, 2))
        ours = np.ravel(dataset["reversals"].values)[valid].astype(int)
        if len(ours):
            lines.append(f"reversals: {ours.min()} to {ours.max()}")
        if len(ours) and "reversals_predicted" in dataset:
            off = abs(ours - np.ravel(dataset["reversals_predicted"].values)[valid])
            lines[-1] += (
                f"; as predicted in {(off == 0).mean():.1%} of the cells, within one in {(off <= 1).mean():.1%}"
            )
    if "energy_error" in dataset:
        error = np.ravel(dataset["energy_error"].values)
        lines.append(f"energy error: median {np.nanmedian(error):.1e}, largest {np.nanmax(error):.1e}")
    if "step_rule" in dataset:
        rule, step = np.ravel(dataset["step_rule"].values), np.ravel(dataset["step"].values)
        who = ", ".join(f"{name} in {(rule == code).sum()}" for code, name in STEP_RULES.items() if code in rule)
        lines.append(f"step: {step.min():.3g} to {step.max():.3g}, set by {who} cells")
    if "verified_cell" in dataset:
        changed = dataset.attrs.get("verified_counts_changed")
        counts = f"{changed} counts changed, " if changed is not None else ""
        spin = f"the largest difference in spin is {dataset.attrs['verified_largest_spin_difference']:.1e}"
        lines.append(f"verified: {dataset.sizes['verified']} cells run again with finer steps: {counts}{spin}")
    if "wall_time" in dataset.attrs:
        lines.append(
            f"cost: {dataset.attrs['wall_time']:.3g} s, {dataset.attrs['trajectories_per_second']:.3g} trajectories/s"
        )
    return "\n".join(lines)
