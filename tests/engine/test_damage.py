"""What a run does with a checkpoint or dataset that is damaged, foreign or of another configuration or version.

Damaged tiles and rows are computed again, and the files come out as of an undisturbed run, byte for byte.
What would mix other numbers in is refused.  Real processes that are killed are in `test_faults`.
"""

import os
import shutil
from collections.abc import Callable, Iterator
from importlib import metadata
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result
from support import SMALL, Write
from support.cli import invoke, refused
from support.runs import Heard, interrupt, limited, nothing_drawn
from support.same import contents

import sweep
from sweep.faults import FileError
from sweep.results import provenance
from sweep.results.checkpoint import Checkpoint
from sweep.results.provenance import Identity
from sweep.sources import versions

TILE = 3
"""Cells a tile at the most; of twelve cells there are then six tiles in two groups."""


@pytest.fixture(scope="module", autouse=True)
def _many_tiles() -> Iterator[None]:
    with limited(tile=TILE, batch=2 * TILE), nothing_drawn():  # `test_faults` has pictures
        yield


@pytest.fixture(scope="module")
def config(kept: Write) -> Path:
    return kept(SMALL)


@pytest.fixture(scope="module")
def undisturbed(config: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    out = tmp_path_factory.mktemp("undisturbed")
    sweep.run(config, out)
    return contents(out)


@pytest.fixture(scope="module")
def half(config: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What an interrupted run leaves: three finished tiles, rows of the three others."""
    out = tmp_path_factory.mktemp("half")
    running, last_of_first = (out / "small.checkpoint" / name for name in ("running.npz", "000002.npz"))

    def stop_in_the_second_group() -> None:
        if last_of_first.exists() and 3 in np.load(running)["tiles"]:
            interrupt()

    with limited(tile=TILE, batch=2 * TILE, chunk_blocks=20), pytest.raises(KeyboardInterrupt):
        sweep.run(config, out, progress=Heard(stop_in_the_second_group))
    return out


@pytest.fixture
def out(half: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(half, tmp_path / "out"))


def cut(share: float) -> Callable[[Path], None]:
    return lambda path: os.truncate(path, int(share * path.stat().st_size))


def flip(path: Path) -> None:
    whole = bytearray(path.read_bytes())
    whole[len(whole) // 2] ^= 0xFF
    path.write_bytes(whole)


def foreign(path: Path) -> None:
    with path.open("wb") as stream:
        np.savez(stream, status=np.ones(2), seconds=np.ones(()), cpu=np.array("x"), tiles=np.arange(3))


def another_tile(path: Path) -> None:
    """Each gets what the next one had."""
    files = sorted(path.parent.glob("*.npz"))
    shutil.copy(files[(files.index(path) + 1) % len(files)], path)


CUTS = {f"cut{i}": cut(i) for i in (0, 0.4, 0.999)}
DAMAGES: dict[str, Callable[[Path], None]] = CUTS | {
    "removed": Path.unlink,
    "foreign": foreign,
    "another's": another_tile,
}
QUICK = ("cut0.4", "another's")


@pytest.mark.parametrize(
    "how", [how if how in QUICK else pytest.param(how, marks=pytest.mark.campaign) for how in DAMAGES]
)
def test_damaged_tiles_and_state_rows_are_computed_again(
    config: Path, out: Path, undisturbed: dict[str, bytes], how: str
) -> None:
    files = sorted((out / "small.checkpoint").glob("*.npz"))
    assert [path.stem for path in files] == ["000000", "000001", "000002", "running"]
    for path in files:
        DAMAGES[how](path)
    for name in ("1.npz", "0abc.npz", "notes.txt", "000099.npz", ".x.part", "000099.npz.orig"):  # ignored
        (out / "small.checkpoint" / name).write_bytes(b"mine")
    result = invoke("run", config, "--output", out)
    reported = [f"{path.name}: damaged" in result.stderr for path in files]
    assert (result.exit_code, reported) == (0, [how != "removed"] * 4), result.stderr
    assert contents(out) == undisturbed


ODD = (b"null", b"[]", b'"x"', b"{}", b'{"config": 1}', b"[" * 100_000, b"9" * 5000, b"\xff", b'{"config": "\x1b[2J"}')
"""Files of JSON, or nearly, that are no identities."""


@pytest.mark.parametrize("how", [*CUTS.values(), flip, foreign, *ODD], ids=lambda how: str(how)[:20])
def test_a_damaged_identity_is_refused(config: Path, out: Path, how: Callable[[Path], None] | bytes) -> None:
    file = out / "small.checkpoint" / "identity.json"
    file.write_bytes(how) if isinstance(how, bytes) else how(file)
    refused(invoke("run", config, "--output", out, "--quiet"), "identity.json: damaged", "--fresh")


def test_a_fresh_run_ignores_a_damaged_identity(config: Path, out: Path, undisturbed: dict[str, bytes]) -> None:
    cut(0.4)(out / "small.checkpoint" / "identity.json")
    assert invoke("run", config, "--output", out, "--fresh").exit_code == 0
    assert contents(out) == undisturbed


@pytest.mark.parametrize("settings", [(), ("--set", "delta=0.04")], ids=["same", "other"])
def test_tiles_without_an_identity_are_known_by_their_stamp(
    config: Path, out: Path, undisturbed: dict[str, bytes], settings: tuple[str, ...]
) -> None:
    (out / "small.checkpoint" / "identity.json").unlink()
    result = invoke("run", config, "--output", out, *settings)
    assert (result.exit_code, "not a file of this run" in result.stderr) == (0, bool(settings)), result.stderr
    assert (contents(out) == undisturbed) == (not settings)


def test_another_configuration_is_refused(config: Path, out: Path) -> None:
    refuses(invoke("run", config, "--output", out, "--set", "t_end=1400"), "t_end: 1400.0", "t_end: 1500.0")
    assert invoke("run", config, "--output", out).exit_code == 0
    refuses(invoke("run", config, "--output", out, "--set", "delta=0.04"), "small.nc: not resumed", "delta: 0.04")


def refuses(result: Result, *words: str) -> None:
    """It ended with exit code 2 and says these words, in one line or several."""
    assert (result.exit_code, [word for word in words if word not in result.stderr]) == (2, []), result.stderr


@pytest.fixture
def forgets() -> Iterator[None]:
    """A process reads versions and sources once, as if they never changed while it runs."""
    forget()
    yield
    forget()


def forget() -> None:
    provenance.sources.cache_clear()
    versions.cache_clear()


@pytest.mark.usefixtures("forgets")
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.campaign)], ids=["half", "whole"])
@pytest.mark.parametrize("package", ["rattleback-sweep", "numba"])
def test_another_version_is_refused(
    config: Path, out: Path, whole: bool, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if whole:
        assert invoke("run", config, "--output", out).exit_code == 0
    before = {path: path.read_bytes() for path in out.rglob("*.*") if path.is_file()}
    true = metadata.version
    with monkeypatch.context() as patch:
        patch.setattr(metadata, "version", lambda name: "9.9" if name == package else true(name))
        forget()
        result = invoke("run", config, "--output", out)
    refuses(result, "not resumed, it comes from other versions: sweep")
    assert f"{package.removeprefix('rattleback-')} 9.9" in result.stderr.partition(", now")[2]
    assert {path: path.read_bytes() for path in out.rglob("*.*") if path.is_file()} == before


@pytest.mark.usefixtures("forgets")
def test_other_sources_are_refused(config: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.results.provenance.decisive_sources", list)
    refuses(invoke("run", config, "--output", out), "other sources of the model or kernel")


def test_a_damaged_dataset_is_refused(config: Path, tmp_path: Path) -> None:
    (tmp_path / "small.nc").write_bytes(b"not a dataset")
    refuses(invoke("run", config, "--output", tmp_path), "not a netCDF dataset")


def test_another_name_is_another_run(config: Path, out: Path) -> None:
    sweep.run(config, out, name="second", mu=40.0, b=2.0)
    assert {path.name for path in out.iterdir()} == {"small.checkpoint", "second.nc"}


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.campaign)])
def test_every_flipped_bit_of_a_tile_is_seen(every: int, tmp_path: Path) -> None:
    """Numpy alone reads past some: a header with a smaller shape ends before the checksum."""
    identity = Identity("name: x", "0" * 16, "1" * 16, "sweep 0")
    # The directory's entry of the second takes 64 bytes: one bit makes it the comment of the first.
    tile = {"status": np.arange(3000.0), "fourteen_chars": np.ones(1), "cpu": np.array("zen")}
    checkpoint = Checkpoint(tmp_path / "c", identity, lambda _: None)
    checkpoint.save(0, tile)
    path = tmp_path / "c" / "000000.npz"
    whole, missed = path.read_bytes(), 0
    data = whole.index(tile["status"].tobytes())
    places = [*range(data + 16), *range(data + tile["status"].nbytes - 16, len(whole))]
    bits = [(place, bit) for place in places for bit in range(8)][::every]
    for place, bit in bits:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << bit
        path.write_bytes(damaged)
        try:
            found = checkpoint.load(0)
        except FileError:
            continue
        missed += 1
        assert found.keys() == tile.keys()
        assert all(np.array_equal(found[name], tile[name]) for name in tile)
    assert missed < len(bits) / 2  # dates and rights of the entries
