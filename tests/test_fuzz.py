"""Any input is either accepted or refused in lines that help; nothing else happens.

The inputs, and what must hold for each, are in tests/fuzzing/.
"""

from pathlib import Path
from random import Random

import fuzzing
import pytest
import xarray as xr
from click.testing import Result
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support import Write
from support.cli import invoke

from sweep import InputError, load_config
from sweep.config import document

# Inputs of each kind: what a second or two allows.
EXAMPLES = {"yaml_tree": 200, "yaml_bytes": 200, "setting": 330, "mapping": 130, "table": 200}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fuzzing.prepare(tmp_path_factory.mktemp("fuzz"))


@pytest.mark.parametrize("times", [1, pytest.param(12, marks=pytest.mark.campaign)], ids=["some", "many"])
@pytest.mark.parametrize("kind", fuzzing.KINDS)
def test_any_input_is_accepted_or_refused(kind: str, times: int, folder: Path) -> None:
    """Within seconds; a campaign draws other inputs each time."""

    @settings(
        max_examples=times * EXAMPLES[kind],
        derandomize=times == 1, print_blob=True, suppress_health_check=[HealthCheck.too_slow],
        deadline=20_000,
    )  # fmt: skip
    @given(st.randoms(use_true_random=False))
    def hand_in(random: Random) -> None:
        fuzzing.KINDS[kind](random, folder)

    hand_in()


def refused(result: Result) -> str:
    assert (result.exit_code, result.stdout) == (2, "")
    return result.stderr


def test_a_table_with_very_many_columns_is_refused_in_a_few_lines(write: Write, tmp_path: Path) -> None:
    (tmp_path / "wide.csv").write_text("mu" + ",mu" * 99_999 + "\n", encoding="utf-8")
    assert len(refused(invoke("run", write("cases: wide.csv\n"))).splitlines()) == 21


def test_refusals_do_not_quote_a_file_that_is_no_table(write: Write, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("key=" + "s3cret" * 20 + ",more\n,tail\n", encoding="utf-8")
    said = refused(invoke("run", write("cases: secret\n")))
    assert "tail" not in said
    assert "s3cret" * 11 not in said


@pytest.mark.parametrize("name", ["../../x", "/tmp/x", "a/b", "..", "", '"a\\0b"', '"a\\nb"', "x" * 101, "-x", ".x"])
def test_a_name_cannot_leave_the_output_folder(name: str, write: Write) -> None:
    with pytest.raises(InputError, match="name: "):
        load_config(write(f"name: {name}\nfriction: {{mu: 60}}\n"))


@pytest.mark.parametrize("stem", ["файл", "-", "x" * 200, ".hidden", "a b", "..%2f"])
def test_any_file_name_gives_a_valid_name(stem: str, write: Write) -> None:
    assert load_config(write("friction: {mu: 60}\n", f"{stem}.yaml")).name


def test_no_code_in_a_file_is_executed(write: Write, tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    for call in (f"!!python/object/apply:os.mkdir [{mark}]", f"!!python/object/new:os.mkdir [{mark}]"):
        with pytest.raises(InputError, match="a YAML tag or anchor"):
            load_config(write(f"friction: {{mu: {call}}}\n"))
        with pytest.raises(InputError, match="a YAML tag or anchor"):
            document.parse_value(call, "--set x")
    assert not mark.exists()


def test_messages_contain_no_control_characters(write: Write, tmp_path: Path) -> None:
    said = refused(invoke("run", write('"\\e[2J\\n": 1\nfriction: {mu: 60}\n', "a\x1b[2Jb\n.yaml")))
    assert len(said.splitlines()) == 1
    assert said.strip().isprintable()
    xr.Dataset({"status": ("b", [1])}, attrs={"title": "\x1b[2J", "sweep_kind": "run"}).to_netcdf(tmp_path / "odd.nc")
    printed = invoke("info", tmp_path / "odd.nc").stdout
    assert "[2J" in printed
    assert "\x1b" not in printed


def test_the_number_of_trajectories_is_limited(write: Write) -> None:
    pairs = [part for name in ("mu", "b", "n0") for i in range(1, 21) for part in ("--at", f"{name}={i}")]
    assert "--at: 8000 trajectories are too many; choose at most 1000 cells" in refused(
        invoke("trajectory", write(), *pairs)
    )
