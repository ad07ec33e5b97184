"""A small made-up dataset: boxes that drive before a moving camera, in every format.

    python -m tests.scenarios.export.episodes DIR

writes it for the tools of `tests/fixtures/make_formats.py`.
"""

import sys
from pathlib import Path

import numpy as np

from scenarios.export.episode import Episode, FrameRecord, visible_masks
from scenarios.export.frames import FrameFiles
from scenarios.export.writer import LAYOUTS
from sim.camera import Camera, Pose, project
from sim.simulation import Odometer
from sim.truth.boxes import visible_parts
from sim.truth.types import FrameTruth
from sim.world import FIRST_VEHICLE_ID, Bodies, Ego, Kind, Role
from tracker.types import Status, Tracks

CAMERA = Camera(width=96, height=64, focal=90.0, cx=50.0, cy=30.0)
RATE, FRAMES = 10, 8
NAMES = ("0500", "0501")
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
KINDS = (Kind.CAR, Kind.CAR, Kind.VAN, Kind.LORRY, Kind.BUS, Kind.MOTORCYCLE, Kind.CAR)


def corners_of(bodies: Bodies) -> np.ndarray:
    """(N, 8, 3) corners in the world."""
    out = np.zeros((len(bodies), 8, 3))
    for k in range(len(bodies)):
        c, s = np.cos(bodies.yaws[k]), np.sin(bodies.yaws[k])
        turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        out[k] = (CORNERS * bodies.sizes[k]) @ turn.T + bodies.positions[k]
    return out


def pixels_in(box: np.ndarray, low: tuple[int, int], high: tuple[int, int]) -> int:
    x0, y0, x1, y1 = (int(v) for v in box)
    width = max(0, min(x1, high[0]) - max(x0, low[0]))
    return width * max(0, min(y1, high[1]) - max(y0, low[1]))


def frame_of(tick: int, bodies: Bodies, pose: Pose, ego: Ego) -> tuple[FrameRecord, np.ndarray]:
    """Everything of a frame whose vehicles look like their boxes, and its id map."""
    pixels, depths = project(CAMERA, pose, corners_of(bodies))
    boxes = np.concatenate([np.floor(pixels.min(axis=1)), np.ceil(pixels.max(axis=1))], axis=1)
    width, height = CAMERA.width, CAMERA.height
    ids = np.zeros((height, width), np.uint32)
    for k in np.argsort(-depths.min(axis=1)):
        x0, y0, x1, y1 = np.clip(boxes[k], 0, [width, height] * 2).astype(int)
        ids[y0:y1, x0:x1] = bodies.ids[k]
    visible_px, box_visible = visible_parts(ids, bodies.ids)
    truth = FrameTruth(
        tick=tick,
        ids=bodies.ids,
        kinds=bodies.kinds,
        roles=bodies.roles,
        visible_px=visible_px,
        amodal_px=np.array([pixels_in(box, (0, 0), (width, height)) for box in boxes]),
        amodal_px_full=np.array(
            [pixels_in(box, (-width, -height), (2 * width, 2 * height)) for box in boxes]
        ),
        box_visible=box_visible,
        box_amodal=boxes,
        occluder_ids=np.zeros(len(bodies), np.uint32),
        distances=depths.min(axis=1),
        positions=pose.to_camera(corners_of(bodies)).mean(axis=1),
        velocities=np.zeros((len(bodies), 3)),
    )
    record = FrameRecord(
        tick=tick,
        time=tick / RATE,
        truth=truth,
        bodies=bodies,
        masks=visible_masks(ids, truth),
        pose=pose,
        ego=ego,
        odometer=Odometer(speed=10.0, yaw_rate=0.0),
    )
    return record, ids


