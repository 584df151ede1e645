"""What commands say: what was meant, what was written and kept, and nothing more than one line when one is enough."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from support import Write
from support.cli import invoke
from support.runs import Heard, Stop

import sweep
from sweep.config import load_config
from sweep.config.document import parse_value
from sweep.engine.reporter import Progress
from sweep.progress import Terminal

TEXT = "name: quick\nmodel: averaged\nfriction: {mu: [40, 60]}\nintegrator: {t_end: 40}\n"

MEANT = {
    "rnu": "Did you mean 'run'?",
    "run c.yaml --outptu x": "Did you mean '--output'?",
    "run c.yaml --set fricton.mu=3": "--set fricton.mu: fricton: unknown key (did you mean friction?); the keys",
    "run c.yaml --set mux=3": "--set mux: unknown key (did you mean friction.mu?)",
    "run c.yaml --set model=sllip": "point of a package, not 'sllip' (did you mean slip?)",
    "run c.yaml --set method=ADAM": "--set method: must be dopri5, adams or auto, not 'ADAM' (did you mean adams?)",
    "run c.yaml --set measure=[noise_limit]": "not 'noise_limit' (did you mean noise_limited?)",
    "trajectory c.yaml --at mux=3": "--at mux=3: unknown parameter (did you mean mu?); the parameters are a, b",
    "trajectory c.yaml --at mu=-3 --dry-run": "--at mu: must be a finite number >= 0 and < 1e+12, not -3",
    "trajectory c.yaml --at mu=3 --at mu=-3": "--at mu[1]: must be a finite number >= 0",
    "run c.yaml --set mu": "--set mu: not a setting; write PATH=VALUE, such as friction.mu=60",
    "run c.yaml --set friction.mu=[": "not YAML",
    "run c.yaml --set name.first=3": "--set name.first: name is a value, not a section; name a key such as friction.mu",
    "run c.yaml --set mu=1..2:100000 --set n0=1..2:100000 --dry-run": "0 cells are too many",
    "critical c.yaml --set x0=[0.01,0.02]": "--set x0: cannot be an axis of critical spins; give one number",
    "critical c.yaml --set model=analytic": "the analytic model is a formula and cannot be simulated; choose slip",
    "trajectory c.yaml --at mu": "NAME=NUMBER",
    "trajectory c.yaml --at every=1": "--at every=1: unknown parameter; the parameters are a, b, c, delta",
}  # fmt: skip


@pytest.mark.parametrize("command", MEANT)
def test_a_refusal_says_what_may_be_meant(command: str, write: Write, tmp_path: Path) -> None:
    result = invoke(*command.replace("c.yaml", f"{write(TEXT)} --output {tmp_path / 'out'}").split())
    assert (result.exit_code, MEANT[command] in result.stderr) == (2, True), result.output
    assert "Usage: " in result.stderr or len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_nothing_close_is_not_suggested(write: Write) -> None:
    assert "did you mean" not in invoke("run", write(TEXT), "--set", "colour=3").stderr


@pytest.mark.parametrize("character", ["\udcff", "\0", "\U000e0001"])
def test_what_cannot_be_printed_is_quoted_as_short_as_any_other(character: str, write: Write) -> None:
    """Such a character takes up to ten in print, of which 300 once filled a screen."""
    result = invoke("trajectory", write(TEXT), "--at", f"{character * 300}=1")
    assert result.exit_code == 2
    assert len(result.stderr) < 700, result.stderr


RANGES = {
    "20..60:41": (20, 60, 41), "-0.1..1e-1:3": (-0.1, 0.1, 3), ".5..1.:2": (0.5, 1, 2), "1e1..25:1e3": (10, 25, 1000),
    "-3..-1:5": (-3, -1, 5),
}  # fmt: skip


@pytest.mark.parametrize("text", RANGES)
def test_a_range_is_set_in_short(text: str) -> None:
    assert parse_value(text, "") == dict(zip(("start", "stop", "num"), RANGES[text], strict=True))


@pytest.mark.parametrize("text", ["20..60", "20.60:41", "a..b:3", "20..60:41:2", "20...:3", "'20..60:41'"])
def test_other_words_are_no_range(text: str) -> None:
    assert parse_value(text, "") == text.strip("'")


def test_a_range_may_be_set_and_help_says_so(write: Write) -> None:
    result = invoke("run", write(TEXT), "--set", "friction.mu=20..60:41", "--dry-run")
    assert "41 (mu 41)" in result.stdout
    assert "START..STOP:NUM" in invoke("run", "--help").stdout.replace("\n", " ")


@pytest.mark.parametrize("number", ["3", "3.0", "3e0", "+3.", "30e-1"])
def test_a_whole_number_may_be_written_as_any_number(number: str, write: Write) -> None:
    text = f"friction: {{mu: {{start: 1, stop: 2, num: {number}}}}}\nrefine: {number}\n"
    config = load_config(write(f"{text}measure: [reversals, {{reversal_times: {number}}}]\n"))
    assert (len(config.axes["mu"]), config.refine, config.measure) == (3, 3, ("reversals", "reversal_times=3"))
    assert "refine: 3\n" in config.to_yaml()


@pytest.mark.parametrize(
    "command",
    [
        "info quick.nc",
        "run quick.yaml --output .",
        "run quick.yaml --dry-run",
        "run quick.yaml --output . --fresh 2>&1",
    ],
)
def test_a_closed_pipe_ends_a_command_silently(command: str, tmp_path: Path) -> None:
    """As `… | head` does once it has what it wants; also one that shows its progress there."""
    (tmp_path / "quick.yaml").write_text(TEXT, encoding="utf-8")
    sweep.run(tmp_path / "quick.yaml", tmp_path)
    words, both, _ = command.partition(" 2>&1")
    run = [sys.executable, "-m", "sweep", *words.split()]
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        run, cwd=tmp_path, stdout=writing, stderr=writing if both else subprocess.PIPE, text=True, check=False
    )
    os.close(writing)
    assert done.returncode == 141
    assert [line for line in (done.stderr or "").splitlines() if "already complete" not in line] == []


def test_a_command_tells_what_it_wrote(write: Write, tmp_path: Path) -> None:
    command, out = ("run", write(TEXT), "--output", tmp_path / "out"), tmp_path / "out" / "quick"
    assert invoke(*command).stdout.endswith(f"\nwrote {out}.nc and .png\n")
    again = invoke(*command)
    assert again.stdout.endswith("\nnothing was written\n")
    assert "already complete, nothing to compute" in again.stderr
    out.with_suffix(".png").unlink()
    assert invoke(*command).stdout.endswith(f"\nwrote {out}.png\n")
    assert invoke(*command, "--fresh").stdout.endswith(f"\nwrote {out}.nc and .png\n")


@pytest.mark.usefixtures("short_chunks")
def test_a_resumed_run_tells_how_many_cells_are_kept(write: Write, tmp_path: Path) -> None:
    stopped = Stop(3)
    with pytest.raises(KeyboardInterrupt):
        sweep.run(write(), tmp_path / "out", reporter=stopped)
    assert not any("resuming" in note for note in stopped.notes)
    again = Heard()
    sweep.run(write(), tmp_path / "out", reporter=again)
    assert again.notes == ["resuming an earlier run: 0 of 12 cells finished, 12 under way"]


@pytest.mark.parametrize("unit", ["cells", "bodies", "sqrt(c/g)"])
@pytest.mark.parametrize("width", [30, 40, 60, 79, 80, 200])
def test_a_terminal_of_any_width_keeps_the_bar(width: int, unit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    screen = io.StringIO()
    terminal = Terminal()
    assert terminal.console.width == width
    terminal.chunk(Progress(6072, 3036, 0, 0, 10.0, unit))
    terminal._bar.stop()
    Console(file=screen, width=width).print(terminal._bar.get_renderable())
    (line,) = screen.getvalue().splitlines()
    assert len(line) <= width
    assert "3036/6072" in line
    assert 2 <= line.count("━") < 40
    assert (unit in line) == (width >= 80)


def test_a_log_tells_now_and_then_how_far_a_run_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rich draws its bar nowhere but on a terminal, and elsewhere once, at the end."""
    screen = io.StringIO()
    with Terminal() as terminal:
        terminal.console = Console(file=screen)
        for seconds, lines in ((60.0, 0), (-1.0, 1)):
            monkeypatch.setattr("sweep.progress._LOGGED", seconds)
            terminal.chunk(Progress(6072, 3036, 0, 0, 10.0))
            assert screen.getvalue().count("3036/6072 cells") == lines
