"""The commands that show a dataset: `plot`, `info` and `explore`."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

import click

from sweep import interrupt
from sweep.cli.faults import DONE, refuse, say
from sweep.cli.options import FILE, PATH, announce, named_values
from sweep.plots import formats


@click.command()
@FILE
@click.option("--variable", help="Variable to draw [default: the first picture named in the configuration, or "
              "else the reversals, next to their prediction].")  # fmt: skip
@click.option("--x", help="Parameter along the horizontal axis.")
@click.option("--y", help="Parameter along the vertical axis.")
@named_values("--at", "at", "Draw only the cells nearest to this value of an axis, e.g. n0=0.05")
@click.option("--vmin", type=float, help="Lowest value of the colour scale [default: that of the cells drawn].")
@click.option("--vmax", type=float, help="Highest value of the colour scale [default: that of the cells drawn].")
@click.option("--cmap", metavar="NAME", help="A matplotlib colour map, such as viridis.")
@click.option("--width", metavar="LENGTH",
              help="Width of a figure for print, such as 85mm, with text of 6 points or more.")  # fmt: skip
@click.option("--title", help='Title of the figure, "" for none [default: that of the dataset].')
@click.option("--output", type=PATH, help=f"Picture to write; its suffix names the format: {formats.A_PICTURE} "
              "[default: a PNG beside FILE, named after FILE and the options].")  # fmt: skip
def plot(
    file: Path, variable: str | None, at: dict[str, Any], title: str | None, output: Path | None, **how: Any
) -> None:
    """Draw maps, curves, trajectories, critical spins or boundaries."""
    from sweep.plots import panels, picture
    from sweep.results.kind import opened

    interrupt.raise_again()
    # The picture drawn without options belongs to the run; any other gets its own name.
    options = {name: value for name, value in {**at, **how, "title": title}.items() if value is not None}
    parts = [f"{name}={f'{value:g}' if isinstance(value, float) else value}" for name, value in options.items()]
    target = output or file.with_name(f"{'_'.join(filter(None, [file.stem, variable, *parts]))}.png".replace("/", "-"))
    dataset = opened(file)
    picture.plot(dataset, variable, at=at, title=title, output=target, **how)
    for name, i in panels.nearest(dataset, at).items():
        taken = float(dataset[name][i])
        say(f"{name} = {taken:g}" + (f", nearest to {at[name]:g}" if taken != at[name] else ""))
    say(f"wrote {target}")


@click.command()
@FILE
@click.option("--all", "whole", is_flag=True, help="Add meanings, units, all attributes and the configuration.")
def info(file: Path, whole: bool) -> None:
    """Summarise the results, accuracy and contents of a dataset."""
    from sweep.results.kind import opened
    from sweep.results.summary import contents, describe, overview

    dataset = opened(file)
    lines = [str(dataset.attrs.get("title", file.name)), describe(dataset), overview(dataset)]
    say("\n".join([*lines, contents(dataset)] if whole else lines))


@click.command()
@FILE
@click.option("--port", type=click.IntRange(1, 65535), help="Port of the page [default: the first free one from 5006].")
@click.option("--no-browser", is_flag=True, help="Print the address without opening a browser.")
@click.option("--model", help="Python file of the user-defined model of the dataset; its code is run.")
def explore(file: Path, port: int | None, no_browser: bool, model: str | None) -> None:
    """Explore the maps of a dataset in the browser.

    Click a cell to run its trajectory. The page can be opened only on this machine; press Ctrl-C to stop.
    """
    try:
        from sweep.explorer.server import serve
    except ModuleNotFoundError as error:
        if error.name not in ("bokeh", "tornado"):
            raise
        refuse("explore", "needs Bokeh, which is not installed: pip install 'rattleback-sweep[explore]'")
    from sweep.explorer.setup import Setup, usable
    from sweep.explorer.slices import open_source

    source = open_source(file)
    setup = Setup(source, model, announce) if model else usable(source)
    serve(source, setup, port, browser=not no_browser, say=say)
    say("stopped")
    sys.stdout.flush()
    os._exit(DONE)  # A running trajectory cannot be interrupted, and stopping loses nothing
