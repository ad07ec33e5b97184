"""Datasets of real episodes: the same bytes whoever draws them and however often they are stopped."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from scenarios import generate as generating
from scenarios import manifest as manifests
from scenarios import spec
from scenarios.dataset import Dataset, sequence_name
from scenarios.errors import InputError
from scenarios.export.writer import LAYOUTS
from scenarios.generate import generate
from scenarios.loop import run_episode
from scenarios.workers import LocalPool, ThisProcess, open_workers
from tests.scenarios.export.test_rle import naive_decode

SCENARIO = spec.load("lane-day", ["seconds=0.1"])
SEEDS = range(500, 503)


pytestmark = pytest.mark.usefixtures("gl")


def contents(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}


def dataset(layout="mot", **changes):
    return Dataset(**({"scenario": SCENARIO, "seeds": SEEDS, "format": layout} | changes))


@pytest.fixture(scope="module")
def whole(tmp_path_factory, gl):
    """The dataset, drawn by one process in one go."""
    place = tmp_path_factory.mktemp("whole") / "deep" / "set"
    told = []
    document = generate(dataset(), place, ThisProcess(), told.append)
    assert (document["episodes"], document["drawn"], document["frames"]) == (3, 3, 9)
    assert sum(told) == 9
    return place


def test_pictures_depth_and_masks_are_those_of_the_simulation(whole):
    seen = []
    run_episode(SCENARIO, 501, {}, on_frame=lambda observation, _: seen.append(observation))
    lines = [json.loads(line) for line in (whole / "truth/0501/frames.jsonl").read_text().splitlines()]
    assert len(lines) == len(seen) == 3
    for k, (line, observation) in enumerate(zip(lines, seen, strict=True)):
        image = cv2.imread(str(whole / line["image"]))[..., ::-1]
        np.testing.assert_array_equal(image, observation.image)
        depth = cv2.imread(str(whole / f"truth/0501/depth/{k:06d}.png"), cv2.IMREAD_UNCHANGED)
        near = observation.depth < 255
        np.testing.assert_allclose(depth[near] / 256, observation.depth[near], atol=1 / 512)
        for found in line["objects"]:
            if found["mask"]:
                mask = naive_decode(found["mask"]["counts"], *found["mask"]["size"])
                np.testing.assert_array_equal(mask, observation.ids == found["id"])
    assert any(found["mask"] for found in lines[0]["objects"])


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("in-car-day", ("traffic.density=4", "scenery.density=0.1", "camera.width=160", "camera.height=120")),
        ("aerial-convoy", ("scenery.trees=0.1", "camera.width=160", "camera.height=120", "camera.focal=200")),
    ],
)
@pytest.mark.parametrize("layout", ["mot", "kitti"])
def test_the_other_scenes_are_written_too(name, overrides, layout, tmp_path):
    scenario = spec.load(name, ["seconds=0.1", *overrides])
    place = tmp_path / "set"
    generate(dataset(layout, scenario=scenario, seeds=range(500, 501)), place, ThisProcess())
    seen = []
    run_episode(scenario, 500, {}, on_frame=lambda observation, _: seen.append(observation))
    lines = [json.loads(line) for line in (place / "truth/0500/frames.jsonl").read_text().splitlines()]
    assert len(lines) == len(seen) == 3
    for line, observation in zip(lines, seen, strict=True):
        np.testing.assert_array_equal(cv2.imread(str(place / line["image"]))[..., ::-1], observation.image)
        truth = observation.truth
        assert [found["id"] for found in line["objects"]] == truth.ids.tolist()
        assert (line["ego"] is None) == (name == "aerial-convoy")
        for found, ids, pixels in zip(line["objects"], truth.ids, truth.visible_px, strict=True):
            if found["mask"]:
                mask = naive_decode(found["mask"]["counts"], *found["mask"]["size"])
                np.testing.assert_array_equal(mask, observation.ids == ids)
                assert mask.sum() == pixels
    assert any(found["mask"] for line in lines for found in line["objects"])


def test_nothing_but_the_layout_is_left(whole):
    assert {entry.name for entry in whole.iterdir()} == {
        *(".dataset.json", "manifest.json", "seqmaps", "testtrack-train", "truth"),
    }
    names = {entry.name for entry in (whole / "testtrack-train").iterdir()}
    assert names == {"0500", "0501", "0502"}
    assert {entry.name for entry in (whole / "testtrack-train/0500").iterdir()} == {
        *("img1", "gt", "seqinfo.ini"),
    }


@pytest.mark.parametrize("layout", ["coco", "kitti"])
def test_the_other_layouts(layout, tmp_path):
    place = tmp_path / layout
    generate(dataset(layout, seeds=range(501, 502)), place, ThisProcess())
    assert (place / "manifest.json").is_file()
    folder = place / LAYOUTS[layout].folder("0501")
    assert [entry.name for entry in sorted(folder.iterdir())] == [f"{k:06d}.png" for k in range(3)]
    if layout == "coco":
        document = json.loads((place / "annotations/instances.json").read_text())
        assert document == json.loads((place / "annotations/0501.json").read_text())
        assert [image["file_name"] for image in document["images"]] == [f"0501/{k:06d}.png" for k in range(3)]
        assert len({annotation["id"] for annotation in document["annotations"]}) == len(
            document["annotations"]
        )
    else:
        assert (place / "training/label_02/0501.txt").read_text().count("Cyclist") > 3


def test_a_video_in_place_of_pictures(whole, tmp_path):
    generate(dataset(coding="ffv1", seeds=range(501, 502)), tmp_path / "set", ThisProcess())
    path = tmp_path / "set/testtrack-train/0501/img1.mkv"
    with av.open(str(path)) as container:
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]
    assert len(frames) == 3
    for k, frame in enumerate(frames, start=1):
        image = cv2.imread(str(whole / f"testtrack-train/0501/img1/{k:06d}.png"))[..., ::-1]
        np.testing.assert_array_equal(frame, image)
    assert "imDir=img1.mkv" in (path.parent / "seqinfo.ini").read_text()


def test_the_bytes_do_not_depend_on_the_jobs(whole, tmp_path):
    generate(dataset(), tmp_path / "set", LocalPool(2))
    assert contents(tmp_path / "set") == contents(whole)


def test_a_finished_dataset_is_left_as_it_is(whole):
    before = {path: path.stat().st_mtime_ns for path in whole.rglob("*") if path.is_file()}
    assert generate(dataset(), whole, ThisProcess())["drawn"] == 0
    assert {path: path.stat().st_mtime_ns for path in whole.rglob("*") if path.is_file()} == before


class StoppedError(Exception):
    pass


class StopsAfter(ThisProcess):
    """Breaks off when so many episodes are drawn, before the last of them is moved to its place."""

    def __init__(self, count):
        self._count = count

    def each(self, work, seeds, **options):
        for number, found in enumerate(super().each(work, seeds, **options), start=1):
            if number == self._count:
                raise StoppedError
            yield found


@pytest.mark.parametrize("count", [1, 2, 3])
def test_what_was_drawn_is_not_drawn_again(whole, tmp_path, count, monkeypatch):
    place = tmp_path / "set"
    monkeypatch.setattr("scenarios.export.writer.write_episode", partial(from_drawn, whole))
    with pytest.raises(StoppedError):
        generate(dataset(), place, StopsAfter(count))
    assert not (place / "manifest.json").exists()
    assert generate(dataset(), place, ThisProcess())["drawn"] == 3 - count
    assert contents(place) == contents(whole)


def test_a_move_that_was_interrupted_is_gone_on_with(whole, tmp_path, monkeypatch):
    place = tmp_path / "set"
    monkeypatch.setattr("scenarios.export.writer.write_episode", partial(from_drawn, whole))
    rename, moves = Path.rename, []

    def failing(self, target):
        if generating.STAGING in self.parts and Path(target).parts[-2:-1] == ("truth",):
            moves.append(target)
            if len(moves) == 2:
                raise StoppedError  # its pictures are in their place, the truth is not
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", failing)
    with pytest.raises(StoppedError):
        generate(dataset(), place, ThisProcess())
    monkeypatch.undo()
    assert (place / "testtrack-train/0501").is_dir()
    assert not (place / "truth/0501").exists()
    monkeypatch.setattr("scenarios.export.writer.write_episode", partial(from_drawn, whole))
    (place / generating.STAGING / ".0502.half").mkdir()  # of a killed worker
    assert generate(dataset(), place, ThisProcess())["drawn"] == 1
    assert contents(place) == contents(whole)


def from_drawn(whole, _dataset, seed, root, _environment, _progress):
    """Stand in for drawing: copy what was drawn before."""
    for name, data in contents(whole).items():
        if sequence_name(seed) in Path(name).parts:
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_bytes(data)


def test_killed_and_resumed(whole, tmp_path):
    place = tmp_path / "set"
    command = [
        *(sys.executable, "-m", "scenarios.cli", "generate", "lane-day", "--set", "seconds=0.1"),
        *("--seed", "500", "--count", "3", "--out", str(place)),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    deadline = time.monotonic() + 600
    while not (place / "truth").is_dir() and time.monotonic() < deadline and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.communicate(timeout=60)
    assert (place / "truth").is_dir()
    for part in place.rglob("*"):  # what has its final name is whole
        if part.is_dir() and part.parent.name == "truth":
            assert contents(part) == contents(whole / part.relative_to(place))
    assert generate(dataset(), place, ThisProcess())["drawn"] <= 2
    assert contents(place) == contents(whole)


@pytest.mark.slow
def test_a_cluster_of_two_one_of_them_killed(whole, tmp_path):
    from distributed import LocalCluster

    place = tmp_path / "set"
    with (
        LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        open_workers(1, cluster.scheduler_address) as workers,
    ):
        victim = next(iter(cluster.workers.values())).pid

        def kill(_frames):
            nonlocal victim
            if victim:
                os.kill(victim, signal.SIGKILL)
                victim = None

        document = generate(dataset(), place, workers, lambda frames: kill(frames) if frames else None)
    assert victim is None
    assert document["drawn"] == 3
    assert contents(place) == contents(whole)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"layout": "coco"}, "format is mot, not coco"),
        ({"coding": "ffv1"}, "frames is png, not ffv1"),
        ({"seeds": range(500, 504)}, "seeds is"),
        ({"scenario": spec.load("lane-day", ["seconds=0.1", "sensor.noise=9"])}, "sensor.noise is"),
    ],
)
def test_another_dataset_is_never_mixed_in(whole, changes, message):
    before = contents(whole)
    with pytest.raises(InputError, match=message):
        generate(dataset(**changes), whole, ThisProcess())
    assert contents(whole) == before


def test_other_files_are_refused(tmp_path):
    (tmp_path / "mine.txt").touch()
    with pytest.raises(InputError, match="other files"):
        generate(dataset(), tmp_path, ThisProcess())
    with pytest.raises(InputError, match="no directory"):
        generate(dataset(), tmp_path / "mine.txt", ThisProcess())
    with pytest.raises(InputError, match="cannot write"):
        generate(dataset(), tmp_path / "mine.txt" / "below", ThisProcess())
    assert contents(tmp_path) == {"mine.txt": b""}


def test_two_at_once_are_refused(whole):
    with (
        generating._claimed(dataset(), whole),
        pytest.raises(InputError, match="another process"),
        generating._claimed(dataset(), whole),
    ):
        pass


def test_other_versions_are_never_mixed_in(whole, tmp_path, monkeypatch):
    place = tmp_path / "set"
    monkeypatch.setattr("scenarios.export.writer.write_episode", partial(from_drawn, whole))
    with pytest.raises(StoppedError):
        generate(dataset(), place, StopsAfter(2))
    monkeypatch.setattr(manifests, "environment", lambda: {"numpy": "1.0"})
    with pytest.raises(InputError, match="but other episodes were made with"):
        generate(dataset(), place, ThisProcess())
