"""What an import does: `dataset.sweep` in any order and from several threads, and the systems on which sweep runs."""

import subprocess
import sys

import pytest

THREADS = """
import threading

at_once = threading.Barrier(6)

def load(name):
    at_once.wait()
    __import__(name)

both = [threading.Thread(target=load, args=(name,)) for name in ("sweep", "xarray") * 3]
for each in both: each.start()
for each in both: each.join()
import xarray
"""


def run(program: str) -> subprocess.CompletedProcess[str]:
    """A program in a process of its own, with warnings as errors."""
    return subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    "imports",
    [
        "import xarray, sweep",
        "import sweep, xarray",
        "import sweep; from xarray import Dataset; import xarray",
        THREADS,
    ],
    ids=["after xarray", "before xarray", "before a part of it", "threads"],
)
def test_datasets_have_the_accessor(imports: str) -> None:
    """Registered once: xarray warns of a second time."""
    result = run(f"{imports}\nprint(xarray.Dataset().sweep.plot.__name__)")
    assert (result.stdout, result.stderr) == ("plot\n", "")


def test_windows_is_pointed_to_wsl() -> None:
    result = run("import sys; sys.platform = 'win32'; sys.modules['fcntl'] = None; import sweep")
    last = result.stderr.splitlines()[-1]
    assert last.startswith("ImportError: sweep runs on Linux and macOS; on Windows, install it in WSL")
