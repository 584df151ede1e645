"""The machine draws configurations and runs them, does with datasets what users do, and asks what must hold."""

from __future__ import annotations

import logging
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, ClassVar
from unittest.mock import patch

import click
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from fuzzing import Violation, check_refusal
from hypothesis import note
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, multiple, precondition, rule
from matplotlib.figure import Figure
from support.runs import Stop, same_numbers

import sweep
from machine import draws, oracles, words
from machine.draws import Draws, Flat, Piece
from sweep.cli import main
from sweep.config import Config, ConfigError, load_config
from sweep.config.document import parse_value
from sweep.faults import Refused
from sweep.kernels.status import FAILURES, IMPOSSIBLE, TIME_LIMIT
from sweep.plots.formats import PICTURES
from sweep.results.kind import kind
from sweep.results.summary import contents, describe
from sweep.units import PAPER_UNITS

NUMBER = st.integers(0, 999)
KEYS = [*draws.PATHS, *3 * [path for path, _ in draws.choices()]]
"""The choice of a law or a model decides what else belongs to a configuration, and is drawn more often."""
BASE = st.sampled_from(sorted(draws.shipped()))
MOST_STEPS = 3e6
"""Of all cells of a run together; a second or two."""
REPEATED = ["integrator.t_end", "integrator.tolerance"]
NUMBERS = ("status", "reversals", "t_stop", "spin_final", "t_last_reversal", "margin", "decided")


@dataclass(frozen=True)
class Scene:
    """A configuration that was accepted."""

    flat: Flat
    config: Config

    def with_(self, changes: Flat, *without: str) -> dict[str, Any]:
        """What its file would say with some keys changed, and others left out."""
        kept = {path: value for path, value in self.flat.items() if path not in without}
        return draws.nested(kept | changes)


@dataclass(frozen=True)
class Found:
    """A dataset, perhaps with the configuration that it is of."""

    dataset: xr.Dataset
    scene: Any = None
    """The `Scene`, or None."""
    ran: bool = False
    """Whether it is the run of that configuration, and no part or prediction of it."""

    @property
    def compared(self) -> bool:
        """Whether each cell was simulated, so that it can be elsewhere too."""
        return self.ran and self.scene.config.simulated and not self.scene.config.refine


def nothing_drawn(really: bool = True) -> Any:
    """Runs without pictures, which take longer to draw than small runs."""
    return patch("sweep.engine.run._draw", lambda *_: None) if really else nullcontext()


class Logged(logging.Handler):
    """Makes a warning that a library logs a fault."""

    def emit(self, record: logging.LogRecord) -> None:
        raise Violation(f"{record.name} logs {record.getMessage()!r}")


