"""The in-car tracker on real recordings, against labels made by eye.

``python -m tests.validation.recordings`` prints, clip by clip, how many of the labelled same-way cars
are covered and which tracks stand on nothing. Labels (labels/in_car.json) are x intervals every 25
frames. Names that begin with "far:" are vehicles lower than 12 px at 640 px width, or mostly out of
view: they need not be covered, and a track on one is not false.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from scenarios.video import Video
from tracker import registry
from tracker.types import Frame, Info, Intrinsics, Status

RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "real" / "in-car"
LABELS = Path(__file__).parent / "labels" / "in_car.json"
FOCAL = {"test_video.mp4": 1157.0}
CLIPS = ("solidWhiteRight.mp4", "test_video.mp4", "night_motorway.mp4", "empty_desert_road.mp4")
COVERING_IOU = 0.5
"""Least overlap of a track's x interval with a label's, intersection over union, one to one."""
ON_NOTHING_SECONDS = 0.5
SETTLED = 1
"""Labelled frames left out of the second count: in a clip's very first frame nothing has moved yet."""

Interval = tuple[float, float]


@dataclass(frozen=True)
class ClipResult:
    """What a clip showed.

    Attributes:
        labelled: Cars, of each labelled frame.
        covered: How many of them have a track, likewise.
        false_tracks: Ids of tracks on nothing.
        seconds: Its length.
    """

    labelled: tuple[int, ...]
    covered: tuple[int, ...]
    false_tracks: tuple[int, ...]
    seconds: float


def overlap(a: Interval, b: Interval) -> float:
    """Intersection over union of two intervals."""
    inner = max(0.0, min(a[1], b[1]) - max(a[0], b[0]))
    return inner / (a[1] - a[0] + b[1] - b[0] - inner)


def covered(labels: list[Interval], tracks: list[Interval]) -> int:
    """How many labels have a track of their own with enough overlap."""
    if not labels or not tracks:
        return 0
    overlaps = np.array([[overlap(label, track) for track in tracks] for label in labels])
    rows, columns = linear_sum_assignment(-(overlaps >= COVERING_IOU).astype(float))
    return int((overlaps[rows, columns] >= COVERING_IOU).sum())


def labels_between(labels: dict[int, dict[str, Interval]], frame: int) -> list[Interval]:
    """All labelled intervals of a frame, interpolated between the two labelled frames around it."""
    before = max((f for f in labels if f <= frame), default=min(labels))
    after = min((f for f in labels if f >= frame), default=max(labels))
    weight = (frame - before) / (after - before) if after > before else 0.0
    strip = {f: {name.removeprefix("far:"): x for name, x in labels[f].items()} for f in (before, after)}
    found = []
    for name in {**strip[before], **strip[after]}:
        start = strip[before].get(name, strip[after].get(name))
        end = strip[after].get(name, start)
        found.append(tuple((1 - weight) * np.array(start) + weight * np.array(end)))
    return found


def evaluate(clip: str, tracker_name: str = "in-car") -> ClipResult:
    """Run a tracker over a clip and compare it with the labels."""
    documents = json.loads(LABELS.read_text())
    labels = {int(f): {n: tuple(x) for n, x in row.items()} for f, row in documents.get(clip, {}).items()}
    tracker = registry.make(tracker_name)
    labelled, found = [], []
    lifetimes: dict[int, int] = {}
    on_nothing: dict[int, int] = {}
    with Video(RECORDINGS / clip) as video:
        focal = FOCAL.get(clip)
        intrinsics = focal and Intrinsics(focal=focal, cx=video.width / 2, cy=video.height / 2)
        tracker.start(
            Info(width=video.width, height=video.height, rate=video.rate, intrinsics=intrinsics or None)
        )
        frames = 0
        for picture in video.frames():
            tick = picture.tick
            tracks = tracker.step(Frame(image=picture.image, tick=tick, time=picture.time))
            frames += 1
            confirmed = tracks.status == Status.CONFIRMED
            spans = [(float(b[0]), float(b[2])) for b in tracks.boxes[confirmed]]
            if tick in labels:
                wanted = [x for name, x in labels[tick].items() if not name.startswith("far:")]
                labelled.append(len(wanted))
                found.append(covered(wanted, spans))
            vehicles = labels_between(labels, tick) if labels else []
            for identity, span in zip(tracks.ids[confirmed].tolist(), spans, strict=True):
                middle = (span[0] + span[1]) / 2
                touches = any(overlap(span, v) > 0.2 or v[0] <= middle <= v[1] for v in vehicles)
                lifetimes[identity] = lifetimes.get(identity, 0) + 1
                on_nothing[identity] = on_nothing.get(identity, 0) + (not touches)
        limit = ON_NOTHING_SECONDS * video.rate
        false = tuple(i for i in lifetimes if on_nothing[i] >= limit)
        return ClipResult(
            labelled=tuple(labelled),
            covered=tuple(found),
            false_tracks=false,
            seconds=frames / video.rate,
        )


def share(result: ClipResult, first: int) -> str:
    """Say how many cars are covered in the labelled frames from one on."""
    hits, total = sum(result.covered[first:]), sum(result.labelled[first:])
    return f"{hits}/{total} {hits / total:.2f}" if total else "-"


def main() -> None:
    """Print the table."""
    print(f"{'clip':24} {'covered':>12} {'after 1st':>12} {'false tracks':>13} {'per 10 s':>9}")
    for clip in CLIPS:
        result = evaluate(clip)
        shares = f"{share(result, 0):>12} {share(result, SETTLED):>12}"
        rate = 10 * len(result.false_tracks) / result.seconds
        print(f"{clip:24} {shares} {len(result.false_tracks):>13} {rate:>9.2f}")


if __name__ == "__main__":
    main()
