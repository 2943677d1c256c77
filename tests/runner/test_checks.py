import subprocess
import sys

import pytest

from runner import checks


@pytest.fixture
def lanes(monkeypatch, tmp_path):
    """Commands that checks would run, with a status for each kind; `other` is 4.5 or 5.2."""

    class Lanes:
        other = checks.BLENDER["3.11" if sys.version_info[:2] == (3, 13) else "3.13"]
        statuses: dict[str, int] = {}  # noqa: RUF012
        has_other_python = True

        def __init__(self):
            self.ran: list[str] = []
            self.commands: dict[str, list[str]] = {}

        def run(self, command):
            ruff = "ruff" in command
            kind = " ".join(command[command.index("ruff") :]) if ruff else "first"
            return self.ends(kind, command)

        def start(self, command, output):
            assert command[command.index("--blender") + 1] == self.other
            output.write(b"printed by the second")
            return Process(self.ends("second", command))

        def ends(self, kind, command):
            self.ran.append(kind)
            self.commands[kind] = command
            return self.statuses.get(kind, 0)

    class Process:
        def __init__(self, status):
            self.wait = self.poll = lambda: status

    lanes = Lanes()
    # setenv first, so that what main() writes there is undone as well
    monkeypatch.setenv("NFM_BLENDER", "")
    monkeypatch.setenv("NFM_HOME", str(tmp_path))
    monkeypatch.setattr(checks, "_in_checkout", lanes.run)
    monkeypatch.setattr(checks, "_started", lanes.start)
    monkeypatch.setattr(
        checks.subprocess,
        "run",
        lambda command, **_: subprocess.CompletedProcess(command, not lanes.has_other_python),
    )
    return lanes


def test_everything(lanes):
    assert checks.main([]) == 0
    assert lanes.ran == ["ruff check", "ruff format --check", "second", "first"]


def test_what_the_second_lane_prints_is_shown(lanes, capfdbinary):
    checks.main([])
    assert capfdbinary.readouterr().out == b"printed by the second"


def test_arguments_go_to_both_lanes_without_ruff(lanes):
    assert checks.main(["-k", "foo"]) == 0
    assert lanes.ran == ["second", "first"]
    assert all(command[-2:] == ["-k", "foo"] for command in lanes.commands.values())


def test_the_second_lane_leaves_whole_fits_to_the_first(lanes):
    """Its -m comes before the caller's, of which pytest takes the last."""
    checks.main(["-m", "osl"])
    assert lanes.commands["second"][-4:] == ["-m", "not one_version", "-m", "osl"]
    assert "not one_version" not in lanes.commands["first"]


def test_chosen_blender_is_the_only_lane_and_runs_everything(lanes, monkeypatch):
    monkeypatch.setenv("NFM_BLENDER", "5.2")
    checks.main(["-k", "foo"])
    assert lanes.ran == ["first"]
    assert "not one_version" not in lanes.commands["first"]


def test_missing_python_skips_the_second_lane_and_says_so(lanes, capsys):
    lanes.has_other_python = False
    assert checks.main(["-x"]) == 0
    assert lanes.ran == ["first"]
    assert f"Blender {lanes.other} are skipped" in capsys.readouterr().err


@pytest.mark.parametrize("failing", ["ruff check", "ruff format --check", "first", "second"])
def test_one_failure_fails_all_and_stops_nothing(lanes, failing):
    lanes.statuses = {failing: 1}
    assert checks.main([]) == 1
    assert len(lanes.ran) == 4


@pytest.mark.parametrize(
    ("lane", "arguments", "status"),
    [("second", ["-k", "foo"], 0), ("second", [], 5), ("first", ["-k", "foo"], 5)],
)
def test_no_tests_collected(lanes, lane, arguments, status):
    lanes.statuses = {lane: 5}
    assert checks.main(arguments) == status


@pytest.mark.parametrize("status", [0, 1])
def test_coverage_of_one_version(lanes, status, monkeypatch):
    monkeypatch.setenv("COVERAGE_FILE", "")
    monkeypatch.setenv("COVERAGE_CORE", "")
    commands = []
    monkeypatch.setattr(checks, "_in_checkout", _noting(commands, status))
    assert checks.main(["--coverage", "tests/osl"]) == status
    assert [command[4] for command in commands] == ["run", "combine", "report"]
    assert commands[0][-3:] == ["-m", "pytest", "tests/osl"]
    assert "second" not in lanes.ran


def _noting(commands, status):
    def run(command):
        commands.append(command)
        return status if "pytest" in command else 0

    return run
