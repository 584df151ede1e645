"""What a person does on the page, in chromium: the extra `browser` and Debian's chromium have to be there.

python -m pytest -m browser -n0
"""

from __future__ import annotations

import io
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
import xarray as xr
from mpl_toolkits.mplot3d import proj3d
from PIL import Image
from support import ROOT, own

import sweep
from sweep.explorer.runner import Job
from sweep.explorer.slices import Source
from sweep.kernels.status import SETTLED, TIME_LIMIT
from sweep.plots import animation, labels

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

    Open = Callable[[str], Page]

pytestmark = pytest.mark.browser

TIMEOUT = 60_000
"""Milliseconds: more than any machine needs; the kernel is compiled before."""

N0 = 1
"""Index of the slice with cells of many kinds."""

CELL = "n0=0.05&cell=mu:70,b:4,n0:0.05"
"""That slice, and one of its cells."""


@pytest.fixture(scope="module")
def served(tiny: Path) -> Iterator[str]:
    """The address of the explorer, run as a user runs it; it has to end with one line at Ctrl-C."""
    with explorer(tiny) as process:
        yield address(process)
        assert stopped(process) == (0, "stopped\n", "")


@contextmanager
def explorer(*arguments: str | Path) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "sweep", "explore", *map(str, arguments), "--no-browser"]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=ROOT, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def address(process: subprocess.Popen[str]) -> str:
    """The address that an explorer prints."""
    assert process.stdout
    line = process.stdout.readline()
    found = re.search(r"http://localhost:\d+/", line)
    assert found, line
    return found[0]


def stopped(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """How an explorer ends at Ctrl-C: its exit status, and what it says further on either stream."""
    process.send_signal(signal.SIGINT)
    said, complaints = process.communicate(timeout=60)
    return process.returncode, said, complaints


@pytest.fixture(scope="module")
def go(browser: Browser, served: str) -> Iterator[Open]:  # noqa: ARG001  whose pages close before it ends
    """Opens an address on a page of its own; there must be no error and no warning on the console of any."""
    complaints = list[str]()

    def opened_at(place: str) -> Page:
        page = context.new_page()
        page.set_default_timeout(TIMEOUT)

        def complain(what: object) -> None:
            complaints.append(f"{page.url}: {what}")

        page.on("console", lambda message: message.type in ("error", "warning") and complain(message.text))
        page.on("pageerror", complain)
        page.goto(place)
        return page

    with browser.new_context(viewport={"width": 1400, "height": 950}) as context:
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        yield opened_at
    assert not complaints


@pytest.fixture(scope="module")
def visit(go: Open, served: str) -> Open:
    """Opens the explorer at a query."""
    return lambda query: settle(go(f"{served}?x=mu&y=b&{query}"))


@pytest.fixture(scope="module")
def shared(visit: Open) -> Page:
    """The map of the slice with cells of many kinds, and a cell whose trajectory is drawn."""
    return visit(CELL)


@pytest.fixture
def clicked(shared: Page) -> Page:
    """The same as it was opened; to read, look and zoom."""
    shared.set_viewport_size({"width": 1400, "height": 950})
    shared.evaluate(f"{MAP}.x_range.reset(); {MAP}.y_range.reset()")
    if "show=reversals" not in shared.url:
        select(shared, "show", "spin reversals, simulated", "show=reversals")
    wait_for_curves(shared, 1)
    return settle(shared)


@pytest.fixture
def page(visit: Open) -> Iterator[Page]:
    """The map alone, on a page that is closed after the test."""
    page = visit("n0=0.05")
    yield page
    page.close()


@pytest.fixture
def counts(opened: xr.Dataset) -> np.ndarray:
    """The reversals of that slice as the map shows them, shape (b, mu)."""
    return opened["reversals"].isel(n0=N0).transpose("b", "mu").values


def settle(page: Page) -> Page:
    """Wait until the map and its patterns are drawn."""
    page.wait_for_function("document.querySelector('#map canvas, #map *') && window.Bokeh?.documents[0]?.is_idle")
    page.wait_for_function(f"{MAP}.inner_width > 10 && {MAP}.renderers[2].data_source.data.image[0].length > 4")
    return page


NAMED = "Bokeh.documents[0].get_model_by_name"

CLOCK = "m.center.filter((c) => c.type === 'Label')[0].text"

FACES = "m.renderers.find((r) => r.data_source.name === 'faces').data_source.data"

NUMBERS = "m.renderers.find((r) => r.data_source.name === 'numbers').data_source.data"

MAP = f"{NAMED}('map').children[0]"


def found(name: str) -> str:
    """JavaScript for the model of this name, of which "map figure" is always the one that is shown."""
    return MAP if name == "map figure" else f"{NAMED}('{name}')"


def model(page: Page, name: str, expression: str) -> Any:
    """The value of a JavaScript expression on the model `m` of this name."""
    return page.evaluate(f"(() => {{ const m = {found(name)}; return {expression} }})()")


def image(page: Page) -> list[float]:
    """The values of the map, row by row."""
    return list(model(page, "map figure", "[...m.renderers[0].data_source.data.image[0]]"))


def text(page: Page, name: str) -> str:
    """What can be read in the widget of this name."""
    return str(model(page, name, "Bokeh.index.find_one(m).shadow_el.querySelector('.bk-clearfix').innerText"))


def wait(page: Page, name: str, expression: str) -> None:
    """Wait until an expression on the model `m` of this name is true."""
    page.wait_for_function(f"(() => {{ const m = {found(name)}; return m && ({expression}) }})()")


def place(page: Page, i: float, j: float) -> Any:
    """The middle of the cell in column i and row j of the map, in pixels of the window."""
    return page.evaluate(
        f"""([i, j]) => {{
            scrollTo(0, 0)
            const map = {MAP}, view = Bokeh.index.find_one(map), image = map.renderers[0].data_source.data
            const [rows, columns] = image.image[0].shape
            const at = (range, scale, k, n) => scale.compute(range.start + ((k + 0.5) / n) * (range.end - range.start))
            const box = view.canvas_view.el.getBoundingClientRect(), frame = view.frame
            return [box.x + at(map.x_range, frame.x_scale, i, columns),
                    box.y + at(map.y_range, frame.y_scale, j, rows)]
        }}""",
        [i, j],
    )


def tip(page: Page, i: int, j: int) -> str:
    """What stands beside the pointer on a cell."""
    page.mouse.move(*place(page, i, j + 1))
    page.mouse.move(*place(page, i, j))
    return str(page.locator(".bk-tooltip-content").first.text_content())


def contrast(box: Locator) -> float:
    """The smallest contrast of the words in a box with its ground, by the formula of WCAG 2."""
    worded = "(e) => [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim())"
    inks = box.locator("*").evaluate_all(f"(all) => all.filter({worded}).map((e) => getComputedStyle(e).color)")
    ground = box.evaluate("e => getComputedStyle(e).backgroundColor")

    def luminance(colour: str) -> float:
        share = np.array(re.findall(r"[\d.]+", colour)[:3], float) / 255
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722]) + 0.05

    ratios = [luminance(ink) / luminance(ground) for ink in inks]
    return min(max(ratio, 1 / ratio) for ratio in ratios)


