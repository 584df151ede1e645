"""Arguments and options that several commands share, and how their values are read."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from sweep.cli.faults import refuse, say
from sweep.faults import brief, local_path
from sweep.parameters import PARAMETERS

if TYPE_CHECKING:
    from sweep.config import Config


class _Local(click.Path):
    """A path of this machine."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ARG002
        return local_path(value)


PATH = _Local()


def examples() -> dict[str, Path]:
    """Return the configurations that come with the package, by name."""
    return {path.stem: path for path in sorted((Path(__file__).parents[1] / "examples").glob("*.yaml"))}


def begun(_context: click.Context, parameter: click.Parameter, typed: str) -> list[CompletionItem]:
    """Complete a key of a configuration, or the name of a parameter for `--at`."""
    from sweep.config.schema import PATHS

    known = PATHS if parameter.name == "settings" else {p.name: p.meaning for p in PARAMETERS.values()}
    return [CompletionItem(f"{key}=", help=words) for key, words in known.items() if key.startswith(typed)]


def _values(_context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]) -> dict[str, Any]:
    """Return the values of a repeatable option by name, such as 60, "12 cm" or a range; of a repeated name all."""
    from sweep.config.document import parse_value

    option, given = parameter.opts[0], dict[str, list[Any]]()
    for text in texts:
        name, equals, value = text.partition("=")
        if not (name and equals and value.strip()):
            refuse(f"{option} {brief(text)}", "must be NAME=VALUE, such as mu=60 or a=12cm")
        given.setdefault(name, []).append(parse_value(value, f"{option} {brief(name)}"))
    return {name: values[0] if len(values) == 1 else values for name, values in given.items()}


def named_values(option: str, argument: str, words: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a repeatable option that takes NAME=VALUE, as a mapping."""
    return click.option(
        option, argument, multiple=True, metavar="NAME=VALUE", shell_complete=begun, callback=_values,
        help=f"{words} (repeatable).",
    )  # fmt: skip


FILE = click.argument("file", type=PATH)
SETTINGS = named_values(
    "--set", "settings",
    "Replace a value of the configuration, e.g. t_end=1000, or mu=20..60:41 for the range START..STOP:NUM",
)  # fmt: skip
AT = named_values("--at", "at", "Choose the cells to follow, e.g. mu=60")
OUTPUT = click.option("--output", type=PATH, help="Folder for the results [default: runs/NAME].")
QUIET = click.option("--quiet", is_flag=True, help="Print only errors.")


def report_folder(default: str) -> Callable[[Any], Any]:
    """Return the option `--output` of a command that writes a report."""
    return click.option("--output", type=PATH, default=default, show_default=True, help="Folder for the report.")


def configured(command: Callable[..., None]) -> Callable[..., None]:
    """Add the argument CONFIG and the option `--set` to a command, which receives the loaded configuration."""

    @wraps(command)
    def call(config: Path, settings: dict[str, Any], **options: Any) -> None:
        command(config=loaded(config, settings), **options)

    return click.argument("config", type=PATH)(SETTINGS(call))


def loaded(config: Path, settings: dict[str, Any]) -> Config:
    from sweep.config import load_config

    if not config.exists() and config.stem in examples():
        refuse(config, f"no such file; `sweep examples {config.stem}` copies the example of that name")
    return load_config(config, settings, argument=lambda path: f"--set {path}", announce=announce)


announce = partial(say, err=True)
"""Print a note on stderr even with --quiet: user code never runs unannounced."""
