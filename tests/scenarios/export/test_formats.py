"""Each format as the tool that owns it reads it; see `tests/fixtures/make_formats.py`."""

import json
from pathlib import Path

import numpy as np
import pytest

from scenarios.export.mot import read_tracks
from scenarios.export.writer import LAYOUTS
from scenarios.score.clear import clear
from scenarios.score.hota import hota
from scenarios.score.identity import identity
from scenarios.score.sequence import Sequence
from sim.world import Kind
from tests.scenarios.export import episodes
from tests.scenarios.export.test_rle import naive_decode
from tracker.boxes import iou

READ = json.loads((Path(__file__).parents[2] / "fixtures" / "formats.json").read_text())


def alike(a: str, b: str) -> bool:
    """Compare texts token by token, numbers with the last bits' freedom."""
    for line, other in zip(a.splitlines(), b.splitlines(), strict=True):
        for left, right in zip(line.split(), other.split(), strict=True):
            if left != right and abs(float(left) - float(right)) > 1e-6:
                return False
    return True


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_tools_read_what_is_written_now(layout, tmp_path):
    episodes.write(tmp_path, layout)
    written, read = episodes.texts(tmp_path), READ["files"][layout]
    assert written.keys() == read.keys()
    for name, text in written.items():
        assert alike(text, read[name]) if layout == "kitti" else text == read[name], name


def test_pycocotools_decodes_the_masks():
    found = iter(READ["coco"]["annotations"])
    for index, name in enumerate(episodes.NAMES):
        for tick, (record, ids) in enumerate(episodes.frames_of(index)):
            for row in np.flatnonzero(record.truth.visible_px):
                mask, annotation = ids == record.truth.ids[row], next(found)
                x0, y0, x1, y1 = record.truth.box_visible[row]
                assert annotation == {
                    "file": f"{name}/{tick:06d}.png",
                    "track": record.track_ids[row],
                    "category": Kind(record.truth.kinds[row]).name.lower(),
                    "area": mask.sum(),
                    "box": [x0, y0, x1 - x0, y1 - y0],
                    "rows": mask.sum(axis=1).tolist(),
                    "columns": mask.sum(axis=0).tolist(),
                }
                text = record.masks[row]
                np.testing.assert_array_equal(naive_decode(text, *mask.shape), mask)
    assert next(found, None) is None
    assert READ["coco"]["precision"] == {"segm": 1.0, "bbox": 1.0}


@pytest.mark.parametrize("index", range(len(episodes.NAMES)))
def test_trackeval_scores_mot_as_we_do(index):
    read = READ["mot"][episodes.NAMES[index]]
    frames, tracks = episodes.frames_of(index), episodes.tracks_of(index)
    assert read["frames"] == len(frames)
    truth_ids, track_ids, similarities, scored = [], [], [], 0
    for (record, _), track, boxes in zip(frames, tracks, read["read"], strict=True):
        clipped = np.clip(record.truth.box_amodal, 0, [episodes.CAMERA.width, episodes.CAMERA.height] * 2)
        inside = ((clipped[:, 2:] - clipped[:, :2]) > 0).all(axis=1)
        wanted = np.concatenate([record.track_ids[:, None], clipped], axis=1)
        wanted[:, 3:] -= wanted[:, 1:3]
        np.testing.assert_allclose(boxes, wanted[inside], atol=1e-3)
        kept = inside & (record.truth.visible >= 0.3)
        scored += kept.sum()
        truth_ids.append(record.track_ids[kept])
        track_ids.append(track.ids)
        similarities.append(iou(clipped[kept], np.round(track.boxes, 4)))
    assert read["scored"] == scored
    sequence = Sequence.of(truth_ids, track_ids, similarities)
    assert hota(sequence).hota.mean() == pytest.approx(read["hota"])
    assert identity(sequence).idf1 == pytest.approx(read["idf1"])
    assert clear(sequence).mota == pytest.approx(read["mota"])
    assert clear(sequence).id_switches == read["id_switches"]
    assert 0 < read["hota"] < 1


def test_gt_is_read_by_our_own_reader_too(tmp_path):
    episodes.write(tmp_path, "mot")
    folder = tmp_path / "testtrack-train" / "0500"
    frames = read_tracks(folder / "gt" / "gt.txt", frames=episodes.FRAMES)
    assert sum(map(len, (frame.ids for frame in frames))) == len(
        (folder / "gt" / "gt.txt").read_text().splitlines()
    )


@pytest.mark.parametrize("index", range(len(episodes.NAMES)))
def test_trackeval_reads_kittis_labels(index):
    read = READ["kitti"][episodes.NAMES[index]]
    assert read["frames"] == episodes.FRAMES
    assert read["scored"] > 0
    assert (read["hota"], read["idf1"], read["mota"], read["id_switches"]) == (1.0, 1.0, 1.0, 0)
    for (record, _), boxes in zip(episodes.frames_of(index), read["read"], strict=True):
        clipped = np.clip(record.truth.box_amodal, 0, [episodes.CAMERA.width, episodes.CAMERA.height] * 2)
        inside = ((clipped[:, 2:] - clipped[:, :2]) > 0).all(axis=1)
        wanted = np.concatenate([record.track_ids[:, None], clipped - [0, 0, 1, 1]], axis=1)
        np.testing.assert_allclose(boxes, wanted[inside], atol=1e-3)


