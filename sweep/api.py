"""The public names: what `import sweep` offers, which is what `python -m sweep` does from the shell.

What a function needs is imported when it is called: an import of all would take a second.
"""

from __future__ import annotations

from contextlib import contextmanager
from functools import cache

from sweep.studies import BOUNDARY_DEVIATION, BOUNDARY_WIDTH, SPIN_WIDTH

TYPE_CHECKING = False  # as in `sweep`
if TYPE_CHECKING:
    import os
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path
    from typing import Any

    import xarray as xr
    from distributed import Client
    from matplotlib.animation import FuncAnimation

    from sweep.config import Config, ConfigError, ConfigLike, load_config
    from sweep.config.film import Film
    from sweep.engine.reporter import Reporter
    from sweep.explorer.server import Beside
    from sweep.plots.picture import plot
    from sweep.results.store import StoreError
    from sweep.studies.predictions import predict

__all__ = [
    "Config", "ConfigError", "StoreError", "animate", "boundaries", "critical", "explore", "fit", "indices",
    "load_config", "open", "plot", "predict", "run", "trajectory",
]  # fmt: skip

HOMES = {
    "Config": "sweep.config",
    "ConfigError": "sweep.config",
    "StoreError": "sweep.results.store",
    "load_config": "sweep.config",
    "plot": "sweep.plots.picture",
    "predict": "sweep.studies.predictions",
}
"""The modules that define the names which are not defined here; they are names of `sweep` all the same."""


@contextmanager
def _prepared(
    config: ConfigLike, overrides: Mapping[str, Any], progress: bool | None, reporter: Reporter | None
) -> Iterator[tuple[Config, Reporter]]:
    """Yield the checked configuration of a call, and who is told of its progress."""
    from sweep.config import load_config
    from sweep.progress import shown

    register()
    with shown(progress, reporter) as told:
        checked = load_config(config, overrides, announce=told.note)
        _refuse_arguments(checked)
        yield checked, told


def _refuse_arguments(config: Config) -> None:
    """Refuse a user's parameter that no keyword could give, because an argument here has its name."""
    from inspect import signature

    from sweep.faults import fault_of
    from sweep.parameters import sections

    if not config.origin:
        return
    verbs = run, boundaries, critical, trajectory, fit, indices
    arguments = {name for verb in verbs for name in signature(verb).parameters}
    if wrong := sorted(arguments & {*config.table, *sections(config.table)}):
        words = f"parameter {wrong[0]!r} has the name of an argument of sweep.run, or of another verb; rename it"
        raise fault_of(words, file=config.origin.place)


