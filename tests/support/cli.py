"""The command line, called without a process of its own."""

from pathlib import Path

from click.testing import CliRunner, Result

from sweep.cli import main


def invoke(*arguments: str | Path) -> Result:
    """What `sweep ARGUMENTS` says and its exit code."""
    return CliRunner().invoke(main, list(map(str, arguments)), catch_exceptions=False)


def refused(result: Result, *words: str) -> None:
    """It ended with exit code 2 and one line that has these words."""
    one_line(result.exit_code, result.stderr, *words)


def one_line(code: int, said: str, *words: str) -> None:
    """The same of a command by its exit code and what it said."""
    assert code == 2, said
    assert [word for word in words if word not in said] == [], said
    assert len(said.splitlines()) == 1, said
