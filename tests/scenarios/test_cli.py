import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from scenarios import cli, manifest, spec
from tests.scenarios.clips import cut, write_clip
from tracker.types import Tracks

HEAVY = (
    "numpy",
    "scipy",
    "numba",
    "cv2",
    "av",
    "matplotlib",
    "gymnasium",
    "highway_env",
    "trimesh",
    "pyrender",
    "moderngl",
)


def call(*arguments, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return stopped.value.code, captured.out, captured.err


@pytest.fixture(autouse=True)
def _keeps_the_path(monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path])


BAD = {
    "unknown command": ("rnu",),
    "no command": (),
    "unknown option": ("run", "in-car-day", "--sed", "3"),
    "no scenario": ("run",),
    "unknown scenario": ("run", "in-car-dya"),
    "missing scenario file": ("run", "{tmp}/none.toml"),
    "misspelt key in a file": ("run", "{tmp}/misspelt.toml"),
    "not a number in a file": ("run", "{tmp}/nan.toml"),
    "negative size in a file": ("run", "{tmp}/negative.toml"),
    "misspelt key": ("run", "in-car-day", "--set", "sensor.nois=3"),
    "not a number": ("run", "in-car-day", "--set", "sensor.noise=nan"),
    "negative size": ("run", "in-car-day", "--set", "camera.width=-640"),
    "seed is a word": ("run", "in-car-day", "--seed", "x"),
    "negative seed": ("run", "in-car-day", "--seed", "-1"),
    "empty seeds": ("run", "in-car-day", "--seeds", "3:3"),
    "seeds are words": ("run", "in-car-day", "--seeds", "a:b"),
    "both seeds": ("run", "in-car-day", "--seed", "1", "--seeds", "0:2"),
    "no jobs": ("run", "in-car-day", "--jobs", "0"),
    "unknown boxes": ("run", "in-car-day", "--boxes", "full"),
    "unknown tracker": ("run", "in-car-day", "--tracker", "none:such"),
    "no tracker": ("run", "in-car-day", "--tracker", "json:dumps"),
    "one tracker twice": ("run", "in-car-day", "--tracker", "in-car", "--tracker", "in-car"),
    "out is a file": (
        "run",
        "in-car-day",
        "--tracker",
        "tests.scenarios.fakes:SilentTracker",
        "--out",
        "{tmp}/text.mp4",
    ),
    "jobs and cluster": ("run", "in-car-day", "--jobs", "2", "--cluster", "tcp://127.0.0.1:1"),
    "no such cluster": (
        *("run", "lane-day", "--tracker", "tests.scenarios.fakes:SilentTracker"),
        *("--cluster", "no address"),
    ),
    "a figure that is no picture": ("run", "in-car-day", "--figure", "{tmp}/text.mp4", "--out", "{out}"),
    "a figure of text": ("run", "in-car-day", "--figure", "{tmp}/text.png", "--out", "{out}"),
    "nowhere to generate": ("generate", "in-car-day"),
    "generate an unknown scenario": ("generate", "in-car-dya", "--out", "{out}"),
    "generate a misspelt key": ("generate", "in-car-day", "--set", "sensor.nois=3", "--out", "{out}"),
    "unknown format": ("generate", "in-car-day", "--format", "voc", "--out", "{out}"),
    "unknown coding": ("generate", "in-car-day", "--frames", "gif", "--out", "{out}"),
    "none to generate": ("generate", "in-car-day", "--count", "0", "--out", "{out}"),
    "generate a negative seed": ("generate", "in-car-day", "--seed", "-1", "--out", "{out}"),
    "generate without jobs": ("generate", "in-car-day", "--jobs", "0", "--out", "{out}"),
    "generate on no cluster": ("generate", "in-car-day", "--cluster", "no address", "--out", "{out}"),
    "generate into a file": ("generate", "in-car-day", "--out", "{tmp}/text.mp4"),
    "generate among other files": ("generate", "in-car-day", "--out", "{tmp}"),
    "no manifest": ("replay",),
    "missing manifest": ("replay", "{tmp}/none.json"),
    "a folder as manifest": ("replay", "{tmp}"),
    "text as manifest": ("replay", "{tmp}/text.mp4"),
    "other JSON as manifest": ("replay", "{tmp}/other.json"),
    "manifest without a scenario": ("replay", "{tmp}/empty.json"),
    "manifest with a wrong parameter": ("replay", "{tmp}/wrong.json"),
    "manifest without episodes": ("replay", "{tmp}/cut.json"),
    "manifest of an unknown tracker": ("replay", "{tmp}/tracker.json"),
    "nothing to check": ("check",),
    "check an unknown tracker": ("check", "none:such"),
    "check no tracker": ("check", "json:dumps"),
    "unknown detector": ("run", "lane-day", "--tracker", "association@none"),
    "a detector of a tracker of frames": ("run", "lane-day", "--tracker", "in-car@perfect"),
    "more than list takes": ("list", "scenarios"),
    "more than doctor takes": ("doctor", "now"),
    "missing video": ("track", "{tmp}/none.mp4", "--method", "in-car"),
    "text as video": ("track", "{tmp}/text.mp4", "--method", "in-car"),
    "truncated video": ("track", "{tmp}/cut-0.5-clip.mp4", "--method", "tests.scenarios.fakes:SilentTracker"),
    "truncated in the middle": (
        "track",
        "{tmp}/cut-0.8-fast.mp4",
        "--method",
        "tests.scenarios.fakes:SilentTracker",
    ),
    "video without frames": ("track", "{tmp}/none.avi", "--method", "tests.scenarios.fakes:SilentTracker"),
    "no method": ("track", "{tmp}/clip.mp4"),
    "unknown method": ("track", "{tmp}/clip.mp4", "--method", "none:such"),
    "negative focal": ("track", "{tmp}/clip.mp4", "--method", "in-car", "--focal", "-3"),
    "focal not a number": ("track", "{tmp}/clip.mp4", "--method", "in-car", "--focal", "nan"),
}


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    (folder / "misspelt.toml").write_text('scene = "in-car"\n[sensor]\nnois = 3\n')
    (folder / "nan.toml").write_text('scene = "in-car"\n[sensor]\nnoise = nan\n')
    (folder / "negative.toml").write_text('scene = "in-car"\n[camera]\nwidth = -640\n')
    for name in ("text.mp4", "text.png"):
        (folder / name).write_text("not a video\n" * 50)
    scenario = spec.load("in-car-day").model_dump(mode="json")
    whole = {"format": manifest.FORMAT, "scenario": scenario, "trackers": [], "odometry": False}
    whole |= {"environment": {}, "episodes": []}
    wrong = scenario | {"params": scenario["params"] | {"sensor": {"noise": -1}}}
    documents = {
        "other": {"a": 1},
        "empty": {"format": manifest.FORMAT},
        "wrong": whole | {"scenario": wrong},
        "cut": {key: value for key, value in whole.items() if key != "episodes"},
        "tracker": whole | {"trackers": ["none:such"]},
    }
    for name, document in documents.items():
        (folder / f"{name}.json").write_text(json.dumps(document))
    cut(write_clip(folder / "clip.mp4", 30), 0.5)
    cut(write_clip(folder / "fast.mp4", 60, movflags="faststart"), 0.8)
    write_clip(folder / "none.avi", 0)
    return folder