def run(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    rerun: str | None = None,
    progress: bool | None = None,
    reporter: Reporter | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Run a sweep.

    If `output` holds the dataset of a smaller run, of fewer cells or to an earlier `t_end`, only what it lacks is
    simulated.  The dataset is the same, bit for bit, as that of a run of all cells at once.

    Parameters
    ----------
    config : path of a configuration, what its file would say as a mapping, or a `Config`
    output : folder for the dataset and its maps; until they are finished it holds a checkpoint, from which the same
        call resumes.  By default nothing is written
    fresh : discard what an earlier run left in `output`
    rerun : "failed" or "limit": simulate again just those cells of the dataset in `output` that failed, or that
        reached the time limit, with the settings of the integrator as they are now; the others stay as they are
    progress : whether to show a bar; by default in notebooks alone
    reporter : receives progress and messages in place of a bar
    client : connected to a dask cluster whose workers run the cells, or the address of its scheduler; by default the
        threads of this process run them
    overrides : values that replace those of `config`, such as ``mu=60``, ``t_end=1000`` or ``n0=np.linspace(0, 1, 9)``

    Returns
    -------
    Dataset over the axes of the configuration; the `long_name` of a variable says what it means.  If `output` is given
    and there are more than two million cells, values are read from the file when they are asked for.

    Raises
    ------
    ConfigError, StoreError
        if the configuration, or what `output` holds, cannot be used.

    Examples
    --------
    >>> maps = sweep.run({"friction": {"mu": 60}}, n0=[0.02, 0.05, 0.1], t_end=1000)
    >>> maps.reversals.values
    array([1, 2, 5], dtype=int16)
    """
    from sweep.engine.run import run

    with _prepared(config, overrides, progress, reporter) as (checked, told):
        return run(checked, output, fresh=fresh, rerun=rerun, reporter=told, client=client)


def boundaries(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    bracket: float = BOUNDARY_WIDTH,
    deviation: float = BOUNDARY_DEVIATION,
    fresh: bool = False,
    progress: bool | None = None,
    reporter: Reporter | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """The curves over two axes on which the number of reversals changes, for each value of the other axes.

    The cells of the configuration are simulated first.  Where two neighbours along `x` or `y` count differently, the
    place between them at which each count begins is bracketed by further simulations.  Halfway between two points two
    more cells tell whether the smooth curve passes between them; if not, a point is added there.

    Parameters
    ----------
    config, output, fresh, progress, reporter, client, overrides : as for `run`
    x, y : axes over which the curves are drawn; by default the second and the first of more than one value
    bracket : width of the brackets, relative to the value of the parameter along which each lies
    deviation : how far halfway between two points the boundary may be from the smooth curve through them, relative to
        the lengths of the axes

    Returns
    -------
    Dataset over the points of all curves, in order along each: the place, the `level` (the count that begins there),
    the number of the `curve`, and of the bracket the axis along which it lies, the two simulated cells at its ends and
    what these count.

    Raises
    ------
    ConfigError, StoreError
        as `run`; also if the model is a formula, or there are no two axes.

    Examples
    --------
    >>> curves = sweep.boundaries({"friction": {"mu": [60, 80]}}, n0=[0.02, 0.06], t_end=1000, bracket=0.1)
    >>> curves.attrs["x"], curves.attrs["y"]
    ('n0', 'mu')
    """
    from sweep.studies.boundaries import boundaries
    from sweep.studies.kept import kept

    with _prepared(config, overrides, progress, reporter) as (checked, told):
        task = boundaries(checked, x, y, bracket, deviation)
        return kept(task, output, fresh=fresh, reporter=told, client=client)


def critical(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    bracket: float = SPIN_WIDTH,
    fresh: bool = False,
    progress: bool | None = None,
    reporter: Reporter | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Critical spins over all axes of `config` except n0: by formulas, and n_c1 by eigenvalues, n_c2 by simulation.

    n_c1 is the first spin, outwards from zero, at which a tiny rattle grows, by the eigenvalues.  n_c2 is the first
    spin, outwards from that, from which the trajectory from the configuration's start point reverses before t_end: it
    is bracketed by simulation.

    Parameters
    ----------
    config, output, fresh, progress, reporter, client, overrides : as for `run`
    bracket : width of the brackets of n_c2, relative to the spin

    Returns
    -------
    Dataset over the axes without n0.  With each `n_c2_*_simulated` come the ends of its bracket, `*_inner` and
    `*_outer`.  A `*_reason` says why n_c1 or n_c2 is NaN; `critical_reason` is the first of the four that is not
    `exists`.

    Raises
    ------
    ConfigError, StoreError
        as `run`; also if the model is a formula, or the start point is an axis.

    Examples
    --------
    >>> spins = sweep.critical({"friction": {"mu": 60}}, bracket=0.1)
    >>> f"{float(spins.n_c2_plus_simulated):.3f}"
    '0.005'
    """
    from sweep.studies.critical import critical
    from sweep.studies.kept import kept

    with _prepared(config, overrides, progress, reporter) as (checked, told):
        return kept(critical(checked, bracket), output, fresh=fresh, reporter=told, client=client)


def trajectory(
    config: ConfigLike,
    *,
    every: float | None = None,
    stop_when_settled: bool = False,
    samples: int | None = None,
    progress: bool | None = None,
    reporter: Reporter | None = None,
    **values: Any,
) -> xr.Dataset:
    """Follow single cells densely in time, up to t_end.

    The method is always dopri5, whatever the configuration names: it alone can stop after any step for a sample.

    Parameters
    ----------
    config, progress, reporter : as for `run`
    every : time between samples, in sqrt(c/g) or, with `units: SI`, in s, at least a step; by default nearly twenty
        per period of the fastest motion
    stop_when_settled : end a trajectory when neither spin nor count can change any more, as a sweep does, and not at
        t_end, whatever the configuration says; with `t_end: .inf`, it always ends there
    samples : follow so many samples of the parameters that are distributions, those with which a run begins, and not
        the medians alone
    values : the cells, by parameters such as ``mu=60, n0=[0.02, 0.05]``, of which each combination is one trajectory;
        an axis of `config` that is not named takes its first value, with a warning if others are named.  Anything else
        replaces a value of `config`, such as ``t_end=300``

    Returns
    -------
    Dataset over (trajectory, time): the series that the model can show, NaN after the end of a
    trajectory.  Over (trajectory): all that a sweep gives for the cell, from the same steps, which the sampling does
    not change.  The status is `settled` if neither spin nor count would change any more after t_stop.

    Raises
    ------
    ConfigError
        if the configuration cannot be used, the model is a formula, or a cell cannot be run.

    Examples
    --------
    >>> two = sweep.trajectory({"friction": {"mu": 60}}, n0=[0.02, 0.05], t_end=100)
    >>> two.spin.dims
    ('trajectory', 'time')
    """
    from warnings import warn

    from sweep.config import parameters_of
    from sweep.studies.trajectory import first_values, trajectory

    known = parameters_of(config, values)
    cells = {name: value for name, value in values.items() if name in known}
    settings = {name: value for name, value in values.items() if name not in known}
    with _prepared(config, settings, progress, reporter) as (checked, told):
        found = trajectory(
            checked, every=every, stop_when_settled=stop_when_settled, samples=samples, reporter=told, **cells
        )
    if cells and (words := first_values(checked, cells)):
        warn(words, stacklevel=2)
    return found


def animate(
    source: ConfigLike | xr.Dataset,
    output: str | Path | None = None,
    *,
    begin: float = 0.0,
    end: float | None = None,
    speed: float | None = None,
    progress: bool | None = None,
    reporter: Reporter | None = None,
    **values: Any,
) -> FuncAnimation:
    """Show how single bodies turn, side by side and in one clock.

    Parameters
    ----------
    source : a configuration, as for `run`, or a dataset of `trajectory` or `fit`, or the path of its file, which ends
        in .nc.  Of a fit, the film is shown beside the body that fits it
    output : file to write; its suffix names the format: gif, mp4 (which needs ffmpeg) or html (a page without network)
    begin, end : the stretch of time shown; by default until a third beyond the last of the bodies' first reversals
    speed : time shown in a second of the clip; by default such that the clip takes ten
    progress, reporter : as for `run`
    values : the cells and other values of a configuration, as for `trajectory`; a dataset takes none

    Returns
    -------
    The animation, which a notebook shows by its `to_jshtml()`.

    Raises
    ------
    ConfigError
        as `trajectory`; also if the bodies have no attitude or are too many, the stretch is empty, the speed is not
        above zero, or there is no such format.
    StoreError
        if the file is not a dataset, or `output` cannot be written.
    """
    from pathlib import Path
    from typing import cast

    from sweep.plots import animation

    if output is not None:
        animation.check(Path(output))
    if animation.is_dataset(source):
        from sweep.progress import shown as told_by
        from sweep.studies.filmed import shown

        with told_by(progress, reporter) as told:
            of_file = shown(source, told)
        return animation.animate(of_file, output, begin=begin, end=end, speed=speed, **values)
    followed = trajectory(cast("ConfigLike", source), progress=progress, reporter=reporter, **values)
    return animation.animate(followed, output, begin=begin, end=end, speed=speed)


def fit(
    config: ConfigLike,
    film: str | Path | Film,
    free: Sequence[str],
    *,
    laws: Sequence[str] = (),
    time_column: str = "",
    spin_column: str = "",
    progress: bool | None = None,
    reporter: Reporter | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Find the body, friction and start that reproduce a film of one body.

    The trajectory begins with the film, whose times are in the unit of the configuration: s with `units: SI`.

    Parameters
    ----------
    config, progress, reporter, overrides : as for `run`.  A free parameter that has several values is sought between
        the least and the largest.  The range of one that has a single value is found from the film and the body, and
        widened where the best value lies at its end.  A parameter that is a distribution is free as well: that is what
        was measured of it
    film : a table of numbers with a header: a time, and a spin ("spin (rad/s)"), what a phone on the body tells
        ("Gyroscope z (rad/s)") or a heading ("angle (deg)"); with a column "error", intervals follow from that, and
        else from the residuals.  Or a `sweep.config.film.Film`
    time_column, spin_column : names of the columns of the film, with a unit if it gives none, such as "omega (deg/s)";
        by default those with known names
    free : names of the parameters to find.  Of the film itself, film_delay and film_bias can be found too
    laws : laws of friction to compare, such as ``["viscous", "coulomb-tanh"]``.  Each takes from `config` what that
        says of its parameters, and finds those that `config` does not say as well; it does without what it has not

    Returns
    -------
    Dataset over (parameter): the `value` that fits best, and the ends of its intervals of 68 and 95 %.  Over (time):
        the film, the fit, and which rows are outliers, left out of it.  Over (rank): all minima that were found.  The
        attribute `fits` is 1 if what is left between film and curve is noise, and 0 if not; `fits_because` gives the
        reason, `verdict` three sentences, `undetermined` what the film does not determine, and `config` runs the fitted
        body.  With `laws`, dataset over (law, parameter) and (law, time);
        over (law): `chi_square`, `number_free`, `akaike` and the `weight` of each.

    Raises
    ------
    ConfigError
        if the configuration or the film cannot be used, or the configuration is not of one body.
    """
    from sweep.studies.laws import fitted

    with _prepared(config, overrides, progress, reporter) as (checked, told):
        return fitted(checked, film, free, laws, told, (time_column, spin_column))


def explore(dataset: xr.Dataset | str | Path, *, height: int = 950) -> Beside:
    """Show the explorer of a dataset in a notebook: maps, and the trajectory of each cell that is clicked.

    It needs the extra `explore`, and a browser on the same machine as the notebook's kernel.

    Parameters
    ----------
    dataset : of a run or of critical spins, or the path of its file
    height : of the page in the notebook, in pixels

    Returns
    -------
    The explorer, of which a notebook shows the page; its `url` opens in a browser too.  It lives until its `close()` is
    called, or as long as the kernel.

    Raises
    ------
    StoreError
        if the dataset has no axis, or was cut or averaged.
    ModuleNotFoundError
        if Bokeh is not installed.
    """
    from pathlib import Path

    from sweep.explorer.server import serve_beside
    from sweep.explorer.setup import usable
    from sweep.explorer.slices import Source, open_source
    from sweep.results.kind import require_whole

    source = open_source(Path(dataset)) if isinstance(dataset, str | Path) else Source(require_whole(dataset))
    return serve_beside(source, usable(source), height)


def indices(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    progress: bool | None = None,
    reporter: Reporter | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Tell on which of the uncertain parameters the results of a scene depend, by Sobol indices.

    Parameters
    ----------
    config, output, fresh, progress, reporter, client, overrides : as for `run`.  Some parameters are distributions,
        and none is an axis.  n (uncertain parameters + 2) trajectories are run, n being the samples rounded up to a
        power of two

    Returns
    -------
    Dataset over (quantity, parameter): the index of `first_order`, which a parameter has alone, and of `total_order`,
    with all that it shares with others, both with the ends of their intervals of 95 %.  NaN where a sample failed,
    where not all samples have the quantity, or where all have the same.

    Raises
    ------
    ConfigError, StoreError
        as `run`; also if the model is a formula, no parameter is a distribution, or one is an axis.
    """
    from sweep.studies.indices import indices
    from sweep.studies.kept import kept

    with _prepared(config, overrides, progress, reporter) as (checked, told):
        return kept(indices(checked), output, fresh=fresh, reporter=told, client=client)


def open(path: str | os.PathLike[str], *, load: bool = True) -> xr.Dataset:
    """Open a dataset that this program wrote.

    Parameters
    ----------
    path : of the netCDF file
    load : read it into memory and close the file.  If False, values are read when they are asked for, and the file
        stays open until the dataset is closed

    Raises
    ------
    StoreError
        if the file is not such a dataset, or is larger than memory.

    Examples
    --------
    >>> _ = sweep.run({"name": "spins", "friction": {"mu": 60}}, "runs", n0=[0.02, 0.05], t_end=100)
    >>> sweep.open("runs/spins.nc").n0.values
    array([0.02, 0.05])
    """
    from pathlib import Path

    from sweep.results.kind import opened

    register()
    return opened(Path(path), load=load)


class Accessor:
    """What is ours of a dataset of xarray: `dataset.sweep.plot()`, `dataset.sweep.trajectory(mu=60)`."""

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def plot(self, variable: str | None = None, **options: Any) -> Any:
        """Draw the dataset; arguments, figure and errors as of `sweep.plot`."""
        from sweep.plots.picture import plot  # which loads matplotlib

        return plot(self._dataset, variable, **options)

    def trajectory(self, **values: Any) -> Any:
        """Follow single cells densely in time, with the configuration of the dataset.

        Parameters
        ----------
        values : the cells, such as ``mu=60``, and the other arguments of `sweep.trajectory`

        Raises
        ------
        ValueError
            if the dataset contains no configuration.
        ConfigError
            as `sweep.trajectory`; also if its model is code of a user, which runs only if `sweep.trajectory` is given
            the configuration.
        """
        if "config" not in self._dataset.attrs:
            raise ValueError("the dataset tells no configuration; call sweep.trajectory with one")
        from sweep.results.configuration import configuration

        return trajectory(configuration(self._dataset), **values)


@cache
def register() -> None:
    """Make `Accessor` the attribute `sweep` of every dataset."""
    import xarray as xr

    xr.register_dataset_accessor("sweep")(Accessor)  # type: ignore[no-untyped-call]
