"""Whole commands in processes forked from one that has everything imported and the kernel loaded.

A fork server imports `warm` once; a command then starts within milliseconds, so that hundreds can be
killed in a minute.  They are processes of their own, with all the files, locks and signals of one.
"""

import ctypes
import faulthandler
import multiprocessing
import os
import sys
from multiprocessing import forkserver
from pathlib import Path
from typing import Any
from unittest.mock import patch

from numba.np.ufunc import parallel

from sweep.cli import main
from sweep.engine import executor, local
from sweep.engine import run as engine_run

TILE = 3
"""Cells a tile; of twelve cells there are then six tiles in two groups."""


def context() -> Any:
    """Where to start processes with `command`."""
    started = multiprocessing.get_context("forkserver")
    started.set_forkserver_preload(["support.warm"])
    # Of numba's ways to share out work this one starts new threads after a fork.
    with patch.dict(os.environ, NUMBA_THREADING_LAYER="workqueue", PYTHONPATH=os.pathsep.join(sys.path)):
        forkserver.ensure_running()
    return started


def start(arguments: list[str], log: Path, **settings: Any) -> Any:
    """A process of `command`, which knows its `log`."""
    process = context().Process(target=command, args=(arguments, log), kwargs=settings)
    process.start()
    process.log = log
    return process


def command(
    arguments: list[str],
    log: Path,
    *,
    unprivileged: bool = False,
) -> None:
    """Run `sweep ARGUMENTS`, its output in `log`, with many tiles, groups and checkpoints.

    Parameters
    ----------
    unprivileged : bound by the permissions of files even as root
    """
    # The lock around numba's threads is the fork server's, and whoever is killed while it has it would stop all others.
    # One of this method also ends with its process.
    multiprocessing.set_start_method("fork", force=True)
    parallel._set_init_process_lock()
    with log.open("wb") as stream:
        os.dup2(stream.fileno(), 1)
        os.dup2(stream.fileno(), 2)
    faulthandler.enable()
    executor.CHUNK_SECONDS = 0.004
    engine_run.tile_size = lambda cells: TILE  # noqa: ARG005
    local.BATCH = 2 * TILE
    if unprivileged:
        _drop_capabilities()
    main(arguments)


def _drop_capabilities() -> None:
    header = (ctypes.c_uint32 * 2)(0x20080522, 0)
    if ctypes.CDLL(None, use_errno=True).capset(header, (ctypes.c_uint32 * 6)()):
        raise OSError(ctypes.get_errno(), "capset")
