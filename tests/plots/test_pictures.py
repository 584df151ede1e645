"""The registry of pictures, and the picture that the page on adding one makes."""

import re
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from support import ROOT
from support.figures import made

from sweep.config import InputError, load_config
from sweep.plots import panels, picture, pictures, quantities
from sweep.plots.pictures.record import Picture
from sweep.results.dataset import VARIABLES
from sweep.results.probabilities import PROBABILITIES


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> list[Picture]:
    """The pictures of the two blocks of code on the page, registered as those in files of their own."""
    text = (ROOT / "docs" / "how-to" / "add-picture.md").read_text(encoding="utf-8")
    found = list[Picture]()
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        module: Any = ModuleType("page")
        exec(block, module.__dict__)
        found += module.PICTURES
    for each in found:
        monkeypatch.setitem(pictures.PICTURES, each.name, each)
        monkeypatch.setitem(quantities.DERIVED, each.name, each.derive)
    return found


def test_the_pictures_of_the_page_are_drawn(page: list[Picture]) -> None:
    rest_error, shares = page
    dataset = made(n0=[0.02, 0.05])
    dataset["spin_rest"] = dataset["spin_final"] - 0.5
    dataset["spin_error"] = 0 * dataset["spin_final"] + 0.25
    axes = picture.plot(dataset, rest_error.name, at={"n0": 0.02}).axes[0]
    drawn: Any = axes.collections[0]
    np.testing.assert_allclose(drawn.get_array(), 0.25 / np.abs(dataset["spin_rest"].values[..., 0]))

    dataset["reversals"][:, :, 1] = 3
    first, second = picture.plot(dataset, shares.name).axes
    assert (first.get_title(), second.get_title()) == ("n₀ = 0.02", "n₀ = 0.05")
    for panel, counts in ((first, dataset["reversals"][..., 0]), (second, dataset["reversals"][..., 1])):
        bars: Any = panel.patches
        expected = np.bincount(counts.values.ravel(), minlength=11) / counts.size
        np.testing.assert_allclose([bar.get_height() for bar in bars], expected)


@pytest.mark.usefixtures("page")
def test_a_configuration_names_a_picture_by_its_record_alone() -> None:
    config = load_config({"friction": {"mu": [20, 60]}, "picture": ["shares"], "measure": ["reversals"]})
    quantities.check_pictures(config)


def test_every_record_is_of_a_variable_or_derives_it() -> None:
    for name, one in pictures.PICTURES.items():
        assert (name in {*VARIABLES, *PROBABILITIES}) == (one.derive is None)
        assert set(one.needs) <= {*VARIABLES, "reversal"}
        assert set(one.compares) <= {*VARIABLES, *pictures.PICTURES}


def test_no_code_asks_for_the_name_of_a_picture() -> None:
    names = "|".join(pictures.PICTURES)
    for room in ("plots", "explorer"):
        for path in (ROOT / "sweep" / room).glob("*.py"):
            asked = re.findall(
                rf'^.*\b(?:if|elif|while|and|or)\b.*[!=]= \[?"(?:{names})"', path.read_text(), re.MULTILINE
            )
            assert not asked, path


def test_panels_show_what_belongs_together_in_one(page: list[Picture]) -> None:
    chosen = panels.choose(made(n0=[0.02, 0.05]), page[1].name)
    assert (chosen.across, [*chosen.each[0]], len(chosen.each)) == ([], ["n0"], 2)
    assert panels.choose(made(n0=[0.02, 0.05]), page[1].name, x="count").across == ["count"]
    with pytest.raises(InputError, match="x: shares is not drawn over one axis"):
        panels.choose(made(n0=[0.02, 0.05]), page[1].name, x="n0")
