"""Arguments and options that several commands share, and how their values are read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from sweep.cli.faults import refuse, say
from sweep.faults import brief, suggestion
from sweep.parameters import PARAMETERS, Parameter

if TYPE_CHECKING:
    from sweep.config import Config

PATH = click.Path(path_type=Path)


def examples() -> dict[str, Path]:
    """Return the configurations that come with the package, by name."""
    return {path.stem: path for path in sorted((Path(__file__).parents[1] / "examples").glob("*.yaml"))}


def begun(_context: click.Context, parameter: click.Parameter, typed: str) -> list[CompletionItem]:
    """Complete a key of a configuration, or the name of a parameter for `--at`."""
    from sweep.config.schema import PATHS

    known = PATHS if parameter.name == "settings" else {p.name: p.meaning for p in PARAMETERS.values()}
    return [CompletionItem(f"{key}=", help=words) for key, words in known.items() if key.startswith(typed)]


FILE = click.argument("file", type=PATH)
SETTINGS = click.option(
    "--set", "settings", multiple=True, metavar="PATH=VALUE", shell_complete=begun,
    help="Replace a value of the configuration, e.g. friction.mu=60, or friction.mu=20..60:41 for the range "
    "START..STOP:NUM (repeatable).",
)  # fmt: skip
OUTPUT = click.option("--output", type=PATH, help="Folder for the results [default: runs/NAME].")
QUIET = click.option("--quiet", is_flag=True, help="Print only errors.")


def report_folder(default: str) -> Callable[[Any], Any]:
    """Return the option `--output` of a command that writes a report."""
    return click.option("--output", type=PATH, default=default, show_default=True, help="Folder for the report.")


def configured(command: Callable[..., None]) -> Callable[..., None]:
    """Add the argument CONFIG and the option `--set` to a command, which receives the loaded configuration."""

    @wraps(command)
    def call(config: Path, settings: tuple[str, ...], **options: Any) -> None:
        command(config=loaded(config, settings), **options)

    return click.argument("config", type=PATH)(SETTINGS(call))


def loaded(config: Path, settings: tuple[str, ...]) -> Config:
    from sweep.config import load_config
    from sweep.config.document import parse_value

    if not config.exists() and config.stem in examples():
        refuse(config, f"no such file; `sweep examples {config.stem}` copies the example of that name")
    parsed = {}
    for setting in settings:
        path, equals, value = setting.partition("=")
        if not (equals and path):
            refuse(f"--set {brief(setting)}", "not a setting; write PATH=VALUE, such as friction.mu=60")
        parsed[path] = parse_value(value, f"--set {brief(path)}")
    return load_config(config, parsed, argument=lambda path: f"--set {path}", announce=announce)


announce = partial(say, err=True)
"""Print a note on stderr even with --quiet: user code never runs unannounced."""


def cells_of(texts: tuple[str, ...], known: Mapping[str, Parameter]) -> dict[str, Any]:
    """Return the values of `--at` by parameter, such as 60, "12 cm" or a range."""
    from sweep.config.document import parse_value

    given: dict[str, list[Any]] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if name not in known:
            meant = suggestion(name, known)
            refuse(f"--at {brief(text)}", f"unknown parameter{meant}; the parameters are {', '.join(known)}")
        if not (equals and value.strip()):
            refuse(f"--at {brief(text)}", "must be NAME=VALUE, such as mu=60 or a=12cm")
        given.setdefault(name, []).append(parse_value(value, f"--at {name}"))
    return {name: values[0] if len(values) == 1 else values for name, values in given.items()}


def parse_pair(text: str, option: str) -> tuple[str, float]:
    from sweep.config.document import number

    name, _, value = text.partition("=")
    if (parsed := number(value)) is None:
        refuse(f"{option} {brief(text)}", "must be NAME=NUMBER")
    return name, parsed


def parse_span(text: str, option: str) -> tuple[float, float]:
    from sweep.config.document import number

    low, dots, high = text.partition("..")
    ends = number(low), number(high)
    if not dots or ends[0] is None or ends[1] is None or not ends[0] < ends[1]:
        refuse(f"{option} {brief(text)}", "must be LOW..HIGH, two numbers, the lower one first")
    return ends[0], ends[1]