def resize(page: Page, width: int) -> None:
    """Give the window another width, and wait until the figures fit and the server has painted the patterns anew."""
    page.set_viewport_size({"width": width, "height": 950})
    page.wait_for_function(f"{MAP}.outer_width <= {width}")
    page.wait_for_timeout(300)
    wait(page, "map figure", "Math.abs(m.renderers[2].data_source.data.image[0].shape[1] - m.inner_width) <= 1")


def curves(page: Page) -> list[str]:
    """What the legend says of the curves that are drawn."""
    return list(model(page, "curve legend", "m.items.filter((i) => i.visible).map((i) => i.label.value)"))


def wait_for_curves(page: Page, count: int) -> None:
    test = f"m.items.filter((i) => i.visible && /reversals?$/.test(i.label.value)).length === {count}"
    wait(page, "curve legend", test)


def pixels(page: Page, i: float, j: float, columns: int = 5, rows: int = 4) -> np.ndarray:
    """The colours in the inner part of a cell of the map, shape (pixels, 3)."""
    size = model(page, "map figure", "[m.inner_width, m.inner_height]")
    return shot(page, *place(page, i, j), 0.7 * size[0] / columns, 0.7 * size[1] / rows)


def shot(page: Page, x: float, y: float, width: float, height: float) -> np.ndarray:
    """The colours around a place in the window, shape (pixels, 3)."""
    clip = {"x": x - width / 2, "y": y - height / 2, "width": width, "height": height}
    picture = Image.open(io.BytesIO(page.screenshot(clip=clip))).convert("RGB")
    return np.asarray(picture).reshape(-1, 3)


def colour_in_palette(page: Page, count: int) -> list[int]:
    """The colour that the bar has for a count."""
    text = model(page, "map figure", f"m.renderers[0].glyph.color_mapper.palette[{count} - Math.ceil("
                 "m.renderers[0].glyph.color_mapper.low)]")  # fmt: skip
    return [int(text[k : k + 2], 16) for k in (1, 3, 5)]


def enter(page: Page, name: str, text: str, url: str = "") -> None:
    """Type into the field of this name, and wait for what the address says then."""
    field = control(page, name, "input")
    field.fill(text)
    field.press("Enter")
    page.wait_for_url(re.compile(url))


def select(page: Page, name: str, words: str, url: str = "") -> None:
    """Choose from the list of this name, and wait for what the address says then."""
    control(page, name, "select").select_option(label=words)
    page.wait_for_url(re.compile(url))


def control(page: Page, name: str, kind: str) -> Locator:
    """The element of this kind in the widget of this name."""
    marker = f"sweep-{re.sub('[^a-z0-9]', '-', name.lower())}"
    model(page, name, f"Bokeh.index.find_one(m).el.classList.add('{marker}')")
    return page.locator(f".{marker} {kind}").first


# ---- opening and reading


