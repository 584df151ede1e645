"""Repeats the paper's numerical results (its section on simulations), drawn in its arrangement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from scipy.ndimage import median_filter

from sweep.config import Config, load_config
from sweep.engine.run import run
from sweep.kernels.measures import possible
from sweep.models import MODELS, TIERS
from sweep.models.ladder import analytic
from sweep.plots.quantities import with_derived
from sweep.plots.trajectories import draw_spin
from sweep.report.direct import standard
from sweep.report.rows import Section, against, states
from sweep.reproduce.rows import against_paper
from sweep.studies.trajectory import trajectory


def configure(
    model: str = "slip", t_end: float = 30_000.0, measure: Sequence[str] | None = None, **parameters: Any
) -> Config:
    """Return the paper's standard case at μ = 60, replacing the parameters that the model has; arrays are axes."""
    tier = TIERS[model]
    settings = {
        "name": "reproduce",
        "model": model,
        "friction": {"mu": 60.0},
        "integrator": {"t_end": t_end},
        **({} if measure is None else {"measure": [name for name in measure if name in possible(tier)]}),
        "max_failed_fraction": 1.0,
    }
    return load_config(settings, {name: values for name, values in parameters.items() if name in tier.parameters})


def _figure(width: float, height: float, rows: int = 1, columns: int = 1, **shared: Any) -> tuple[Figure, Any]:
    """Make a figure of this size in inches, and its axes."""
    figure = Figure(figsize=(width, height), dpi=100, layout="constrained")
    return figure, figure.subplots(rows, columns, **shared)


def slip_ratio() -> Section:
    """Check figs. v01vp1m100 … v02vp2m200: the acceleration of the slip is small compared with that of v_0."""
    both = trajectory(configure(t_end=400.0), at={"mu": [100, 200]})
    section = Section("Is dv_p/dt small compared with dv_0/dt?")
    for i, mu in enumerate((100, 200)):
        figure, pair = _figure(8, 3, columns=2)
        for axes, component in zip(pair, (1, 2), strict=True):
            # Starting without slip makes it jump once; the figures show the amplitudes after the jump.
            late = both.isel(mu=i, time=both["time"].values > 1.0)
            v0, vp = late[f"v0_rate_{component}"], late[f"slip_rate_{component}"]
            ratio = float(np.sqrt((vp**2).mean() / (v0**2).mean()))
            what = f"amplitude (rms) of v̇_p{component} over v̇_0{component}, μ = {mu}"
            section.rows.append(against_paper(f"slip_ratio_{mu}", what, ratio))
            axes.plot(late["time"], v0, linewidth=0.5, label=f"v̇_0{component}")
            axes.plot(late["time"], vp, linewidth=0.5, label=f"v̇_p{component}")
            axes.legend(fontsize=7)
            axes.set_xlabel("t")
        section.figures.append((f"v01vp1m{mu}, v02vp2m{mu}: μ = {mu}", figure))
    return section


def critical_spins() -> Section:
    """Check fig. nc21pm: below n_c1 the rattle decays, above n_c2 the spin reverses."""
    section = Section("Spins below, between and above the critical ones, μ = 75")
    figure, pair = _figure(8, 6.5, rows=2)
    for axes, starts in zip(pair, ((0.0015, 0.003, 0.005), (-0.006, -0.015, -0.025)), strict=True):
        three = trajectory(configure(t_end=8000.0), at={"mu": 75, "n0": starts}, every=2.0)
        draw_spin(axes, three)
        for i, (n0, grows, reverses) in enumerate(zip(starts, (False, True, True), (False, False, True), strict=True)):
            one = three.isel(n0=i)
            rattle = one["energy"] - 0.5 * 21.8 * one["spin"] ** 2
            early, peak = float(rattle[:40].mean()), float(rattle[40:].max())
            found = (peak > 3 * early, int(one["reversals"]) > 0)
            words = _behaviour(grows, reverses), _behaviour(*found)
            section.rows.append(states(f"n0 = {n0:g}", "nc21pm", *words, found == (grows, reverses)))
    section.figures.append(("nc21pm: (a) positive, (b) negative start spin", figure))
    return section


