"""The whole command on the real simulation, on half a second of a drive."""

import base64
import json
import os
import signal
import subprocess
import sys
import time
from functools import partial

import cv2
import numpy as np
import pytest

from scenarios import runs, spec
from scenarios.log import load
from scenarios.runs import Run
from scenarios.workers import LocalPool
from tracker.types import Tracks

SILENT = "tests.scenarios.fakes:SilentTracker"
MIDDLE = "tests.scenarios.test_cli:MiddleTracker"
SHORT = ("--set", "seconds=0.5")


pytestmark = pytest.mark.usefixtures("gl")


def command(*arguments, hash_seed="0", start=subprocess.run, **options):
    return start(
        [sys.executable, "-m", "scenarios.cli", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONHASHSEED": hash_seed},
        **options,
    )


def document(*arguments, **options):
    ended = command("run", "in-car-day", *SHORT, "--json", *arguments, **options)
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


@pytest.fixture(scope="module")
def first(gl):
    return document("--tracker", "in-car", hash_seed="1")


def test_the_document_has_what_the_contract_names(first):
    assert {"scenario", "spec_id", "seeds", "tracker", "frames", "scores", "difficulty"} <= set(first)
    assert {"hashes", "timing_ms", "fps", "peak_rss_mb"} <= set(first)
    assert (first["scenario"], first["seeds"], first["frames"]) == ("in-car-day", [0], 15)
    assert first["tracker"] == "in-car"
    assert set(first["hashes"]) == {"truth", "frames", "tracks"}
    assert list(first["timing_ms"]) == ["world", "render", "sensor", "truth", "track"]
    assert {"hota", "mota", "idf1", "identification"} <= set(first["scores"])


def test_the_same_in_another_process_under_another_hash_seed(first):
    again = document("--tracker", "in-car", hash_seed="2")
    for key in ("spec_id", "scores", "difficulty", "hashes"):
        assert again[key] == first[key]


def test_seeds_and_settings_change_what_they_should():
    def hashes(seed, *settings):
        scenario = spec.load("in-car-day", ["seconds=0.1", *settings])
        run = Run(scenario=scenario, seeds=range(seed, seed + 1), trackers=(SILENT,))
        return runs.execute(run)["hashes"]

    usual, other = hashes(0), hashes(1)
    assert other["truth"] != usual["truth"]
    assert other["frames"] != usual["frames"]
    noisier = hashes(0, "sensor.noise=9")
    assert noisier["truth"] == usual["truth"]
    assert noisier["frames"] != usual["frames"]


def test_results_do_not_depend_on_the_jobs():
    scenario = spec.load("in-car-day", ["seconds=0.1"])
    options = {"scenario": scenario, "seeds": range(2), "trackers": (SILENT, MIDDLE)}
    one = runs.execute(Run(**options))
    two = runs.execute(Run(**options), workers=LocalPool(2))
    assert one["paired"] == two["paired"]
    for a, b in zip(one["runs"], two["runs"], strict=True):
        assert a["tracker"] == b["tracker"]
        assert a["seeds"] == b["seeds"] == [0, 1]
        assert a["frames"] == b["frames"] == 6
        for key in ("scores", "difficulty", "hashes"):
            assert a[key] == b[key]


def test_an_episode_is_kept_whole(tmp_path):
    picture = tmp_path / "beside a recording.png"
    picture.write_bytes(cv2.imencode(".png", np.zeros((4, 6, 3), np.uint8))[1])
    run = Run(
        scenario=spec.load("in-car-day", ["seconds=0.1"]),
        seeds=range(3, 5),
        trackers=(SILENT, MIDDLE),
        figures=(picture,),
    )
    documents = runs.run_seed(run, tmp_path, 4)
    folder = tmp_path / "seed-4" / "tests.scenarios.test_cli-MiddleTracker"
    assert {entry.name for entry in folder.iterdir()} == {
        "scores.json",
        "tracks.txt",
        "log.npz",
        "report.html",
    }
    assert json.loads((folder / "scores.json").read_text()) == documents[MIDDLE]
    log = load(folder / "log.npz")
    assert (log.seed, log.tracker, len(log.tracks)) == (4, MIDDLE, 3)
    assert log.hashes == documents[MIDDLE]["hashes"]
    page = (folder / "report.html").read_text("utf-8")
    assert picture.stem in page
    assert base64.b64encode(picture.read_bytes()).decode() in page


def test_an_interrupt_ends_with_130_and_leaves_nothing(tmp_path):
    process = command(
        "run",
        "in-car-day",
        "--tracker",
        SILENT,
        "--out",
        str(tmp_path / "deep" / "out"),
        start=subprocess.Popen,
        # Who starts the tests in the background may have made them deaf to interrupts.
        preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
    )
    deadline = time.monotonic() + 60
    while not any(tmp_path.iterdir()) and time.monotonic() < deadline:
        time.sleep(0.1)
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert out == ""
    assert err.splitlines()[-1] == "testtrack: interrupted"
    assert "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_a_cluster_gives_what_one_process_gives(tmp_path):
    from distributed import LocalCluster

    wanted = ("--seeds", "500:502", "--tracker", MIDDLE, "--tracker", "association@noisy")
    alone = document(*wanted)
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        place = tmp_path / "out"
        found = document(*wanted, "--cluster", cluster.scheduler_address, "--out", str(place))
    assert found["paired"] == alone["paired"]
    for one, other in zip(found["runs"], alone["runs"], strict=True):
        for key in ("seeds", "frames", "scores", "difficulty", "details", "hashes"):
            assert one[key] == other[key]
    assert len(found["runs"]) == 2
    assert sorted(p.name for p in place.glob("seed-*")) == ["seed-500", "seed-501"]
    assert json.loads((place / "scores.json").read_text())["paired"] == alone["paired"]


def test_in_real_time_a_tracker_that_is_never_ready_sees_one_more_frame():
    slow = document("--tracker", "tests.scenarios.test_run:SleepyTracker", "--realtime")
    assert (slow["realtime"], slow["dropped_frames"], slow["frames"]) == (True, 13, 15)
    assert "dropped" not in slow["scores"]


class SleepyTracker:
    """Takes longer than the whole drive."""

    def start(self, info):
        pass

    def step(self, frame):  # noqa: ARG002
        time.sleep(0.6)
        return Tracks.confirmed([1], [[0, 0, 9, 9]])
