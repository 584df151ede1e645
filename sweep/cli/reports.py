"""The commands that write a report: `reproduce` and `bench`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sized
from pathlib import Path
from typing import NoReturn

import click

from sweep.cli.faults import DONE, ROWS_FAILED, say
from sweep.cli.options import report_folder


@click.command()
@report_folder("runs/reproduce")
def reproduce(output: Path) -> None:
    """Recompute the numbers and figures of Takano (2011).

    Writes one HTML report, which compares them with the paper. The exit code is 0 if every row agrees, 1 otherwise.
    """
    from sweep.reproduce import reproduce as compare

    _write(compare, output, "reproduce.html", "rows")


@click.command()
@report_folder("runs/bench")
def bench(output: Path) -> None:
    """Measure speed against error, and run hard cases.

    Covers every method and model. Takes about two minutes on two cores; writes bench.html, bench.png and bench.csv. The
    exit code is 0 if all hard cases pass, 1 otherwise; speed and error are reported but not judged.
    """
    from sweep.bench import bench as measure

    _write(measure, output, "bench.html, .png and .csv", "hard cases")


def _write(report: Callable[[Path, Callable[[str], None]], Sized], output: Path, files: str, rows: str) -> NoReturn:
    """Write a report, whose `files` go to the folder `output`, and exit with an error unless all of its `rows` hold."""
    from sweep.progress import Terminal
    from sweep.results.writing import require_writable

    require_writable(output / files.partition(",")[0])
    with Terminal():
        failed = report(output, click.echo)
    say(f"\nwrote {output / files}; failed {rows}: {len(failed) or 'none'}")
    sys.exit(ROWS_FAILED if failed else DONE)
