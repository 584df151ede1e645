"""The machine runs a configuration that was drawn, does with it what users do, and asks what must hold."""

from __future__ import annotations

import json
import logging
import os
import re
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import click
import numpy as np
import pytest
import xarray as xr
from fuzzing import Violation, check_refusal, invoke, round_trip
from hypothesis import event, note
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from matplotlib.figure import Figure
from support.runs import Stop, limited, nothing_drawn, same_numbers

import sweep
from machine import draws, oracles, words
from machine.draws import Draws, Flat, Piece
from machine.meetings import Features, Meetings, features
from sweep.config import Config, InputError, load_config
from sweep.config.document import parse_value
from sweep.faults import Error
from sweep.kernels.status import IMPOSSIBLE, TIME_LIMIT
from sweep.plots.formats import SUFFIXES
from sweep.results.kind import RUN, kind, require_whole
from sweep.results.summary import contents, describe
from sweep.units import PAPER_UNITS

NUMBER = st.integers(0, 999)


def several(drawn: st.SearchStrategy[Any], number: int = 3) -> st.SearchStrategy[list[Any]]:
    """Draws of which the machine takes one."""
    return st.lists(drawn, min_size=number, max_size=number)


def asked_of(names: Iterable[str], known: Mapping[str, list[str]], most: int = 3) -> st.SearchStrategy[Asked]:
    """A command or a function, with some of its options or arguments."""
    return st.sampled_from(sorted(names)).flatmap(lambda name: st.tuples(st.just(name), draws.draws(known[name], most)))


CHANGES = st.tuples(draws.draws(draws.PHYSICAL, 5, 2), draws.draws(draws.OTHERWISE, 5, 2)).map(
    lambda two: two[0] + two[1]
)
SCENES = several(st.tuples(NUMBER, CHANGES), 4)
PICTURE = draws.draws(words.TAKEN["plot"], 4)
STUDIES = ("boundaries", "critical")
NUMERALS = re.compile(r"-?\d+(\.\d*)?(e-?\d+)?")

Asked = tuple[str, Draws]
"""A command or a function, and options or arguments of it."""


@dataclass(frozen=True)
class Scene:
    """A configuration that was accepted."""

    flat: Flat
    config: Config

    @property
    def features(self) -> Features:
        """What distinguishes it from others."""
        return features(draws.shipped()["paper"], self.flat) | {self.config.tier.name, f"{len(self.config.axes)} axes"}

    def with_(self, changes: Flat, *without: str) -> dict[str, Any]:
        """What its file would say with some keys changed, and others left out."""
        return draws.nested({path: value for path, value in self.flat.items() if path not in without} | changes)


class Logged(logging.Handler):
    """Makes a warning that a library logs a fault."""

    def emit(self, record: logging.LogRecord) -> None:
        raise Violation(f"{record.name} logs {record.getMessage()!r}")


