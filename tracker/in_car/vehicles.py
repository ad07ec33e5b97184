"""The vehicles that are tracked: a box each, carried by the points on it and held by the outlines."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tracker.boosting import Trees, log_odds
from tracker.in_car.body import body_motion, covered, inward
from tracker.in_car.cues import Cue, cues
from tracker.in_car.features import Picture
from tracker.in_car.lamps import on_lamp
from tracker.in_car.outlines import outlines
from tracker.in_car.points import PointStore
from tracker.in_car.relief import Relief, make_relief
from tracker.in_car.yaw import EgoMotion
from tracker.types import Status

Floats = NDArray[np.float64]

# Log odds of a vehicle at which it is confirmed, and below which it is given up.
CONFIRM, REJECT = 2.5, -1.5
# Bounds of the log odds: old evidence must not outlast new evidence for too long.
LOWEST, HIGHEST = -6.0, 5.0
# Log odds of a single outline: at which a vehicle is begun; which neither raise nor lower a vehicle's; and
# what one look may add or take.
BEGIN, EVEN, MOST = 0.5, -1.0, 4.0
# Below these odds after the first trees the others could not save it.
HOPELESS = -4.0
# The odds at which it is begun if its points agree, and sums of their log odds: so many speak for it, so few
# against.
AGREED, MANY, FEW = -0.5, 12.0, 1.0
# Seconds before a vehicle is judged by how it moves; and for which all of one must have looked like nothing
# else, while the ego drove, to make it sure however few points are on it.
YOUNG, LONG = 0.2, 1.0
# Outlines are looked at once in so many frames.
SEARCH = 3
# Play of an outline's sides and foot around where they are expected, as a share of the width, and of the
# logarithm of the width in metres.
PLAY, SIZE_PLAY = 0.06, 0.12
# Log odds by which another outline over a vehicle has to be better, for this many looks, to replace it.
BETTER, LOOKS = 2.0, 2
# Overlap, over the smaller box, at which two boxes cannot both be vehicles; and at which none is begun.
SAME, TAKEN = 0.55, 0.35
# So near the frame's edge, px, a vehicle goes on beyond it.
EDGE = 3.0
# Seconds over which the points' evidence is worth once itself: the span of the displacements.
CORRELATION = 0.35
# Log odds from which a point may belong to a vehicle, and from which it may while the ego stands.
LIKELY, UNCLEAR = 1.0, -0.5
# Most growth, as a share of the size a frame, of a vehicle that was only ever seen cut off by the frame. It
# overtakes, since one that is overtaken was seen whole before; scenery that the ego passes grows.
PASSING_GROWTH = 0.003
# How far, px over `CORRELATION` seconds, its points must have moved toward the focus of expansion before it
# is sure, and how many they must be, over the root of what is seen of its width, px.
INWARD, CROWDED = 3.0, 0.7
# Ego speed below which a look tells less and less that the last one did not, m/s.
WALK = 5.0


@dataclass(slots=True, kw_only=True)
class Vehicle:
    """One tracked vehicle; working px, frames.

    Attributes:
        id: >= 1.
        box: (4,).
        log_width: ln of its width over the contact's height below the horizon: constant as its metres.
        velocity: (2,) of its middle, px a frame.
        growth: Share of its size a frame.
        odds: Log odds that it is one.
        age: Frames.
        missed: Frames since a point or an outline showed it.
        members: Points that move with it.
        confirmed: Whether it ever was sure.
        whole: Whether the frame ever showed both its sides.
        inward: How far its points moved toward the focus of expansion over `CORRELATION` seconds, px.
        rivals: Looks in a row at which another outline was better.
        certain: Looks in a row at which all of it was seen, and its odds were as high as they can be.
    """

    id: int
    box: Floats
    log_width: float
    velocity: Floats = field(default_factory=lambda: np.zeros(2))
    growth: float = 0.0
    odds: float = 0.0
    age: int = 0
    missed: int = 0
    members: int = 0
    confirmed: bool = False
    whole: bool = False
    inward: float = 0.0
    rivals: int = 0
    certain: int = 0

    @property
    def status(self) -> Status:
        """How sure it is in this frame."""
        if not self.confirmed:
            return Status.TENTATIVE
        return Status.COASTING if self.missed > 0 else Status.CONFIRMED


@dataclass(frozen=True, slots=True, kw_only=True)
class Sighting:
    """The K outlines that a look weighed.

    Attributes:
        boxes: (K, 4) working px.
        cues: (K, C), see `tracker.in_car.cues`.
        odds: (K,) log odds that each is a vehicle's.
    """

    boxes: Floats
    cues: Floats
    odds: Floats


class VehicleStore:
    """Keeps the vehicles of an episode.

    Attributes:
        vehicles: In the order of their ids.
        sighting: What was seen in this frame; None where it was not looked for.
    """

    def __init__(self, *, rate: float, trees: Trees) -> None:
        """Start without vehicles.

        Args:
            rate: Frames a second.
            trees: By which outlines are weighed.
        """
        self._rate = rate
        self._trees = trees
        self._next_id = 1
        self._frame = 0
        self.vehicles: list[Vehicle] = []
        self.sighting: Sighting | None = None

    def step(
        self, picture: Picture, points: PointStore, moved: Floats, ego: EgoMotion, farthest: float
    ) -> None:
        """Advance by one frame.

        Args:
            picture: Of this frame.
            points: Followed into this frame; their owners are updated.
            moved: (N, 2) displacement of each point over `CORRELATION` seconds, px.
            ego: The camera's own motion.
            farthest: Least height of the horizon above a contact row, px: beyond that no vehicle is begun.
        """
        horizon = float(ego.focus[1])
        for vehicle in self.vehicles:
            self._carry(vehicle, points, moved, picture.grey.shape[1], ego.focus)
        self.sighting = None
        if self._frame % SEARCH == 0:
            middle = float(ego.focus[0])
            relief = make_relief(picture.grey, picture.red, horizon=horizon, middle=middle, focal=ego.focal)
            self._look(relief, points, moved, ego.speed, farthest)
        self._frame += 1
        self._end(picture.grey.shape, points, horizon)
        self._join(points, ego.speed)

    def _look(self, relief: Relief, points: PointStore, moved: Floats, speed: float, farthest: float) -> None:
        """Weigh the picture's outlines; hold the vehicles to them and begin new ones."""
        ripe = points.age >= 4
        # While the ego stands nothing moves, and what did not move against a vehicle may be one.
        least = LIKELY if speed > WALK else UNCLEAR
        free = (points.evidence > least) | on_lamp(relief, points.position)
        likely = ripe & free & (points.position[:, 1] > relief.horizon + 2.0)
        shape = relief.shape
        expected = np.array([_outline(vehicle.box, *shape) for vehicle in self.vehicles]).reshape(-1, 3)
        expected[:, 2] = np.maximum(expected[:, 2], relief.horizon + 4.0)
        found = expected
        if likely.any():
            found = np.concatenate([expected, outlines(relief, points.position[likely], farthest)])
        if not len(found):
            return
        seen = points.position[ripe], moved[ripe], points.evidence[ripe]
        measured, windows = cues(relief, found, *seen)
        odds = log_odds(measured, self._trees, settled=(HOPELESS, np.inf))
        self.sighting = Sighting(boxes=windows, cues=measured, odds=odds)
        # Of the two roofs the likelier.
        count = len(found)
        tall = odds[count:] > odds[:count]
        odds = np.where(tall, odds[count:], odds[:count])
        windows = np.where(tall[:, None], windows[count:], windows[:count])
        for index, vehicle in enumerate(self.vehicles):
            self._hold(vehicle, expected[index], windows, odds, index, relief, speed)
        first = len(self.vehicles)
        for index in first + np.argsort(-odds[first:], kind="stable"):
            if odds[index] < AGREED:
                break
            speak = measured[index, [Cue.FOR, Cue.AGAINST]]
            if odds[index] > BEGIN or (speak[0] > MANY and speak[1] < FEW):
                self._begin(windows[index], points, likely, relief)

    def _hold(
        self,
        vehicle: Vehicle,
        expected: Floats,
        windows: Floats,
        odds: Floats,
        own: int,
        relief: Relief,
        speed: float,
    ) -> None:
        """Pull a vehicle's box to the likeliest outline near it, and weigh it by that."""
        x0, x1, row = expected
        height, width = relief.shape
        wide = max(x1 - x0, 1.0)
        play = PLAY * wide + 1.0
        widths = np.log((windows[:, 2] - windows[:, 0]) / np.maximum(windows[:, 3] - relief.horizon, 1.0))
        cut = x0 < EDGE or x1 > width - EDGE
        # An end that was never seen may come into view anywhere.
        unseen = np.array([x0 < EDGE, x1 > width - EDGE]) & (not vehicle.whole)
        ends = ((windows[:, [0, 2]] - (x0, x1)) / play) ** 2
        off = ((windows[:, 3] - row) / play) ** 2 + ends[:, ~unseen].sum(1)
        if not cut:
            off += ((widths - vehicle.log_width) / SIZE_PLAY) ** 2
        off[own] = 0.0
        value = odds - 0.5 * off
        best = int(value.argmax())
        gain = float(np.clip(odds[best] - EVEN, -MOST, MOST)) * SEARCH / (self._rate * CORRELATION)
        if gain < 0.0:
            # While the ego stands nothing moves that could show it.
            gain *= min(1.0, speed / WALK)
        vehicle.odds = float(np.clip(vehicle.odds + gain, LOWEST, HIGHEST))
        vehicle.whole = vehicle.whole or not cut
        least = 2 if vehicle.whole else CROWDED * math.sqrt(wide)
        proven = vehicle.odds > CONFIRM and vehicle.age >= YOUNG * self._rate and vehicle.members >= least
        certain = vehicle.whole and vehicle.odds >= HIGHEST and speed > WALK
        vehicle.certain = vehicle.certain + 1 if certain else 0
        lasting = vehicle.certain * SEARCH >= LONG * self._rate
        if lasting or (proven and (vehicle.whole or vehicle.inward > INWARD)):
            vehicle.confirmed = True
        if odds[best] > 0.0:
            vehicle.missed = 0
        young = vehicle.age < 0.5 * self._rate
        gain = 0.6 if young else 0.35
        found = windows[best]
        step = gain * (found - vehicle.box)
        for end, beyond, hidden in (
            (0, vehicle.box[0] < EDGE, found[0] < 1.0),
            (2, vehicle.box[2] > width - EDGE, found[2] > width - 1.0),
        ):
            # Where the frame cuts it off its end is not seen; one that comes into view is where it is seen.
            if beyond and hidden:
                step[end] = 0.0
            elif beyond and not vehicle.whole:
                step[end] = found[end] - vehicle.box[end]
        if found[3] > height - 3.0:
            step[3] = 0.0
        vehicle.box = vehicle.box + step
        if not cut:
            vehicle.log_width += (0.4 if young else 0.1) * (widths[best] - vehicle.log_width)
        self._replace(vehicle, windows, odds, odds[best], relief.horizon)

    def _replace(self, vehicle: Vehicle, windows: Floats, odds: Floats, held: float, horizon: float) -> None:
        """Move a vehicle to another outline over it that is better by far, again and again."""
        better = np.flatnonzero(odds > max(held + BETTER, BEGIN))
        others = [one.box for one in self.vehicles if one is not vehicle and one.confirmed]
        for index in better[np.argsort(-odds[better], kind="stable")][:20]:
            window = windows[index]
            if covered(window, vehicle.box) < SAME or any(covered(window, box) > TAKEN for box in others):
                continue
            vehicle.rivals += 1
            if vehicle.rivals >= LOOKS:
                vehicle.box, vehicle.rivals = window.copy(), 0
                vehicle.log_width = float(np.log((window[2] - window[0]) / (window[3] - horizon)))
            return
        vehicle.rivals = 0

    def _carry(self, vehicle: Vehicle, points: PointStore, moved: Floats, width: int, focus: Floats) -> None:
        """Move the box with its points, in a picture so many px wide."""
        own = np.flatnonzero((points.owner == vehicle.id) & (points.age >= 1))
        box = vehicle.box
        middle = np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])])
        vehicle.age += 1
        vehicle.members = 0
        if len(own):
            kept, shift, away, growth, trust = body_motion(
                points.position[own],
                points.flow[own],
                moved[own],
                points.age[own] >= 4,
                middle,
                box[2] - box[0],
                vehicle.growth,
                self._rate * CORRELATION,
            )
            points.owner[own[~kept]] = 0
            vehicle.members = int(kept.sum())
        if vehicle.members:
            vehicle.inward = inward(points.position[own[kept]] - focus, moved[own[kept]])
            vehicle.growth += 0.3 * trust * (growth - vehicle.growth)
            middle_shift = shift - vehicle.growth * away
            vehicle.velocity += 0.3 * (middle_shift - vehicle.velocity)
            vehicle.missed = 0
        else:
            middle_shift = vehicle.velocity
            vehicle.growth *= 0.95
            vehicle.missed += 1
        middle += middle_shift
        half = 0.5 * np.array([box[2] - box[0], box[3] - box[1]]) * (1.0 + vehicle.growth)
        carried = np.concatenate([middle - half, middle + half])
        if not vehicle.whole:
            # What comes into the picture goes on beyond its edge until an outline shows its end.
            if box[0] < EDGE:
                carried[0] = min(carried[0], box[0])
            if box[2] > width - EDGE:
                carried[2] = max(carried[2], box[2])
        vehicle.box = carried

    def _end(self, shape: tuple[int, ...], points: PointStore, horizon: float) -> None:
        """Give up vehicles that left, were lost, never proved themselves, or are another's part."""
        height, width = shape
        patience = 0.5 * self._rate
        kept: list[Vehicle] = []
        for vehicle in sorted(self.vehicles, key=lambda one: (not one.confirmed, -one.odds, one.id)):
            box = vehicle.box
            wide, tall = box[2] - box[0], box[3] - box[1]
            seen = max(min(box[2], width) - max(box[0], 0.0), 0.0) * max(
                min(box[3], height) - max(box[1], 0.0), 0.0
            )
            old = vehicle.age >= YOUNG * self._rate
            gone = (
                vehicle.odds < REJECT
                or vehicle.missed > (patience if vehicle.confirmed else 3)
                or seen < 0.25 * wide * tall
                or tall < 6.0
                or box[3] < horizon + 4.0
                or (not vehicle.whole and old and vehicle.growth > PASSING_GROWTH)
                or (not vehicle.confirmed and vehicle.age > 2.0 * self._rate and vehicle.odds < 0.5)
                or any(covered(box, other.box) > SAME for other in kept)
            )
            if gone:
                points.owner[points.owner == vehicle.id] = 0
            else:
                kept.append(vehicle)
        self.vehicles = sorted(kept, key=lambda one: one.id)

    def _join(self, points: PointStore, moving: float) -> None:
        """Give new points on a vehicle to it, and take back those that lie outside."""
        x, y = points.position.T
        for vehicle in self.vehicles:
            box = vehicle.box
            wide, tall = box[2] - box[0], box[3] - box[1]
            own = points.owner == vehicle.id
            far = (x < box[0] - 0.06 * wide - 2.0) | (x > box[2] + 0.06 * wide + 2.0)
            far |= (y < box[1] - 0.35 * wide) | (y > box[3] + 0.08 * wide + 2.0)
            points.owner[own & far] = 0
            inside = (x > box[0] + 0.03 * wide) & (x < box[2] - 0.03 * wide)
            inside &= (y > box[1] + 0.03 * tall) & (y < box[3] + 0.02 * tall)
            middle = np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])])
            expected = vehicle.velocity + vehicle.growth * (points.position - middle)
            along = np.abs(points.flow - expected).max(1) < 0.7 + 0.01 * wide
            fresh = inside & along & (points.owner == 0) & (points.age >= 3)
            fresh &= (points.evidence > 0.3) | (moving < 2.0)
            points.owner[fresh] = vehicle.id

    def _begin(self, box: Floats, points: PointStore, likely: NDArray[np.bool_], relief: Relief) -> None:
        """Begin a vehicle in an outline (4,) that no other one holds and that has points of its own."""
        if any(covered(box, other.box) > TAKEN for other in self.vehicles):
            return
        wide, tall, width = box[2] - box[0], box[3] - box[1], relief.shape[1]
        x, y = points.position.T
        inside = likely & (x > box[0] - 0.05 * wide) & (x < box[2] + 0.05 * wide)
        inside &= (y > box[1] - 0.05 * tall) & (y < box[3] + 0.05 * tall)
        members = inside & (points.owner == 0)
        # The points of another vehicle do not speak for it, least where the frame hides how wide it is.
        share = 2 if box[0] < EDGE or box[2] > width - EDGE else 3
        if not members.any() or share * members.sum() < inside.sum():
            return
        log_width = float(np.log(wide / (box[3] - relief.horizon)))
        vehicle = Vehicle(id=self._next_id, box=box.copy(), log_width=log_width)
        self._next_id += 1
        vehicle.velocity = np.median(points.flow[members], axis=0)
        vehicle.members = int(members.sum())
        points.owner[members] = vehicle.id
        self.vehicles.append(vehicle)


def _outline(box: Floats, height: int, width: int) -> tuple[float, float, float]:
    """Return what of a box's sides and foot lies in the picture, a pixel at least: x0, x1, row."""
    x0 = min(max(float(box[0]), 0.0), width - 1.0)
    x1 = min(max(float(box[2]), x0 + 1.0), float(width))
    return x0, x1, min(float(box[3]), height - 1.0)
