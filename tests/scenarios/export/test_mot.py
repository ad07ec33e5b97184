"""MOTChallenge text, written and read."""

from pathlib import Path

import numpy as np
import pytest

from scenarios.export import mot
from tracker.types import Status, Tracks


def test_only_confirmed_tracks_frames_from_one_boxes_unshifted(tmp_path: Path) -> None:
    frames = [
        Tracks.none(),
        Tracks(
            ids=np.array([4, 9]),
            boxes=np.array([[0.0, 1.5, 10.0, 21.25], [5.0, 5.0, 6.0, 6.0]]),
            status=np.array([Status.CONFIRMED, Status.COASTING], np.uint8),
        ),
    ]
    mot.write_tracks(tmp_path / "tracks.txt", frames)
    assert (tmp_path / "tracks.txt").read_text() == "2,4,0.0000,1.5000,10.0000,19.7500,1.0000,-1,-1,-1\n"
    first, second, third = mot.read_tracks(tmp_path / "tracks.txt", frames=3)
    assert len(first) == len(third) == 0
    assert second.ids.tolist() == [4]
    assert second.boxes.tolist() == [[0.0, 1.5, 10.0, 21.25]]
    assert len(mot.read_tracks(tmp_path / "tracks.txt")) == 2
    assert [p.name for p in tmp_path.iterdir()] == ["tracks.txt"]


def test_a_failed_write_leaves_nothing(tmp_path: Path) -> None:
    def frames() -> object:
        yield Tracks.none()
        raise RuntimeError("stopped")

    with pytest.raises(RuntimeError):
        mot.write_tracks(tmp_path / "tracks.txt", frames())  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("1,2,3\n", "line 1: wanted"),
        ("1,1,0,0,5,5\n1,2,0,0,x,5\n", "line 2"),
        ("0,1,0,0,5,5\n", "from 1"),
        ("1.5,1,0,0,5,5\n", "from 1"),
        ("1,1,0,0,nan,5\n", "finite"),
        ("1,1,0,0,-5,5\n", "-5 by 5"),
        ("1,1,0,0,5,5\n1,1,0,0,5,5\n", "twice"),
        ("9,1,0,0,5,5\n", "frame 9"),
    ],
)
def test_bad_lines_are_named(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "tracks.txt").write_text(text)
    with pytest.raises(ValueError, match=message):
        mot.read_tracks(tmp_path / "tracks.txt", frames=5)


def test_missing_and_binary_files(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="cannot be read"):
        mot.read_tracks(tmp_path / "none.txt")
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match="cannot be read"):
        mot.read_tracks(tmp_path / "binary")