def test_the_map_shows_the_dataset(clicked: Page, opened: xr.Dataset, counts: np.ndarray) -> None:
    """Settled counts have the colour of the bar; other cells have a pattern over it, or in place of it."""
    assert clicked.title() == opened.attrs["title"]
    assert image(clicked) == counts.ravel().tolist()
    for i, j in np.ndindex(5, 4):
        share = (pixels(clicked, i, j) == colour_in_palette(clicked, int(counts[j, i]))).all(axis=1).mean()
        if (i, j) == (0, 0):  # failed
            assert share == 0
        elif (i, j) in [(2, 0), (3, 0)]:  # a lower bound, and limited by round-off
            assert 0.5 < share < 0.95  # a boundary runs through both
        elif opened["status"].values[i, j, N0] == 1:
            assert share > 0.8, (i, j)  # a line may run through the cell
    legend = text(clicked, "legend")
    for words in ("lower bound", "failed: 1 lifted off the table", "limited by round-off"):
        assert words in legend


def test_a_map_ends_where_the_semi_axes_are_equal(opened: xr.Dataset) -> None:
    from sweep.explorer.figure import MapFigure

    shown = MapFigure(Source(opened.assign_coords(a=3.5)), "b", "mu").figure
    assert shown.x_range.bounds == (1.5, 3.5)
    assert shown.y_range.bounds == (35, 85)


def test_boundaries_have_their_counts(clicked: Page, counts: np.ndarray) -> None:
    """Each stands between cells that count fewer and cells that count as many, and can be read."""
    numbers = model(
        clicked, "map figure", f"{NUMBERS}.count.map((n, k) => [Number(n), {NUMBERS}.x[k], {NUMBERS}.y[k]])"
    )
    assert {count for count, *_ in numbers} == {2, 3, 4}
    for width in (1400, 420):
        resize(clicked, width)
        for count, mu, b in numbers:
            i, j = (mu - 40) / 10, b - 2
            around = counts[int(j) : int(j) + 2, int(i) : int(i) + 2]
            assert around.min() < count <= around.max()
            colours = shot(clicked, *place(clicked, i, j), 10, 12)
            assert (colours > 240).all(axis=1).mean() > 0.3  # its ground
            assert (colours < 100).all(axis=1).mean() > 0.05  # its ink
    select(clicked, "show", "simulated − predicted", "show=difference")
    wait(clicked, "map figure", f"!{NUMBERS}.count.length")


def test_the_pointer_shows_all_of_a_cell(clicked: Page, opened: xr.Dataset) -> None:
    near = tip(clicked, 2, 0)
    clicked.locator("#cell").get_by_text("μ = 60, b = 2, n₀ = 0.05").wait_for()
    clicked.evaluate("sweep.fold()")
    shown = text(clicked, "cell")
    clicked.evaluate("sweep.fold()")
    cell = opened.isel(mu=2, b=0, n0=N0)
    assert "lower bound" in shown
    for name in ("spin_final", "t_stop", "n_c1_linear", "form_factor", "energy_error"):
        assert ", ".join(labels.number(value) for value in cell[name].sortby([*cell[name].dims]).values.flat) in shown
    assert "ended at the time limit" in shown
    assert near.strip() == f"spin reversals, simulated: {int(cell['reversals'])}"
    select(clicked, "show", "how the trajectory ended", "show=status")
    assert tip(clicked, 2, 0).strip() == "how the trajectory ended: ended at the time limit"


def test_cuts_follow_the_pointer(clicked: Page, counts: np.ndarray) -> None:
    """Those of the row and of the column; a cell that failed is a gap."""
    shown = counts.astype(float)
    shown[0, 0] = np.nan
    for i, j in [(2, 1), (3, 0)]:
        clicked.mouse.move(*place(clicked, i, j))
        wait(clicked, "cut along mu", f"m.title.text === 'at b = {2 + j}'")
        for name, expected in (("mu", shown[j]), ("b", shown[:, i])):
            value = model(clicked, f"cut along {name}", "[...m.renderers[0].data_source.data.value]")
            np.testing.assert_array_equal(value, expected)
        here = model(clicked, "cut along b", "[...m.renderers[1].data_source.data.here]")
        assert np.flatnonzero(np.isfinite(here)).tolist() == [j]
    clicked.evaluate(f"{MAP}.x_range.start = 50")
    assert model(clicked, "cut along mu", "m.x_range.start") == 50


def test_axes_variable_and_selection_change(go: Open, served: str, opened: xr.Dataset) -> None:
    page = settle(go(served))
    assert "?show=reversals&x=b&y=mu&n0=0.05&sign=1&cell=" in page.url
    select(page, "x", "friction μ", "x=mu&y=b")
    select(page, "y", "start spin n₀", "x=mu&y=n0")
    settle(page)
    assert model(page, "map figure", "m.left[0].axis_label") == "start spin n₀ (√(g/c))"
    control(page, "b", "[role=slider]").focus()
    page.keyboard.press("ArrowRight")
    page.wait_for_url(re.compile("b=3"))
    page.mouse.move(*place(page, 1, 1))
    page.locator("#cell").get_by_text("μ = 50, b = 3, n₀ = 0.05").wait_for()
    select(page, "show", "simulated − predicted", "show=difference")
    settle(page)
    difference = (opened["reversals"] - opened["reversals_predicted"]).isel(b=1).transpose("n0", "mu").values
    assert image(page) == difference.ravel().tolist()


