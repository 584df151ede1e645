"""Each change of the table in `docs/explanation/layout.md` is made, in a copy of the package, in the files it names."""

import re
import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from support import ROOT
from support.own import PENDULUM
from support.processes import python


@dataclass(frozen=True)
class Change:
    new: dict[str, str]
    """Files by their path, and what they say."""
    edits: dict[str, list[tuple[str, str]]]
    """Files by their path: what they say once, and what they are to say in its place."""
    works: str
    """A program that fails unless the change works."""


SCENE = '{"model": "averaged", "friction": {"mu": 60}, "integrator": {"t_end": 300}}'
BODY = {"units": "SI", "body": {"a": 0.2, "b": 0.03, "c": 0.02, "offset": 0.01, "mass": 1.0, "Ixx": 2e-4, "Iyy": 1.6e-3,
        "Izz": 1.7e-3, "Ixy": -2e-5}, "friction": {"mu": 0.5}, "start": {"roll": 0.01, "pitch": 0.01, "omega3": -5.0},
        "integrator": {"t_end": 1.0}, "measure": ["energy_error"]}  # fmt: skip

TWIN = '''"""The time of the first reversal by another name."""

from sweep.kernels.measures.first_reversal import FirstReversal
from sweep.kernels.measures.measurement import measured
from sweep.units import TIME


class Twin(FirstReversal):
    name = "twin"
    variables = {"t_twin": measured("float64", TIME, "time of the first reversal once more")}

    def read(self, table, times):
        return {"t_twin": table["first_reversal"]}
'''

RK4 = """RK4 = Tableau(
    name="rk4", code=9, summary="the classical formula", order=4,
    a=((F(1, 2),), (F(0), F(1, 2)), (F(0), F(0), F(1))),
    b=(F(1, 6), F(1, 3), F(1, 3), F(1, 6)), c=(F(0), F(1, 2), F(1, 2), F(1)),
    real_stability=2.7853, phase=0.3, layer_error=0.1,
)
TABLEAUS = (DOPRI5, RK4)"""

LAW = """        Law("square", ("mu", "speed", "fading"), _square, lambda columns: columns["mu"] / columns["speed"],
            linear_to=lambda columns: np.asarray(_LINEAR * columns["speed"]), pure=frozenset({"mu"})),
        Law("none","""

SQUARE = """@inline
def _square(square: Any, p: Any) -> Any:
    return p.mu / (np.sqrt(square + p.speed * p.speed) * (1.0 + square / (p.fading * p.fading)))


LAWS: dict"""

STORE = '''"""A store in memory that counts what it saves."""

from sweep.results.store import Store


class Counting(Store):
    """Counts the tiles."""

    saved = 0

    def save(self, *arguments):
        Counting.saved += 1
        return super().save(*arguments)
'''