def frames_of(seed: int) -> list[tuple[FrameRecord, np.ndarray]]:
    rng = np.random.default_rng(seed)
    n = len(KINDS)
    start = np.stack([rng.uniform(12, 45, n), rng.uniform(-12, 12, n), np.zeros(n)], axis=1)
    yaws, speeds = rng.uniform(-0.6, 0.6, n), rng.uniform(0, 12, n)
    velocities = speeds[:, None] * np.stack([np.cos(yaws), np.sin(yaws), np.zeros(n)], axis=1)
    sizes = rng.uniform([3.5, 1.6, 1.4], [7.0, 2.4, 3.0], (n, 3))
    out = []
    for tick in range(FRAMES):
        bodies = Bodies(
            ids=np.arange(FIRST_VEHICLE_ID, FIRST_VEHICLE_ID + n, dtype=np.uint32),
            kinds=np.array(KINDS, np.uint8),
            roles=np.full(n, Role.SAME_WAY, np.uint8),
            models=np.zeros(n, np.int32),
            positions=start + velocities * tick / RATE,
            yaws=yaws,
            velocities=velocities,
            sizes=sizes,
            colours=np.zeros((n, 3), np.float32),
            lamps=np.zeros(n, np.uint8),
            leans=np.zeros((n, 2)),
        )
        yaw, at = 0.05 * tick, np.array([0.6 * tick, 0.1 * tick, 1.5])
        pose = Pose.looking(at, yaw=yaw, pitch=-0.02 + 0.01 * np.sin(tick), roll=0.01 * tick)
        ego = Ego(position=at * [1, 1, 0], yaw=yaw, speed=6.0, yaw_rate=-0.5, pitch=0.0, heave=0.0)
        out.append(frame_of(tick, bodies, pose, ego))
    return out


def episode_of(index: int, layout_name: str, coding: str = "png") -> Episode:
    layout = LAYOUTS[layout_name]
    name = NAMES[index]
    return Episode(
        name=name,
        index=index,
        camera=CAMERA,
        rate=RATE,
        images=FrameFiles(folder=layout.folder(name), first=layout.first, coding=coding),
        frames=tuple(record for record, _ in frames_of(index)),
    )


def write(root: Path, layout_name: str) -> None:
    """Write the dataset without pictures, whose tools read none."""
    for index in range(len(NAMES)):
        part = root / f"part-{index}"
        LAYOUTS[layout_name].write_episode(part, episode_of(index, layout_name))
        for file in sorted(path for path in part.rglob("*") if path.is_file()):
            target = root / file.relative_to(part)
            target.parent.mkdir(parents=True, exist_ok=True)
            file.rename(target)
        for folder in sorted(part.rglob("*"), reverse=True):
            folder.rmdir()
        part.rmdir()
    LAYOUTS[layout_name].write_index(root, NAMES, FRAMES)


def tracks_of(index: int) -> list[Tracks]:
    """A tracker that is nearly right: it jitters, misses, and swaps two ids half way."""
    rng = np.random.default_rng(100 + index)
    out = []
    for k, frame in enumerate(episode_of(index, "mot").frames):
        boxes = frame.truth.box_amodal + rng.normal(0, 1.0, (len(frame.truth), 4))
        kept = rng.random(len(boxes)) > 0.2
        ids = np.arange(1, len(boxes) + 1)
        if k >= FRAMES // 2:
            ids[:2] = ids[1::-1].copy()
        out.append(
            Tracks(
                ids=ids[kept],
                boxes=boxes[kept],
                status=np.full(kept.sum(), Status.CONFIRMED, np.uint8),
            )
        )
    return out


def texts(root: Path) -> dict[str, str]:
    """Every file's text by its path."""
    return {
        str(path.relative_to(root)): path.read_text("ascii")
        for path in sorted(root.rglob("*"))
        if path.is_file()
    }


if __name__ == "__main__":
    from scenarios.export.mot import write_tracks

    place = Path(sys.argv[1])
    for layout in LAYOUTS:
        (place / layout).mkdir(parents=True)
        write(place / layout, layout)
    data = place / "tracks" / "testtrack-train" / "nearly" / "data"
    data.mkdir(parents=True)
    for number, sequence in enumerate(NAMES):
        write_tracks(data / f"{sequence}.txt", tracks_of(number))
