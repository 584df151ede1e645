"""Whole commands in processes forked from one that has everything imported and the kernel loaded.

A fork server imports `warm` once; a command then starts within milliseconds, so that hundreds can be
killed in a minute.  They are processes of their own, with all the files, locks and signals of one.
"""

import ctypes
import faulthandler
import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from multiprocessing import forkserver
from pathlib import Path
from typing import Any
from unittest.mock import patch

from numba.np.ufunc import parallel

from support.same import contents
from sweep.cli import main
from sweep.engine import limits

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


@dataclass
class Runs(AbstractContextManager["Runs"]):
    """The command `VERB CONFIG --output OUT`, again and again; at the end of the context, no process of it is left."""

    verb: str
    config: Path
    out: Path
    started: list[Any] = field(default_factory=list)

    def start(self, *arguments: str, **settings: Any) -> Any:
        """A process that runs it, which knows the `log` of what it says."""
        asked = [self.verb, str(self.config), "--output", str(self.out), *arguments]
        log = self.out.parent / f"{self.out.name}.log{len(self.started)}"
        process = context().Process(target=command, args=(asked, log), kwargs=settings)
        process.start()
        process.log = log
        self.started.append(process)
        return process

    def finish(self, *arguments: str, **settings: Any) -> tuple[int, str]:
        """Exit code and output of a process that runs it."""
        process = self.start(*arguments, **settings)
        process.join(120)
        return process.exitcode, process.log.read_text(encoding="utf-8")

    def complete(self, **settings: Any) -> dict[str, bytes]:
        """The files after a process that succeeds."""
        code, said = self.finish(**settings)
        assert code == 0, said
        return contents(self.out)

    def strike(self, now: Callable[[], bool], with_signal: int, *arguments: str, delay: float = 0.0) -> Any:
        """Start a process and send the signal so long after the moment `now`; None where it ended before that came."""
        process = self.start(*arguments)
        while not now():
            if not process.is_alive():
                return None
            time.sleep(2e-4)
        time.sleep(delay)
        os.kill(process.pid, with_signal)
        process.join(60)
        if process.is_alive():
            os.kill(process.pid, signal.SIGABRT)  # to have its stacks in the log
            process.join(60)
        return process

    def __exit__(self, *_: object) -> None:
        for process in self.started:
            process.kill()
            process.join()
            process.close()


def command(arguments: list[str], log: Path, *, unprivileged: bool = False) -> None:
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
    limits.LIMITS = limits.Limits(chunk_seconds=0.004, tile=TILE, batch=2 * TILE)
    if unprivileged:
        _drop_capabilities()
    main(arguments)


def _drop_capabilities() -> None:
    header = (ctypes.c_uint32 * 2)(0x20080522, 0)
    if ctypes.CDLL(None, use_errno=True).capset(header, (ctypes.c_uint32 * 6)()):
        raise OSError(ctypes.get_errno(), "capset")