def test_another_body_is_estimated_and_then_simulated(visit: Open, counts: np.ndarray) -> None:
    """Its counts follow a slider; a click runs its trajectory; and the dataset's map returns."""
    page = visit("n0=0.05")
    before = image(page)
    control(page, "body delta", "[role=slider]").focus()
    for _ in range(30):
        page.keyboard.press("ArrowRight")
    wait(page, "map figure", "/^spin reversals, simulated, δ = 0.045.* rad$/.test(m.title.text)")
    assert page.url.endswith("&n0=0.05&sign=1&with=delta:0.0455")
    assert "grey dots: lines of the dataset's body" in text(page, "legend")
    lines = {name: model(page, name, "m.data.xs.length") for name in ("stale", "line best", "line boundary")}
    assert lines == {"stale": lines["stale"], "line best": 1, "line boundary": 0}
    assert lines["stale"] > 2
    body, friction = {"b": [2, 3, 4, 5], "delta": 0.0455}, {"mu": [40, 50, 60, 70, 80]}
    other = sweep.run(
        {"body": body, "friction": friction, "measure": ["reversals"]}, t_end=1500, method="dopri5", n0=0.05
    )
    assert image(page) == other["reversals"].transpose("b", "mu").values.ravel().tolist()
    page.mouse.move(*place(page, 3, 2))
    page.locator("#cell").get_by_text("μ = 70, b = 4, n₀ = 0.05, δ = 0.0455 rad").wait_for()
    page.mouse.click(*place(page, 3, 2))
    page.wait_for_url(re.compile(r"cell=b:4,delta:0.0455,mu:70,n0:0.05"))
    control(page, "back", "button").click()
    wait(page, "map figure", "m.title.text === 'spin reversals, simulated'")
    assert image(page) == before == counts.ravel().tolist()
    page.wait_for_url(re.compile(r"^(?!.*with=)"))
    page.close()


def document_of(dataset: xr.Dataset, **query: str) -> tuple[Any, Any]:
    """The document that the server makes of an address, without a browser, and its view."""
    from bokeh.document import Document

    from sweep.explorer.view import View

    document = Document()
    return document, View(document, Source(dataset), None, None, {key: [value] for key, value in query.items()})


@pytest.mark.parametrize("values", [1, 2])
def test_an_axis_of_one_value_has_no_slider(opened: xr.Dataset, values: int, caplog: pytest.LogCaptureFixture) -> None:
    from bokeh.models import Slider

    document, _ = document_of(opened.isel(n0=slice(values)), n0="0.02")
    document.validate()
    names = {model.name for model in document.select({"type": Slider})}
    assert {"mu", "b", "n0"} - names == ({"n0"} if values == 1 else set())
    assert not caplog.records


def test_no_cell_is_shown_along_other_axes(opened: xr.Dataset) -> None:
    """Until the pointer is on one: its indices were those of the old axes."""
    document, _ = document_of(opened, x="mu", y="b")
    cell = document.get_model_by_name("cell")
    nothing = cell.text
    document.get_model_by_name("probe").data = {"i": [1], "j": [1]}
    assert "μ = 50, b = 3, n₀ = 0.05" in cell.text
    document.get_model_by_name("y").value = "n0"
    assert cell.text == nothing


# ---- trajectories


def test_a_page_that_is_gone_ends_only_its_own_run(opened: xr.Dataset) -> None:
    """Bokeh takes the document apart first; the thread of the trajectories, which all pages share, has to go on."""
    (document, view), job = document_of(opened), Job({}, lambda _: None)
    document.callbacks.destroy()
    view._report(job)
    assert job.dropped


def test_a_click_runs_the_cell(page: Page, opened: xr.Dataset) -> None:
    page.mouse.click(*place(page, 3, 2))
    wait_for_curves(page, 1)
    cell = opened.isel(mu=3, b=2, n0=N0)
    assert curves(page) == [f"1: μ = 70, b = 4, n₀ = 0.05, {int(cell['reversals'])} reversals"]
    time, spin = model(page, "spin", "['time', 'spin'].map((k) => [...m.renderers[0].data_source.data[k]])")
    assert time[-1] == pytest.approx(float(cell["t_stop"]), rel=1e-6)
    assert spin[0] == pytest.approx(0.05)
    assert spin[-1] == pytest.approx(float(cell["spin_final"]), rel=1e-6)
    series = "['energy', 'dissipated'].map((k) => [...m.renderers[0].data_source.data[k]])"
    energy, lost = model(page, "energies", series)
    np.testing.assert_allclose(np.array(energy)[[0, -1]] + np.array(lost)[[0, -1]], energy[0], rtol=1e-5)
    assert page.url.endswith("cell=b:4,mu:70,n0:0.05")


def test_cells_are_overlaid_and_removed(page: Page) -> None:
    page.mouse.click(*place(page, 1, 1))
    wait_for_curves(page, 1)
    page.keyboard.down("Shift")
    page.mouse.click(*place(page, 3, 2))
    page.keyboard.up("Shift")
    wait_for_curves(page, 2)
    assert page.url.count("cell=") == 2
    control(page, "remove 1", "button").click()
    wait_for_curves(page, 1)
    assert curves(page)[0].startswith("1: μ = 70")
    model(page, "curves", "m.properties.children.change.connect(() => { window.flickers = true })")
    page.mouse.click(*place(page, 2, 2))
    wait(page, "curve legend", "/μ = 60/.test(m.items[0].label.value)")
    assert page.url.count("cell=") == 1
    assert not page.evaluate("window.flickers")  # the old curve stays until there is something of the new one


