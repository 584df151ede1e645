"""The commands that simulate: `run`, `trajectory`, `animate`, `boundaries`, `critical` and `fit`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sweep.cli.faults import TOO_MANY_FAILED, refuse, say
from sweep.cli.options import AT, OUTPUT, PATH, QUIET, SETTINGS, configured, loaded
from sweep.interrupt import INTERRUPTED
from sweep.studies import BOUNDARY_DEVIATION, BOUNDARY_WIDTH, DEVIATIONS, SPIN_WIDTH, WIDTHS

if TYPE_CHECKING:
    import xarray as xr

    from sweep.config import Config
    from sweep.results.folder import RunFiles
    from sweep.studies.study import Task


CLIENT = click.option("--client", metavar="ADDRESS", help="Run on the workers of this dask scheduler.")


DRY_RUN = click.option(
    "--dry-run", is_flag=True, help="Print how much would be simulated and roughly how long it would take, then stop."
)
FRESH = click.option("--fresh", is_flag=True, help="Discard the files of an earlier run instead of resuming it.")


def _resumed(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options of commands that keep their simulations, resume, and can use several processes."""
    for option in (QUIET, CLIENT, FRESH, DRY_RUN, OUTPUT):
        command = option(command)
    return command


@click.command()
@configured
@_resumed
def run(config: Config, **how: Any) -> None:
    """Run the sweep that CONFIG describes.

    Writes NAME.nc (the dataset) and NAME.png (its maps), where NAME is the name of the run, and NAME_VARIABLE.png for
    each further variable listed under `picture` in CONFIG. An interrupted run keeps finished work, and the same command
    resumes it. If you have added values to an axis of CONFIG or raised t_end, only the missing part is simulated.
    `sweep parameters` lists the parameters.
    """
    from sweep.engine.estimate import estimate
    from sweep.engine.run import run as run_sweep
    from sweep.results.summary import failed_fraction

    if (result := _written(config, "run", partial(run_sweep, config), partial(estimate, config), **how)) is None:
        return
    failed = failed_fraction(result)
    if failed > config.max_failed_fraction:
        most = f"max_failed_fraction allows {config.max_failed_fraction:.2%}"
        click.echo(f"{failed:.2%} of the cells failed; {most}", err=True)
        sys.exit(TOO_MANY_FAILED)


@click.command()
@configured
@AT
@click.option("--every", type=click.FloatRange(0, min_open=True),
              help="Time between samples [default: nearly twenty per period of the fastest motion].")  # fmt: skip
@click.option("--stop-early", is_flag=True,
              help="Stop once spin and count can no longer change, as a sweep does, instead of at t_end.")  # fmt: skip
@click.option("--samples", type=click.IntRange(1), metavar="N",
              help="Follow N samples of the uncertain parameters instead of their medians.")  # fmt: skip
@OUTPUT
@DRY_RUN
@QUIET
def trajectory(
    config: Config, at: dict[str, Any], samples: int | None, output: Path | None, dry_run: bool, quiet: bool, **how: Any
) -> None:
    """Follow single cells of CONFIG, or those of --at, over time.

    They run to t_end of CONFIG. Writes NAME_trajectory.nc and .png: spin with reversals and critical spins, contact
    point, accelerations, normal force, energy and the work of friction. Several trajectories share one set of panels;
    for samples, only the spins are drawn.
    """
    from sweep.config import values_at

    values_at(config, at)  # before anything heavy is loaded
    from sweep.studies.trajectory import estimate

    if dry_run:
        click.echo(estimate(config, at, samples))
        return
    files = _files(config, "trajectory", output)
    _save(_followed(config, at, quiet, samples=samples, **how), files)
    if not quiet:
        say(f"wrote {files.dataset} and .png")


