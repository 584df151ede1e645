"""The tilted table of `docs/how-to/add-scene.md`, made on a copy of the package as the page says."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT
from support.processes import python

_PAGE = (ROOT / "docs" / "how-to" / "add-scene.md").read_text(encoding="utf-8")
_CHANGES = re.findall(r"In `(\S+)`:\n\n```diff\n(.*?)```", _PAGE, re.DOTALL)
LEVEL = ("slip", "noslip", "slip+viscous+offset+skew+gravity+sigma", "noslip+solid+gravity+rolling", "slip+contensou")


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package after the changes of the page."""
    folder = tmp_path_factory.mktemp("tilted")
    shutil.copytree(ROOT / "sweep", folder / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
    for name, text in _CHANGES:
        path = folder / name
        for change in text.split("@@\n"):
            lines = change.splitlines(keepends=True)
            old, new = ("".join(line[1:] for line in lines if line[0] in (" ", sign)) for sign in "-+")
            source = path.read_text(encoding="utf-8")
            if new not in source:  # whoever has followed the page has made this change
                assert source.count(old) == 1, f"add-scene.md shows lines that are not in {name}; renew them:\n{old}"
                path.write_text(source.replace(old, new), encoding="utf-8")
    return folder


def printed(folder: Path, code: str) -> dict[str, Any]:
    """What the last line of some code says, run with the package of a folder in plain Python."""
    said = python("-c", code, folder=folder, PYTHONPATH=str(folder), NUMBA_DISABLE_JIT="1").stdout
    found: dict[str, Any] = json.loads(said.splitlines()[-1])
    return found


def test_a_level_table_keeps_its_equations(copy: Path) -> None:
    """The files of generated equations are named after their text."""
    code = f"""
from sweep.models import find
from sweep.models.generated import GENERATED
print(*[find(name).name for name in {LEVEL}], *GENERATED, sep="\\n")
"""
    here, there = (python("-c", code, folder=each, PYTHONPATH=str(each)).stdout for each in (ROOT, copy))
    assert here == there
    assert here.count("<sweep rhs") == len(LEVEL)


def test_an_upright_body_slides_down_without_friction(copy: Path) -> None:
    """It spins meanwhile, so that the direction of its slip turns against it."""
    found = printed(copy, """
import json
import numpy as np
from scipy.integrate import solve_ivp
from sweep.models import find
from sweep.models.model import take
model = find("slip+none+slope")
columns = {"a": 10, "b": 3, "c": 1, "delta": 0.03, "slope": 0.1, "n0": 0.5, "x0": 0, "y0": 0}
columns = {name: np.array([float(value)]) for name, value in columns.items()}
p = take(model.constants.of(columns), 0)
start = np.ravel(model.start(columns))
end = solve_ivp(lambda t, y: model.rhs(tuple(y), p)[0], (0, 7), start, rtol=1e-11, atol=1e-13).y[:, -1]
print(json.dumps({"v": end[5:7].tolist(), "d": end[7:].tolist(), "u": end[:2].tolist()}))
""")  # fmt: skip
    assert found["u"] == [0, 0]
    np.testing.assert_allclose(found["v"], np.multiply(found["d"], 7 * np.sin(0.1)), rtol=1e-9)
    np.testing.assert_allclose(found["d"], [np.cos(7 * 0.5), np.sin(7 * 0.5)], rtol=1e-9)


@pytest.mark.parametrize("name", ["slip+viscous+slope", "noslip+solid+slope"])
def test_gravity_along_the_table_feeds_the_body_and_friction_takes(copy: Path, name: str) -> None:
    found = printed(copy, f"""
import json
import numpy as np
from sweep.models import find
from sweep.models.model import take
model = find("{name}")
columns = {{"a": 10, "b": 3, "c": 1, "delta": 0.03, "mu": 20, "slope": 0.1, "n0": 0.5, "x0": 0, "y0": 0}}
p = take(model.constants.of({{name: np.array([float(value)]) for name, value in columns.items()}}), 0)
y = np.array([0.02, -0.03, 0.4, -0.3, -0.6, 0.03, 0.01, 0.6, 0.8])
if len(model.states) == 7:
    y = np.delete(y, [5, 6])
slopes, (_, power, R, _) = model.rhs(tuple(y), p)
turn = np.array([[np.cos(0.03), -np.sin(0.03), 0], [np.sin(0.03), np.cos(0.03), 0], [0, 0, 1]])
shape, inertia = turn.T @ np.diag([100.0, 9.0, 1.0]) @ turn, np.array([10.0, 101.0, 109.0]) / 5

def of(y):
    u = np.array([y[0], y[1], -np.sqrt(1 - y[0]**2 - y[1]**2)])
    v = y[5:7] if len(y) == 9 else np.zeros(2)
    d = np.append(y[-2:], -(y[-2:] @ u[:2]) / u[2])
    height = np.sqrt(u @ shape @ u)
    v_g = np.append(v, -(v @ u[:2]) / u[2]) + np.cross(-shape @ u / height, y[2:5])
    return 0.5 * inertia @ y[2:5]**2 + 0.5 * v_g @ v_g + np.cos(0.1) * height, d @ v_g

h, change = 1e-6, np.array(slopes)
gained = (of(y + h * change)[0] - of(y - h * change)[0]) / (2 * h)
print(json.dumps({{"rates": [gained, np.sin(0.1) * of(y)[1] - power]}}))
""")  # fmt: skip
    gained, expected = found["rates"]
    assert gained == pytest.approx(expected, rel=1e-7)


def test_a_configuration_runs_on_a_tilted_table(copy: Path) -> None:
    found = printed(copy, """
import json
import numpy as np
from scipy.integrate import solve_ivp
import sweep
from sweep.models import find
from sweep.models.model import take
config = sweep.load_config({"friction": {"mu": 20}, "table": {"slope": "3 deg"}, "integrator": {"t_end": 4}})
columns = config.grid.columns()

def spin(model):
    p = take(model.constants.of(columns), 0)
    y = solve_ivp(lambda t, y: model.rhs(tuple(y), p)[0], (0, 4), np.ravel(model.start(columns)), "LSODA",
                  rtol=1e-10, atol=1e-12).y[:, -1]
    return float(model.rhs(tuple(y), p)[1][0])

model = config.equations
spins = sweep.run(config).spin_final.item(), spin(model), spin(find("slip"))
print(json.dumps({"spins": spins, "said": [model.name, config.integrator.method, *sorted(model.offers)]}))
""")  # fmt: skip
    ours, theirs, level = found["spins"]
    assert ours == pytest.approx(theirs, abs=1e-8)
    assert abs(ours - level) > 1e-5
    assert found["said"] == ["slip+viscous+slope", "dopri5", "count", "spin"]
