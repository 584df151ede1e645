"""The commands that help to write a configuration: `body`, `examples` and `parameters`."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import click

from sweep.cli import options
from sweep.cli.faults import refuse, say
from sweep.cli.options import PATH
from sweep.faults import brief, suggestion
from sweep.parameters import PARAMETERS, Parameter

_MEASURED = ("mass", "density", "length", "width", "height", "radius_long", "radius_short", "a", "b", "c", "angle")
"""The parameters of solids that can be measured."""


def _measured(command: Callable[..., None]) -> Callable[..., None]:
    """Add an option for each quantity that can be measured."""
    for name in reversed(_MEASURED):
        words = f"{PARAMETERS[name].long_name.capitalize()}."
        command = click.option(f"--{name.replace('_', '-')}", metavar="NUMBER[+-ERROR]UNIT", help=words)(command)
    return command


@click.command()
@_measured
@click.option("--whole", is_flag=True, help="Use a whole ellipsoid instead of its lower half.")
@click.option("--stl", type=PATH, help="STL file of the shape, in millimetres, z pointing up as it stands on a table.")
def body(whole: bool, stl: Path | None, **texts: str | None) -> None:
    """Print a configuration of a body with measured sizes.

    The body is a homogeneous solid, by default the lower half of an ellipsoid. Lengths may be in m, cm, mm, in or ft.
    Give the mass or the density, and for each direction a size, a radius of curvature or a semi-axis. If you give two,
    the size describes the solid and the other describes the surface. With --stl, give only the mass or the density.

    A size such as 36mm without an error is uncertain by half its last digit; write 36+-0mm if it is exact.
    """
    if stl and whole:
        refuse("--whole", "cannot be combined with --stl; leave out one of the two")
    from sweep.config import load_config
    from sweep.config.cross_checks import unfit
    from sweep.config.document import parse_value
    from sweep.config.measured import guesses, of_shape, of_solid

    given = {name: text for name, text in texts.items() if text is not None}
    text = of_shape(stl, given) if stl else of_solid(" ellipsoid" if whole else " half_ellipsoid", given)
    scene = {"friction": {"mu": 0}, "start": {"n0": 0, "x0": 0, "y0": 0}, **parse_value(text, "body")}
    at_medians = load_config(scene).at_medians
    if reason := unfit(at_medians):
        refuse("body", reason)
    click.echo(text + guesses(at_medians.grid.columns()), nl=False)


@click.command()
@click.argument("name", required=False)
@click.option("--output", type=PATH, default=".", help="Folder to copy the example to [default: the current one].")
def examples(name: str | None, output: Path) -> None:
    """List the examples of the package, or copy the example NAME.

    The model file and film of an example are copied too, if it has any. No file is overwritten.
    """
    shipped = options.examples()
    if name is None:
        width = max(map(len, shipped))
        for stem, path in shipped.items():
            first = path.read_text(encoding="utf-8").splitlines()[0]
            say(f"{stem:{width}}  {first.removeprefix('# ')}")
        return
    if name not in shipped:
        refuse(f"examples {brief(name)}", f"no such example{suggestion(name, shipped)}; `sweep examples` lists them")
    companions = [path for path in shipped[name].parent.glob(f"{name}*") if path.suffix != ".yaml"]
    for path in (copied := [shipped[name], *companions]):
        if (output / path.name).exists():
            refuse(str(output / path.name), "already exists; choose another folder with --output")
    output.mkdir(parents=True, exist_ok=True)
    for path in copied:
        shutil.copyfile(path, output / path.name)
        say(f"wrote {output / path.name}")


@click.command()
def parameters() -> None:
    """List the parameters of a configuration.

    Each takes a number, a list, a range such as {start: 20, stop: 200, num: 41, spacing: log}, or a distribution such
    as {normal: [60, 5]}. The list gives units, defaults and bounds.
    """
    text = click.HelpFormatter(max_width=100)
    text.write_dl([(p.path, _summary(p)) for p in PARAMETERS.values()])
    say(text.getvalue().rstrip())


def _summary(parameter: Parameter) -> str:
    default = "" if parameter.default is None else f"default {parameter.default:g}"
    return "; ".join(filter(None, [parameter.meaning, default, parameter.bounds(1e3)]))