def _behaviour(grows: bool, reverses: bool) -> str:
    return f"rattle {'grows' if grows else 'does not grow'}, spin {'reverses' if reverses else 'does not reverse'}"


def friction() -> Section:
    """Check fig. mu601000: counts at three frictions, and the approach to rolling."""
    section = Section("From three reversals to rolling")
    figure, (top, bottom) = _figure(8, 6.5, rows=2)
    three = trajectory(configure(), at={"mu": [60, 130, 200]}, every=3.0)
    draw_spin(top, three.sel(time=slice(0, 6000)), critical=False)
    for i, mu in enumerate((60, 130, 200)):
        section.rows.append(against_paper(f"reversals_{mu}", f"reversals at μ = {mu}", int(three["reversals"][i])))
    rough = trajectory(configure(t_end=1500.0), at={"mu": [500, 1000, 1500]}, every=0.25)
    rolling = trajectory(configure("noslip", t_end=1500.0), every=0.25)
    draw_spin(bottom, rough, critical=False)
    bottom.plot(rolling["time"], rolling["spin"], "k--", linewidth=0.8, label="no slip")
    bottom.legend(fontsize=7)
    distance = [_distance(rough.isel(mu=i), rolling, 400.0) for i in range(3)]
    closer = distance[0] > distance[1] > distance[2]
    found = ", ".join(f"{d:.2g}" for d in distance)
    what = "largest difference from no-slip, t < 400, μ = 500, 1000, 1500"
    section.rows.append(states(what, "mu601000 (b)", "falls with μ", found, closer))
    tail = three["spin"][0].sel(time=slice(5700, 6000)).values
    found = f"relative variation of {np.ptp(tail) / abs(tail[-1]):.1g} over 5700 < t < 6000"
    constant = bool(np.ptp(tail) < 1e-3 * abs(tail[-1]))
    section.rows.append(states("spin after the last reversal, μ = 60", "sec. sim C", "stays constant", found, constant))
    section.figures.append(("mu601000: (a) μ = 60, 130, 200, (b) μ = 500, 1000, 1500 and no slip", figure))
    return section


def _distance(one: xr.Dataset, other: xr.Dataset, until: float) -> float:
    times = np.arange(0, until, 0.25)
    ours, theirs = (each["spin"].dropna("time").interp(time=times) for each in (one, other))
    return float(np.abs(ours - theirs).max())


def count_against_friction() -> Section:
    """Check fig. nrvsmu: predicted and simulated reversals against μ."""
    maps = run(configure(mu=np.arange(20, 201, 2.0)))
    ours, theirs = (maps[name].values.astype(int) for name in ("reversals", "reversals_predicted"))
    mu = maps["mu"].values
    apart = np.flatnonzero(np.abs(ours - theirs) > 1)
    limit = float(mu[apart[0] - 1]) if len(apart) else float(mu[-1])
    rough = mu > 70
    larger = float((theirs >= ours)[rough].mean())
    low, high = (float((ours == theirs)[part].mean()) for part in (~rough, rough))
    figure, axes = _figure(7, 3.6)
    axes.plot(mu, theirs, "s", fillstyle="none", label="n_r:ap, predicted")
    axes.plot(mu, ours, "x", label="n_r:ex, simulated")
    axes.set(xlabel="μ", ylabel="n_r")
    axes.legend()
    section = Section("Reversals against friction", figures=[("nrvsmu", figure)])
    remark = f"equal in {low:.0%} of the cells up to μ = 70, in {high:.0%} beyond"
    share = f"in {larger:.0%} of the cells"
    section.rows = [
        against_paper("agree_up_to", "counts agree within one up to μ =", limit, remark),
        states("beyond μ = 70, n_ap >= n_ex", "nrvsmu", "n_ap is larger", share, larger > 0.95),
    ]
    return section


