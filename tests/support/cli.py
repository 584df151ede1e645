"""The command line, called without a process of its own."""

from pathlib import Path

from click.testing import CliRunner, Result

from sweep.cli import main


def invoke(*arguments: str | Path) -> Result:
    """What `sweep ARGUMENTS` says and its exit code."""
    return CliRunner().invoke(main, list(map(str, arguments)), catch_exceptions=False)


def refused(result: Result, *words: str) -> None:
    """It ended with exit code 2 and one line that has these words."""
    assert result.exit_code == 2, result.output
    assert all(word in result.stderr for word in words), result.stderr
    assert len(result.stderr.splitlines()) == 1, result.stderr
