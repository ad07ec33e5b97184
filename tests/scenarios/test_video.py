import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.video import Video
from tests.scenarios.clips import cut, write_clip


def read(path):
    with Video(path) as video:
        return list(video.frames())


def test_frames_come_in_order_with_time_and_number(tmp_path):
    path = write_clip(tmp_path / "clip.mp4", 30)
    with Video(path) as video:
        assert (video.width, video.height, video.rate, video.announced) == (64, 48, 25.0, 30)
        frames = list(video.frames())
    assert [frame.tick for frame in frames] == list(range(30))
    assert [frame.time for frame in frames] == pytest.approx(np.arange(30) / 25)
    assert frames[0].image.shape == (48, 64, 3)
    assert frames[0].image.dtype == np.uint8
    brightness = [frame.image.mean() for frame in frames]
    assert np.all(np.diff(brightness) > 2)


def test_frames_are_decoded_as_they_are_asked_for(tmp_path):
    path = write_clip(tmp_path / "clip.mkv", 30)
    with Video(path) as video:
        frames = video.frames()
        assert next(frames).tick == 0
        assert next(frames).tick == 1


@pytest.mark.parametrize("name", ["clip.mp4", "clip.avi", "clip.mkv"])
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_a_truncated_file_is_refused(tmp_path, name, share):
    path = cut(write_clip(tmp_path / name, 60), share)
    with pytest.raises(InputError, match=r"breaks off after \d+ frames|cannot be read as a video"):
        read(path)


def test_a_truncated_file_with_its_index_in_front_is_refused(tmp_path):
    path = cut(write_clip(tmp_path / "clip.mp4", 60, movflags="faststart"), 0.8)
    with pytest.raises(InputError, match=r"breaks off after \d+ frames"):
        read(path)


@pytest.mark.parametrize("name", ["none.mp4", "none.avi", "none.mkv"])
def test_a_video_without_frames_is_refused(tmp_path, name):
    with pytest.raises(InputError, match=r"no frames|no video stream|cannot be read"):
        read(write_clip(tmp_path / name, 0))


def test_what_is_no_video_is_refused(tmp_path):
    text = tmp_path / "text.mp4"
    text.write_text("not a video\n" * 50)
    empty = tmp_path / "empty.mp4"
    empty.touch()
    for path in (text, empty):
        with pytest.raises(InputError, match="cannot be read as a video"):
            read(path)
    with pytest.raises(InputError, match="no such file"):
        read(tmp_path / "none.mp4")
    with pytest.raises(InputError, match="is no file"):
        read(tmp_path)
