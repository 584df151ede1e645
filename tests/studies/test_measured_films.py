"""Films of measured bodies: whether a fit finds the friction, and what is wrong with a film, a body or a law.

Bodies and films are made by another program (`support.films`).  A campaign tries one of each; all are tried by

    SWEEP_FILMS=0:20 SWEEP_SPOILT=0:10 python -m pytest -n0 -s -m campaign tests/studies/test_measured_films.py

(with --timeout=0; a film takes a minute of processor time).  Of SWEEP_FILMS_SEED=278952100 and 2617345860, 37 of 40
intervals hold the friction, in the median 2.9 and 2.2 times as wide as with exact sizes, for 2.0 and 1.8 times as many
trajectories.  Eleven of 20 spoilt films have their fault named: a late start, another law or frame rate often cannot be
told from right ones, as start and sizes make up for them within the noise.  So the second test passes for the film that
it tries by default, and not for all.
"""

import os
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from support import films

import sweep
from sweep.config import InputError
from sweep.config.film import Film

SEED = int(os.environ.get("SWEEP_FILMS_SEED", "1"))
KINDS = ("degrees", "mirrored", "law", "late", "rate", "size")


def asked(name: str, usual: str) -> range:
    first, _, last = os.environ.get(name, usual).partition(":")
    return range(int(first), int(last))


def filmed(number: int, kind: int = 0) -> films.Filmed:
    random = np.random.default_rng([SEED, kind, number])
    return next(islice(filter(None, iter(lambda: films.made(random), 0)), 1))


@pytest.mark.campaign
def test_intervals_with_errors_of_the_ruler_hold_the_friction() -> None:
    held, widths, refused = list[bool](), list[float](), list[str]()
    for number in (numbers := asked("SWEEP_FILMS", "0:1")):
        one, ends = filmed(number), list[np.ndarray]()
        for exact in (True, False):
            found = sweep.fit(one.scene(exact=exact), one.film, films.FREE, progress=False)
            mu = found.sel(parameter="mu")
            ends.append(np.array([mu.lower_95.item(), mu.upper_95.item()]))
            refused += [] if found.attrs["fits"] else [found.attrs["fits_because"]]
            said = found.attrs["fits_because"] if not found.attrs["fits"] else "fits"
            print(number, one.solid, len(one.weights), one.friction, exact, ends[-1], found.attrs["trajectories"], said)
        held.append(bool(ends[1][0] < one.friction["mu"] < ends[1][1]))
        widths.append(float(np.ptp(ends[1]) / np.ptp(ends[0])))
        print(number, "holds" if held[-1] else "does not hold", f"{widths[-1]:.3g} times as wide", flush=True)
    assert sum(held) >= 0.9 * len(numbers)
    assert not refused
    assert np.median(widths) <= 5


@pytest.mark.release
def test_a_range_is_widened_once_slopes_at_its_ends_are_exact() -> None:
    """A film of seed 278952100, whose start lies beyond the first range of x0; it was refused for that."""
    random = np.random.default_rng([278952100, 0, 16])
    one = next(islice(filter(None, iter(lambda: films.made(random), 0)), 1))
    found = sweep.fit(one.scene(), one.film, films.FREE, progress=False)
    assert found.attrs["fits"] == 1
    assert found.sel(parameter="x0").range_to.item() > 0.02


def spoilt(one: films.Filmed, kind: str, random: np.random.Generator) -> tuple[dict[str, object], Film, str]:
    """A configuration and a film, one of which is wrong, and what names the change."""
    film, scene = one.film, one.scene()
    if kind == "degrees":
        return scene, replace(film, value=np.unwrap(np.degrees(film.value) % 360)), "deg"
    if kind == "mirrored":
        return scene, replace(film, value=-film.value), "reverse the sign"
    if kind == "law":
        other = "viscous" if one.friction["law"] == "coulomb" else "coulomb"
        return one.scene(law=other), film, f"law: {one.friction['law']}"
    if kind == "late":
        kept = film.time > random.uniform(0.3, 0.7) * 2 * np.pi / abs(one.start["n0"])  # in the middle of a turn
        return scene, replace(film, time=film.time[kept] - film.time[kept][0], value=film.value[kept]), "film_delay"
    if kind == "rate":
        rate = random.choice([0.5, 2.0])
        return scene, replace(film, time=film.time / rate), f"times of the film by {rate:.3g}"
    name = str(random.choice(["length", "width", "height"]))
    wrong = replace(one, measured=one.measured | {name: one.measured[name] * random.choice([5 / 6, 6 / 5])})
    return wrong.scene(), film, f"correct {name}"


@pytest.mark.campaign
def test_the_change_that_a_spoilt_film_needs_is_named() -> None:
    named = list[bool]()
    for number in (numbers := asked("SWEEP_SPOILT", "0:1")):
        scene, film, words = spoilt(filmed(number, 1), KINDS[number % 6], np.random.default_rng([SEED, 2, number]))
        try:
            found = sweep.fit(scene, film, films.FREE, progress=False)
            said = found.attrs["verdict"].splitlines()[1]
        except InputError as error:
            said = str(error)
        named.append(words in said)
        print(number, KINDS[number % 6], "named" if named[-1] else f"not named {words}", said, flush=True)
    assert sum(named) >= 0.8 * len(numbers)