@click.command()
@click.argument("source", metavar="CONFIG|FILE", type=PATH)
@SETTINGS
@AT
@click.option("--begin", type=float, default=0.0, show_default=True, help="Time at which the clip begins.")
@click.option("--end", type=float, help="Time at which the clip ends [default: soon after the first reversal].")
@click.option("--speed", type=float, help="Time shown per second of the clip [default: such that it takes 10 s].")
@click.option(
    "--output",
    type=PATH,
    help="File to write: gif, mp4 or html [default: NAME_trajectory.gif in runs/NAME, or next to FILE].",
)
@QUIET
def animate(
    source: Path, settings: dict[str, Any], at: dict[str, Any], output: Path | None, quiet: bool, **how: Any
) -> None:
    """Animate bodies and the paths of their contact points.

    CONFIG describes the bodies; FILE is a dataset written by `sweep trajectory` (NAME_trajectory.nc) or by `sweep fit`
    (NAME_fit.nc), which shows the filmed body and the fitted one. Bodies are shown side by side on a common clock,
    above their spin curves. An html page needs no network; an mp4 needs ffmpeg.
    """
    from sweep.plots import animation
    from sweep.results.writing import require_writable

    of_file = animation.is_dataset(source)
    if of_file and (settings or at):
        refuse("--set" if settings else "--at", "cannot be used with a dataset; give the configuration instead")
    config = None if of_file else loaded(source, settings)
    usual = Path("runs") / config.name / f"{config.name}_trajectory.gif" if config else source.with_suffix(".gif")
    target = output or usual
    animation.check(target, **how)
    require_writable(target)
    if config:
        animation.require_attitude(config)
        result = _followed(config, at, quiet)
    else:
        from sweep.progress import Terminal
        from sweep.studies.filmed import shown

        with Terminal(quiet) as terminal:
            result = shown(source, terminal)
    target.parent.mkdir(parents=True, exist_ok=True)
    animation.animate(result, target, **how)
    if not quiet:
        say(f"wrote {target}")


@click.command()
@configured
@click.option("--x", help="Parameter along the horizontal axis.")
@click.option("--y", help="Parameter along the vertical axis.")
@click.option("--bracket", type=click.FloatRange(*WIDTHS), default=BOUNDARY_WIDTH, show_default=True,
              help="Relative distance between the two simulated cells on either side of a boundary.")  # fmt: skip
@click.option("--deviation", type=click.FloatRange(*DEVIATIONS), default=BOUNDARY_DEVIATION, show_default=True,
              help="Maximum interpolation error of a curve, as a fraction of the axis length.")  # fmt: skip
@_resumed
def boundaries(config: Config, x: str | None, y: str | None, bracket: float, deviation: float, **how: Any) -> None:
    """Find where the number of reversals changes.

    The grid of CONFIG locates the curves over two of its axes, or the places along its only axis; further simulations
    refine them, so that each point lies between two simulated cells. Writes NAME_boundaries.nc and .png. An interrupted
    search keeps finished simulations, and the same command resumes it.
    """
    from sweep.studies.boundaries import boundaries as search

    _studied(search(config, x, y, bracket, deviation), **how)


@click.command()
@configured
@click.option("--bracket", type=click.FloatRange(*WIDTHS), default=SPIN_WIDTH, show_default=True,
              help="Relative width of the brackets of n_c2.")  # fmt: skip
@_resumed
def critical(config: Config, bracket: float, **how: Any) -> None:
    """Find the critical spins over all axes of CONFIG except n0.

    All are given by the paper's formulas; n_c1 also comes from the model's eigenvalues, and n_c2 from simulation.
    Writes NAME_critical.nc and .png. An interrupted search keeps finished simulations, and the same command resumes it.
    """
    from sweep.studies.critical import critical as search

    _studied(search(config, bracket), **how)


@click.command()
@configured
@click.argument("film", type=PATH)
@click.option("--free", required=True, metavar="NAME,NAME", help="Parameters to fit, e.g. mu,sigma,n0,x0,y0.")
@click.option("--laws", metavar="NAME,NAME", help="Laws of friction to fit and compare, e.g. viscous,coulomb.")
@click.option("--time-column", default="", metavar="NAME", help="Column of the time, e.g. 'clock (ms)'.")
@click.option("--spin-column", default="", metavar="NAME",
              help="Column of the spin, gyroscope or heading, with its unit if the film has none.")  # fmt: skip
@click.option("--run", default="", metavar="NAME",
              help="Run in a table of several: the end of column names, or a word of its column 'run'.")  # fmt: skip
