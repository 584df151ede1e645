"""A long option has the name of its Python argument."""

from inspect import Parameter, signature
from types import FunctionType

import click
import pytest

import sweep
from sweep.cli import main

VERBS = [verb for verb in main.commands if isinstance(getattr(sweep, verb, None), FunctionType)]
"""The commands that are functions too."""

EVERYWHERE = {
    "set": "keywords of any name in Python",
    "overrides": "--set in the shell",
    "quiet": "turns off the summary as well as the progress",
    "progress": "always shown in the shell, unless --quiet",
    "dry_run": "prints an estimate for a person",
}
ALONE = {
    "trajectory": {"output": "the function returns its dataset"},
    "fit": {"output": "the function returns its dataset"},
    "plot": {"ax": "axes of the caller", "file": "", "dataset": "the FILE of the command"},
    "explore": {
        "port": "of a server", "no_browser": "of a server", "model": "runs code", "height": "of a notebook",
        "file": "", "dataset": "the FILE of the command",
    },
}  # fmt: skip
"""The only names that one of both has alone, and why, in all verbs and in some."""


def names_in_the_shell(verb: str) -> set[str]:
    """Names of arguments, and of options as Python would write them."""
    longs = [max(each.opts, key=len) for each in main.commands[verb].params]
    return {long.lstrip("-").replace("-", "_") for long in longs}


def names_in_python(verb: str) -> set[str]:
    return {*signature(getattr(sweep, verb)).parameters}


@pytest.mark.parametrize("verb", VERBS)
def test_an_option_has_the_name_of_its_argument(verb: str) -> None:
    different = names_in_the_shell(verb) ^ names_in_python(verb)
    assert different <= {*EVERYWHERE, *ALONE.get(verb, {})}


@pytest.mark.parametrize("verb", VERBS)
def test_an_option_has_the_default_of_its_argument(verb: str) -> None:
    arguments = signature(getattr(sweep, verb)).parameters
    for each in main.commands[verb].params:
        if isinstance(each, click.Option) and each.show_default and not each.required:
            assert arguments[str(each.name)].default == each.default


def test_every_exception_is_needed() -> None:
    differences = {verb: names_in_the_shell(verb) ^ names_in_python(verb) for verb in VERBS}
    assert {*EVERYWHERE} <= set.union(*differences.values())
    for verb, alone in ALONE.items():
        assert {*alone} <= differences[verb], verb


def test_cells_and_settings_are_keywords_alike() -> None:
    for verb in VERBS:
        arguments = signature(getattr(sweep, verb)).parameters
        assert ("set" in names_in_the_shell(verb)) == any(a.kind == Parameter.VAR_KEYWORD for a in arguments.values())