class Machine(RuleBasedStateMachine):
    """Each rule is a combination of features: a configuration that was drawn, and something done with it."""

    pool: ClassVar[list[Piece]] = []
    """The kernels that may be run."""
    far: ClassVar[bool] = False
    """Whether kills, fits and animations are drawn, which take seconds, and runs to the default t_end."""
    client: ClassVar[Any] = None
    """Of a dask cluster, if cells are to be run there too."""
    browser: ClassVar[bool] = False
    """Whether documents of the explorer are built."""
    done: ClassVar[int] = 0
    """Combinations so far."""

    scenes, datasets = Bundle("scenes"), Bundle("datasets")
    SCENE = scenes.map(attrgetter("scene"))

    def __init__(self) -> None:
        super().__init__()
        self._temporary = TemporaryDirectory()
        self.folder = Path(self._temporary.name)
        self._logged = Logged(logging.WARNING)
        for name in ("matplotlib", "bokeh"):
            logging.getLogger(name).addHandler(self._logged)

    def teardown(self) -> None:
        for name in ("matplotlib", "bokeh"):
            logging.getLogger(name).removeHandler(self._logged)
        self._temporary.cleanup()

    def ask(self, what: str, call: Callable[[], Any], *files: str) -> Any:
        """What `call` returns; None if it refuses in lines that help.  Anything else is a fault."""
        type(self).done += 1
        note(f"# {what}")
        try:
            return call()
        except Refused as error:
            check_refusal(error, *files, "")
            return None

    def _new(self, name: str = "") -> Path:
        return Path(os.path.join(self.folder, f"{len(os.listdir(self.folder))}{name}"))

    # ---- configurations and their runs

    @initialize(targets=(scenes, datasets), base=BASE, changes=draws.draws(KEYS), number=NUMBER)
    def begin(self, base: str, changes: Draws, number: int) -> Found:
        return self._configured(base, changes, number)

    @rule(targets=(scenes, datasets), base=BASE, changes=draws.draws(KEYS), number=NUMBER)
    def configure(self, base: str, changes: Draws, number: int) -> Found:
        """Draw a configuration that is the same when it is read again, and predict, estimate and run it."""
        return self._configured(base, changes, number)

    def _configured(self, base: str, changes: Draws, number: int) -> Found:
        scene = self._scene(base, changes, number)
        while not self._affordable(scene.config) and number % 8 != 1 and (changes or base != "paper"):
            base, changes = base if changes else "paper", changes[1:]
            scene = self._scene(base, changes, number)
        if scene.config.row != "case" or not scene.config.cases:  # a table stands in no document
            again = load_config(self._written(scene.config.to_yaml()))
            assert again.fingerprint() == scene.config.fingerprint(), "read again, another configuration"
        invoke("run", str(self._written(draws.in_yaml(scene.flat))), "--dry-run")
        predicted = sweep.predict(scene.config)
        if not self._affordable(scene.config):
            return Found(predicted, scene)
        found = self._run(scene.config, *([self._new()] if number % 8 == 0 else []))
        for name in predicted.data_vars:
            xr.testing.assert_equal(predicted[name], found[name])
        return Found(found, scene, ran=True)

    def _scene(self, base: str, changes: Draws, number: int) -> Scene:
        """A configuration of few cells and steps, with kernels of the pool if it has such."""
        drawn = {path: draws.setting(path, n) for path, n in changes}
        known = {key: value for key, value in draws.shipped()[base].items() if key not in drawn}
        flat, config = draws.in_pool(known | drawn, base, self.pool, number)
        unit = 1.0 if config.units == PAPER_UNITS else float(np.sqrt(config.grid.columns()["c"].max() / 9.8))
        small: Flat = {"samples": 3} if config.samples and config.samples > 5 else {}
        if config.integrator.t_end > 1000 * unit and not (self.far and config.grid.size < 4 and number % 6 == 0):
            small["integrator.t_end"] = float(f"{1000 * unit:.2g}")
        return Scene(*draws.accepted(flat | small, base))

    def _affordable(self, config: Config) -> bool:
        if not config.simulated or config.grid.size > 60:
            return not config.simulated
        return draws.kernels(config) <= {*self.pool} and draws.steps(config) < MOST_STEPS

    def _written(self, text: str) -> Path:
        path = self._new(".yaml")
        path.write_text(text, encoding="utf-8")
        return path

    def _run(self, config: Any, *where: Any, **how: Any) -> xr.Dataset:
        found = sweep.run(config, *where, **how)
        oracles.sound(config if isinstance(config, Config) else load_config(config), found)
        return found

    # ---- the same cells elsewhere

    @rule(found=datasets, number=NUMBER, places=st.lists(NUMBER, min_size=1, max_size=4, unique=True))
    def as_cases(self, found: Found, number: int, places: list[int]) -> None:
        """Some cells in any order have the same numbers alone and as cases, be they samples or of a grid."""
        if not found.compared:
            return
        config, there = found.scene.config, oracles.rows(found.dataset)
        cells = [n % len(there["status"]) for n in places]
        names = [name for name in config.tier.parameters if len(np.unique(there[name])) > 1 or name in config.cases]
        columns = {name: there[name][cells].tolist() for name in names or config.tier.parameters[:1]}
        keys = {config.table[name].path: column[0] for name, column in columns.items()}
        settings = {f"integrator.{key}": value for key, value in config.integrator.model_dump().items()}
        alone = keys if len(cells) == 1 and number % 2 else {"cases": columns}
        again = self._run(found.scene.with_(settings | alone, *keys, "samples", "cases"))
        oracles.same(
            oracles.rows(again), {name: there[name][cells] for name in there if name in found.dataset.data_vars}
        )

    @rule(found=datasets)
    def transposed(self, found: Found) -> None:
        """The order of the axes makes no difference."""
        if found.compared and len(found.scene.config.axes) > 1:
            document = draws.nested(dict(reversed(found.scene.flat.items())))
            turned = {key: document[key] for key in reversed(document)}
            again = self._run(turned).transpose(*found.dataset["status"].dims, ...)
            oracles.same(oracles.rows(again), oracles.rows(found.dataset))

    @rule(found=datasets, names=st.sampled_from([oracles.MIRRORED, oracles.TURNED]))
    def mirrored(self, found: Found, names: tuple[str, ...]) -> None:
        """A mirror image, or a body turned by half a turn about the vertical, ends and counts alike."""
        self._elsewhere(found, dict.fromkeys(names, -1.0), {})

    @rule(found=datasets)
    def in_si(self, found: Found) -> None:
        """A body of any size, in SI, does so too."""
        if found.compared and found.scene.config.units == PAPER_UNITS:
            old, unit = found.scene.config.integrator, oracles.TIME
            times = {"t_end": old.t_end * unit, "patience": old.patience and old.patience * unit}
            times |= {} if old.step == "auto" else {"step": old.step * unit}
            fixed = {"units": "SI", "gravity": oracles.LENGTH / unit**2, "body.mass": oracles.MASS}
            more = {f"integrator.{key}": value for key, value in times.items()} | fixed
            self._elsewhere(found, oracles.scales(found.scene.config), more)

    def _elsewhere(self, found: Found, factors: dict[str, float], more: Flat) -> None:
        """The cells of a run as cases, with parameters multiplied, if the kernels are there."""
        if not found.compared:
            return
        there, config = oracles.rows(found.dataset), found.scene.config
        columns = {name: (there[name] * factors.get(name, 1.0)).tolist() for name in config.tier.parameters}
        keys = (config.table[name].path for name in columns)
        try:
            other = load_config(found.scene.with_({"cases": columns} | more, *keys, "samples", "cases", "picture"))
        except Refused:  # a measurement that the model in SI does not offer
            return
        if self._affordable(other):
            oracles.alike(oracles.rows(self._run(other)), there)

    @rule(found=datasets, factor=st.sampled_from([1.5, 4.0]))
    def longer(self, found: Found, factor: float) -> None:
        """What ended before t_end ends alike if t_end is later."""
        if found.compared:
            later = {"integrator.t_end": found.scene.config.integrator.t_end * factor}
            before, after = oracles.rows(found.dataset), oracles.rows(self._run(found.scene.with_(later)))
            ended = before["status"] != TIME_LIMIT
            oracles.alike(*({name: values[ended] for name, values in each.items()} for each in (before, after)))

    @rule(found=datasets, place=NUMBER)
    def follow(self, found: Found, place: int) -> None:
        """A cell that is followed in time ends and counts alike."""
        if found.compared and not found.scene.config.samples:
            config, there = found.scene.config, oracles.rows(found.dataset)
            cell = [place % len(there["status"])]
            values = {name: float(there[name][cell[0]]) for name in (*config.axes, *config.cases)}
            scene = found.scene.with_({}, "cases")
            if there["status"][cell[0]] == IMPOSSIBLE:
                with pytest.raises(ConfigError):
                    sweep.trajectory(scene, **values)
                return
            followed = sweep.trajectory(scene, stop_when_settled=True, **values)
            oracles.alike(oracles.rows(followed), {name: column[cell] for name, column in there.items()})

    # ---- over the files of an earlier run

    @rule(target=datasets, scene=SCENE, number=NUMBER)
    def grow(self, scene: Scene, number: int) -> Any:
        """A run over the dataset of a smaller one, or of a shorter one, is that of all cells at once."""
        config, folder = scene.config, self._new()
        if not self._affordable(config) or config.refine:
            return multiple()
        few: Flat = {"integrator.t_end": config.integrator.t_end / 2, "integrator.patience": config.integrator.patience}
        more: Flat = few | {"integrator.t_end": config.integrator.t_end}
        if config.axes and number % 3:
            random, (name, known) = Random(number), list(config.axes.items())[number % len(config.axes)]
            numbers = [*random.sample(known, len(known)), float(np.mean(known)) * 1.001 or 1e-6]
            sets = numbers[random.randrange(len(numbers)) :], random.sample(numbers, len(numbers))
            few, more = ({config.table[name].path: each} for each in sets)
        with nothing_drawn(number % 5 > 0):
            self._run(scene.with_(few), folder)
            found = self._run(scene.with_(more), folder)
        same_numbers(found, sweep.run(scene.with_(more)))
        return Found(found, Scene(scene.flat | more, load_config(scene.with_(more))), ran=True)

    @rule(scene=SCENE, which=st.sampled_from(["failed", "limit"]), change=draws.draws(REPEATED, 1))
    def rerun(self, scene: Scene, which: str, change: Draws) -> None:
        """Cells that are run again are those of a run with the new settings; the others stay."""
        if not self._affordable(scene.config) or not scene.config.simulated:
            return
        folder, document = self._new(), scene.with_({path: draws.setting(path, n) for path, n in change})
        with nothing_drawn():
            old = oracles.rows(self._run(scene.config, folder))
            again = self.ask("rerun", lambda: sweep.run(document | {"name": scene.config.name}, folder, rerun=which))
        if again is not None:
            new, fresh = oracles.rows(again), oracles.rows(sweep.run(document))
            repeated = np.isin(old["status"], FAILURES if which == "failed" else TIME_LIMIT)
            for cells, rows in ((repeated, fresh), (~repeated, old)):
                oracles.same({k: v[cells] for k, v in new.items()}, {k: v[cells] for k, v in rows.items()}, NUMBERS)

    @rule(scene=SCENE, chunks=st.integers(0, 3))
    def interrupted(self, scene: Scene, chunks: int) -> None:
        """A run that was interrupted goes on to the same numbers."""
        if self._affordable(scene.config):
            folder = self._new()
            with patch("sweep.engine.executor._rescale", lambda *_: 200), suppress(KeyboardInterrupt), nothing_drawn():
                sweep.run(scene.config, folder, reporter=Stop(chunks))
            with nothing_drawn():
                same_numbers(self._run(scene.config, folder), sweep.run(scene.config))

    @precondition(lambda self: self.far)
    @rule(scene=SCENE, after=st.floats(0.3, 3.0))
    def killed(self, scene: Scene, after: float) -> None:
        """So does one whose process was killed."""
        if self._affordable(scene.config):
            file, folder = self._written(draws.in_yaml(scene.flat)), self._new()
            words = [sys.executable, "-m", "sweep", "run", str(file), "--output", str(folder), "--quiet"]
            process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(after)
            process.kill()
            process.wait()
            same_numbers(self._run(load_config(file), folder), sweep.run(load_config(file)))

    @precondition(lambda self: self.client is not None)
    @rule(found=datasets)
    def on_a_cluster(self, found: Found) -> None:
        """The workers of a cluster come to the same numbers."""
        if found.compared:
            same_numbers(self._run(found.scene.config, client=self.client), found.dataset)

    # ---- what is done with datasets

    @rule(target=datasets, found=datasets, way=st.sampled_from(sorted(words.CUTS)), number=NUMBER)
    def cut(self, found: Found, way: str, number: int) -> Any:
        """What xarray makes of a dataset can be described and drawn, or is refused."""
        if not found.dataset.dims or not found.dataset.data_vars:
            return multiple()
        random = Random(number)
        cut = words.CUTS[way](found.dataset, random.choice(sorted(map(str, found.dataset.dims))), random)
        if kind(cut):
            self.ask("describe", lambda: (describe(cut), contents(cut)))
            figure = self.ask("plot", lambda: sweep.plot(cut))
            figure and figure.draw_without_rendering()
            self._reopened(Found(cut))
        return Found(cut)

    def _saved(self, found: Found, file: Path) -> bool:
        """Whether xarray can save a dataset: one that is stacked it cannot."""
        with suppress(ValueError, NotImplementedError):
            found.dataset.to_netcdf(file)
        return file.exists()

    @rule(target=datasets, found=datasets)
    def save(self, found: Found) -> Any:
        """A dataset that is saved is the same when it is opened."""
        again = self._reopened(found)
        return multiple() if again is None else Found(again, found.scene, found.ran)

    def _reopened(self, found: Found) -> xr.Dataset | None:
        file = self._new(".nc")
        again = self.ask("open", lambda: sweep.open(file), str(file)) if self._saved(found, file) else None
        if again is not None:
            xr.testing.assert_identical(again.drop_attrs(deep=False), found.dataset.drop_attrs(deep=False))
        return again

    @rule(found=datasets, arguments=draws.draws(words.TAKEN["plot"], 3), form=st.sampled_from(["", *PICTURES]))
    def plot(self, found: Found, arguments: Draws, form: str) -> None:
        """A picture, in any format, or as a notebook shows it."""
        given = words.arguments("plot", arguments) | ({"output": self.folder / f"x.{form}"} if form else {})
        figure = self.ask("plot", lambda: found.dataset.sweep.plot(**given))
        if isinstance(figure, Figure) and not form:
            figure.draw_without_rendering()

    @precondition(lambda self: self.browser)
    @rule(found=datasets, addressed=draws.draws(["show", "x", "y", "low", "high", "n0"]))
    def explore(self, found: Found, addressed: Draws) -> None:
        """The document of the explorer, at any address."""
        from bokeh.document import Document

        from sweep.explorer.setup import usable
        from sweep.explorer.slices import Source
        from sweep.explorer.view import View

        texts = [*map(str, found.dataset.data_vars), *map(str, found.dataset.dims), "1", "1e7", "x"]
        query = {key: [texts[n % len(texts)]] for key, n in addressed}
        document = Document()
        source = self.ask("open", lambda: Source(found.dataset))
        if source:
            View(document, source, usable(source), None, query)
            document.validate()

    @rule(target=datasets, scene=SCENE, name=st.sampled_from(words.CALLED), given=st.data())
    def call(self, scene: Scene, name: str, given: Any) -> Any:
        """A function that takes a configuration, with any of its arguments."""
        taken = words.arguments(name, given.draw(draws.draws(words.TAKEN[name], 3)))
        if not self._affordable(scene.config) or (name in words.SLOW and not self.far):
            return multiple()
        taken |= {"film": self._film(), "free": ["mu"]} if name == "fit" else {}
        taken |= {"output": self._new(".gif")} if name == "animate" else {}
        found = self.ask(name, lambda: getattr(sweep, name)(scene.config, **taken), str(self.folder / "film.csv"))
        return Found(found) if isinstance(found, xr.Dataset) else multiple()

    def _film(self) -> Path:
        file = self.folder / "film.csv"
        times = np.linspace(0, 60, 20)
        rows = "".join(f"{t:.3f},{0.05 * np.exp(-t / 100):.5f}\n" for t in times)
        file.write_text("time,spin\n" + rows, encoding="utf-8")
        return file

    # ---- the command line

    @rule(scene=SCENE, found=datasets, verb=st.sampled_from(sorted(words.VERBS)), given=st.data())
    def command(self, scene: Scene, found: Found, verb: str, given: Any) -> None:
        """A command with any of its options."""
        asked = words.VERBS[verb].params
        known, drawn = {each.name for each in asked}, given.draw(draws.draws(words.options(verb), 3))
        line = [word for name, n in drawn for word in words.option(verb, name, n)]
        if "config" in known and not self._carried_out(scene, line):
            line.append("--dry-run")
        if (verb in words.SLOW and not self.far) or ("--dry-run" in line and "dry_run" not in known):
            return
        file = self._new(".nc")
        if "file" in known and not self._saved(found, file):
            return
        config = self._written(draws.in_yaml(scene.flat))
        files = {"config": config, "film": self._film(), "source": config, "file": file, "name": "quick"}
        first = [str(files[each.name]) for each in asked if isinstance(each, click.Argument)]
        if "output" in known:
            line += ["--output", str(self._new({"animate": ".gif", "plot": ".png"}.get(verb, "")))]
        self.ask(f"sweep {verb}", lambda: invoke(verb, *first, *line))

    def _carried_out(self, scene: Scene, line: list[str]) -> bool:
        """Whether a command with these settings takes little time."""
        pairs = [line[i + 1].partition("=") for i, word in enumerate(line) if word == "--set"]
        try:
            given = {path: parse_value(text, path) for path, _, text in pairs}
            return self._affordable(load_config(draws.nested(scene.flat), given))
        except Refused:
            return True


def invoke(*line: str) -> None:
    """Run the command line, which ends as it says, and in lines that help where it refuses."""
    result = CliRunner().invoke(main, line)
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    lines = result.stderr.splitlines()
    helps = lines and (lines[0].startswith("Usage: ") or all(": " in line and len(line) < 1500 for line in lines))
    if result.exit_code not in (0, 2, 3) or (result.exit_code == 2 and (result.stdout or not helps)):
        raise Violation(f"{line}: {result.exit_code} {result.stdout!r:.300} {result.stderr!r:.600}")