def test_parameters_leave_the_grid(visit: Open) -> None:
    page = visit(CELL)
    wait_for_curves(page, 1)
    enter(page, "parameter mu", "63.5", "mu:63.5")
    wait(page, "curve legend", "/μ = 63.5.*reversals/.test(m.items[0].label.value)")
    curve = sweep.trajectory(ROOT / "configs" / "mu.yaml", mu=63.5, b=4, n0=0.05, t_end=1500)
    spin = model(page, "spin", "[...m.renderers[0].data_source.data.spin]")
    assert spin[100] == pytest.approx(float(curve["spin"][100]), abs=0.02)
    enter(page, "parameter mu", "-5")
    page.get_by_text("mu has to be a finite number >= 0").wait_for()
    assert "mu:63.5" in page.url


def test_the_trajectory_is_played(clicked: Page) -> None:
    control(clicked, "play", "button").click()
    wait(clicked, "time", "m.value > 0.02 * m.end")
    control(clicked, "play", "button").click()
    moment = model(clicked, "time", "m.value")
    clicked.wait_for_timeout(300)
    assert model(clicked, "time", "m.value") == moment
    line = "m.center.filter((c) => c.type === 'Span' && c.dimension === 'height')[0]"
    assert model(clicked, "spin", f"{line}.location") == moment
    assert model(clicked, "body", CLOCK) == f"t = {moment:.{1 if moment < 100 else 0}f} √(c/g)"


def test_the_body_turns_as_in_an_animation(clicked: Page) -> None:
    """Its outline, its middle and its trace lie where matplotlib's perspective puts them."""
    one = sweep.trajectory(ROOT / "configs" / "mu.yaml", mu=70, b=4, n0=0.05, t_end=1500)
    wait(clicked, "body", f"{FACES}.xs.length")
    times = one["time"].sel(time=slice(0, model(clicked, "time", "m.end"))).values
    scene = animation._Scene(one.expand_dims("trajectory"), times)
    (body,) = scene.bodies
    for frame in (0, 100, 1000):
        clicked.evaluate(f"{NAMED}('time').value = {times[frame] + 1e-6}")
        clicked.wait_for_timeout(300)
        scene.show(frame)
        (surface,) = body.axes.collections
        faces = np.array(surface._faces)
        x, y, depth = (
            v.reshape(faces.shape[:2]) for v in proj3d.proj_transform(*faces.reshape(-1, 3).T, body.axes.get_proj())
        )
        seen = np.array(model(clicked, "body", f"['xs', 'ys'].map((k) => {FACES}[k].map((each) => [...each]))"))
        for drawn, expected in zip(seen, (x, y), strict=True):
            assert drawn.min() == pytest.approx(expected.min(), abs=0.03 * np.ptp(expected))
            assert drawn.max() == pytest.approx(expected.max(), abs=0.03 * np.ptp(expected))
        nearest = depth.mean(axis=1).argmin()
        middles, middle = seen.mean(axis=2), np.array([x[nearest].mean(), y[nearest].mean()])
        assert np.hypot(*(middles - middle[:, None])).min() < 0.01 * np.ptp(x)


def test_a_link_reopens_the_page(page: Page, visit: Open) -> None:
    select(page, "show", "final spin n", "show=spin_final")
    settle(page)
    page.mouse.click(*place(page, 3, 2))
    wait_for_curves(page, 1)
    page.get_by_role("button", name="Copy link").click()
    page.get_by_role("button", name="Copied").wait_for()
    link = page.evaluate("navigator.clipboard.readText()")
    assert link == page.url
    other = visit(link.partition("?")[2])
    wait_for_curves(other, 1)
    assert (other.url, curves(other), image(other)) == (link, curves(page), image(page))


def test_a_wrong_link_is_reported_and_harmless(visit: Open) -> None:
    page = visit("show=<img src=x onerror=alert(1)>&n0=9&cell=mu:-3&file=/etc/passwd")
    said = text(page, "notice")
    for words in ("<img src=x onerror=alert(1)> is not", "n0=9 is not", "cell=mu:-3", "unknown URL parameter 'file'"):
        assert words in said
    assert page.locator("#notice img").count() == 0
    assert "show=reversals" in page.url


def test_at_first_sight_a_trajectory_runs_and_its_body_turns(go: Open, served: str) -> None:
    """The map is that of the largest start spin, and no part of the page is empty."""
    page = settle(go(served))
    wait_for_curves(page, 1)
    assert "n0=0.05" in page.url
    wait(page, "time", "m.value > 0")
    wait(page, "body", f"{FACES}.xs.length")
    cell = page.locator("#cell")
    assert cell.get_by_text("spin reversals, simulated").count() == 1
    assert int(text(page, "cell").split("spin reversals, simulated")[1].split()[0]) > 0
    for name in ("b", "mu"):
        assert model(page, f"cut along {name}", "m.title.text").removeprefix("at ") in text(page, "cell")
    rows = cell.locator("tr")
    assert rows.count() > 10
    assert sum(rows.nth(k).is_visible() for k in range(rows.count())) == 5
    cell.get_by_role("button", name="values").click()
    assert all(rows.nth(k).is_visible() for k in range(rows.count()))
    page.close()


