import json

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.output import to_json, whole_directory


def names(path):
    return sorted(entry.name for entry in path.iterdir())


def test_a_directory_appears_only_when_it_is_whole(tmp_path):
    target = tmp_path / "deep" / "out"
    with whole_directory(target) as part:
        (part / "a.txt").write_text("a")
        assert not target.parent.exists()
    assert (target / "a.txt").read_text() == "a"
    assert names(tmp_path) == ["deep"]
    assert names(target.parent) == ["out"]


@pytest.mark.parametrize("stop", [ValueError, KeyboardInterrupt])
def test_nothing_is_left_of_what_was_broken_off(tmp_path, stop):
    def break_off():
        with whole_directory(tmp_path / "deep" / "out") as part:
            (part / "a.txt").write_text("a")
            raise stop

    with pytest.raises(stop):
        break_off()
    assert names(tmp_path) == []


def test_what_was_written_before_is_replaced_or_kept(tmp_path):
    target = tmp_path / "out"
    for name in ("old", "new"):
        with whole_directory(target) as part:
            (part / name).touch()
    assert names(target) == [".testtrack", "new"]

    def break_off():
        with whole_directory(target):
            raise ValueError

    with pytest.raises(ValueError):  # noqa: PT011
        break_off()
    assert names(target) == [".testtrack", "new"]
    assert names(tmp_path) == ["out"]


def test_files_of_others_are_never_replaced(tmp_path):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.tex").touch()
    (tmp_path / "file").touch()
    for target in (tmp_path / "mine", tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="--out"), whole_directory(target):
            pass
    assert names(tmp_path) == ["file", "mine"]
    assert names(tmp_path / "mine") == ["thesis.tex"]


def test_an_empty_directory_is_used(tmp_path):
    (tmp_path / "out").mkdir()
    with whole_directory(tmp_path / "out") as part:
        (part / "a").touch()
    assert names(tmp_path / "out") == [".testtrack", "a"]


def test_json_is_strict():
    document = {
        "a": np.float64(0.5),
        "b": float("nan"),
        "c": np.array([1, 2]),
        "d": (np.int64(3), None),
        4: np.nan,
    }
    assert json.loads(to_json(document)) == {"a": 0.5, "b": None, "c": [1, 2], "d": [3, None], "4": None}
