"""COCO JSON: images, instances with run-length masks, and videos with track ids.

``bbox``, ``area`` and ``segmentation`` are of the visible part; vehicles of which nothing is visible have
no annotation. Pictures count from 0. ``annotations/instances.json`` has all sequences; each has a file of
its own beside it with the same ids.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path, PurePosixPath
from typing import Any, ClassVar

import numpy as np

from scenarios.export.episode import Episode, FrameRecord
from scenarios.files import moved_in
from scenarios.output import to_json
from sim.world import VEHICLE_KINDS

ROWS = 10_000
"""Annotations of an image are numbered from its id times this: no two images share one."""
_LISTS = ("videos", "images", "annotations")
_HEAD: dict[str, Any] = {
    "info": {"description": "simulated by testtrack"},
    "licenses": [],
    "categories": [
        {"id": int(kind), "name": kind.name.lower(), "supercategory": "vehicle"} for kind in VEHICLE_KINDS
    ],
}


class CocoLayout:
    """See the module."""

    first: ClassVar[int] = 0

    def folder(self, name: str) -> PurePosixPath:
        """See `Layout.folder`."""
        return PurePosixPath("images", name)

    def write_episode(self, root: Path, episode: Episode) -> None:
        """See `Layout.write_episode`."""
        first_image = episode.index * len(episode.frames) + 1
        video = {
            "id": episode.index + 1,
            "name": episode.name,
            "width": episode.camera.width,
            "height": episode.camera.height,
            "fps": episode.rate,
            "length": len(episode.frames),
        }
        images = [
            {
                "id": first_image + k,
                "file_name": PurePosixPath(episode.images.of(k)).relative_to("images").as_posix(),
                "width": episode.camera.width,
                "height": episode.camera.height,
                "video_id": episode.index + 1,
                "frame_id": k,
            }
            for k in range(len(episode.frames))
        ]
        size = [episode.camera.height, episode.camera.width]
        annotations = [
            _annotation(frame, row, image=first_image + k, video=episode.index + 1, size=size)
            for k, frame in enumerate(episode.frames)
            for row in np.flatnonzero(frame.truth.visible_px).tolist()
        ]
        folder = root / "annotations"
        folder.mkdir(parents=True)
        document = _HEAD | {"videos": [video], "images": images, "annotations": annotations}
        (folder / f"{episode.name}.json").write_text(to_json(document, indent=None) + "\n", "ascii")

    def write_index(self, root: Path, names: Sequence[str], frames: int) -> None:  # noqa: ARG002
        """Join the sequences' lists, one sequence in memory at a time."""
        folder = root / "annotations"
        with moved_in(folder / "instances.json") as part, part.open("w", encoding="ascii") as file:
            file.write(json.dumps(_HEAD)[:-1])
            for key in _LISTS:
                file.write(f', "{key}": [')
                separator = ""
                for name in names:
                    for item in json.loads((folder / f"{name}.json").read_text("ascii"))[key]:
                        file.write(separator + json.dumps(item, separators=(",", ":")))
                        separator = ",\n"
                file.write("]")
            file.write("}\n")


def _annotation(frame: FrameRecord, row: int, *, image: int, video: int, size: list[int]) -> dict[str, Any]:
    truth = frame.truth
    x0, y0, x1, y1 = truth.box_visible[row]
    left, top, right, bottom = truth.box_amodal[row]
    return {
        "id": image * ROWS + row,
        "image_id": image,
        "video_id": video,
        "category_id": truth.kinds[row],
        "track_id": frame.track_ids[row],
        "bbox": [x0, y0, x1 - x0, y1 - y0],
        "area": truth.visible_px[row],
        "segmentation": {"size": size, "counts": frame.masks[row]},
        "iscrowd": 0,
        "bbox_amodal": [left, top, right - left, bottom - top],
        "visibility": truth.visible[row],
    }