@OUTPUT
@QUIET
def fit(
    config: Config, film: Path, free: str, laws: str | None, time_column: str, spin_column: str, run: str,
    output: Path | None, quiet: bool,
) -> None:  # fmt: skip
    """Find the parameters of the body in CONFIG that reproduce FILM.

    FILM is a table with a header: a time, and a spin, a gyroscope reading or a heading, such as "Time (s), Gyroscope z
    (rad/s)". A free parameter with several values in CONFIG is sought between the smallest and the largest; the range
    of a free parameter with a single value is found from the film. The offsets film_delay and film_bias of the film
    itself can also be free. Three sentences say whether the fit can be trusted. Writes NAME_fit.nc and .png, and
    NAME_fit.yaml, which runs the fitted body; with --laws, writes NAME_laws.nc, .png and .yaml, the last for the best
    law.
    """
    from sweep.progress import Terminal
    from sweep.results.summary import describe
    from sweep.results.writing import replacing
    from sweep.studies.laws import fitted

    names, others = ([name.strip() for name in each.split(",")] if each else [] for each in (free, laws))
    files = _files(config, "laws" if laws else "fit", output)
    with Terminal(quiet) as terminal:
        result = fitted(config, film, names, others, terminal, (time_column, spin_column, run))
    _save(result, files)
    with replacing(files.configuration) as temporary:
        temporary.write_text(result.attrs["config"], encoding="utf-8")
    if not quiet:
        say(f"{describe(result)}\nwrote {files.dataset}, .png and .yaml")


def _followed(config: Config, at: dict[str, Any], quiet: bool, **how: Any) -> xr.Dataset:
    """Follow the cells of `--at`."""
    from sweep.progress import Terminal
    from sweep.studies.trajectory import trajectory

    with Terminal(quiet) as terminal:
        return trajectory(config, at=at, reporter=terminal, **how)


def _files(config: Config, verb: str, output: Path | None) -> RunFiles:
    """Return the files of a command without a checkpoint, after checking that they can be written."""
    from sweep.results.folder import RunFiles

    files = RunFiles(output or Path("runs") / config.name, f"{config.name}_{verb}")
    files.require_writable()
    return files


def _save(result: xr.Dataset, files: RunFiles) -> None:
    """Write a dataset and its picture."""
    from sweep.plots.attempt import attempt
    from sweep.results import netcdf

    files.folder.mkdir(parents=True, exist_ok=True)
    netcdf.write(files.dataset, result)
    attempt(result, files.picture, partial(say, err=True))


def _studied(task: Task, **how: Any) -> None:
    """Carry out a study and report the result, as `_written`."""
    _written(task.config, task.verb, task.run, task.estimate, **how)


def _written(
    config: Config, verb: str, work: Callable[..., xr.Dataset], estimate: Callable[[], str], *,
    fresh: bool, dry_run: bool, output: Path | None, client: str | None, quiet: bool,
) -> xr.Dataset | None:  # fmt: skip
    """Carry out `work`, show its progress, and report result and files; in a dry run print only the estimate."""
    if dry_run:
        click.echo(estimate())
        return None
    from sweep.progress import Terminal
    from sweep.results.summary import describe

    folder, name = output or Path("runs") / config.name, config.name if verb == "run" else f"{config.name}_{verb}"
    before = _stamps(folder, name)
    with Terminal(quiet) as terminal:
        try:
            result = work(output=folder, fresh=fresh, reporter=terminal, client=client)
        except KeyboardInterrupt:
            done = f"{terminal.last.done:.0f} of {terminal.last.cells} cells" if terminal.last else "no cells"
            command = "the same command without --fresh" if fresh else "the same command"
            kept = f"{command} resumes the {'run' if verb == 'run' else 'search'}"
            terminal.note(f"interrupted: {done} finished and kept; {kept}")
            sys.exit(INTERRUPTED)
    if not quiet:
        click.echo(describe(result))
        new = [suffix for suffix, stamp in _stamps(folder, name).items() if stamp != before.get(suffix)]
        say(f"wrote {folder / name}{' and '.join(new)}" if new else "nothing was written")
    return result


def _stamps(folder: Path, name: str) -> dict[str, tuple[int, int]]:
    """Return marks, by suffix, that change whenever a result file `name` in `folder` is rewritten."""
    found = [path for ending in (".nc", ".png", "_*.png") for path in sorted(folder.glob(f"{name}{ending}"))]
    return {path.name.removeprefix(name): (path.stat().st_ino, path.stat().st_mtime_ns) for path in found}
