"""A user's model in a configuration: where it is found, when its code runs, and what is said of a broken one."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import own
from support.cli import invoke, refused
from support.own import FADING, PENDULUM, ROLLING

import sweep
from sweep.config import InputError, load_config
from sweep.models.model import Offer
from sweep.models.theory.stability import stable_ranges
from sweep.models.user import loading

MARK = "import numpy as np\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return own.write(tmp_path)


@pytest.fixture
def ran(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A file that the code of the pendulum writes when it runs."""
    sign = folder / "ran"
    monkeypatch.setenv("SIGN_OF_THE_PENDULUM", str(sign))
    sign_it = "import os\nopen(os.environ['SIGN_OF_THE_PENDULUM'], 'w').close()\n"
    (folder / "pendulum.py").write_text(PENDULUM.replace(MARK, MARK + sign_it, 1), encoding="utf-8")
    loading.load.cache_clear()
    yield sign
    loading.load.cache_clear()


def after(text: str, old: str, new: str, message: str, at: str = "") -> tuple[str, int, str]:
    """A model with an edit, the line that has `at` if the fault has one, and what is said of it."""
    assert text.count(old) >= 1, old
    edited = text.replace(old, new, 1)
    line = next((i for i, each in enumerate(edited.splitlines(), 1) if at and each.startswith(at)), 0)
    return edited, line, message


def line_of(text: str, part: str) -> int:
    return text[: text.index(part)].count("\n") + 1


RHS = "    angle, rate, phase = y\n"
NO_MODEL = "MODEL is of the type NoneType; it has to be Model(…), or with_law(Law(…), …)"
BROKEN = {
    "no model": after(PENDULUM, "MODEL =", "OTHER =", NO_MODEL),
    "syntax": after(PENDULUM, "def start(columns):", "def start(columns:", "not Python: ", "def start"),
    "import": after(PENDULUM, MARK, "import nowhere\n", "ModuleNotFoundError: No module named 'nowhere'", "import now"),
    "exit": after(PENDULUM, MARK, "raise SystemExit(0)\n" + MARK, "it ends the program", "raise"),
    "branch": after(PENDULUM, RHS, RHS + "    if rate > 0: rate = 0.0\n", "a branch on arrays; inline functions are",
                    "    if"),
    "derivatives": after(PENDULUM, "(rate, turning, 2 / 3)", "(rate, turning)",
                         "rhs, of derivatives, gives 2 values; it has to give a tuple of 3", "@inline"),
    "energy": (PENDULUM.replace("return y[1], 0.0, 1.0", "return y[1]"), line_of(PENDULUM, "@inline\ndef energy"),
               "energy gives ndarray; it has to give a tuple of 3"),
    "a constant": after(PENDULUM, 'columns["torque"])', "1.0)", "torque has the shape (); it has to be (2,)",
                        "    @classmethod"),
    "a column": after(PENDULUM, 'cls(columns["damping"]', 'cls(columns["dampng"]', "KeyError: 'dampng'",
                      "        return cls"),
    "an argument too few": after(PENDULUM, "def rhs(y, p)", "def rhs(y)", "rhs() takes 1 positional argument but 2",
                                 "@inline"),
    "an argument too many": (PENDULUM.replace("lambda columns: 2 +", "lambda columns, t: 2 +"),
                             line_of(PENDULUM, "    fastest_motion"), "<lambda>() missing 1 required positional"),
    "an argument of a method": after(PENDULUM, "def of(cls, columns)", "def of(cls)", "Constants.of() takes 1 pos",
                                     "    @classmethod"),
    "name": after(PENDULUM, 'name="pendulum"', 'name="slip"', "invalid model name 'slip': use letters, digits"),
    "spin_state": after(PENDULUM, "spin_state=1", "spin_state=3", "and spin_state the index of one of them"),
    "offers": after(PENDULUM, "Offer.SPIN})", '"modes"})', "cannot offer modes; it may offer COUNT, SPIN, EN"),
    "units": after(PENDULUM, "spin_state=1,", 'spin_state=1, units="CGS",', "units 'CGS' are unknown; choose paper, "),
    "unknown": after(PENDULUM, "spin_state=1,", 'spin_state=1, parameters=("nu",),', "parameter 'nu' is unknown"),
    "no period": after(PENDULUM, "    slower_period=", "    # ", "define slower_period, or do not offer COUNT"),
    "no motion at the end": (
        PENDULUM.replace("2 + columns", "1.5 - columns").replace("0.5 + 0 * columns", "np.inf + columns"),
        line_of(PENDULUM, "    fastest_motion"), "the fastest motion is 0, from which steps follow"),
    "decided": (PENDULUM.replace("MODEL =", "@inline\ndef decided(y, p):\n    return y[1]\n\n\nMODEL =")
                .replace("spin_state=1,", "spin_state=1, decided=decided,"), line_of(PENDULUM, "MODEL ="),
                "decided is neither true nor false; it has to be comparisons, joined by & and |"),
    "a law's argument": after(FADING, "(square, p)", "(square)", "resistance() takes 1 positional argument but 2",
                              "@inline"),
    "law": after(FADING, "resistance,\n", "3,\n", "'int' object is not callable"),
    "law without linear_to": (re.sub("        linear_to=.*\n", "", FADING), line_of(FADING, "@inline"),
                              "the resistance depends on the slip velocity; say by linear_to"),
    "a law's unit": after(FADING, 'SPEED, "slip velocity that halves friction"', '"1", "slip velocity, in sqrt(g c)"',
                          "its unit stands in long_name"),
    "law's section": after(FADING, '"fading", "friction"', '"fading", "body"', "give it the section 'friction'"),
}  # fmt: skip


