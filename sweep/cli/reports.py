"""The commands that write a report: `reproduce` and `bench`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from sweep import interrupt
from sweep.cli.faults import DONE, ROWS_FAILED, Explained
from sweep.cli.options import report_folder


@click.command()
@report_folder("runs/reproduce")
def reproduce(output: Path) -> None:
    """Compare every number and figure of Takano (2011) with ours, in one HTML report.

    Exit code 0 only if every row holds, 1 otherwise.
    """
    with Explained():
        from sweep.progress import Terminal
        from sweep.reproduce import reproduce as compare

        interrupt.raise_again()
        with Terminal():
            failed = compare(output, click.echo)
        click.echo(f"\nwrote {output / 'reproduce.html'}; {len(failed)} rows do not hold")
        sys.exit(ROWS_FAILED if failed else DONE)


@click.command()
@report_folder("runs/bench")
def bench(output: Path) -> None:
    """Measure the speed and error of each method and model, and run cases that are hard to get right.

    Takes about four minutes on two cores; writes bench.html, bench.png and bench.csv.

    Exit code 1 if a hard case does not hold, else 0: speed and error are reported, not judged.
    """
    with Explained():
        from sweep.bench import bench as measure
        from sweep.progress import Terminal

        interrupt.raise_again()
        with Terminal():
            failed = measure(output, click.echo)
        click.echo(f"\nwrote {output / 'bench.html'}, .png and .csv; {len(failed)} hard cases do not hold")
        sys.exit(ROWS_FAILED if failed else DONE)