def test_a_colour_means_one_count_in_all_maps(page: Page, opened: xr.Dataset, counts: np.ndarray) -> None:
    """Unless the visitor has the map rescaled."""
    ends = "[m.renderers[0].glyph.color_mapper.low, m.renderers[0].glyph.color_mapper.high].map(Math.round)"
    simulated = opened["reversals"].where(opened["status"].isin([SETTLED, TIME_LIMIT]))
    low, high = (
        int(f([getattr(v, f.__name__)() for v in (simulated, opened["reversals_predicted"])])) for f in (min, max)
    )
    colours = []
    for slider in ("ArrowLeft", "ArrowRight"):
        control(page, "n0", "[role=slider]").focus()
        page.keyboard.press(slider)
        page.wait_for_url(re.compile("n0=0.02" if slider == "ArrowLeft" else "n0=0.05"))
        settle(page)
        colours.append(colour_in_palette(page, counts.max()))
        assert model(page, "map figure", ends)[1] >= high - 1
        assert model(page, "map figure", ends)[0] <= low + 1
    assert colours[0] == colours[1]
    select(page, "scale", "of this map", "scale=map")
    wait(page, "map figure", f"{ends}[1] < {high}")
    settle(page)
    assert colour_in_palette(page, counts.max()) != colours[0]


def test_back_undoes_the_last_choice(page: Page) -> None:
    before, url = image(page), page.url
    select(page, "show", "final spin n", "show=spin_final")
    settle(page)
    page.wait_for_timeout(800)
    page.mouse.click(*place(page, 3, 2))
    wait_for_curves(page, 1)
    page.go_back()
    page.wait_for_url(re.compile("show=spin_final(?!.*cell=)"))
    wait(page, "curve legend", "m.items.every((i) => !i.visible)")
    page.go_back()
    wait(page, "show", "m.value === 'reversals'")
    settle(page)
    assert (page.url, image(page)) == (url, before)
    page.go_forward()
    wait(page, "show", "m.value === 'spin_final'")


def test_the_zoom_stands_in_the_link(page: Page, visit: Open) -> None:
    page.evaluate(f"{MAP}.x_range.setv({{start: 48, end: 72}})")
    page.wait_for_url(re.compile("zoom=48:72:"))
    other = visit(page.url.partition("?")[2])
    wait(other, "map figure", "m.x_range.start === 48 && m.x_range.end === 72")
    select(other, "show", "final spin n", "show=spin_final.*zoom=48:72:")
    assert "zoom" not in text(other, "notice")
    other.evaluate(f"{MAP}.x_range.reset()")
    other.wait_for_url(re.compile("^(?!.*zoom)"))
    other.close()


def test_the_page_says_how_to_start_a_server_that_has_ended(browser: Browser, tiny: Path) -> None:
    with explorer(tiny) as process, browser.new_context() as context:
        page = context.new_page()
        page.goto(address(process))
        settle(page)
        assert page.locator("#ended").is_hidden()
        stopped(process)
        page.locator("#ended").wait_for(state="visible", timeout=TIMEOUT)
        assert page.locator("#ended").inner_text() == (
            f"The explorer has ended. To start it again: python -m sweep explore {tiny}"
        )


# ---- the keyboard, and narrow windows


