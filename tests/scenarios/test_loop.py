import dataclasses

import numpy as np
import pytest

from scenarios import bridge, spec
from scenarios.loop import track_observations
from tests.scenarios.fakes import CAMERA, CAR, BrightTracker, SilentTracker, observations

FRAMES = 12


@pytest.fixture(scope="module")
def scenario():
    return spec.load("in-car-day")


def follow(scenario, trackers, frames=None, **options):
    frames = observations(FRAMES) if frames is None else frames
    return track_observations(frames, scenario, 0, trackers, info=bridge.tracker_info(CAMERA, 30), **options)


def test_every_tracker_steps_on_each_frame_and_gets_its_own_log(scenario):
    trackers = {"bright": BrightTracker(), "silent": SilentTracker()}
    bright, silent = follow(scenario, trackers)
    assert (bright.tracker, silent.tracker) == ("bright", "silent")
    assert bright.has_boxes
    assert not silent.has_boxes
    assert len(bright.tracks) == len(silent.tracks) == len(bright.truth) == FRAMES
    assert bright.hashes["frames"] == silent.hashes["frames"]
    assert bright.hashes["truth"] == silent.hashes["truth"]
    assert bright.hashes["tracks"] != silent.hashes["tracks"]
    assert silent.traces is None
    assert np.all(bright.ego_speed == 20.0)


def test_what_a_tracker_does_to_its_arrays_reaches_nobody(scenario):
    twins = follow(scenario, {"a": BrightTracker(), "b": BrightTracker()})
    alone = follow(scenario, {"a": BrightTracker()})[0]
    for log in twins:
        assert log.hashes == alone.hashes
    x0 = [frame.boxes[0, 0] for frame in alone.tracks]
    assert x0 == [10 + tick for tick in range(FRAMES)]


def test_traces_come_with_their_votes(scenario):
    traces = follow(scenario, {"bright": BrightTracker()})[0].traces
    assert traces is not None
    assert traces.ticks.tolist() == np.repeat(np.arange(FRAMES), 2).tolist()
    rows = zip(traces.vote_ids, traces.vote_objects, traces.vote_counts, strict=True)
    assert [tuple(map(int, row)) for row in rows] == [(1, CAR, 2), (2, 1, 1)] * FRAMES


def test_timing_has_every_stage_of_every_frame(scenario):
    timing = follow(scenario, {"bright": BrightTracker()})[0].timing_ms
    assert list(timing) == ["world", "render", "sensor", "truth", "track"]
    assert all(len(ms) == FRAMES for ms in timing.values())
    assert np.all(timing["render"] == 2.0)
    assert np.all(timing["truth"] > 4.0)


def test_truth_does_not_leak(scenario):
    def lying(frames):
        for observation in frames:
            truth = dataclasses.replace(
                observation.truth, ids=observation.truth.ids + 5, box_amodal=observation.truth.box_amodal + 9
            )
            yield dataclasses.replace(
                observation, truth=truth, ids=np.zeros_like(observation.ids), depth=observation.depth * 2
            )

    true = follow(scenario, {"bright": BrightTracker()}, odometry=True)[0].hashes
    false = follow(scenario, {"bright": BrightTracker()}, lying(observations(FRAMES)), odometry=True)[
        0
    ].hashes
    assert true["tracks"] == false["tracks"]
    assert true["frames"] == false["frames"]
    assert true["truth"] != false["truth"]


def test_hashes_follow_what_they_are_of(scenario):
    def hashes(**options):
        return follow(scenario, {"bright": BrightTracker()}, observations(FRAMES, **options))[0].hashes

    assert hashes() == hashes()
    noisier, other = hashes(noise=4.0), hashes(car=CAR + 1)
    assert noisier["truth"] == hashes()["truth"]
    assert noisier["frames"] != hashes()["frames"]
    assert other["truth"] != hashes()["truth"]


def test_frames_are_taken_one_by_one(scenario):
    taken, seen = [], []

    def counted():
        for observation in observations(FRAMES):
            taken.append(observation.tick)
            yield observation

    def on_frame(observation, shown):
        tracks, diagnostics = shown["bright"]
        seen.append((observation.tick, len(taken), len(tracks), len(diagnostics.traces.ids)))

    follow(scenario, {"bright": BrightTracker()}, counted(), on_frame=on_frame)
    assert seen == [(tick, tick + 1, 1, 2) for tick in range(FRAMES)]
