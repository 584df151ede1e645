"""Defines the public names: `import sweep` offers what `python -m sweep` does in the shell.

Functions import what they need when they are called, since importing everything would take a second.
"""

from __future__ import annotations

import sys
from contextlib import contextmanager
from threading import Lock

from sweep.studies import BOUNDARY_DEVIATION, BOUNDARY_WIDTH, SPIN_WIDTH

TYPE_CHECKING = False  # as in `sweep`
if TYPE_CHECKING:
    import os
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from importlib.machinery import ModuleSpec
    from pathlib import Path
    from types import ModuleType
    from typing import Any

    import xarray as xr
    from distributed import Client
    from matplotlib.animation import FuncAnimation
    from matplotlib.figure import Figure

    from sweep.config import Config, ConfigLike, load_config
    from sweep.config.film import Film
    from sweep.engine.reporter import Reporter
    from sweep.explorer.server import Beside
    from sweep.faults import Error, FileError, InputError
    from sweep.plots.picture import plot

__all__ = [
    "Config", "Error", "FileError", "InputError", "animate", "boundaries", "critical", "explore", "fit",
    "load_config", "open_dataset", "plot", "predict", "run", "trajectory",
]  # fmt: skip

HOMES = {
    "Config": "sweep.config",
    "Error": "sweep.faults",
    "FileError": "sweep.faults",
    "InputError": "sweep.faults",
    "load_config": "sweep.config",
    "plot": "sweep.plots.picture",
}
"""Modules of the public names that are not defined here."""


@contextmanager
def _prepared(
    config: ConfigLike, overrides: Mapping[str, Any], progress: bool | Callable[[float, str], None] | None
) -> Iterator[tuple[Config, Reporter]]:
    """Yield the checked configuration of a call, and the reporter of its progress."""
    from sweep.config import load_config
    from sweep.progress import reporting

    with reporting(progress) as reporter:
        checked = load_config(config, overrides, announce=reporter.note)
        _refuse_arguments(checked)
        yield checked, reporter


def _refuse_arguments(config: Config) -> None:
    """Refuse a user's parameter with the name of an argument here, since no keyword could set it."""
    from inspect import signature

    from sweep.faults import fault_of
    from sweep.parameters import sections

    if not config.origin:
        return
    verbs = run, boundaries, critical, trajectory, fit
    arguments = {name for verb in verbs for name in signature(verb).parameters}
    if wrong := sorted(arguments & {*config.table, *sections(config.table)}):
        message = f"parameter {wrong[0]!r} has the name of an argument of sweep.run or a similar function; rename it"
        raise fault_of(message, file=config.origin.place)


