"""The motorcycle-lane trackers on real recordings of static cameras, against labels made by eye.

``python -m tests.validation.static_recordings`` prints, clip by clip and tracker by tracker, how many of the
labelled vehicles have a confirmed box of their own with IoU >= .4, and how many boxes have no label. Labels
(labels/static.json) are boxes x0, y0, x1, y1 in every 50th frame; what is centred above "far_above" is
too small to be labelled, and counts neither way.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from scenarios.video import Video
from tracker import registry
from tracker.boxes import iou
from tracker.types import Frame, Info, Status

RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "real" / "static"
LABELS = Path(__file__).parent / "labels" / "static.json"
TRACKERS = ("motorcycle-lane", "motorcycle-lane:paper", "motorcycle-lane:mog2-nn")
FOUND_IOU = 0.4

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ClipResult:
    """What a clip's labelled frames showed: labels, those found, boxes without a label."""

    labelled: int
    found: int
    false: int


def count_found(labels: Floats, boxes: Floats) -> int:
    """How many labels (L, 4) have a box of their own among (N, 4)."""
    overlaps = iou(labels, boxes) >= FOUND_IOU
    rows, columns = linear_sum_assignment(overlaps, maximize=True)
    return int(overlaps[rows, columns].sum())


def evaluate(clip: str, tracker_name: str) -> ClipResult:
    """Run a tracker over a clip and compare it with the labels."""
    document = json.loads(LABELS.read_text())[clip]
    labels = {int(tick): list(boxes.values()) for tick, boxes in document["frames"].items()}
    tracker = registry.make(tracker_name)
    labelled = found = false = 0
    with Video(RECORDINGS / clip) as video:
        tracker.start(Info(width=video.width, height=video.height, rate=video.rate, intrinsics=None))
        for picture in video.frames():
            tracks = tracker.step(Frame(image=picture.image, tick=picture.tick, time=picture.time))
            if picture.tick not in labels:
                continue
            wanted = np.array(labels[picture.tick], float).reshape(-1, 4)
            boxes = tracks.boxes[tracks.status == Status.CONFIRMED]
            hits = count_found(wanted, boxes)
            near = 0.5 * (boxes[:, 1] + boxes[:, 3]) >= document["far_above"]
            labelled, found = labelled + len(wanted), found + hits
            false += max(int(near.sum()) - hits, 0)
    return ClipResult(labelled=labelled, found=found, false=false)


def main() -> None:
    """Print the table."""
    print(f"{'clip':24} {'tracker':26} {'found':>9} {'recall':>7} {'false boxes':>12}")
    for clip in json.loads(LABELS.read_text()):
        for name in TRACKERS:
            result = evaluate(clip, name)
            counts, recall = f"{result.found}/{result.labelled}", result.found / result.labelled
            print(f"{clip:24} {name:26} {counts:>9} {recall:7.2f} {result.false:12}")


if __name__ == "__main__":
    main()
