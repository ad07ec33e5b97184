"""All that is true of an episode, beside the files of whichever format: JSON, a line a frame.

``frames.jsonl`` has the camera's pose, the ego, what its odometer measured, and the vehicles: boxes visible
and amodal, pixels, the three shares of visibility, occluder, mask, and pose in the world. ``camera.json``
has the calibration, ``events.json`` the occlusion events. Axes and units are this project's: metres, radians,
world x east, y north, z up; boxes are half-open and pixel centres at +0.5; frames count from 0.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.export.episode import Episode, FrameRecord
from scenarios.output import to_json, write_json
from sim.truth.events import occlusion_events
from sim.world import Kind, Role


def write_truth(folder: Path, episode: Episode) -> None:
    """Write what is true of an episode into a folder that exists."""
    camera = episode.camera
    write_json(folder / "camera.json", asdict(camera) | {"rate": episode.rate})
    events = occlusion_events([frame.truth for frame in episode.frames], episode.rate)
    write_json(folder / "events.json", [asdict(event) for event in events])
    size = [camera.height, camera.width]
    with (folder / "frames.jsonl").open("w", encoding="ascii", newline="\n") as file:
        for number, frame in enumerate(episode.frames):
            line = {"frame": number, "image": episode.images.of(number)} | _frame(frame, size)
            file.write(to_json(line, indent=None) + "\n")


def _frame(frame: FrameRecord, size: list[int]) -> dict[str, Any]:
    return {
        "time": frame.time,
        "camera": {"position": frame.pose.position, "rotation": frame.pose.rotation},
        "ego": asdict(frame.ego) if frame.ego else None,
        "odometry": asdict(frame.odometer) if frame.odometer else None,
        "objects": [_object(frame, k, size) for k in range(len(frame.truth))],
    }


def _object(frame: FrameRecord, k: int, size: list[int]) -> dict[str, Any]:
    truth, bodies = frame.truth, frame.bodies
    visible = bool(truth.visible_px[k])
    return {
        "id": truth.ids[k],
        "track_id": frame.track_ids[k],
        "kind": Kind(truth.kinds[k]).name.lower(),
        "role": Role(truth.roles[k]).name.lower(),
        "box_visible": truth.box_visible[k] if visible else None,
        "box_amodal": truth.box_amodal[k] if np.isfinite(truth.box_amodal[k]).all() else None,
        "visible_px": truth.visible_px[k],
        "amodal_px": truth.amodal_px[k],
        "amodal_px_full": truth.amodal_px_full[k],
        "visibility_in_frame": truth.visibility_in_frame[k],
        "in_frame": truth.in_frame[k],
        "visible": truth.visible[k],
        "occluder_id": truth.occluder_ids[k],
        "distance": truth.distances[k],
        "mask": {"size": size, "counts": frame.masks[k]} if visible else None,
        "position": bodies.positions[k],
        "yaw": bodies.yaws[k],
        "velocity": bodies.velocities[k],
        "size": bodies.sizes[k],
    }
