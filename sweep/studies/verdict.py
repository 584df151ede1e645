"""Judges a fit: whether curve and film differ by noise alone, what is known, and what the film cannot show.

The residuals of a correct curve are independent of each other. Their noise, estimated from third differences that
remove slow variations, is then as large as they are, and neither their autocorrelation (Ljung and Box 1978, doi
10.1093/biomet/65.2.297) nor the lengths of their runs of one sign (Wald and Wolfowitz 1940) are unusual.  In short
films chi square gives that autocorrelation ten times too small a probability, which noise fitted by the same curve
corrects.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import log10, sqrt
from typing import NamedTuple

import numpy as np
from scipy import stats

from sweep.config import Config
from sweep.faults import counted, either
from sweep.grid import BODY, Array
from sweep.studies.intervals import variance
from sweep.studies.misfit import UNKNOWNS, Minimum, Problem
from sweep.units import ANGLE, SPIN, TIME, named, pretty

# The probability that one of the tests rejects a correct curve, and the lags of the autocorrelation.
_CHANCE, _LAGS = 1e-3, 20

_DOUBT = 0.05
"""The probability below which the residuals of a correct curve, or its distances from what was measured, are odd enough
to try changes."""

# Numbers of rows of a short film, and of samples of noise.
_SHORT, _SAMPLES = 2000, 4000

# Outliers are this many times the noise off the curve and off their neighbours; a fit with more than this share is
# rejected.
_OFF, _SHARE = 5.0, 0.03

# Standard errors by which the kurtosis of the residuals may exceed that of a normal distribution.
_TAILS = 6.0

# A parameter is pressed against the end of its range if the misfit would fall by this many variances within this share
# of the range.
_BEYOND, _PRESSED = 0.02, 2.0


# Number of errors by which a parameter may differ from its measured value.
_FAR = 3.5


class Verdict(NamedTuple):
    """The judgement of a fit."""

    reasons: list[str]
    """Reasons why the curve does not fit the film; empty if it does."""
    size: float
    """Root mean square of the residuals, in units of the film's errors."""
    noise: float
    """The part of it that is noise."""
    odd: float
    """The probability that a correct curve is as far off film and measured values, or farther."""

    @property
    def doubtful(self) -> bool:
        return not self.fits or self.odd < _DOUBT

    @property
    def fits(self) -> bool:
        return not self.reasons

    @property
    def because(self) -> str:
        """Return the reason, as text."""
        return "; ".join(self.reasons) or "the difference between film and curve is noise"


def judged(problem: Problem, best: Minimum) -> Verdict:
    """Judge the residuals and the place of the best minimum."""
    kept = problem.kept
    away = best.away[: len(kept)][kept]
    size, noise = float(np.sqrt(np.mean(away**2))), own_noise(away)
    pulls = best.away[len(kept) :] / problem.scale
    odd, reasons = _oddity(problem, best, away) if size > 0 and np.isfinite(size) else 1.0, list[str]()
    if odd < _CHANCE:
        by = f"{size / noise:.2g} times the noise" if size > 1.3 * noise > 0 else "more than noise"
        reasons.append(f"curve and film differ by {by}, and in the same direction for many rows")
    if size > 0 and stats.kurtosis(away) > _TAILS * sqrt(24 / len(away)):
        reasons.append("some rows lie farther from the curve than noise can explain")
    if problem.film.error is not None and stats.chi2.sf(best.misfit, problem.freedom) < _CHANCE:
        reasons.append(f"curve and film differ by {size:.3g} times the errors given in the film")
    if (left_out := int((~kept).sum())) > _SHARE * len(kept):
        reasons.append(f"{left_out} of {len(kept)} rows are outliers")
    if ends := pressed(problem, best):
        reasons.append(f"better values of {_all(ends)} lie outside the range searched")
    if off := np.array([*problem.free])[problem.measured][np.abs(pulls) > _FAR].tolist():
        reasons.append(f"{_all(off)} would have to be more than {_FAR:g} errors from the measured value")
    return Verdict(reasons, size, noise, min(odd, stats.chi2.sf(pulls @ pulls, len(pulls)) if len(pulls) else 1.0))