def test_a_screen_reader_has_names_and_short_news(clicked: Page, counts: np.ndarray) -> None:
    clicked.wait_for_timeout(1000)
    for name in ("start spin n₀", "δ (rad)", "time", "drag mu"):
        assert clicked.get_by_role("slider", name=name, exact=True).count() == 1, name
    assert clicked.get_by_role("slider", name="start spin n₀").get_attribute("aria-valuetext") == "0.05"
    for name in ("Box Zoom", "Reset", "Save"):
        assert clicked.get_by_role("button", name=name, exact=True).count() >= 1, name
    clicked.locator("#map").focus()
    for key in ("Shift+ArrowLeft", "Shift+ArrowDown", "ArrowRight"):
        clicked.keyboard.press(key)
    first = clicked.locator("#said").inner_text()
    clicked.keyboard.press("ArrowUp")
    second = clicked.locator("#said").inner_text()
    assert first != second
    found = re.fullmatch(r"spin reversals, simulated: (\d+|no value), at μ = (\d+), b = (\d+)", second)
    assert found
    shown = counts[int(found[3]) - 2, (int(found[2]) - 40) // 10]
    assert found[1] in (str(shown), "no value")
    assert clicked.locator("[aria-live=polite]").count() == 2  # that of the notice, and this one


def test_everything_can_be_done_with_the_keyboard(page: Page) -> None:
    for _ in range(40):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "map":
            break
    else:
        pytest.fail("the map cannot be reached with the Tab key")
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    for key in ("ArrowRight", "ArrowRight", "ArrowRight", "ArrowUp", "ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
    page.locator("#cell").get_by_text("μ = 60, b = 3, n₀ = 0.05").wait_for()
    page.keyboard.press("Enter")
    wait_for_curves(page, 1)
    assert curves(page)[0].startswith("1: μ = 60, b = 3, n₀ = 0.05")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+Enter")
    wait_for_curves(page, 2)


def test_the_page_is_dark_where_the_system_is(visit: Open, opened: xr.Dataset) -> None:
    """Grounds become dark and letters light, in figures too; the colours of the map stay; a button turns the page."""
    page = visit(CELL)
    wait_for_curves(page, 1)

    def grounds() -> list[float]:
        """How light the middles of the page's parts are."""
        page.mouse.move(0, 0)
        page.wait_for_timeout(300)
        picture = Image.open(io.BytesIO(page.screenshot(full_page=True))).convert("L")
        places = ("#controls", "#cell", "#curves", "#chosen", "#played")
        boxes = [page.locator(place).first.bounding_box() for place in places]
        parts = [picture.crop((b["x"], b["y"], b["x"] + b["width"], b["y"] + b["height"])) for b in boxes if b]
        return [float(np.median(np.asarray(part))) for part in parts]

    assert min(grounds()) > 240
    tip(page, 1, 1)
    assert contrast(page.locator(".bk-Tooltip").first) > 4.5
    page.emulate_media(color_scheme="dark")
    page.reload()
    settle(page)
    wait_for_curves(page, 1)
    assert max(grounds()) < 60
    tip(page, 1, 1)
    tooltip = page.locator(".bk-Tooltip").first
    colour = tooltip.evaluate("e => getComputedStyle(e).backgroundColor")
    assert max(map(int, re.findall(r"\d+", colour)[:3])) < 60
    assert contrast(tooltip) > 4.5
    counts = opened["reversals"].isel(n0=N0).values
    assert (pixels(page, 2, 2) == colour_in_palette(page, int(counts[2, 2]))).all(axis=1).mean() > 0.8
    page.get_by_role("button", name="Light or dark page").click()
    assert min(grounds()[:3]) > 240


@pytest.mark.parametrize("width", [1000, 1600])
def test_a_click_shows_its_curves_without_scrolling(visit: Open, width: int) -> None:
    page = visit("n0=0.05")
    page.set_viewport_size({"width": width, "height": 950})
    page.mouse.click(*place(settle(page), 1, 1))
    wait_for_curves(page, 1)
    for name in ("#map", "#curves"):
        box = page.locator(name).first.bounding_box()
        assert box
        assert box["y"] + box["height"] <= 950
    assert page.evaluate("scrollY") == 0
    # News of a run stand between the parts of the page, not over them.
    assert page.evaluate("getComputedStyle(document.querySelector('#notice')).position") == "static"
    page.close()


def test_nothing_runs_out_of_the_window(clicked: Page) -> None:
    for width in (1400, 900, 400):
        resize(clicked, width)
        clicked.wait_for_function("width => document.documentElement.scrollWidth <= width", arg=width)
        for name in ("map figure", "spin", "energies", "body"):
            wait(clicked, name, f"200 < m.outer_width && m.outer_width <= {width}")
        view = f"Bokeh.index.find_one({found('spin')})"
        wait(clicked, "curve legend", f"{view}.frame.bbox.top >= Bokeh.index.find_one(m).bbox.bottom")  # on no curve


def test_a_click_runs_a_users_model_that_the_user_names(go: Open, tmp_path: Path) -> None:
    own.write(tmp_path)
    run = sweep.run(tmp_path / "pendulum.yaml", tmp_path, torque=[0.5, 1.0, 1.2], damping=[0.3, 0.5], t_end=60)
    with explorer(tmp_path / "pendulum.nc", "--model", tmp_path / "pendulum.py") as process:
        page = settle(go(f"{address(process)}?x=torque"))
        spot = {"torque": 2, "damping": 1}
        page.mouse.click(*place(page, *(spot[str(dim)] for dim in reversed(run["reversals"].dims))))
        wait_for_curves(page, 1)
        count = run["reversals"].isel(spot).item()
        assert curves(page)[0].endswith(f"torque = 1.2, {count} reversals")
        wait(page, "played", "!m.visible")
        enter(page, "parameter torque", "1.5")
        wait(page, "curve legend", "/torque = 1.5, .*reversals/.test(m.items[0].label.value)")
        page.close()
        code, said, announced = stopped(process)
    assert (code, said) == (0, "stopped\n")
    assert re.fullmatch(rf"running the code of {tmp_path / 'pendulum.py'} \(SHA-256 \w{{16}}…\)\n", announced)


def test_a_body_in_si_units_says_them(go: Open, tmp_path: Path) -> None:
    """Fields, sliders, axes and words carry units; small numbers can be typed, and sliders be logarithmic."""
    sigma = {"start": 1e-6, "stop": 1e-5, "num": 6, "spacing": "log"}
    sweep.run(ROOT / "configs" / "wooden.yaml", tmp_path, sigma=sigma, n0=[-8.0, -6.0, 6.0], t_end=100)
    with explorer(tmp_path / "wooden.nc") as process:
        page = settle(go(f"{address(process)}?cell=sigma:3.2e-6,n0:6"))
        wait_for_curves(page, 1)
        wait(page, "parameter sigma", "m.value === '3.2e-06'")
        assert model(page, "parameter sigma", "m.title") == "σ (kg m²/s)"
        wait(page, "drag sigma", f"Math.abs(m.value - {np.log(3.2e-6)}) < 1e-3")
        wait(page, "energies", "m.below[0].axis_label === 'time t (s)'")
        ticks = "m.below[0].formatter.doFormat([1e-5, 5e-6, -0.02, 1200000], {})"
        assert model(page, "map figure", ticks) == ["10⁻⁵", "5×10⁻⁶", "−0.02", "1.2×10⁶"]
        page.get_by_text(re.compile(r"followed to t = \d+ s")).wait_for()
        enter(page, "parameter sigma", "5e-6", "sigma:5e-06")
        control(page, "drag sigma", "[role=slider]").focus()
        page.keyboard.press("ArrowRight")
        page.wait_for_url(re.compile(r"sigma:5\.0\d+e-06"))
        page.mouse.move(*place(page, 1, 0))
        page.locator("#cell").get_by_text(re.compile(r"n₀ = −8 rad/s, σ = .*×10⁻⁶ kg m²/s")).first.wait_for()
        page.close()


def test_a_notebook_shows_the_explorer_of_a_dataset(go: Open, opened: xr.Dataset, tmp_path: Path) -> None:
    shown = sweep.explore(opened, height=700)
    try:
        (tmp_path / "notebook.html").write_text(f"<!doctype html><title>n</title>{shown._repr_html_()}")
        page = go(f"file://{tmp_path / 'notebook.html'}")
        assert page.locator("iframe").evaluate("(frame) => frame.clientHeight") == 700
        page.frames[1].wait_for_function(f"window.Bokeh?.documents[0]?.is_idle && {MAP}.inner_width > 10")
        assert page.frames[1].title() == opened.attrs["title"]
        page.close()
    finally:
        shown.close()
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(shown.url, timeout=5)


# ---- texts of a dataset

HOSTILE = r'a $$\href{javascript:window.hacked=1}{b}$$ \[c\] \(d\) <img src=x onerror="window.hacked=1">'
"""A text in which Bokeh would read mathematics, with a link, and HTML."""


def test_texts_of_a_dataset_are_no_code(go: Open, tmp_path: Path) -> None:
    dataset = sweep.predict({"friction": {"mu": [40, 60, 80]}, "body": {"b": [2, 3, 4]}, "start": {"n0": [0.02, 0.05]}})
    flags = {"flag_values": np.int8([1, 2]), "flag_meanings": f"{HOSTILE.replace(' ', '_')} other"}
    dataset["status"] = xr.ones_like(dataset["reversals_predicted"], "int8").assign_attrs(flags)
    dataset = dataset.assign_attrs(title=HOSTILE)
    for name, variable in dataset.variables.items():
        variable.attrs.update(long_name=f"{name}: {HOSTILE}", description=HOSTILE, units=HOSTILE)
    dataset.to_netcdf(tmp_path / "hostile.nc")
    with explorer(tmp_path / "hostile.nc") as process:
        place = address(process)
        page = settle(go(f"{place}?x=mu&y=b&palette={quote(HOSTILE)}"))
        asked = list[str]()
        page.on("request", lambda request: asked.append(request.url))
        assert HOSTILE in seen([text(page, "notice")])
        for k, show in enumerate(("reversals_predicted", "status")):
            control(page, "show", "select").select_option(index=k)
            page.wait_for_url(re.compile(f"show={show}"))
            assert HOSTILE in seen([tip(page, 1, 1)])
            page.locator("#cell td").first.wait_for()
            assert HOSTILE in seen([text(page, "cell")])
            control(page, "n0", ".noUi-handle").hover()
            page.mouse.down()
            page.mouse.move(10, 10)
            page.mouse.up()
        page.wait_for_timeout(1000)
        for where in ("h1", ".bk-slider-title"):
            assert HOSTILE in seen(page.locator(where).all_inner_texts())
        assert page.locator("a[href], img").count() == 0
        assert page.evaluate("window.hacked") is None
        assert [url for url in asked if not url.startswith(place)] == []
        page.close()


def seen(texts: list[str]) -> str:
    """What can be read: a word joiner has no width."""
    return " ".join(" ".join(texts).replace("\N{WORD JOINER}", "").split())


# ---- who may come in


def test_only_this_machine_is_served(served: str) -> None:
    port = urlsplit(served).port
    tables = [path.read_text(encoding="ascii") for path in Path("/proc/net").glob("tcp*")]
    listening = [line.split()[1] for table in tables for line in table.splitlines() if line.split()[3] == "0A"]
    assert [at for at in listening if int(at.rsplit(":", 1)[1], 16) == port] == [f"0100007F:{port:04X}"]


def test_a_port_in_use_is_one_line(tiny: Path, served: str) -> None:
    port = str(urlsplit(served).port)
    with explorer(tiny, "--port", port) as process:
        said, complaints = process.communicate(timeout=60)
    assert (process.returncode, said) == (2, "")
    assert complaints == f"port {port}: Address already in use\n"
