"""What stands beside every format."""

import json

import numpy as np
import pytest

from scenarios.export.truth import write_truth
from sim.camera import Camera, Pose, project
from tests.scenarios.export import episodes
from tests.scenarios.export.test_rle import naive_decode


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("truth")
    write_truth(place, episodes.episode_of(0, "mot"))
    return place


def test_a_line_a_frame_with_every_vehicle(folder):
    lines = [json.loads(line) for line in (folder / "frames.jsonl").read_text().splitlines()]
    frames = episodes.frames_of(0)
    assert [line["frame"] for line in lines] == list(range(episodes.FRAMES))
    assert lines[0]["image"] == "testtrack-train/0500/img1/000001.png"
    for line, (record, ids) in zip(lines, frames, strict=True):
        assert line["time"] == record.time
        assert line["ego"]["speed"] == 6.0
        assert line["odometry"] == {"speed": 10.0, "yaw_rate": 0.0}
        truth = record.truth
        assert [found["id"] for found in line["objects"]] == truth.ids.tolist()
        for k, found in enumerate(line["objects"]):
            assert found["visible_px"] == truth.visible_px[k]
            assert found["visible"] == truth.visible[k]
            assert found["visibility_in_frame"] == truth.visibility_in_frame[k]
            assert found["in_frame"] == truth.in_frame[k]
            assert found["box_amodal"] == truth.box_amodal[k].tolist()
            if truth.visible_px[k]:
                assert found["box_visible"] == truth.box_visible[k].tolist()
                mask = naive_decode(found["mask"]["counts"], *found["mask"]["size"])
                np.testing.assert_array_equal(mask, ids == truth.ids[k])
            else:
                assert found["box_visible"] is None
                assert found["mask"] is None


def test_calibration_and_poses_project_the_world_into_the_picture(folder):
    calibration = json.loads((folder / "camera.json").read_text())
    assert calibration.pop("rate") == episodes.RATE
    camera = Camera(**calibration)
    inside = 0
    for line in map(json.loads, (folder / "frames.jsonl").read_text().splitlines()):
        pose = Pose(np.array(line["camera"]["position"]), np.array(line["camera"]["rotation"]))
        for found in line["objects"]:
            middle = np.add(found["position"], (0, 0, found["size"][2] / 2))
            (x, y), _ = project(camera, pose, middle)
            x0, y0, x1, y1 = found["box_amodal"]
            assert x0 <= x <= x1
            assert y0 <= y <= y1
            inside += 1
    assert inside == episodes.FRAMES * len(episodes.KINDS)


def test_occlusion_events_are_kept(folder):
    from sim.truth.events import occlusion_events

    wanted = occlusion_events([record.truth for record, _ in episodes.frames_of(0)], episodes.RATE)
    found = json.loads((folder / "events.json").read_text())
    assert [(event["hidden"], event["first"], event["last"]) for event in found] == [
        (event.hidden, event.first, event.last) for event in wanted
    ]
    assert wanted