def _all(names: Iterable[str]) -> str:
    return either(names).replace(" or ", " and ")


def own_noise(values: Array) -> float:
    """Return the standard deviation of what varies from row to row, by third differences."""
    return float(np.sqrt(np.mean(np.diff(values, 3) ** 2) / 20)) if len(values) > 3 else 0.0


def _oddity(problem: Problem, best: Minimum, away: Array) -> float:
    """Return the probability that noise is as correlated as the residuals, or has as long runs of one sign."""
    n, lags = len(away), min(_LAGS, len(away) // 5)
    found = _correlation(away[None], lags)[0]
    correlated = float(stats.chi2.sf(found, lags))
    if correlated < _DOUBT and n < _SHORT:
        kept = np.concatenate([problem.kept, np.ones(len(problem.measured), bool)])
        columns = best.jacobian[kept]
        if problem.film.what == "heading":  # a film does not show where a heading is counted from
            columns = np.column_stack([columns, np.arange(len(columns)) < n])
        basis = np.linalg.qr(columns)[0]
        samples = np.random.default_rng(0).normal(size=(_SAMPLES, len(columns)))
        correlated = float(np.mean(_correlation((samples - samples @ basis @ basis.T)[:, :n], lags) >= found))
    above = away > 0
    ups, downs, runs = above.sum(), (~above).sum(), 1 + np.count_nonzero(above[1:] != above[:-1])
    expected = 1 + 2 * ups * downs / n
    in_runs = stats.norm.cdf((runs - expected) / max(sqrt(max((expected - 1) * (expected - 2), 0) / (n - 1)), 1e-9))
    return min(correlated, float(in_runs))


def _correlation(away: Array, lags: int) -> Array:
    """Return Ljung and Box's measure of the autocorrelation of residuals of shape (samples, rows)."""
    n, squares = away.shape[1], np.einsum("ij,ij->i", away, away)
    shares = [np.einsum("ij,ij->i", away[:, :-lag], away[:, lag:]) / squares for lag in range(1, lags + 1)]
    return np.asarray(n * (n + 2) * sum(share**2 / (n - lag) for lag, share in enumerate(shares, start=1)))


def outliers(problem: Problem, best: Minimum) -> Array:
    """Return the instants that count, shape (instants,): not those as far off their neighbours as off the curve."""
    away = of_film(problem, best)
    scale = min(
        stats.median_abs_deviation(away, scale="normal"),
        stats.median_abs_deviation(np.diff(away, 3), scale="normal") / 20**0.5,
    )
    around = np.lib.stride_tricks.sliding_window_view(np.pad(away, 3, mode="reflect"), 7)
    alone = away - np.median(around, axis=1)
    return np.asarray(~((np.abs(away) > _OFF * scale) & (np.abs(alone) > _OFF * scale)))


def of_film(problem: Problem, best: Minimum) -> Array:
    """Return the residuals of all instants, including outliers."""
    curve = problem.curves(best.place[None], problem.film.time)[0]
    away = (curve - problem.film.value) / problem.film.errors
    if problem.film.what == "heading":
        away -= np.average(away[problem.kept])
    return np.asarray(away)


def gross(values: Array) -> Array:
    """Return the instants that count before a fit, shape (instants,): those not far from nearly all others."""
    low, middle, high = np.percentile(values, [2, 50, 98])
    return np.asarray((np.abs(values - middle) <= 3 * max(high - middle, middle - low)) | (high == low))


def pressed(problem: Problem, best: Minimum, share: float = _BEYOND, fall: float = _PRESSED) -> dict[str, int]:
    """Return the parameters at an end of their range, -1 or 1, beyond which the misfit would fall.

    To first order it falls by `fall`, in units of the variance, within a `share` of the range. It does not fall if the
    film says nothing about the parameter.
    """
    slopes = 2 * best.jacobian.T @ best.away / variance(problem, best)
    ends = {n: r.ends(place, 1e-3) for (n, r), place in zip(problem.free.items(), best.place, strict=True)}
    return {n: end for (n, end), slope in zip(ends.items(), slopes, strict=True) if -end * slope * share > fall}


def sentences(
    problem: Problem, verdict: Verdict, values: Array, limits: Array, edge: Array, words: list[str], advice: str
) -> str:
    """Return three sentences: how well the curve fits, what is known how accurately, and which film would show more.

    `limits` holds the ends of the 95 % intervals, shape (2, free); `edge` marks ends that are limits of the search;
    `advice` is the second sentence of a fit that cannot be trusted.
    """
    config, names = problem.config, list(problem.free)
    unit = pretty(named(ANGLE if problem.film.what == "heading" else SPIN, config.units))
    return "\n".join([
        _how(problem, verdict, unit),
        _known(config, names, values, limits, edge) if verdict.fits else advice,
        _unknown([name for name, each in zip(names, edge, strict=True) if each], words) if verdict.fits
        else "The values and intervals below describe a curve that does not match the film.",
    ])  # fmt: skip


def _how(problem: Problem, verdict: Verdict, unit: str) -> str:
    rows = counted(int((~problem.kept).sum()), "outlier was", "outliers were")
    left = "" if problem.kept.all() else f"; {rows} left out"
    if not verdict.fits:
        return f"The fit cannot be trusted: {'; '.join(verdict.reasons)}{left}."
    if problem.film.error is not None:
        size = f"{verdict.size:.2g} times the film's errors"
    else:
        size = f"{verdict.size:.2g} {unit}"
    return f"The curve fits the film: they differ by {size} (root mean square), which is noise{left}."


def _known(config: Config, names: Sequence[str], values: Array, limits: Array, edge: Array) -> str:
    """Describe what is known, each value with its 95 % interval."""
    phrases = []
    for name, value, (low, high), at in zip(names, values, limits.T, edge, strict=True):
        if not at:
            words = config.described(name)["long_name"] if name in config.table else name
            phrases.append(f"{words} is {_digits(value, high - low)}{unit_after(config, name)} "
                        f"({_digits(low, high - low)} to {_digits(high, high - low)})")  # fmt: skip
    if not phrases:
        return "The film determines none of the free parameters."
    return f"At 95 % confidence, {', '.join(phrases)}."


def _digits(value: float, width: float) -> str:
    """Format a number with two digits of the width of its interval."""
    digits = 2 + max(0, round(log10(abs(value) / width))) if value and width > 0 else 3
    return f"{value:.{min(digits, 8)}g}"


def unit_after(config: Config, name: str) -> str:
    """Return the unit of a parameter, as figures print it, after a space."""
    of_film = {"film_delay": named(TIME, config.units), "film_bias": named(SPIN, config.units)}
    found = config.described(name).get("units", "") if name in config.table else of_film[name]
    return f" {pretty(found)}" if found not in ("", "1") else ""


def _unknown(names: Sequence[str], words: Sequence[str]) -> str:
    """Describe what the film does not determine, and which film would."""
    if not names:
        tied = [each.partition(":")[0] for each in words if "only in combination" in each]
        if tied:
            return f"But {tied[0]}; measure one of them independently."
        return "A film with a different start would test the law of friction."
    which = dict.fromkeys(next((film for some, film in _FILMS.items() if name in some), _SLIPPING) for name in names)
    return f"The film does not determine {_all(names)}; for that, {'; and '.join(which)}."


_SLIPPING = "film the body as it slips and reverses: with a faster spin, or more tilt at the start"
_AT_START = ("n0", "x0", "y0", "roll", "pitch", "omega1", "omega2", "omega3")
_FILMS: Mapping[tuple[str, ...], str] = {
    ("sigma", "mu_viscous", "mu_rolling", "mu_spinning"): "continue filming until the body rests",
    _AT_START: "begin the film when the hand lets go, with more rows per second",
    UNKNOWNS: "also film one second of rest",
    BODY: "weigh and measure the body",
}
