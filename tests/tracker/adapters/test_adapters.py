"""The adapters: with their packages, against stored answers; without them, one line names what is missing."""

import importlib.util
import json

import numpy as np
import pytest

from tests.fixtures.make_adapters import INFO, PATH, answers, detections
from tracker.base import check_tracker
from tracker.registry import DETECTION_TRACKERS, build
from tracker.types import Status

PACKAGES = {"bytetrack": "supervision", "norfair": "norfair", "stone-soup-jpda": "stonesoup"}
STORED = json.loads(PATH.read_text())


def here(name: str) -> bool:
    return importlib.util.find_spec(PACKAGES[name]) is not None


def test_jpda_shows_the_innovations_of_its_updates():
    if not here("stone-soup-jpda"):
        pytest.skip("stonesoup is not installed")
    tracker = build("stone-soup-jpda")
    tracker.start(INFO)
    shown = []
    for found in detections():
        tracks = tracker.follow(found)
        innovations = tracker.diagnostics.innovations
        assert len(innovations) == (tracks.status == Status.CONFIRMED).sum()
        shown += innovations.tolist()
    # Its noise is set for real boxes, three times what was added to these.
    assert len(shown) > 60
    assert 0 < np.mean(shown) < 2


@pytest.mark.parametrize("name", DETECTION_TRACKERS)
def test_the_answers_are_the_stored_ones(name):
    if not here(name):
        pytest.skip(f"{PACKAGES[name]} is not installed")
    for found, wanted in zip(answers(name, detections()), STORED[name], strict=True):
        assert (found["ids"], found["status"]) == (wanted["ids"], wanted["status"])
        np.testing.assert_allclose(found["boxes"], wanted["boxes"], atol=0.01)


@pytest.mark.parametrize("name", DETECTION_TRACKERS)
def test_the_contract_is_kept(name):
    if not here(name):
        pytest.skip(f"{PACKAGES[name]} is not installed")
    check_tracker(build(name))


@pytest.mark.parametrize("name", DETECTION_TRACKERS)
def test_a_missing_package_is_named(name):
    if here(name):
        pytest.skip(f"{PACKAGES[name]} is installed")
    with pytest.raises(
        ValueError, match=f"needs a package that is not here: No module named '{PACKAGES[name]}"
    ):
        build(name)


@pytest.mark.parametrize("name", DETECTION_TRACKERS)
def test_the_stored_tracks_lie_on_the_objects(name):
    """From the tenth frame on each tracker of the stored run has the first object confirmed, by one id."""
    ids = set()
    for given, shown in zip(detections()[10:], STORED[name][10:], strict=True):
        near = [
            number
            for number, box, status in zip(shown["ids"], shown["boxes"], shown["status"], strict=True)
            if status == Status.CONFIRMED and np.abs(np.array(box) - given.boxes[0]).max() < 12
        ]
        ids.update(near)
    assert ids
