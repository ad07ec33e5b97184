"""Pictures and depth come back as they went in."""

from pathlib import PurePosixPath

import av
import cv2
import numpy as np
import pytest

from scenarios.export.frames import FrameFiles, open_frames, write_depth


def pictures(size=(22, 34), frames=4):
    return np.random.default_rng(3).integers(0, 256, (frames, *size, 3), dtype=np.uint8)


def written(root, coding, images):
    files = FrameFiles(folder=PurePosixPath("images/0007"), first=1, coding=coding)
    height, width = images.shape[1:3]
    with open_frames(root, files, width=width, height=height, rate=30) as writer:
        for image in images:
            writer.write(image)
    return files


def decoded(path):
    with av.open(str(path)) as container:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])


def test_png_loses_nothing(tmp_path):
    images = pictures()
    files = written(tmp_path, "png", images)
    assert [files.of(k) for k in range(2)] == ["images/0007/000001.png", "images/0007/000002.png"]
    for k, image in enumerate(images):
        np.testing.assert_array_equal(cv2.imread(str(tmp_path / files.of(k)))[..., ::-1], image)
    assert len(list((tmp_path / "images" / "0007").iterdir())) == len(images)


def test_ffv1_loses_nothing_and_is_the_same_each_time(tmp_path):
    images = pictures()
    files = written(tmp_path / "a", "ffv1", images)
    assert files.of(0) == files.of(3) == "images/0007.mkv"
    np.testing.assert_array_equal(decoded(tmp_path / "a" / files.of(0)), images)
    written(tmp_path / "b", "ffv1", images)
    assert (tmp_path / "a" / files.of(0)).read_bytes() == (tmp_path / "b" / files.of(0)).read_bytes()


def test_h264_is_near_and_the_same_each_time(tmp_path):
    images = np.repeat(np.linspace(0, 250, 4).astype(np.uint8), 22 * 34 * 3).reshape(4, 22, 34, 3)
    files = written(tmp_path / "a", "h264", images)
    assert files.of(2) == "images/0007.mp4"
    found = decoded(tmp_path / "a" / files.of(0))
    assert found.shape == images.shape
    assert np.abs(found.astype(int) - images).max() < 12
    written(tmp_path / "b", "h264", images)
    assert (tmp_path / "a" / files.of(0)).read_bytes() == (tmp_path / "b" / files.of(0)).read_bytes()


def test_depth_in_steps_of_a_256th_metre_and_0_where_there_is_none(tmp_path):
    depth = np.array([[0.5, 1.001, 255.99, 256.1], [np.inf, 2000.0, 10.25, 100.0]], np.float32)
    write_depth(tmp_path / "depth.png", depth)
    steps = cv2.imread(str(tmp_path / "depth.png"), cv2.IMREAD_UNCHANGED)
    assert steps.dtype == np.uint16
    np.testing.assert_array_equal(steps, [[128, 256, 65533, 0], [0, 0, 2624, 25600]])


def test_a_picture_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(OSError, match="cannot be written"):
        write_depth(tmp_path / "none" / "depth.png", np.ones((2, 2), np.float32))