CHANGES = {
    "a measurement": Change(
        {"sweep/kernels/measures/twin.py": TWIN},
        {
            "sweep/kernels/measures/__init__.py": [
                ("import Tier\n", "import Tier\nfrom sweep.kernels.measures.twin import Twin\n"),
                ("    Reversals, EnergyError,", "    Reversals, Twin, EnergyError,"),
            ]
        },
        f"""
one, other = (sweep.run({SCENE}, measure=["reversals", name]) for name in ("first_reversal", "twin"))
assert one["t_first_reversal"].item() == other["t_twin"].item() > 0
assert other["t_twin"].attrs["long_name"].count("once more")
""",
    ),
    "an integration method": Change(
        {},
        {"sweep/kernels/tableau.py": [("TABLEAUS = (DOPRI5,)", RK4)]},
        f"""
import numpy as np
from sweep.bench.section import colour, marker
from sweep.results.dataset import VARIABLES

def run(**settings):
    found = sweep.run({SCENE}, mu=20.0, n0=0.1, t_end=400, measure=[], stop_when_settled=False, **settings)
    return float(found.spin_final), float(found.step)

exact, _ = run(method="dopri5", step=0.02)
errors = [abs(run(method="rk4", step=step)[0] - exact) for step in (0.8, 0.4, 0.2)]
assert np.allclose(np.diff(np.log2(errors)), -4, atol=0.1), errors
(loose, long), (tight, short) = (run(method="rk4", tolerance=tolerance) for tolerance in (1e-6, 1e-10))
assert abs(loose - exact) < 1e-6
assert abs(tight - exact) < 1e-10
assert abs(long / short - 10) < 0.2  # the fourth root of the ratio of the tolerances
assert VARIABLES["method"].flags[9] == "rk4"
assert colour("rk4") and marker("rk4")
""",
    ),
    "a model": Change(
        {
            "sweep/models/ladder/twin.py": "from dataclasses import replace\n\n"
            "from sweep.models.ladder import averaged\n\n"
            'MODEL = replace(averaged.MODEL, name="twin", summary="the averaged model by another name")\n'
        },
        {
            "sweep/models/__init__.py": [
                ("from sweep.models.ladder import analytic,", "from sweep.models.ladder import twin, analytic,"),
                ("for module in (slip,", "for module in (twin, slip,"),
            ]
        },
        f"""
one, other = (sweep.run({SCENE}, model=model) for model in ("averaged", "twin"))
assert one["spin_final"].item() == other["spin_final"].item()
assert other.attrs["title"].count("twin")
""",
    ),
    "a model of one's own": Change(
        {},
        {},
        """
found = sweep.run({"model": "pendulum.py", "integrator": {"t_end": 60}}, torque=1.2)
assert found["reversals"].item() > 5
""",
    ),
    "a friction law": Change(
        {},
        {
            "sweep/models/general/laws.py": [("LAWS: dict", SQUARE), ('        Law("none",', LAW)],
            "sweep/parameters.py": [
                (
                    '        ("mu_static",',
                    '        ("fading", u.SPEED, "slip of half the force", None, _SIZE),\n        ("mu_static",',
                )
            ],
        },
        f"""
found = sweep.run({BODY!r}, **{{"friction.law": "square"}}, speed=0.05, fading=0.2)
assert found["energy_error"].item() < 1e-6
assert found["fading"].attrs["long_name"].startswith("slip of half")
""",
    ),
    "a surface of bodies": Change(
        {},
        {
            "sweep/models/general/surfaces.py": [
                ("from dataclasses import dataclass, field\n", "from dataclasses import dataclass, field, replace\n"),
                (
                    "for surface in (ELLIPSOID, PARABOLOID)",
                    'for surface in (ELLIPSOID, PARABOLOID, replace(ELLIPSOID, name="egg"))',
                ),
            ]
        },
        f"""
one, other = (sweep.run({BODY!r}, **{{"body.surface": surface}}) for surface in ("ellipsoid", "egg"))
assert one["spin_final"].item() == other["spin_final"].item()
""",
    ),
    "a store": Change(
        {"sweep/results/counting.py": STORE},
        {
            "sweep/engine/run.py": [
                ("import Checkpoint\n", "import Checkpoint\nfrom sweep.results.counting import Counting\n"),
                ("Store(), reporter", "Counting(), reporter"),
            ]
        },
        f"""
sweep.run({SCENE})
from sweep.results.counting import Counting
assert Counting.saved == 1
""",
    ),
}


def named() -> dict[str, list[str]]:
    """The files that the table names for each change."""
    text = (
        (ROOT / "docs" / "explanation" / "layout.md").read_text(encoding="utf-8").split("## What a change touches")[1]
    )
    rows = re.findall(r"^\| (an? [^|]+?) \| ([^|]+) \|", text, re.MULTILINE)
    return {change: re.findall(r"`(sweep/[\w./]+)`", files) for change, files in rows}


def test_the_table_tells_of_each_change_the_files_that_it_touches() -> None:
    told = named()
    assert list(told) == list(CHANGES)
    for name, change in CHANGES.items():
        touched = [*change.edits, *(f"{Path(path).parent}/" for path in change.new)]
        assert len(touched) <= 2, name
        assert set(touched) <= set(told[name]), name


@pytest.mark.campaign
@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_these_files_works(name: str, tmp_path: Path) -> None:
    change = CHANGES[name]
    shutil.copytree(ROOT / "sweep", tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
    for path, text in change.new.items():
        (tmp_path / path).write_text(text, encoding="utf-8")
    for path, replacements in change.edits.items():
        text = (tmp_path / path).read_text(encoding="utf-8")
        for old, new in replacements:
            assert text.count(old) == 1, f"{path} says {old!r} {text.count(old)} times"
            text = text.replace(old, new)
        (tmp_path / path).write_text(text, encoding="utf-8")
    (tmp_path / "pendulum.py").write_text(PENDULUM, encoding="utf-8")
    program = f"import sweep\nassert sweep.__file__.startswith({str(tmp_path)!r})\n{change.works}"
    python("-c", program, folder=tmp_path, PYTHONPATH=str(tmp_path))
