"""Defines the command line: `python -m sweep VERB`.

Each command imports what it needs when it runs, so that `--help` and errors in the command line appear at once.
"""

from __future__ import annotations

import click

from sweep.cli import environment
from sweep.cli.configurations import body, examples, parameters
from sweep.cli.faults import Commands
from sweep.cli.reports import bench, reproduce
from sweep.cli.results import explore, info, plot
from sweep.cli.runs import animate, boundaries, critical, fit, run, trajectory


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="rattleback-sweep", prog_name="sweep")
def main() -> None:
    """Run parameter sweeps of the reversals of a rattleback.

    CONFIG is a YAML file; FILE is a dataset that a command wrote.

    Exit codes: 0 done; 1 a check of `reproduce` or `bench` failed; 2 a configuration or file is wrong; 3 more cells
    failed than the configuration allows; 130 interrupted (the same command without --fresh resumes the run); 141 the
    program reading the output closed the pipe.
    """
    environment.check()


for _command in (
    examples, parameters, body, run, trajectory, animate, boundaries, critical, fit, reproduce, bench, plot,
    info, explore,
):  # fmt: skip
    main.add_command(_command)
