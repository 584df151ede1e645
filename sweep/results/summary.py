"""Describes a dataset in words: how its cells ended, how accurate they are, and what they cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import product
from textwrap import fill

import numpy as np
import xarray as xr

from sweep.faults import counted, duration
from sweep.kernels.method import STEP_RULES
from sweep.kernels.status import FAILURES, IMPOSSIBLE, SETTLED, TIME_LIMIT, Doubt
from sweep.results.dataset import DOUBTS, REASONS, STATUSES, TRAJECTORIES, along_one, never_settles, uncertain
from sweep.results.kind import BOUNDARIES, CRITICAL, FIT, SPINS, TRAJECTORY, Kind, kind, parameters
from sweep.results.margins import FOUND, UNCERTAIN, WIDE
from sweep.results.probabilities import PROBABILITIES


def failed_fraction(dataset: xr.Dataset) -> float:
    """Return the fraction of cells whose simulation failed."""
    return float(dataset["status"].isin(FAILURES).mean())


def describe(dataset: xr.Dataset) -> str:
    """Summarise the results of a dataset of any kind in a few lines."""
    return "\n".join(_LINES.get(kind(dataset), _run)(dataset))


def overview(dataset: xr.Dataset) -> str:
    """Report the accuracy of a dataset, its variables by their axes, and its origin, all on one screen."""
    over: dict[str, list[str]] = {}
    for name, variable in dataset.data_vars.items():
        over.setdefault(", ".join(map(str, variable.dims)) or "no axis", []).append(str(name))
    lists = [f"over {axes}: {', '.join(names)}" for axes, names in over.items()]
    origin = ", ".join(str(dataset.attrs[key]) for key in ("created", "versions") if key in dataset.attrs)
    lines = [*accuracy(dataset), *lists, f"made {origin}" if origin else ""]
    return "\n".join(fill(line, 100, subsequent_indent="  ") for line in lines if line)


def contents(dataset: xr.Dataset) -> str:
    """List the variables, attributes and configuration of a dataset, one per line."""
    variables = [
        f"  {name} ({', '.join(map(str, variable.dims))}): {variable.attrs.get('long_name', '')}"
        + (f", in {units}" if (units := variable.attrs.get("units")) else "")
        for name, variable in dataset.data_vars.items()
    ]
    attributes = [f"{key}: {dataset.attrs[key]}" for key in sorted(set(dataset.attrs) - {"title", "config"})]
    return "\n".join([*variables, *attributes, f"config:\n{dataset.attrs.get('config', '')}"])


def _boundaries(dataset: xr.Dataset) -> Iterator[str]:
    """Summarise how many boundary points were found, and how accurately."""
    points = dataset.sizes["point"]
    curves, simulated = len(np.unique(dataset["curve"])), dataset.attrs["trajectories"]
    words = f"{counted(curves, 'curve')} with " if "y" in dataset.attrs else ""
    yield f"{words}{counted(points, 'point')}, by {counted(simulated, 'simulation')}"
    ends, outcome = np.stack([dataset["end_fewer"].values, dataset["end_more"].values]), dataset["outcome"].values
    width = np.ptp(ends, axis=0) / np.abs(ends).max(axis=0)
    found, wide = width[outcome == FOUND], width[outcome == WIDE]
    if found.size:
        yield f"found {found.size}, within a relative error of {found.max():.1e} along the bracket"
    if wide.size:
        yield (f"wide {wide.size}: brackets up to {wide.max():.1e} wide, because a cell in them failed, did not end or "
               "has no certain count")  # fmt: skip
    if off := int(dataset.attrs.get("middles_off", 0)):
        yield f"lost {off}: the boundary was not found halfway between two points, so the curve is split there"
    if early := int(dataset.attrs.get("cells_not_final", 0)):
        remedy = "; a longer t_end makes them final" if points else ""  # a model that never settles has no points
        yield f"not final {early}: counts of grid cells are lower bounds{remedy}"
    if pairs := int(dataset.attrs.get("pairs_not_searched", 0)):
        yield f"not searched {pairs}: pairs of neighbours whose counts differ, where a count is not final or missing"
    if uncertain := int((dataset["outcome"] == UNCERTAIN).sum()):
        yield f"uncertain {uncertain}: the count at one end is not certain; its error may reach the other count"


def _fit(dataset: xr.Dataset) -> Iterator[str]:
    """Report a fit: verdict, values and intervals, what the film does not determine, and how well the curve fits."""
    yield from verdict(dataset)
    if "law" in dataset.dims:
        yield from _laws(dataset)
        return
    yield f"{'':12} {'value':>12}   {'68 %':^25}   {'95 %':^25}"
    for name in dataset["parameter"].values:
        one = dataset.sel(parameter=name)
        ends = (f"{one[f'lower_{n}'].item():11.5g} … {one[f'upper_{n}'].item():<11.5g}" for n in (68, 95))
        yield f"{name:12} {one['value'].item():12.6g}   {bound(one) or '   '.join(ends)}".rstrip()
    yield from filter(None, dataset.attrs["undetermined"].split("; "))
    if others := int((dataset["misfit"][1:] < 1.05 * dataset["misfit"][0]).sum()):
        yield f"{counted(others, 'other minimum fits', 'other minima fit')} within 5 % as well: see minimum"
    yield (
        f"residuals {dataset.attrs['root_mean_square']:.4g}, root mean square; Akaike's criterion "
        f"{dataset.attrs['akaike']:.6g}; {counted(dataset.attrs['trajectories'], 'trajectory', 'trajectories')}"
    )


def verdict(dataset: xr.Dataset) -> list[str]:
    """Return the sentences on a fit, one per line."""
    return str(dataset.attrs.get("verdict", "")).splitlines()


def bound(one: xr.Dataset) -> str:
    """Describe the bound of a parameter whose 95 % interval reaches an end of the search; return "" for any other."""
    ends = f"below {one['upper_95'].item():.5g}", f"above {one['lower_95'].item():.5g}"
    return ("", *(f"{end} at 95 %; no interval" for end in ends), "not determined by the film")[int(one.get("edge", 0))]


def _laws(dataset: xr.Dataset) -> Iterator[str]:
    """Report how well each law fits, best first, its parameters, and what the film says about the laws."""
    yield f"{'':14} {'chi square':>12} {'free':>5} {'Akaike':>12} {'weight':>9}   value and interval of 68 %"
    for law in dataset["law"].values[np.argsort(dataset["akaike"].values)]:
        one = dataset.sel(law=law).dropna("parameter", subset=["value"])
        head = f"{one['chi_square'].item():12.6g} {one['number_free'].item():5} {one['akaike'].item():12.6g}"
        ends = zip(*(one[name].values for name in ("parameter", "value", "lower_68", "upper_68")), strict=True)
        values = [f"{name} = {value:.4g} ({low:.4g} … {high:.4g})" for name, value, low, high in ends]
        yield f"{law:14} {head} {one['weight'].item():9.2g}   {values[0] if values else ''}"
        yield from (f"{'':57}{value}" for value in values[1:])
    yield from filter(None, dataset.attrs["undetermined"].split("; "))


def _trajectories(dataset: xr.Dataset) -> Iterator[str]:
    """Report how each trajectory ended, and its reversals, one per line."""
    most = 20
    dataset = along_one(dataset)
    number = dataset.sizes[TRAJECTORIES]
    yield f"{counted(number, 'trajectory', 'trajectories')}, sampled in time"
    for i in range(min(number, most)):
        one = dataset.isel({TRAJECTORIES: i})
        where = ", ".join(f"{name} = {float(one[name]):g}" for name in parameters(one))
        count = f", {counted(int(one['reversals']), 'reversal')}" if "reversals" in one else ""
        samples = int(np.isfinite(one["spin"]).sum())
        end = f"{STATUSES[int(one['status'])]} at t = {float(one['t_stop']):.6g}"
        yield f"  {where}: {end}{count}, {counted(samples, 'sample')}"
    if number > most:
        yield f"  and {number - most} more"


def _critical(dataset: xr.Dataset) -> Iterator[str]:
    """Report how many critical spins were found, and why others are missing."""
    yield f"critical spins of {_count(dataset['n_c_reason'].isel(sign=0), 'body', 'bodies')}"
    if "impossible" in dataset.attrs:
        yield f"impossible: {dataset.attrs['impossible']}"
    for (name, source), sign in product(SPINS.items(), dataset["sign"].values):
        one = dataset.sel(sign=sign)
        found = one[source].values[np.isfinite(one[source])]
        codes = one["n_c_reason"].values[np.isnan(one[source])]
        counts = {words.replace("_", " "): int((codes == code).sum()) for code, words in REASONS.items()}
        ends = ", ".join(f"{count} {words}" for words, count in (counts | {"found": len(found)}).items() if count)
        span = f"; {found.min():.4g} to {found.max():.4g}" if len(found) else ""
        yield f"  {name}, {'positive' if sign > 0 else 'negative'} spin: {ends}{span}"


def _count(variable: xr.DataArray, *noun: str) -> str:
    """Describe the number of values, and the axes."""
    axes = " × ".join(f"{d} {n}" for d, n in variable.sizes.items())
    return f"{counted(variable.size, *noun)}{f' ({axes})' if axes else ''}"


def _run(dataset: xr.Dataset) -> Iterator[str]:
    """Report how cells ended, their counts, their accuracy, and their cost."""
    if "status" not in dataset or dataset["status"].dtype.kind not in "iu":
        averaged = "status" in dataset
        yield "no status of individual cells: averaged" if averaged else "no status: predictions, or a part of a run"
        return
    status = np.ravel(dataset["status"].values)
    ends = ", ".join(f"{(status == code).sum()} {name}" for code, name in STATUSES.items() if code in status)
    valid = np.isin(status, (SETTLED, TIME_LIMIT))
    counts = f"; {_reversals(dataset, valid)}" if "reversals" in dataset and valid.any() else ""
    yield f"{_count(dataset['status'], 'cell')}: {ends or 'status unknown'}{counts}"
    if "impossible" in dataset.attrs:
        yield f"impossible: {dataset.attrs['impossible']}"
    if "probability" in dataset and dataset["probability"].dims == ("count",):
        yield f"probability: {', '.join(_probabilities(dataset))}"
    if "doubts" in dataset and dataset["doubts"].dtype.kind in "iu" and valid.any():
        yield from _doubts(dataset, int(valid.sum()))


def _doubts(dataset: xr.Dataset, counts: int) -> Iterator[str]:
    """Say how many of the counts are certain, where the others lie and what to do, and which errors are large.

    A count is listed with the first doubt that applies.
    """
    left, doubts = uncertain(dataset), dataset["doubts"]
    if "certain" in dataset:
        others = "; the others:" if left.any() else ""
        yield f"{counts - int(left.sum())} of {counted(counts, 'count is', 'counts are')} certain{others}"
    elif left.any():
        yield f"{int(left.sum())} of {counted(counts, 'count is', 'counts are')} uncertain:"
    for bit, (_, words, remedy) in DOUBTS.items():
        these = left & (doubts & int(bit) > 0)
        left &= ~these
        if these.any():
            helps = bit != Doubt.TIME_LIMIT or not never_settles(dataset)
            yield f"  {int(these.sum())}{_place(these)}: {words}{f'; {remedy}' if helps else ''}"
    if missed := int((doubts & int(Doubt.TOLERANCE) > 0).sum()):
        error = f", with errors up to {dataset['spin_error'].max().item():.1e}" if "spin_error" in dataset else ""
        miss = "misses" if missed == 1 else "miss"
        yield f"final spins: {missed} of {counted(counts, 'cell')} {miss} the tolerance{error}"
    if noisy := int((doubts & int(Doubt.ROUND_OFF) > 0).sum()):
        where = counted(noisy, "cell")
        yield f"late reversals: round-off decides their times in {where}, where spin errors are unknown"


def _place(where: xr.DataArray) -> str:
    """Describe where on the axes the cells of a mask lie; "" if they are spread over all of them."""
    ranges = []
    for name in (str(dim) for dim in where.dims if where.sizes[dim] > 1 and dim in where.coords):
        values = np.sort(where[name].values[where.any([dim for dim in where.dims if dim != name])])
        if len(values) < where.sizes[name] and values.dtype.kind in "iuf":
            low, high = values[0], values[-1]
            ranges.append(f"{name} = {low:g}" if low == high else f"{name} = {low:g} to {high:g}")
    return f", at {', '.join(ranges)}" if ranges else ""


def accuracy(dataset: xr.Dataset) -> Iterator[str]:
    """Report errors, steps and cost of a run."""
    for name, words in (("spin", ", as estimated"), ("energy", "")):
        error = dataset[f"{name}_error"].values if f"{name}_error" in dataset else np.empty(0)
        if np.isfinite(error).any():
            yield f"{name} error: median {np.nanmedian(error):.1e}, largest {np.nanmax(error):.1e}{words}"
    names = ("status", "step_rule", "step")
    if {*names} <= {*dataset.data_vars} and (dataset["status"] != IMPOSSIBLE).any():
        status, rule, step = (np.ravel(dataset[name].values) for name in names)
        step, rule = step[status != IMPOSSIBLE], rule[status != IMPOSSIBLE]
        rules = {name: int((rule == code).sum()) for code, name in STEP_RULES.items() if code in rule}
        who = ", ".join(f"{name} in {counted(count, 'cell')}" for name, count in rules.items())
        yield f"step: {step.min():.3g} to {step.max():.3g}, set by {who}"
    if dataset.attrs.get("wall_time"):
        rate = dataset.attrs.get("trajectories_per_second", np.nan)
        yield f"cost: {duration(dataset.attrs['wall_time'])}, {rate:.3g} trajectories/s"


def _probabilities(dataset: xr.Dataset) -> Iterator[str]:
    """Describe the probability of each number of reversals or more."""
    for count in dataset["count"].values:
        one = dataset.sel(count=count)
        share, low, high = (one[name].item() for name in PROBABILITIES)
        yield f"{count} or more {_interval(share, low, high)}"


def _interval(value: float, low: float, high: float) -> str:
    """Format a share with its 95 % interval, where it is known."""
    return f"{value:6.3f} ({low:.3f} to {high:.3f})" if np.isfinite(value) else "unknown"


def _reversals(dataset: xr.Dataset, valid: np.ndarray) -> str:
    counts = np.ravel(dataset["reversals"].values)[valid].astype(int)
    least, most = counts.min(), counts.max()
    text = f"{f'{least} to ' if least < most else ''}{counted(most, 'reversal')}"
    if "reversals_predicted" not in dataset:
        return text
    off = abs(counts - np.ravel(dataset["reversals_predicted"].values)[valid])
    return f"{text}; predicted correctly in {(off == 0).mean():.1%} of the cells, within one in {(off <= 1).mean():.1%}"


_LINES: dict[Kind | None, Callable[[xr.Dataset], Iterator[str]]] = {
    TRAJECTORY: _trajectories,
    CRITICAL: _critical,
    BOUNDARIES: _boundaries,
    FIT: _fit,
}