class Kitti:
    """KITTI's files as the readmes of its devkits describe them, one sequence."""

    def __init__(self, root: Path, name: str) -> None:
        self.labels = [line.split() for line in (root / "label_02" / f"{name}.txt").read_text().splitlines()]
        self.calibration = {}
        for line in (root / "calib" / f"{name}.txt").read_text().splitlines():
            key, *numbers = line.split()
            self.calibration[key.rstrip(":")] = np.array(numbers, float).reshape(3, -1)
        self.oxts = np.loadtxt(root / "oxts" / f"{name}.txt")

    def corners(self, label: list[str]) -> np.ndarray:
        """(2, 8) pixels of the 3D box's corners."""
        h, w, length, x, y, z, turn = map(float, label[10:17])
        half = length / 2
        corners = np.array(
            [
                [half, half, -half, -half, half, half, -half, -half],
                [0, 0, 0, 0, -h, -h, -h, -h],
                [w / 2, -w / 2, -w / 2, w / 2, w / 2, -w / 2, -w / 2, w / 2],
            ]
        )
        c, s = np.cos(turn), np.sin(turn)
        placed = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ corners + [[x], [y], [z]]
        points = self.calibration["P2"] @ np.vstack([placed, np.ones(8)])
        return points[:2] / points[2]

    def unit_poses(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Position and axes of the inertial unit in the world, frame by frame (convertOxtsToPose)."""
        radius, out = 6378137.0, []
        scale = np.cos(np.radians(self.oxts[0, 0]))
        for lat, lon, alt, roll, pitch, yaw in self.oxts[:, :6]:
            east = scale * np.radians(lon) * radius
            north = scale * radius * np.log(np.tan(np.radians(90 + lat) / 2))
            cr, sr, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
            cy, sy = np.cos(yaw), np.sin(yaw)
            rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
            ry = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
            rz = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
            out.append((np.array([east, north, alt]), rz @ ry @ rx))
        return out


@pytest.fixture(scope="module")
def kitti(tmp_path_factory):
    root = tmp_path_factory.mktemp("kitti")
    episodes.write(root, "kitti")
    return Kitti(root / "training", "0500")


def test_kittis_3d_boxes_project_onto_the_2d_ones(kitti):
    frames, checked = episodes.frames_of(0), 0
    for label in kitti.labels:
        truncated = int(label[3])
        if truncated:
            continue
        corners = kitti.corners(label)
        box = np.array(label[6:10], float)
        projected = np.concatenate([corners.min(axis=1), corners.max(axis=1)])
        record, _ = frames[int(label[0])]
        # The camera is tilted by up to 0.08 rad, and KITTI's boxes turn about one axis only.
        slack = 1.5 + 0.1 * max(box[2:] - box[:2])
        np.testing.assert_allclose(projected, box, atol=slack)
        assert int(label[1]) in record.track_ids
        checked += 1
    assert checked > 10


def test_kittis_angles_and_levels(kitti):
    for label in kitti.labels:
        x, z, turn, alpha = float(label[13]), float(label[15]), float(label[16]), float(label[5])
        assert -np.pi <= alpha <= np.pi
        assert np.cos(alpha - (turn - np.arctan2(x, z))) == pytest.approx(1.0)
        assert label[2] in {"Car", "Van", "Truck", "Misc", "Cyclist"}
        assert label[3] in "012"
        assert label[4] in "012"
    assert {label[4] for label in kitti.labels} == {"0", "1", "2"}


def test_kittis_inertial_unit_knows_the_cameras_pose(kitti):
    assert kitti.oxts.shape == (episodes.FRAMES, 30)
    velo_to_cam = kitti.calibration["Tr_velo_cam"] @ np.vstack(
        [kitti.calibration["Tr_imu_velo"], [0, 0, 0, 1]]
    )
    for (record, _), (position, axes) in zip(episodes.frames_of(0), kitti.unit_poses(), strict=True):
        np.testing.assert_allclose(position, record.pose.position, atol=1e-5)
        np.testing.assert_allclose(velo_to_cam[:, :3] @ axes.T, record.pose.rotation, atol=1e-9)
        np.testing.assert_allclose(velo_to_cam[:, 3], 0)


def test_kittis_rates_are_those_of_the_motion(kitti):
    # East at 6 m/s and north at 1 m/s, turning left at 0.5 rad/s.
    inner = kitti.oxts[1:-1]
    np.testing.assert_allclose(inner[:, 6], 1.0)
    np.testing.assert_allclose(inner[:, 7], 6.0)
    yaw = inner[:, 5]
    np.testing.assert_allclose(inner[:, 8], 6 * np.cos(yaw) + np.sin(yaw), atol=1e-9)
    np.testing.assert_allclose(inner[:, 9], -6 * np.sin(yaw) + np.cos(yaw), atol=1e-9)
    np.testing.assert_allclose(inner[:, 22], 0.5, atol=0.01)
    np.testing.assert_allclose(np.linalg.norm(inner[:, 11:14], axis=1), 9.80665, atol=1e-6)
    # Rates about the unit's own axes turn its axes as far as the next pose is turned.
    poses = kitti.unit_poses()
    for k in range(1, len(poses) - 1):
        turned = poses[k - 1][1].T @ poses[k + 1][1]
        seen = (
            0.5
            * episodes.RATE
            * np.array(
                [turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]
            )
        )
        np.testing.assert_allclose(kitti.oxts[k, 17:20], seen / 2, atol=0.01)


def test_seqmap_and_calibration(kitti):
    assert kitti.calibration["P2"].shape == (3, 4)
    assert kitti.calibration["P2"][0, 2] == episodes.CAMERA.cx - 0.5
    text = READ["files"]["kitti"]["training/evaluate_tracking.seqmap.training"]
    assert text == "0500 empty 000000 000008\n0501 empty 000000 000008\n"
