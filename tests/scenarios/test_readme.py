"""What the README shows runs as it is shown."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)

pytestmark = pytest.mark.usefixtures("gl")


def block(holding: str) -> str:
    (found,) = [text for text in BLOCKS if holding in text]
    return found


def run(*arguments: str, cwd: Path) -> str:
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    ended = subprocess.run(
        [sys.executable, *arguments], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.parametrize(
    ("name", "scenario", "tracker"),
    [
        ("mytracker", "in-car-day", "mytracker:Middle"),
        ("mydetections", "lane-day", "mydetections:Rows@noisy"),
    ],
)
def test_a_readers_own_tracker_runs_and_scores(name, scenario, tracker, tmp_path):
    (tmp_path / f"{name}.py").write_text(block(f"# {name}.py"))
    assert f"testtrack run {scenario} --tracker {tracker}" in README
    command = ("run", scenario, "--tracker", tracker, "--set", "seconds=1.2", "--json")
    document = json.loads(run("-m", "scenarios.cli", *command, cwd=tmp_path))
    assert (document["tracker"], document["frames"]) == (tracker, 36)
    assert 0 <= document["scores"]["hota"] <= 1
    kept = run("-m", "scenarios.cli", "check", tracker.partition("@")[0], cwd=tmp_path)
    assert kept.strip().endswith("keeps the contract")


def test_the_environment_steps_to_its_end(tmp_path):
    text = block("gymnasium.make").replace("seconds=2", "seconds=0.3")
    (tmp_path / "stepping.py").write_text(
        text + "\nprint(truncated, info['truth'].tick, len(info['tracks']))\n"
    )
    assert run("stepping.py", cwd=tmp_path).split()[:2] == ["True", "8"]
