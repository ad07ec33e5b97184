"""Active tracking: a controller that keeps a tracker's tracks centred, against a camera left alone.

Run with ``python -m tests.validation.active_tracking [--seeds A:B] [--seconds S] [--tracker NAME]``. In each
drive the platform begins over the convoy of `aerial-convoy`. The controller reads ``info["tracks"]`` alone;
left alone, the platform hovers. Printed are, for each drive and over all, with bootstrap intervals of the
paired differences, of each frame in the mean:

    reward     the environment's: F1 of the tracks' boxes, in which the convoy's vehicles that are out of the
               picture are misses
    F1         the same without these: of whatever is in the picture, however little that is
    convoy     vehicles of the convoy that are scored and have a track's box on them (IoU .5)
    followed   the same of all vehicles, whoever drives by
    in view    vehicles of the convoy of which .3 or more can be seen
"""

from __future__ import annotations

import argparse
from collections import deque
from collections.abc import Sequence

import gymnasium
import numpy as np
from numpy.typing import NDArray

from scenarios.in_the_loop import TrackerInTheLoop
from scenarios.score.frames import Selector
from scenarios.score.params import ScoringParams
from scenarios.score.statistics import interval
from sim.truth.snapshot import Snapshot
from sim.world import Role
from tracker.types import Status, Tracks

MEASURES = ("reward", "F1", "convoy", "followed", "in view")
SCORING = ScoringParams()
UP = np.array([1.0, -1.0])
"""Pictures count rows downward; the platform's action is positive toward the upper edge."""
FULL = 100.0
"""Px/s by which a full action moves the picture, roughly."""
BEHIND = 0.5
"""Seconds over which image speeds are taken."""
ALIKE = 60.0
"""Px/s within which speeds agree."""
LARGER = 1.5
"""Times as many as are in the flock have to move together for these to become the flock."""
SETTLE, CENTRE = 1.0, 2.0
"""Seconds in which the platform takes on the flock's speed, and in which it makes up for its distance."""


class Centring:
    """Flies with the vehicles that most tracks move with, and toward their middle; it sees only tracks.

    Tracks move together if their speeds in the picture agree; who once was in the flock stays in it, through
    bends too.
    """

    def __init__(self, width: int, height: int, rate: int) -> None:
        """Begin a drive of pictures of that size, px, so many a second."""
        self._middle, self._rate = np.array([width, height]) / 2, rate
        self._paths: dict[int, deque[NDArray[np.float64]]] = {}
        self._flock: set[int] = set()
        self._steady = np.zeros(2)

    def act(self, tracks: Tracks) -> NDArray[np.float32]:
        """Return the action that follows from a frame's tracks; without any it flies on as it did."""
        chosen = tracks.status == Status.CONFIRMED
        centres = (tracks.boxes[chosen, :2] + tracks.boxes[chosen, 2:]) / 2
        here = dict(zip(tracks.ids[chosen].tolist(), centres, strict=True))
        self._paths = {k: self._paths.get(k, deque(maxlen=round(BEHIND * self._rate) + 1)) for k in here}
        for k, centre in here.items():
            self._paths[k].append(centre)
        # Image speeds, px/s, of those seen for long enough.
        speeds = {
            k: (path[-1] - path[0]) * self._rate / (len(path) - 1)
            for k, path in self._paths.items()
            if len(path) == path.maxlen
        }
        if not speeds:
            return self._towards(np.zeros(2))
        alike = {
            k: {j for j, other in speeds.items() if np.hypot(*(other - speed)) < ALIKE}
            for k, speed in speeds.items()
        }
        most = max(alike.values(), key=len)
        members = self._flock & speeds.keys()
        if len(most) > LARGER * len(members):
            self._flock = members = most
        common = np.median([speeds[k] for k in members], axis=0)
        joining = {k for k, speed in speeds.items() if np.hypot(*(speed - common)) < ALIKE}
        self._flock = (self._flock & here.keys()) | joining
        off = np.mean([here[k] for k in self._flock], axis=0) - self._middle
        pull = off / CENTRE
        # Of second order, with a pole at each of the two times: what is off goes, at a steady speed too.
        self._steady = np.clip(self._steady + (common + pull) * UP / (FULL * SETTLE * self._rate), -1, 1)
        return self._towards(pull * UP / FULL)

    def _towards(self, velocity: NDArray[np.float64]) -> NDArray[np.float32]:
        return np.array([*np.clip(self._steady + velocity, -1, 1), 0.0, 0.0], np.float32)