@pytest.mark.parametrize("kind", BROKEN)
def test_a_broken_file_is_refused_with_its_line(folder: Path, kind: str) -> None:
    text, line, message = BROKEN[kind]
    (folder / "broken.py").write_text(text, encoding="utf-8")
    config = folder / ("fading.yaml" if "law" in kind else "pendulum.yaml")
    result = invoke("run", config, "--set", "model=broken.py", "--dry-run", "--quiet")
    assert result.exit_code == 2, result.output
    said = result.stderr.splitlines()
    assert said[0].startswith(f"running the code of {folder / 'broken.py'} (SHA-256 ")
    place = f"{folder / 'broken.py'}:{line}: " if line else f"{folder / 'broken.py'}: "
    assert said[1].startswith(place), said
    assert message in said[1], said
    assert len(said) == 2


def test_a_theory_that_does_not_hold_is_refused_where_trajectories_would_settle_by_it(folder: Path) -> None:
    """It needs a Jacobian that is quadratic in the spin."""
    for power, fault in ((2, ""), (4, "broken.py:{line}: the rolling model: the Jacobian of the rattle is not quadr")):
        text = ROLLING.replace("rate**2", f"rate**{power}")
        (folder / "broken.py").write_text(text, encoding="utf-8")
        result = invoke("run", folder / "pendulum.yaml", "--set", "model=broken.py", "--set", "torque=0.5", "--dry-run")
        assert fault.format(line=line_of(text, "@inline")) in result.stderr
        assert result.exit_code == (2 if fault else 0), result.stderr


@pytest.mark.parametrize("name", ["missing.py", "sub.py"])
def test_a_file_that_cannot_be_read_is_refused(folder: Path, name: str) -> None:
    (folder / "sub.py").mkdir()
    refused(invoke("run", folder / "pendulum.yaml", "--set", f"model={name}"), "--set model: ", name)


def test_the_code_of_a_model_is_announced_before_it_runs(folder: Path, ran: Path) -> None:
    announced = []

    def announce(words: str) -> None:
        announced.append((words, ran.exists()))

    load_config(folder / "pendulum.yaml", announce=announce)
    ((words, already),) = announced
    assert words.startswith(f"running the code of {folder / 'pendulum.py'}")
    assert ran.exists()
    assert not already


def test_what_only_opens_the_dataset_does_not_run_it(folder: Path, ran: Path) -> None:
    file, signing = folder / "pendulum.nc", (folder / "pendulum.py").read_text(encoding="utf-8")
    (folder / "pendulum.py").write_text(PENDULUM, encoding="utf-8")
    sweep.run(folder / "pendulum.yaml", folder, damping=[0.3, 0.5], torque=1.0, t_end=5)
    (folder / "pendulum.py").write_text(signing, encoding="utf-8")
    loading.load.cache_clear()
    assert invoke("info", file).exit_code == 0
    assert invoke("plot", file, "--output", folder / "map.png").exit_code == 0
    sweep.open_dataset(file)
    sweep.plot(file)
    assert not ran.exists()


def test_parameters_are_known_to_settings_messages_and_tables(folder: Path) -> None:
    file = folder / "pendulum.yaml"
    assert load_config(file, {"torque": 0.7}).parameters["torque"].numbers == (0.7,)
    assert load_config(file, {"angle": "90 deg"}).parameters["angle"].numbers == pytest.approx((np.pi / 2,))
    assert list(load_config(file).axes) == ["damping", "torque"]
    for key, value, message in (
        ("drive.torq", 1.0, r"drive.torq: unknown key \(did you mean torque\?\); the keys here are torque"),
        ("torque", -1.0, "torque: must be a finite number >= 0 and < 10, not -1"),
        ("body.a", 3.0, "body.a: unknown key; the keys here are damping"),
        ("units", "SI", "units: the file of the model gives the units; leave them out"),
        ("integrator.method", "adams", "cannot run the pendulum model; choose dopri5"),
    ):
        with pytest.raises(InputError, match=message):
            load_config(file, {key: value})
    (folder / "cells.csv").write_text("torque,damping\n0.5,0.2\n1.5,0.4\n", encoding="utf-8")
    cells = load_config({"model": str(folder / "pendulum.py"), "cases": str(folder / "cells.csv")})
    assert cells.cases == {"torque": (0.5, 1.5), "damping": (0.2, 0.4)}