@pytest.mark.parametrize("arguments", BAD.values(), ids=BAD)
def test_bad_input_ends_with_2_and_one_line_and_leaves_nothing(
    arguments, inputs, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    before = sorted(inputs.iterdir())
    arguments = [argument.format(tmp=inputs, out=tmp_path / "out") for argument in arguments]
    if arguments and arguments[0] in ("run", "track") and "--out" not in arguments:
        arguments += ["--out", str(tmp_path / "out")]
    code, out, err = call(*arguments, capsys=capsys)
    assert code == 2, err
    assert out == ""
    assert err.startswith("testtrack: ")
    assert err.count("\n") == 1
    assert err.endswith("\n")
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []
    assert sorted(inputs.iterdir()) == before


def test_a_misspelt_key_names_the_nearest_the_file_and_the_key(inputs, capsys):
    _, _, err = call("run", inputs / "misspelt.toml", capsys=capsys)
    assert str(inputs / "misspelt.toml") in err
    assert "'sensor.nois'" in err
    assert "did you mean 'noise'" in err


@pytest.mark.parametrize(
    "arguments",
    [
        ["--help"],
        ["run", "--help"],
        ["run", "--sed"],
        ["run", "in-car-dya"],
        ["run", "in-car-day", "--jobs", "0"],
        ["generate", "--help"],
        ["generate", "in-car-day", "--out", "none", "--count", "0"],
        ["replay", "--help"],
    ],
)
def test_help_and_errors_import_nothing_heavy(arguments):
    # To read a scenario imports sim, which registers its environments with gymnasium.
    heavy = tuple(
        name for name in HEAVY if "in-car-dya" not in arguments or name not in ("numpy", "gymnasium")
    )
    program = (
        "import sys\nfrom scenarios import cli\n"
        f"try: cli.main({arguments!r})\nexcept SystemExit: pass\n"
        f"print('heavy:', *sorted(set({heavy!r}) & set(sys.modules)), file=sys.stderr)"
    )
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert ended.stderr.splitlines()[-1] == "heavy:"


def test_help_names_the_commands(capsys):
    code, out, _ = call("--help", capsys=capsys)
    assert code == 0
    for command in ("list", "run", "track", "generate", "replay", "doctor"):
        assert command in out


def test_list_names_scenarios_and_trackers(capsys):
    code, out, err = call("list", capsys=capsys)
    assert (code, err) == (0, "")
    assert "in-car-stop-and-go" in out
    assert "in-car:per-frame" in out
    code, out, _ = call("list", "--json", capsys=capsys)
    document = json.loads(out)
    assert code == 0
    assert list(document["scenarios"]) == list(spec.library())
    assert "in-car:paper" in document["trackers"]


def test_track_follows_a_recording(tmp_path, capsys):
    clip = write_clip(tmp_path / "clip.mp4", 30)
    method = "tests.scenarios.test_cli:MiddleTracker"
    code, out, err = call("track", clip, "--method", method, "--focal", "80", "--json", capsys=capsys)
    document = json.loads(out)
    assert (code, err) == (0, "")
    assert (document["frames"], document["rate"], document["seconds"]) == (30, 25.0, 1.2)
    assert (document["focal"], document["tracks"], document["boxes"]) == (80.0, 1, 30)
    assert set(document["timing_ms"]) == {"decode", "track"}


def test_track_writes_what_it_found(tmp_path, capsys):
    clip = write_clip(tmp_path / "clip.mp4", 5)
    method = "tests.scenarios.test_cli:MiddleTracker"
    code, out, err = call("track", clip, "--method", method, "--out", tmp_path / "out", capsys=capsys)
    assert code == 0
    assert "clip.mp4" in out
    assert "report.html" in err
    found = {entry.name for entry in (tmp_path / "out").iterdir()}
    assert {"tracks.txt", "summary.json", "report.html"} <= found
    lines = Path(tmp_path / "out" / "tracks.txt").read_text().splitlines()
    assert [line.split(",")[:2] for line in lines] == [[str(k), "1"] for k in range(1, 6)]


class MiddleTracker:
    """Claims the middle of every picture."""

    def start(self, info):
        self.info = info

    def step(self, _frame):
        import numpy as np

        from tracker.types import Status, Tracks

        box = np.array([[10.0, 10.0, 30.0, 30.0]])
        return Tracks(ids=np.array([1]), boxes=box, status=np.array([Status.CONFIRMED], np.uint8))


class ForgetfulTracker:
    """Breaks three rules."""

    def start(self, info):  # noqa: ARG002
        return

    def step(self, frame):
        frame.image[0, 0] = 0
        return Tracks(ids=np.zeros(1, np.int64), boxes=np.zeros((1, 4)), status=np.ones(1, np.uint8))


def test_check_names_every_broken_rule(capsys):
    code, out, _ = call("check", "tests.scenarios.test_cli:ForgetfulTracker", capsys=capsys)
    assert code == 1
    assert [line.partition(":")[0] for line in out.splitlines()] == ["step", "ids", "boxes"]


def test_check_passes_what_keeps_the_contract(capsys):
    code, out, _ = call("check", "tests.scenarios.fakes:SilentTracker", capsys=capsys)
    assert (code, out) == (0, "tests.scenarios.fakes:SilentTracker keeps the contract\n")