def count_against_shape() -> Section:
    """Check figs. vsb and lf: reversals against b, next to the form factor."""
    b = np.linspace(1.2, 9.8, 87)
    maps = run(configure(mu=np.array([100.0, 200.0]), b=b))
    figure, (top, bottom) = _figure(7, 6, rows=2, sharex=True)
    section = Section("Reversals against shape", figures=[("vsb and lf: counts and form factor against b", figure)])
    factor = analytic.form_factor(standard(b=b))
    best = analytic.best_b(10.0)
    for i, mu in enumerate((100, 200)):
        count = maps["reversals"].values[i].astype(float)
        top.plot(b, count, "x", label=f"μ = {mu}")
        smooth = median_filter(count, 9, mode="nearest")
        found = float(b[smooth == smooth.max()].mean())
        predicted = maps["reversals_predicted"].values[i]
        peak = float(b[predicted == predicted.max()].mean())
        remark = (
            f"the paper's own n_r is largest at b = {peak:.1f}: besides L(f) it contains |sin θ cos θ|, "
            "and θ depends on b too"
        )
        likeness = float(np.corrcoef(smooth, factor)[0, 1])
        said, what = f"correlation {likeness:.2f}", f"n_r against b resembles L(f), μ = {mu}"
        section.rows += [
            against(f"best b, simulated, μ = {mu}", "vsb", best, found, 1.8, "«similar to the form factor»", remark),
            states(what, "vsb", "similar", said, likeness > 0.7),
        ]
    top.set_ylabel("n_r:ex")
    top.legend()
    bottom.plot(b, factor)
    bottom.axvline(best, linestyle="--", color="0.5")
    bottom.set(xlabel="b", ylabel="L(f)")
    return section


def ladder() -> Section:
    """Measure how good each reduced model is: counts, reversal times and cost compared with the full model."""
    mu, b = np.linspace(20, 200, 19), np.linspace(1.5, 9.0, 16)
    measure = ("reversals", "reversal_times")
    maps = {}
    for name in (*MODELS, "slow", "analytic"):
        run(configure(name, t_end=10.0, measure=measure, mu=mu[:1], b=b[:1]))  # compiles
        maps[name] = with_derived(run(configure(name, t_end=15_000.0, measure=measure, mu=mu, b=b)))
    full = maps["slip"]
    errors = (f"error of the {which} reversal (median)" for which in ("first", "last"))
    lines = [["model", "equal counts", "within one", *errors, "trajectories/s"]]
    figure, panels = _figure(12, 3.6, columns=3, sharey=True)
    for name, axes in zip(("effective", "averaged", "analytic"), panels, strict=True):
        off = maps[name]["reversals"].astype(int) - full["reversals"].astype(int)
        mesh = axes.pcolormesh(b, mu, off.transpose("mu", "b"), cmap="RdBu_r", vmin=-6, vmax=6, shading="nearest")
        axes.set(title=name, xlabel="b")
    panels[0].set_ylabel("μ")
    figure.colorbar(mesh, ax=list(panels), label="count minus that of the full model")
    for name, one in maps.items():
        speed = f"{one.attrs['trajectories_per_second']:.3g}" if name in MODELS else "—"
        lines.append([name, *_agreement(one, full), speed])
    caption = (
        "19 × 16 cells, μ = 20 … 200, b = 1.5 … 9, n0 = 0.05, t < 15 000; no-slip: 16 cells, which never stop reversing"
    )
    return Section("How good is each model?", figures=[(caption, figure)], tables=[(caption, lines)])


def _agreement(one: xr.Dataset, full: xr.Dataset) -> list[str]:
    """Return the shares of equal counts and of counts within one, and the errors of times where counts are equal."""
    if "mu" not in one.dims:  # it keeps reversing
        first = abs(one["t_first_reversal"] / full["t_first_reversal"] - 1)
        return ["—", "—", f"{float(first.median()):.1%}", "—"]
    off = abs(one["reversals"].astype(int) - full["reversals"].astype(int))
    times = [
        f"{float(abs(one[name] / full[name] - 1).where(off == 0).median()):.1%}" if name in one else "—"
        for name in ("t_first_reversal", "t_last_reversal")
    ]
    return [f"{float((off == 0).mean()):.1%}", f"{float((off <= 1).mean()):.1%}", *times]