def test_a_configuration_keeps_its_model_wherever_it_goes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = load_config(folder / "pendulum.yaml")
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    (folder / "pendulum.py").rename(elsewhere / "moved.py")
    monkeypatch.chdir(elsewhere)
    copy = load_config(replace(first, name="copy"), {"torque": 0.5})  # made of what was read
    assert copy.parameters["torque"].numbers == (0.5,)
    assert copy.origin == first.origin
    body = {"damping": {"start": 0.1, "stop": 0.9, "num": 33}}
    drive = {"torque": {"start": 0.0, "stop": 1.5, "num": 33}}
    rest = {"start": {"angle": 1.0}, "integrator": {"t_end": 200}}
    there = load_config({"model": Path("moved.py"), "body": body, "drive": drive, **rest})
    assert there.fingerprint() == first.fingerprint()
    (folder / "written.yaml").write_text(there.label(), encoding="utf-8")
    (folder / "moved.py").write_bytes((elsewhere / "moved.py").read_bytes())
    assert load_config(folder / "written.yaml").fingerprint() == first.fingerprint()
    (folder / "moved.py").write_text(PENDULUM + "\n", encoding="utf-8")
    assert load_config(folder / "written.yaml").fingerprint() != first.fingerprint()


def test_the_law_of_a_file_takes_the_place_of_law(folder: Path) -> None:
    file = folder / "fading.yaml"
    assert load_config(file).equations.name == "slip+fading+sigma+offset+gravity"
    for key, value, message in (
        ("friction.law", "coulomb", "friction.law: unknown key"),
        ("mu_static", 1.0, "mu_static: does not belong to the law fading; leave it out"),
        ("body.surface", "cone", "body.surface: must be ellipsoid or paraboloid, not 'cone'"),
    ):
        with pytest.raises(InputError, match=message):
            load_config(file, {key: value})


LIKE_OURS = """\
from sweep.jit import inline
from sweep.models.variants import with_law
from sweep.models.general.laws import Law


@inline
def resistance(square, p):
    return p.mu / (square + p.speed * p.speed) ** 0.5


MODEL = with_law(Law(
    "mine", ("mu", "speed"), resistance, lambda columns: columns["mu"] / columns["speed"],
    linear_to=lambda columns: 0.1 * columns["speed"], pure=frozenset({"mu"}),
))
"""


@pytest.mark.parametrize("shape", [{"a": 0.2, "b": 0.03}, {"a": 0.05, "b": 0.45, "surface": "paraboloid"}], ids=str)
def test_a_body_of_either_surface_slips_by_the_law_of_a_file_as_by_the_same_law_of_the_package(
    folder: Path, shape: dict[str, Any]
) -> None:
    """The motion, the step, and what settling depends on."""
    (folder / "mine.py").write_text(LIKE_OURS, encoding="utf-8")
    inertia = {"Ixx": 2.0e-4, "Iyy": 1.6e-3, "Izz": 1.7e-3, "Ixy": -2.0e-5}
    scene = {"units": "SI", "body": {"c": 0.02, "offset": 0.01, "mass": 1.0, **inertia, **shape}}
    scene |= {"start": {"roll": 0.1, "pitch": 0.2, "omega1": 1.0, "omega3": [-5.0, 0.3], "slip1": 0.1}}
    force = {"mu": 0.5, "speed": 0.01, "sigma": 1e-4}
    ours = load_config({**scene, "friction": {"law": "coulomb", **force}})
    mine = load_config({**scene, "model": str(folder / "mine.py"), "friction": force})
    assert mine.surface == shape.get("surface", "ellipsoid")
    assert load_config(mine, {"mu": 0.6}).surface == load_config(dict(mine.document())).surface == mine.surface
    assert loading.compiled_as(mine.origin, mine.equations.name).constants._fields == ours.equations.constants._fields
    columns, got = ours.grid.columns(), []
    for model in (ours.equations, mine.equations):
        constants = model.constants.of(columns)
        slopes, rest = model.rhs(model.start(columns), constants)
        got.append([*slopes, *rest, *constants, model.fastest_decay(columns), *stable_ranges(model, columns)])
    np.testing.assert_allclose(got[1], got[0], rtol=1e-13)
    assert {Offer.LINEAR, Offer.ENERGY} <= mine.equations.offers == ours.equations.offers
    assert mine.equations.faint == ours.equations.faint


RESERVED = {
    "seed": "pendulum.py: parameter drive.seed: 'seed' already has another",
    "bracket": "pendulum.py: parameter 'bracket' has the name of an argument",
    "t_stop": "parameter t_stop: is reserved for a variable of the dataset; rename it",
    "contact_x": "parameter contact_x: is reserved for a variable of the dataset; rename it",
}


@pytest.mark.parametrize("name", RESERVED)
def test_no_parameter_takes_a_name_that_means_something_else(folder: Path, name: str) -> None:
    (folder / "pendulum.py").write_text(PENDULUM.replace('"torque"', f'"{name}"'), encoding="utf-8")
    with pytest.raises(InputError, match=RESERVED[name]):
        sweep.trajectory({"model": str(folder / "pendulum.py")})
    if name == "t_stop":
        with pytest.raises(InputError, match=RESERVED[name]):
            sweep.run({"model": str(folder / "pendulum.py")})