def run(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    fresh: bool = False,
    progress: bool | Callable[[float, str], None] | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Run a sweep.

    If `output` holds the dataset of a smaller run, with fewer cells or an earlier `t_end`, only the missing part is
    simulated.

    Parameters
    ----------
    config : path of a configuration, its contents as a mapping, or a `Config`
    output : folder for the dataset and its maps; until they are finished it holds a checkpoint, from which the same
        call resumes. By default nothing is written
    fresh : discard the files of an earlier run in `output`
    progress : whether to show a progress bar, by default only in notebooks; or a function that is called with the share
        that is done, from 0 to 1, and a line of text
    client : a client of a dask cluster whose workers run the cells, or the address of its scheduler; by default the
        threads of this process run them
    overrides : values that replace those of `config`, such as ``mu=60``, ``t_end=1000`` or ``n0=np.linspace(0, 1, 9)``

    Returns
    -------
    Dataset over the axes of the configuration; each variable is described by its `long_name`. If `output` is given and
    there are more than two million cells, values are read from the file on demand.

    Raises
    ------
    InputError, FileError
        if the configuration, or the contents of `output`, cannot be used.

    Examples
    --------
    >>> maps = sweep.run({"friction": {"mu": 60}}, n0=[0.02, 0.05, 0.1], t_end=1000)
    >>> maps.reversals.values
    array([1, 2, 5], dtype=int16)
    """
    from sweep.engine.run import run

    with _prepared(config, overrides, progress) as (checked, reporter):
        return run(checked, output, fresh=fresh, reporter=reporter, client=client)


def boundaries(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    x: str | None = None,
    y: str | None = None,
    bracket: float = BOUNDARY_WIDTH,
    deviation: float = BOUNDARY_DEVIATION,
    fresh: bool = False,
    progress: bool | Callable[[float, str], None] | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Find where the number of reversals changes: curves over two axes, or points along a single one.

    Where two neighbouring cells of the configuration have different counts, further simulations bracket the place
    between them at which each count begins. Curves are found for each value of the other axes.

    Parameters
    ----------
    config, output, fresh, progress, client, overrides : as for `run`
    x, y : axes over which the curves are drawn; by default the second and the first with more than one value. A
        configuration may also have a single axis
    bracket : width of the brackets, relative to the value of the parameter along which each lies
    deviation : largest distance of the boundary from the smooth curve through the points, halfway between two of them,
        relative to the lengths of the axes; where it is larger, a point is added

    Returns
    -------
    Dataset over the points of all curves, in order along each: the place, the `level` (the count that begins there),
    the number of the `curve`, and for the bracket the axis along which it lies, the two simulated cells at its ends and
    their counts.

    Raises
    ------
    InputError, FileError
        as `run`; also if the model is not simulated, or there is no axis.

    Examples
    --------
    >>> curves = sweep.boundaries({"friction": {"mu": [60, 80]}}, n0=[0.02, 0.06], t_end=1000, bracket=0.1)
    >>> curves.attrs["x"], curves.attrs["y"]
    ('n0', 'mu')
    """
    from sweep.studies.boundaries import boundaries

    with _prepared(config, overrides, progress) as (checked, reporter):
        task = boundaries(checked, x, y, bracket, deviation)
        return task.run(output, fresh=fresh, reporter=reporter, client=client)


def critical(
    config: ConfigLike,
    output: str | Path | None = None,
    *,
    bracket: float = SPIN_WIDTH,
    fresh: bool = False,
    progress: bool | Callable[[float, str], None] | None = None,
    client: Client | str | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Find the critical spins over all axes of `config` except n0, by formulas, eigenvalues and simulation.

    Outwards from zero, n_c1 is the first spin at which a tiny rattle grows, and n_c2 the first one beyond it whose
    trajectory, from the configuration's start point, reverses before t_end.

    Parameters
    ----------
    config, output, fresh, progress, client, overrides : as for `run`
    bracket : width of the brackets of n_c2, relative to the spin

    Returns
    -------
    Dataset over the axes without n0, and over the `sign` of the spin, 1 and -1: `n_c1_linear` by the eigenvalues,
    `n_c2_simulated` with the ends of its `n_c2_bracket`, and `n_c_reason`, why one of them is missing.

    Raises
    ------
    InputError, FileError
        as `run`; also if the model is not simulated, or the start point is an axis.

    Examples
    --------
    >>> spins = sweep.critical({"friction": {"mu": 60}}, bracket=0.1)
    >>> spins.n_c2_simulated.sel(sign=1).round(3).item()
    0.005
    """
    from sweep.studies.critical import critical

    with _prepared(config, overrides, progress) as (checked, reporter):
        return critical(checked, bracket).run(output, fresh=fresh, reporter=reporter, client=client)


def trajectory(
    config: ConfigLike,
    *,
    at: Mapping[str, Any] | None = None,
    every: float | None = None,
    stop_early: bool = False,
    samples: int | None = None,
    progress: bool | Callable[[float, str], None] | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Follow single cells of a sweep over time, up to t_end.

    The method is always dopri5, because only dopri5 can stop anywhere for a sample.

    Parameters
    ----------
    config, progress, overrides : as for `run`
    at : the cells to follow, by parameter, such as ``{"mu": 60, "n0": [0.02, 0.05]}``, on the grid or off it; other
        parameters keep their values. By default all cells, at most 1000
    every : time between samples, in sqrt(c/g) or, with `units: SI`, in s, at least a step; by default nearly twenty
        per period of the fastest motion
    stop_early : end a trajectory once its count is final, as a sweep does, instead of at t_end, whatever the
        configuration says; always so with `t_end: settled`
    samples : number of samples of the uncertain parameters to follow, instead of their medians; they are the first
        samples of a run

    Returns
    -------
    Dataset with the dimensions of a run of the same cells, and with the time: the series that the model supports, NaN
    after the end of a trajectory. It also has all results of a run, which the sampling does not change. The status is
    `settled` if the count is final at t_stop.

    Raises
    ------
    InputError
        if the configuration cannot be used, the model is not simulated, or a cell cannot be run.

    Examples
    --------
    >>> two = sweep.trajectory({"friction": {"mu": 60}}, at={"n0": [0.02, 0.05]}, t_end=100)
    >>> two.spin.dims
    ('n0', 'time')
    """
    from sweep.studies.trajectory import trajectory

    with _prepared(config, overrides, progress) as (checked, reporter):
        return trajectory(checked, at=at, every=every, stop_early=stop_early, samples=samples, reporter=reporter)


def animate(
    source: ConfigLike | xr.Dataset,
    output: str | Path | None = None,
    *,
    at: Mapping[str, Any] | None = None,
    begin: float = 0.0,
    end: float | None = None,
    speed: float | None = None,
    progress: bool | Callable[[float, str], None] | None = None,
    **overrides: Any,
) -> FuncAnimation:
    """Animate the motion of bodies, side by side on a common clock.

    Parameters
    ----------
    source : a configuration, as for `run`, or a dataset of `trajectory` or `fit`, or the path of its file, which ends
        in .nc. For a fit, the filmed body is shown next to the fitted one
    output : file to write; its suffix sets the format: gif, mp4 (needs ffmpeg) or html (a page that needs no network)
    begin, end : the interval of time shown; by default until twice the latest of the bodies' first reversals
    speed : time shown per second of the clip; by default such that the clip takes ten seconds
    progress : as for `run`
    at, overrides : the cells, and replaced values of a configuration, as for `trajectory`; a dataset takes none

    Returns
    -------
    The animation; show it in a notebook with `to_jshtml()`.

    Raises
    ------
    InputError
        as `trajectory`; also if the bodies are too many or have no attitude, or if the interval, the speed, the format
        or the length of the clip cannot be used.
    FileError
        if the file is not a dataset, or `output` cannot be written.
    """
    from typing import cast

    from sweep.config import load_config
    from sweep.faults import fault_of
    from sweep.plots import animation

    animation.check(output, begin, end, speed)
    if animation.is_dataset(source):
        from sweep.progress import reporting
        from sweep.studies.filmed import shown

        if given := [*(["at"] if at else []), *overrides]:
            raise fault_of("cannot be used with a dataset; give the configuration instead", given[0])
        with reporting(progress) as reporter:
            followed = shown(source, reporter)
    else:
        config = cast("ConfigLike", source)
        animation.require_attitude(load_config(config))
        followed = trajectory(config, at=at, progress=progress, **overrides)
    return animation.animate(followed, output, begin=begin, end=end, speed=speed)


def fit(
    config: ConfigLike,
    film: str | Path | Film,
    free: str | Sequence[str],
    *,
    laws: str | Sequence[str] = (),
    time_column: str = "",
    spin_column: str = "",
    run: str = "",
    progress: bool | Callable[[float, str], None] | None = None,
    **overrides: Any,
) -> xr.Dataset:
    """Find the body, friction and start that reproduce a film of one body.

    The trajectory begins with the film. The film's times are in the unit of the configuration: s with `units: SI`.

    Parameters
    ----------
    config, progress, overrides : as for `run`. A parameter given as a distribution is free as well, and the
        distribution counts as a measurement
    film : a `sweep.config.film.Film`, or a table of numbers with a header: a time, and a spin ("spin (rad/s)"), the
        gyroscope reading of a phone on the body ("Gyroscope z (rad/s)") or a heading ("angle (deg)"). Intervals are
        computed from a column "error" if there is one, otherwise from the residuals
    time_column, spin_column : names of the columns of the film, with a unit if it gives none, such as "omega (deg/s)";
        by default columns with known names
    run : the run, in a table of several: the end of the names of its columns, or the word in its column "run"
    free : names of the parameters to find, including film_delay and film_bias of the film itself. A parameter with
        several values is sought between the smallest and the largest; otherwise the film and the body give the range
    laws : laws of friction to compare, such as ``["viscous", "coulomb"]``.  Parameters of a law that `config` does not
        give are free, and parameters that a law does not have are ignored

    Returns
    -------
    Dataset over (parameter): the `value` that fits best, and the ends of its intervals of 68 and 95 %.  Over (time):
    the film, the fit, and outliers, which are left out of it.  Over (rank): all minima found.  The attribute `fits` is
    1 if the difference between film and curve is noise, otherwise 0; `fits_because` gives the reason, `verdict` three
    sentences, `undetermined` what the film does not determine, and `config` runs the fitted body.  With `laws`, all but
    the minima is over (law) as well, with the `chi_square`, `number_free`, `akaike` and `weight` of each.

    Raises
    ------
    InputError
        if the configuration or the film cannot be used, or the configuration does not describe one body.
    """
    from sweep.studies.laws import fitted

    with _prepared(config, overrides, progress) as (checked, reporter):
        return fitted(checked, film, free, laws, reporter, (time_column, spin_column, run))


def explore(dataset: xr.Dataset | str | Path, *, height: int = 950) -> Beside:
    """Show the explorer of a dataset in a notebook: maps, and the trajectory of each cell that you click.

    Needs the extra `explore`, and a browser on the same machine as the notebook's kernel.

    Parameters
    ----------
    dataset : a run or critical spins, as a dataset or the path of its file
    height : height of the page in the notebook, in pixels

    Returns
    -------
    The explorer, whose page a notebook displays; its `url` also opens in a browser. It lives until its `close()` is
    called or the kernel ends.

    Raises
    ------
    FileError
        if the dataset has no axis, or was cut or averaged.
    ModuleNotFoundError
        if Bokeh is not installed.
    """
    import xarray as xr

    from sweep.explorer.server import serve_beside
    from sweep.explorer.setup import usable
    from sweep.explorer.slices import Source, open_source
    from sweep.faults import local_path
    from sweep.results.kind import require_whole

    if isinstance(dataset, xr.Dataset):
        source = Source(require_whole(dataset))
    else:
        source = open_source(local_path(dataset, "dataset", "a dataset or the path of its file"))
    return serve_beside(source, usable(source), height)


def predict(config: ConfigLike, **overrides: Any) -> xr.Dataset:
    """Return the predictions of the paper and of the linear theory on the grid of `config`, without simulating.

    If `reversal_times` are measured, the time of the first one is predicted as well.

    Parameters
    ----------
    config : a configuration, a mapping with the contents of its file, or the path of a file
    overrides : values that replace those of the file, such as ``mu=60``

    Raises
    ------
    InputError
        if the configuration cannot be used.

    Examples
    --------
    >>> sweep.predict({"friction": {"mu": [60, 130]}}).reversals_predicted.values
    array([3, 7], dtype=int16)
    """
    from sweep import prediction
    from sweep.config import load_config
    from sweep.results import dataset, kind

    checked = load_config(config, overrides)
    found = prediction.predict(checked.tier, checked.grid, checked.measure).variables
    attributes = {kind.ATTRIBUTE: kind.RUN.name, "config": checked.label()}
    return dataset.label(checked, checked.grid, found, attributes)


def open_dataset(path: str | os.PathLike[str], *, load: bool = True) -> xr.Dataset:
    """Open a dataset that this program wrote.

    Parameters
    ----------
    path : path of the netCDF file
    load : read the dataset into memory and close the file. If False, values are read on demand, and the file stays open
        until the dataset is closed

    Raises
    ------
    FileError
        if the file is not a dataset of this program.

    Examples
    --------
    >>> _ = sweep.run({"name": "spins", "friction": {"mu": 60}}, "runs", n0=[0.02, 0.05], t_end=100)
    >>> sweep.open_dataset("runs/spins.nc").n0.values
    array([0.02, 0.05])
    """
    from sweep.faults import local_path
    from sweep.results.kind import opened

    return opened(local_path(path, "path"), load=load)


class _Ended:
    """Property of `Accessor`: a mask of the cells whose status has its name."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, accessor: Accessor, owner: type) -> xr.DataArray:
        from sweep.results.dataset import STATUSES

        codes = {name: code for code, name in STATUSES.items()}
        return accessor._dataset["status"] == codes[self._name]


class Accessor:
    """Adds methods of this package to xarray datasets: `dataset.sweep.plot()`, `dataset.sweep.trajectory()`.

    `dataset.sweep.settled` and the like are masks of the cells with each status.
    """

    not_run, settled, time_limit, impossible = _Ended(), _Ended(), _Ended(), _Ended()
    lift_off, diverged, paradox, toppled = _Ended(), _Ended(), _Ended(), _Ended()

    def __init__(self, dataset: xr.Dataset) -> None:
        self._dataset = dataset

    def __repr__(self) -> str:
        from sweep.results.summary import describe

        title = self._dataset.attrs.get("title", "no title")
        return f"<sweep: {title}>\n{describe(self._dataset)}\nMethods: plot(), trajectory()"

    def plot(self, variable: str | None = None, **options: Any) -> Figure:
        """Draw the dataset; arguments, figure and errors as for `sweep.plot`."""
        from sweep.plots.picture import plot  # loads matplotlib

        return plot(self._dataset, variable, **options)

    def trajectory(self, **options: Any) -> xr.Dataset:
        """Follow the cells of the dataset, or of a selection, over time, with the configuration of the dataset.

        Arguments and result as for `sweep.trajectory`.

        Raises
        ------
        InputError
            if the dataset contains no configuration, or if the model is user-defined, because its code runs only if you
            pass the configuration to `sweep.trajectory`; otherwise as for `sweep.trajectory`.
        """
        from sweep.faults import fault_of
        from sweep.results.configuration import configuration

        if "config" not in self._dataset.attrs:
            raise fault_of("the dataset contains no configuration; call sweep.trajectory with one")
        return trajectory(configuration(self._dataset), **options)


_REGISTERING = Lock()


def register() -> None:
    """Register `Accessor` as the attribute `sweep` of every dataset, unless it is there."""
    import xarray as xr  # before the lock: another thread that imports it may be about to come here

    with _REGISTERING:
        if "sweep" not in vars(xr.Dataset):
            xr.register_dataset_accessor("sweep")(Accessor)  # type: ignore[no-untyped-call]


class AfterXarray:
    """A finder of modules that finds xarray as the others do, and calls `register` once it is imported."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "xarray":
            return None
        others = (finder.find_spec(name, path, target) for finder in sys.meta_path if finder is not self)
        spec = next(filter(None, others), None)
        if spec and (loader := spec.loader):
            execute = loader.exec_module

            def exec_module(module: ModuleType) -> None:
                execute(module)
                register()

            loader.exec_module = exec_module  # type: ignore[method-assign]
        return spec
