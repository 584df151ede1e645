"""Studies too long for `sweep bench`, each a command of its own: `python -m sweep.bench.studies.NAME --help`."""