def fly(env: TrackerInTheLoop, seed: int, controller: Centring | None) -> dict[str, float]:
    """Return what one drive measures, frame by frame in the mean."""
    info = env.reset(seed=seed)[1]
    rows, over = [], False
    while not over:
        action = np.zeros(4, np.float32) if controller is None else controller.act(info["tracks"])
        _, reward, terminated, truncated, info = env.step(action)
        rows.append((reward, *measure(info["truth"], info["tracks"])))
        over = terminated or truncated
    return dict(zip(MEASURES, np.mean(rows, axis=0).tolist(), strict=True))


def measure(truth: Snapshot, tracks: Tracks) -> tuple[float, int, int, int]:
    """Return a frame's measures, all but the reward; a frame with nothing in it has an F1 of 0."""
    width, height = truth.camera.width, truth.camera.height
    selector = Selector("aerial", rate=truth.state.rate, width=width, height=height, params=SCORING)
    frame = selector.take(truth.vehicles, tracks)
    scored, claimed, overlap = selector.compare(frame)
    # Boxes of vehicles lie apart, and so do those of tracks.
    found = scored[(overlap >= SCORING.match_iou).any(axis=1)]
    vehicles = truth.vehicles
    convoy = vehicles.roles == Role.CONVOY
    f1 = 2 * len(found) / max(1, len(scored) + len(claimed))
    followed = int(np.isin(found, vehicles.ids[convoy]).sum())
    return f1, followed, len(found), int((convoy & (vehicles.visible >= SCORING.min_visible)).sum())


def compare(seeds: Sequence[int], *, seconds: float, tracker: str) -> dict[str, dict[str, list[float]]]:
    """Fly every drive twice, and print it; return measures by "centred" and "fixed", one number a drive."""
    made = gymnasium.make("sim:testtrack/Aerial-v0", overrides=[f"seconds={seconds}"])
    env = TrackerInTheLoop(made, tracker)
    rate, (height, width, _) = env.unwrapped.course.rate, env.observation_space.shape
    found: dict[str, dict[str, list[float]]] = {
        who: {name: [] for name in MEASURES} for who in ("centred", "fixed")
    }
    print(f"{'seed':>6}" + "".join(f"{who + ' ' + name:>18}" for who in found for name in MEASURES))
    for seed in seeds:
        for who, by_name in found.items():
            controller = Centring(width, height, rate) if who == "centred" else None
            for name, value in fly(env, seed, controller).items():
                by_name[name].append(value)
        row = "".join(f"{found[who][name][-1]:18.3f}" for who in found for name in MEASURES)
        print(f"{seed:6}{row}", flush=True)
    env.close()
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare the two and print the paired differences."""
    parser = argparse.ArgumentParser(prog="python -m tests.validation.active_tracking")
    parser.add_argument("--seeds", default="600:620", metavar="A:B", help="the drives A, A+1, ... B-1")
    parser.add_argument("--seconds", type=float, default=12.0, help="length of a drive")
    parser.add_argument("--tracker", default="aerial", metavar="NAME")
    chosen = parser.parse_args(arguments)
    first, end = map(int, chosen.seeds.split(":"))
    found = compare(range(first, end), seconds=chosen.seconds, tracker=chosen.tracker)
    print("\ncentred less fixed, mean over drives with its 95 % interval")
    for name in MEASURES:
        difference = interval(np.subtract(found["centred"][name], found["fixed"][name]))
        low, high = difference["ci95"] or (np.nan, np.nan)
        print(f"{name:>12} {difference['mean']:8.3f} [{low:.3f}, {high:.3f}], n = {difference['n']}")


if __name__ == "__main__":
    main()