class Machine(RuleBasedStateMachine):
    """Each example has one configuration, and each of its rules is a combination: something that is done with it."""

    pool: ClassVar[set[Piece]] = set()
    """The kernels that may be run."""
    bases: ClassVar[list[Flat]] = []
    """The configurations that are changed."""
    far: ClassVar[bool] = False
    """Whether kills, fits and animations are drawn, which take seconds."""
    client: ClassVar[Any] = None
    """The client of a dask cluster, if cells are run there too."""
    browser: ClassVar[bool] = False
    """Whether documents of the explorer are built."""
    done: ClassVar[int] = 0
    """Combinations so far."""
    meetings: ClassVar[Meetings] = Meetings()

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

    @invariant()
    def count(self) -> None:
        type(self).done += 1

    def ask(self, what: str, call: Callable[[], Any], *files: str) -> Any:
        """What `call` returns; None if it refuses in lines that help.  Anything else is a fault."""
        note(f"# {what}")
        try:
            return call()
        except Error as error:
            check_refusal(error, *files, "")
            event(f"refused: {what}")
            return None

    def _newest(self, offered: list[tuple[str, Any]]) -> Any:
        """What the configuration has met least: a command or a function, and its words, whose numbers do not count."""
        words = [{f"{verb} {NUMERALS.sub('0', word)}" for word in ("", *given)} for verb, given in offered]
        return self.meetings.newest(offered, [self.scene.features | each for each in words])

    def _new(self, name: str = "") -> Path:
        return Path(os.path.join(self.folder, f"{len(os.listdir(self.folder))}{name}"))

    def _written(self, text: str) -> Path:
        path = self._new(".yaml")
        path.write_text(text, encoding="utf-8")
        return path

    def _run(self, config: Any, *where: Any, **how: Any) -> xr.Dataset:
        with nothing_drawn():
            found = sweep.run(config, *where, **how)
        oracles.sound(config if isinstance(config, Config) else load_config(config), found)
        return found

    # ---- configurations and their runs

    @initialize(drawn=SCENES, arguments=PICTURE, at=NUMBER)
    def begin(self, drawn: list[tuple[int, Draws]], arguments: Draws, at: int) -> None:
        """Draw a configuration and run it; and what costs little is asked of each."""
        scenes = [Scene(*draws.scene(self.bases[n % len(self.bases)], changes, self.pool)) for n, changes in drawn]
        self.scene = self.meetings.newest(scenes, [each.features for each in scenes])
        self.config = self.scene.config
        varies = {*self.config.axes, *self.config.cases}
        self.varying = [name for name in self.config.tier.parameters if name in varies]
        note(f"# {json.dumps(self.scene.flat)}")
        self.found = self._run(self.config)
        self.rows, self.others = oracles.rows(self.found), [self.found]
        self._estimated(self.scene, self.found)
        self._reopened(self.found)
        describe(self.found), contents(self.found)
        self._drawn(self.found, arguments, at)

    @rule(
        base=st.sampled_from(sorted(draws.shipped())),
        changes=draws.draws([*draws.PHYSICAL, *3 * draws.OTHERWISE], 6, 2),
    )
    def estimate(self, base: str, changes: Draws) -> None:
        """Any configuration, whatever its kernel, is predicted and estimated."""
        drawn = {path: draws.setting(path, n) for path, n in changes}
        scene = Scene(*draws.accepted(draws.shipped()[base] | drawn, base))
        if scene.config.grid.size <= 5000:
            self._estimated(scene)

    def _estimated(self, scene: Scene, found: xr.Dataset | None = None) -> None:
        """It is the same when it is read again, and is predicted as it is run."""
        round_trip(scene.config, self.folder)
        invoke("run", str(self._written(draws.in_yaml(scene.flat))), "--dry-run")
        predicted = sweep.predict(scene.config)
        for name in predicted.data_vars if found is not None else ():
            xr.testing.assert_equal(predicted[name], found[name])

    # ---- the same cells elsewhere

    @rule(number=NUMBER, places=st.lists(NUMBER, min_size=1, max_size=4, unique=True))
    def as_cases(self, number: int, places: list[int]) -> None:
        """Some cells in any order have the same numbers alone and as cases, be they samples or of a grid."""
        config = self.config
        if not len(ran := np.flatnonzero(self.rows["status"] != IMPOSSIBLE)):
            return
        cells = list(dict.fromkeys(int(ran[n % len(ran)]) for n in places))
        columns = {name: self.rows[name][cells].tolist() for name in self.varying or config.tier.parameters[:1]}
        keys = {config.table[name].path: column[0] for name, column in columns.items()}
        given = {path: value for path, value in self.scene.flat.items() if path in draws.PHYSICAL and path not in keys}
        settings = {f"integrator.{key}": value for key, value in config.integrator.model_dump().items()}
        settings |= {path: draws.numbers(value)[0] for path, value in given.items()}  # several are of other models
        alone = keys if len(cells) == 1 and number % 2 else {"cases": columns}
        again = oracles.rows(self._run(self.scene.with_(settings | alone, *keys, "samples", "cases")))
        there = {name: self.rows[name][cells] for name in self.rows if name in self.found.data_vars}
        assert there.keys() <= again.keys()
        oracles.same(again, there)

    @precondition(lambda self: len(self.config.axes) > 1 and len(self.config.distributions) < 2)
    @rule()
    def transposed(self) -> None:
        """The order of the axes makes no difference."""
        self._compare(self._run(draws.nested(dict(reversed(self.scene.flat.items())))))

    @precondition(lambda self: self.config.axes)
    @rule(number=NUMBER)
    def shuffled(self, number: int) -> None:
        """Nor does the order of the values along an axis."""
        name, values = [*self.config.axes.items()][number % len(self.config.axes)]
        other = Random(number).sample(values, len(values))
        self._compare(self._run(self.scene.with_({self.config.table[name].path: other})))

    def _compare(self, again: xr.Dataset) -> None:
        """The numbers of all cells are the same, and the variables."""
        again = again.transpose(*self.found["status"].dims, ...).reindex_like(self.found)
        assert {*again.data_vars} == {*self.found.data_vars}
        oracles.same(oracles.rows(again), self.rows)

    @rule(names=st.sampled_from([oracles.MIRRORED, oracles.TURNED]))
    def mirrored(self, names: tuple[str, ...]) -> None:
        """A mirror image, or a body turned by half a turn about the vertical, ends and counts alike."""
        self._elsewhere(dict.fromkeys(names, -1.0), {})

    @precondition(lambda self: self.config.units == PAPER_UNITS)
    @rule()
    def in_si(self) -> None:
        """A body of any size, in SI, does so too."""
        old, unit = self.config.integrator, oracles.TIME
        times = {"t_end": old.t_end * unit, "stop_early": old.first_leg * unit if old.first_leg else old.stop_early}
        times |= {} if old.step == "auto" else {"step": old.step * unit}
        fixed = {"units": "SI", "gravity": oracles.LENGTH / unit**2, "body.mass": oracles.MASS}
        more = {f"integrator.{key}": value for key, value in times.items()} | fixed
        self._elsewhere(oracles.scales(self.config), more, 1 / unit)

    def _elsewhere(self, factors: dict[str, float], more: Flat, spin: float = 1.0) -> None:
        """The cells of a run as cases, with parameters multiplied, if the kernels are there."""
        columns = {name: (self.rows[name] * factors.get(name, 1.0)).tolist() for name in self.config.tier.parameters}
        keys = (self.config.table[name].path for name in columns)
        document = self.scene.with_({"cases": columns} | more, *keys, "samples", "cases", "picture")
        for method, _, specs in [("", "", ()), *sorted(self.pool)]:  # its own if it can be
            integrator = document.get("integrator", {}) | {"method": method}
            own = {"measure": draws.written(specs), "integrator": integrator} if method else {}
            if self._allowed(document | own):
                again = self._run(document | own)
                oracles.alike(oracles.rows(self.found), oracles.rows(again), spin)
                return

    def _allowed(self, document: Any) -> bool:
        """Whether a configuration is accepted and takes little time."""
        with suppress(Error):
            return draws.affordable(load_config(document), self.pool)
        return False

    @rule(factor=st.sampled_from([1.5, 4.0]))
    def longer(self, factor: float) -> None:
        """What ended before t_end ends alike if t_end is later."""
        later = self._run(self.scene.with_({"integrator.t_end": self.config.integrator.t_end * factor}))
        ended = self.rows["status"] != TIME_LIMIT
        oracles.alike(*(oracles.rows(each, ended) for each in (self.found, later)))

    @rule(place=NUMBER, every=st.sampled_from([None, 5.0]))
    def follow(self, place: int, every: float | None) -> None:
        """A cell that is followed in time ends and counts alike."""
        config, cell = self.config, [place % len(self.rows["status"])]
        values = {name: float(self.rows[name][cell[0]]) for name in self.varying}
        scene = self.scene.with_({}, "cases", "samples")
        if self.rows["status"][cell[0]] == IMPOSSIBLE:
            with pytest.raises(InputError):
                sweep.trajectory(scene, at=values)
        else:
            followed = self.ask("follow", lambda: sweep.trajectory(scene, at=values, stop_early=True, every=every))
            if followed is not None and config.integrator.settles:
                oracles.alike(oracles.rows(followed), oracles.rows(self.found, cell))

    @rule(given=draws.draws(range(20), 6, 1), number=NUMBER)
    def overridden(self, given: Draws, number: int) -> None:
        """What a file, the command line and Python each say a part of is run as if it stood in one file."""
        paths = sorted({[*self.scene.flat][k % len(self.scene.flat)] for k, _ in given} - {"cases"})
        file, folder = self._written(json.dumps(self.scene.with_({}, *paths))), self._new()
        config = load_config(file, {path: self.scene.flat[path] for path in paths})
        if [*config.distributions] != [*self.config.distributions]:  # samples depend on the order of their parameters
            return
        if number % 2:
            settings = [f"--set={path}={json.dumps(self.scene.flat[path])}" for path in paths]
            with nothing_drawn():
                invoke("run", str(file), *settings, f"--output={folder}", "--quiet")
            found = sweep.open_dataset(next(folder.glob("*.nc")))
        else:
            found = self._run(config)
        self._compare(found)

    @precondition(lambda self: self.client is not None)
    @rule()
    def on_a_cluster(self) -> None:
        """The workers of a cluster come to the same numbers."""
        same_numbers(self._run(self.config, client=self.client), self.found)

    # ---- over the files of an earlier run

    @rule(number=NUMBER, ways=st.sets(st.sampled_from(["t_end", "axis", "samples", "measure", "name"]), min_size=1))
    def grow(self, number: int, ways: set[str]) -> None:
        """A run over the dataset of a smaller one, or of a shorter one, is that of all cells at once."""
        random, integrator, folder = Random(number), self.config.integrator, self._new()
        larger: Flat = {
            "name": "x", "integrator.t_end": integrator.t_end, "integrator.stop_early": integrator.stop_early
        }  # fmt: skip
        smaller = dict(larger)
        if "t_end" in ways:
            smaller["integrator.t_end"] = integrator.t_end / random.choice((1.3, 2, 10))
        if "samples" in ways and self.config.samples:
            smaller["samples"], larger["samples"] = random.choice((1, 2, 3)), 4
        if "measure" in ways and not self.config.picture:  # a picture may need what is left out
            first = [each for each in self.config.document()["measure"] if each in ("reversals", "margin")][:1]
            if self._allowed(self.scene.with_({"measure": first})):
                smaller["measure"] = first
        if "axis" in ways and self.config.axes:  # some values, then all of them and one more, in any order
            name, known = random.choice([*self.config.axes.items()])
            values = [*random.sample(known, len(known)), float(np.mean(known)) * 1.001 or 1e-6]
            path = self.config.table[name].path
            smaller[path] = values[random.randrange(len(values)) :]
            larger[path] = random.sample(values, len(values))
        if all(self._allowed(self.scene.with_(changes)) for changes in (smaller, larger)):
            self._run(self.scene.with_(smaller), folder)
            found = self._run(self.scene.with_(larger), folder)
            same_numbers(found, self._run(self.scene.with_(larger)))
            self.others.append(found)

    @rule(drawn=several(asked_of(["run", "run", *STUDIES], words.TAKEN, 2)), chunks=st.integers(0, 3))
    def interrupted(self, drawn: list[Asked], chunks: int) -> None:
        """What was interrupted goes on to the same numbers, which are in the file that is written."""
        offered = [(verb, words.arguments(verb, given) if verb != "run" else {}) for verb, given in drawn]
        verb, taken = self._newest(offered)
        taken = {"bracket": 0.2} | taken if verb in ("boundaries", "critical") else taken
        taken.pop("fresh", None)
        call, folder = getattr(sweep, verb), self._new()
        whole = self.ask(verb, lambda: call(self.config, **taken))
        if whole is None:
            return
        with limited(chunk_blocks=200), nothing_drawn():
            for sitting in range(2 + chunks):
                with suppress(KeyboardInterrupt):
                    call(self.config, folder, progress=Stop(chunks + sitting), **taken)
            same_numbers(call(self.config, folder, **taken), whole)
        self.others.append(whole)
        if verb == "boundaries" and whole.sizes["point"]:
            self._recounted(whole.isel(point=slice(None, None, -(-whole.sizes["point"] // 20))))
        elif verb == "critical" and whole.dims:
            dim = str(next(iter(whole.dims)))
            columns = self.config.grid.columns()
            last = self.config.axes.get(dim, (np.nan,))[-1]
            there = (columns.get(dim) == last) & ~self.config.tier.impossible(columns)
            if there.any():  # a body that cannot be is refused alone
                at = {dim: last}
                one, other = whole.sel(at), sweep.critical(self.config, **taken, **at)
                for name in (name for name in one.data_vars if name.endswith("reason")):
                    np.testing.assert_array_equal(one[name].values, other[name].values.reshape(one[name].shape), name)

    def _recounted(self, points: xr.Dataset) -> None:
        """Both ends of brackets of boundaries count as the search says, where a run is certain of it."""
        for end in ("fewer", "more"):
            columns = {name: points[name].values.copy() for name in self.config.axes}
            for i, along in enumerate(points["bracket"].values):
                columns[along][i] = points[f"end_{end}"].values[i]
            cases = {name: column.tolist() for name, column in columns.items()}
            keys = (self.config.table[name].path for name in columns)
            again = oracles.rows(self._run(self.scene.with_({"cases": cases}, *keys, "picture")))
            if "reversals" not in again:  # the search alone counts
                return
            known = again["certain"] == 1 if "certain" in again else np.zeros(len(again["status"]), bool)
            np.testing.assert_array_equal(again["reversals"][known], points[f"reversals_{end}"].values[known])

    @precondition(lambda self: self.far)
    @rule(after=st.floats(0.3, 3.0))
    def killed(self, after: float) -> None:
        """So does what was killed."""
        file, folder = self._written(draws.in_yaml(self.scene.flat)), self._new()
        words = [sys.executable, "-m", "sweep", "run", str(file), "--output", str(folder), "--quiet"]
        process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(after)
        process.kill()
        process.wait()
        same_numbers(self._run(load_config(file), folder), self._run(load_config(file)))

    # ---- what is done with datasets

    @rule(which=NUMBER, ways=st.lists(st.sampled_from(sorted(words.CUTS)), min_size=1, max_size=2), number=NUMBER)
    def cut(self, which: int, ways: list[str], number: int) -> None:
        """What xarray makes of a dataset can be described, saved and drawn, or is refused."""
        cut, random = self.others[which % len(self.others)], Random(number)
        for way in ways:
            if cut.dims and cut.data_vars and all(cut.sizes.values()):
                with warnings.catch_warnings(action="ignore"):  # xarray's own
                    cut = words.CUTS[way](cut, random.choice(sorted(map(str, cut.dims))), random)
        if kind(cut):
            self.ask("describe", lambda: (describe(require_whole(cut)), contents(cut)))
            figure = self.ask("plot", lambda: sweep.plot(cut))
            figure and figure.draw_without_rendering()
            self._reopened(cut)
            self.others.append(cut)

    def _saved(self, dataset: xr.Dataset, file: Path) -> bool:
        """Whether xarray can save a dataset: not one that is or was stacked, or that is from a file and empty."""
        try:
            dataset.to_netcdf(file)
        except (ValueError, NotImplementedError, RuntimeError):
            return False
        except TypeError:
            values = (each for v in dataset.variables.values() if v.dtype == object for each in v.values.flat)
            assert any(isinstance(each, tuple) for each in values)  # it was stacked
            return False
        return True

    def _reopened(self, dataset: xr.Dataset) -> xr.Dataset | None:
        """A dataset that is saved is the same when it is opened."""
        file = self._new(".nc")
        again = self.ask("open", lambda: sweep.open_dataset(file), str(file)) if self._saved(dataset, file) else None
        if again is not None:
            xr.testing.assert_identical(again.drop_attrs(deep=False), dataset.drop_attrs(deep=False))
        return again

    @rule(which=NUMBER, arguments=PICTURE, at=NUMBER, form=st.sampled_from(["", *SUFFIXES]))
    def plot(self, which: int, arguments: Draws, at: int, form: str) -> None:
        """A picture shows what the dataset has there, in any format, and however the dataset is ordered."""
        self._drawn(self.others[which % len(self.others)], arguments, at, form)

    def _drawn(self, dataset: xr.Dataset, arguments: Draws, at: int, form: str = "") -> None:
        given, cut = words.arguments("plot", arguments), dataset
        dims = [dim for dim in dataset.dims if dim in dataset.coords and dim != "count" and dataset.sizes[dim]]
        numbers = [dim for dim in dims if dataset[dim].dtype.kind in "if"]
        known = [*dataset.data_vars, *words.DERIVED]
        given |= {"variable": str(known[at % len(known)])} if "variable" in given and at % 4 else {}
        given |= {name: str(dims[at % len(dims) - i]) for i, name in enumerate("xy") if name in given and dims}
        if "at" in given and numbers and at % 8:
            dim = numbers[at % len(numbers)]
            given["at"] = {str(dim): float(dataset[dim][at % dataset.sizes[dim]])}
            cut = dataset.isel({dim: at % dataset.sizes[dim]})
        how = given | ({"output": self._new(f".{form}")} if form else {})
        figure = self.ask("plot", lambda: dataset.sweep.plot(**how))
        if isinstance(figure, Figure):
            figure.draw_without_rendering()
            if kind(dataset) == RUN and ("at" not in given or cut is not dataset):
                oracles.shown(cut, figure)
            if dims and {*dataset.indexes} - {"count"} == {*dims}:
                turned = dataset.isel({dims[at % len(dims)]: slice(None, None, -1)}).sweep.plot(**given)
                assert oracles.content(turned) == oracles.content(figure), "another picture backwards"

    @precondition(lambda self: self.browser)
    @rule(which=NUMBER, addressed=draws.draws(["show", "x", "y", "low", "high", "n0", "with"], 5))
    def explore(self, which: int, addressed: Draws) -> None:
        """The document of the explorer, at any address."""
        from bokeh.document import Document

        from sweep.explorer.setup import usable
        from sweep.explorer.slices import Source
        from sweep.explorer.view import View

        dataset = self.others[which % len(self.others)]
        texts = [*map(str, dataset.data_vars), *map(str, dataset.dims), "1", "1e7", "x", "a:12,mu:70"]
        query = {key: [texts[n % len(texts)]] for key, n in addressed}
        document = Document()
        source = self.ask("open", lambda: Source(dataset))
        if source:
            View(document, source, usable(source), None, query)
            document.validate()

    @rule(drawn=several(asked_of(words.CALLED, words.TAKEN)))
    def call(self, drawn: list[Asked]) -> None:
        """A function that takes a configuration, with any of its arguments."""
        name, taken = self._newest([(name, words.arguments(name, given)) for name, given in drawn])
        if name in words.SLOW and not self.far:
            return
        taken |= {"film": self._film(), "free": ["mu"]} if name == "fit" else {}
        taken |= {"output": self._new(".gif")} if name == "animate" else {}
        found = self.ask(name, lambda: getattr(sweep, name)(self.config, **taken), str(self.folder / "film.csv"))
        if isinstance(found, xr.Dataset):
            self.others.append(found)
        if name == "trajectory" and found is not None and not taken.get("samples"):
            for each, known in self.config.distributions.items():
                np.testing.assert_array_equal(found[each], known.median, each)

    def _film(self) -> Path:
        file = self.folder / "film.csv"
        times = np.linspace(0, 60, 20)
        rows = "".join(f"{t:.3f},{0.05 * np.exp(-t / 100):.5f}\n" for t in times)
        file.write_text("time,spin\n" + rows, encoding="utf-8")
        return file

    # ---- the command line

    @rule(which=NUMBER, drawn=several(asked_of(words.VERBS, words.OPTIONS)))
    def command(self, which: int, drawn: list[Asked]) -> None:
        """A command with any of its options."""
        offered = [(verb, [w for name, n in given for w in words.option(verb, name, n)]) for verb, given in drawn]
        verb, line = self._newest(offered)
        asked = words.VERBS[verb].params
        known = {each.name for each in asked}
        if "config" in known and not self._carried_out(line):
            line.append("--dry-run")
        if (verb in words.SLOW and not self.far) or ("--dry-run" in line and "dry_run" not in known):
            return
        file = self._new(".nc")
        if "file" in known and not self._saved(self.others[which % len(self.others)], file):
            return
        config = self._written(draws.in_yaml(self.scene.flat))
        files = {"config": config, "film": self._film(), "source": config, "file": file, "name": "quick"}
        first = [str(files[each.name]) for each in asked if isinstance(each, click.Argument)]
        if "output" in known:
            line += ["--output", str(self._new({"animate": ".gif", "plot": ".png"}.get(verb, "")))]
        self.ask(f"sweep {verb}", lambda: invoke(verb, *first, *line))

    def _carried_out(self, line: list[str]) -> bool:
        """Whether a command with these settings takes little time."""
        pairs = [line[i + 1].partition("=") for i, word in enumerate(line) if word == "--set"]
        try:
            given = {path: parse_value(text, path) for path, _, text in pairs}
            return draws.affordable(load_config(self.scene.with_({}), given), self.pool)
        except Error:
            return True
