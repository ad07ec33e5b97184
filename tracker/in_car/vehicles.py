"""The vehicles that are tracked.

A box each, carried along by the points on it and held by the picture's edges.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tracker.in_car.evidence import CLOSING, CLOSING_SHARE
from tracker.in_car.extent import REAR, SLIMMEST, WIDEST, Relief, clear, make_relief, refine, roof_row
from tracker.in_car.points import PointStore
from tracker.in_car.proposals import (
    BODY_PLAY,
    BODY_SHARE,
    misfit,
    propose,
    windows_from_edges,
    worth,
)
from tracker.in_car.yaw import FLOW_NOISE, HEIGHT, EgoMotion
from tracker.types import Status

Floats = NDArray[np.float64]

# Log odds at which a vehicle is confirmed, and below which it is given up.
CONFIRM, REJECT = 2.5, -1.5
# Bounds of the log odds: old evidence must not outlast new evidence for too long.
LOWEST, HIGHEST = -6.0, 5.0
# How much more a window must be worth than a vehicle's box to replace it.
BETTER = 1.3
# Least worth of a window that is begun (`tracker.in_car.proposals`).
LEAST = 0.3
# The nearest vehicle that is begun is this many times nearer than the farthest.
NEAREST_SHARE = 12.0
# Clearness of the outline below which a vehicle is not confirmed, and below which it is given up.
SHOWN, LOST = 0.45, 0.3
# The picture is searched for new outlines once in so many frames.
SEARCH = 3
# Seconds over which the points' evidence is worth once itself: the span of the displacements.
CORRELATION = 0.35


@dataclass(slots=True, kw_only=True)
class Vehicle:
    """One tracked vehicle; working px, seconds."""

    id: int
    box: Floats
    velocity: Floats = field(default_factory=lambda: np.zeros(2))
    growth: float = 0.0
    odds: float = 0.0
    age: int = 0
    missed: int = 0
    members: int = 0
    confirmed: bool = False
    clear: float = 0.0
    log_width: float = float(np.log(REAR))
    rate_of_scale: float = 0.0
    better: int = 0
    rate_error: float = 10.0

    @property
    def status(self) -> Status:
        """How sure it is in this frame."""
        if not self.confirmed:
            return Status.TENTATIVE
        return Status.COASTING if self.missed > 0 else Status.CONFIRMED


class VehicleStore:
    """Keeps the vehicles of an episode."""

    def __init__(self, *, rate: float) -> None:
        """Start without vehicles."""
        self._rate = rate
        self._next_id = 1
        self._frame = 0
        self.vehicles: list[Vehicle] = []

    def step(
        self,
        grey: NDArray[np.uint8],
        points: PointStore,
        moved: Floats,
        ratios: Floats,
        trust: Floats,
        ego: EgoMotion,
        farthest: float,
    ) -> None:
        """Advance by one frame.

        Args:
            grey: (h, w).
            points: Followed into this frame; their owners are updated.
            moved: (N, 2) displacement of each point over `CORRELATION` seconds, px.
            ratios: (N,) log likelihood ratio of each point's motion.
            trust: (N,) in [0, 1], how far the picture fixes it.
            ego: The camera's own motion.
            farthest: Least height of the horizon above a contact row, px: beyond that no vehicle is begun.
        """
        horizon = float(ego.focus[1])
        relief = make_relief(grey, horizon=horizon, middle=float(ego.focus[0]), focal=ego.focal)
        for vehicle in self.vehicles:
            self._carry(vehicle, points, moved)
            self._weigh(vehicle, points, ratios, trust, ego)
            self._hold(vehicle, relief, points)
        self._end(grey, points, horizon)
        self._join(points, ego.speed)
        self._frame += 1
        if self._frame % SEARCH == 0:
            self._begin(relief, points, moved, farthest)

    def _carry(self, vehicle: Vehicle, points: PointStore, moved: Floats) -> None:
        """Move the box with its points."""
        own = np.flatnonzero((points.owner == vehicle.id) & (points.age >= 1))
        box = vehicle.box
        vehicle.age += 1
        if len(own) >= 1:
            flow = points.flow[own]
            shift = np.median(flow, axis=0)
            away = points.position[own] - np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])]) - shift
            expected = shift + vehicle.growth * away
            off = np.abs(flow - expected).max(1)
            wide = box[2] - box[0]
            bad = off > 1.0 + 0.02 * wide
            if len(own) >= 3:
                # Over a longer time bodies come apart that a frame does not tell apart.
                long = moved[own] - vehicle.growth * self._rate * CORRELATION * away
                off = np.abs(long - np.median(long, axis=0)).max(1)
                bad |= (points.age[own] >= 4) & (off > 2.0 * BODY_PLAY + 2.0 * BODY_SHARE * wide)
            points.owner[own[bad]] = 0
            own, flow, away = own[~bad], flow[~bad], away[~bad]
        vehicle.members = len(own)
        if len(own) >= 1:
            shift = np.median(flow, axis=0)
            if len(own) >= 3:
                centred = away - away.mean(0)
                power = float((centred * centred).sum())
                scale = float((centred * (flow - flow.mean(0))).sum()) / max(power, 30.0)
                self._measure_scale(vehicle, scale, power)
                trust = power / (power + 2000.0)
                vehicle.growth += 0.3 * trust * (float(np.clip(scale, -0.05, 0.05)) - vehicle.growth)
            middle_shift = shift - vehicle.growth * np.median(away, axis=0)
            vehicle.velocity += 0.3 * (middle_shift - vehicle.velocity)
            vehicle.missed = 0
        else:
            middle_shift = vehicle.velocity
            vehicle.growth *= 0.95
            vehicle.missed += 1
        middle = np.array([0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])]) + middle_shift
        half = 0.5 * np.array([box[2] - box[0], box[3] - box[1]]) * (1.0 + vehicle.growth)
        vehicle.box = np.concatenate([middle - half, middle + half])

    def _measure_scale(self, vehicle: Vehicle, scale: float, power: float) -> None:
        """Average the rate at which the points of a vehicle move apart, 1/s (scale divergence)."""
        gain = max(1.0 / (self._rate * 0.6), 1.0 / (vehicle.age + 1.0))
        vehicle.rate_of_scale += gain * (
            float(np.clip(scale, -0.1, 0.1)) * self._rate - vehicle.rate_of_scale
        )
        noise = 1.5 * FLOW_NOISE * self._rate / np.sqrt(max(power, 30.0))
        vehicle.rate_error = float(noise * np.sqrt(gain))

    def _divergence(self, vehicle: Vehicle, contact: float, ego: EgoMotion) -> float:
        """Return the log likelihood ratio of a vehicle's growth.

        What is static grows by g times its height of horizon.
        """
        least = ego.ground * contact
        if vehicle.members < 3 or vehicle.age < 0.3 * self._rate:
            return 0.0
        depth = ego.focal * HEIGHT / max(contact, 3.0)
        own = np.hypot(vehicle.rate_error, (CLOSING + CLOSING_SHARE * ego.speed) / depth)
        other = np.hypot(vehicle.rate_error, 0.2 * least + 0.02)
        as_vehicle = -0.5 * (vehicle.rate_of_scale / own) ** 2 - np.log(own)
        as_static = -0.5 * (min(vehicle.rate_of_scale - least, 0.0) / other) ** 2 - np.log(other)
        return float(np.clip(as_vehicle - as_static, -2.0, 2.0))

    def _weigh(
        self, vehicle: Vehicle, points: PointStore, ratios: Floats, trust: Floats, ego: EgoMotion
    ) -> None:
        """Add this frame's evidence, once per correlation time."""
        own = (points.owner == vehicle.id) & (points.age >= 4)
        worth = float(trust[own].sum())
        if worth > 0.3:
            mean = float((np.clip(ratios[own], -4.0, 4.0) * trust[own]).sum()) / worth
            gain = float(np.clip(mean, -2.0, 2.0)) * min(worth / 2.0, 1.0) / (self._rate * CORRELATION)
        else:
            # Nothing speaks for it any more: while the ego moves, old evidence fades.
            gain = -vehicle.odds * min(ego.speed / 10.0, 1.0) / (2.0 * self._rate)
        gain += (
            0.7
            * self._divergence(vehicle, float(vehicle.box[3] - ego.focus[1]), ego)
            / (self._rate * CORRELATION)
        )
        # Within a clear outline it matters little where the points lie and what moves alike around it.
        doubt = self._ill_filled(vehicle, points) + self._alike(vehicle, points)
        gain -= doubt / (self._rate * CORRELATION)
        gain += float(np.clip(2.0 * (vehicle.clear - 0.4), -1.0, 0.0)) / (self._rate * CORRELATION)
        vehicle.odds = float(np.clip(vehicle.odds + gain, LOWEST, HIGHEST))
        if (
            vehicle.odds > CONFIRM
            and vehicle.clear > SHOWN
            and vehicle.age >= 0.2 * self._rate
            and vehicle.members >= 2
        ):
            vehicle.confirmed = True

    def _ill_filled(self, vehicle: Vehicle, points: PointStore) -> float:
        """Return how badly the vehicle's points fill its box, [0, 2].

        A box that drifted off is to be found anew.
        """
        own = points.position[points.owner == vehicle.id]
        if len(own) < 3:
            return 0.0
        box = vehicle.box
        sums = own.sum(0)
        squares = (own * own).sum(0)
        cost = misfit(float(len(own)), *sums, *squares, box[0], box[3], box[2] - box[0])
        return float(np.clip(0.5 * (cost - 4.0), 0.0, 3.0))

    def _alike(self, vehicle: Vehicle, points: PointStore) -> float:
        """Return how much the surroundings move like the vehicle itself, [0, 2].

        Then it is a piece of them.
        """
        box = vehicle.box
        wide, tall = box[2] - box[0], box[3] - box[1]
        x, y = points.position.T
        ring = (x > box[0] - 0.6 * wide) & (x < box[2] + 0.6 * wide)
        ring &= (y > box[1] + 0.3 * tall) & (y < box[3] + 0.3 * tall)
        ring &= (points.owner == 0) & (points.age >= 6)
        like = int((ring & (points.evidence > 1.0)).sum())
        unlike = int((ring & (points.evidence < -0.5)).sum())
        return 2.0 * max(like - unlike - 1, 0) / (like + unlike + vehicle.members + 1.0)

    def _hold(self, vehicle: Vehicle, relief: Relief, points: PointStore) -> None:
        """Pull the box to the edges of the picture."""
        box = vehicle.box
        contact = box[3] - relief.horizon
        if contact < 3.0:
            return
        body = _body(points.position[points.owner == vehicle.id], box)
        young = vehicle.age < 0.5 * self._rate
        found = refine(relief, box, loose=0.08 if young else 0.05, body=body, log_width=vehicle.log_width)
        wide, contact = found[2] - found[0], found[3] - relief.horizon
        shown = clear(relief, found)
        vehicle.clear += 0.1 * (shown - vehicle.clear)
        if contact <= 2.0 or not SLIMMEST * contact < wide < WIDEST * contact:
            return
        # A vehicle keeps its width in metres, which its width over the height of the horizon is.
        vehicle.log_width += (0.2 if young else 0.04) * (np.log(wide / contact) - vehicle.log_width)
        gain = (0.3 if young else 0.15) * min(shown, 1.0)
        vehicle.box = box + gain * (found - box)

    def _end(self, grey: NDArray[np.uint8], points: PointStore, horizon: float) -> None:
        height, width = grey.shape
        patience = 0.5 * self._rate
        kept: list[Vehicle] = []
        for vehicle in sorted(self.vehicles, key=lambda one: (not one.confirmed, -one.clear)):
            box = vehicle.box
            wide, tall = box[2] - box[0], box[3] - box[1]
            seen = max(min(box[2], width) - max(box[0], 0.0), 0.0) * max(
                min(box[3], height) - max(box[1], 0.0), 0.0
            )
            gone = (
                vehicle.odds < REJECT
                or (vehicle.clear < LOST and vehicle.age > 0.3 * self._rate)
                or vehicle.missed > (patience if vehicle.confirmed else 3)
                or seen < 0.25 * wide * tall
                or tall < 6.0
                or box[3] < horizon + 4.0
                or (not vehicle.confirmed and vehicle.age > 2.0 * self._rate and vehicle.odds < 0.5)
                or any(_covered(box, other.box) > 0.55 for other in kept)
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

    def _begin(self, relief: Relief, points: PointStore, moved: Floats, farthest: float) -> None:
        """Begin vehicles where unowned points move like one within a clear outline; replace bad outlines."""
        ripe = points.age >= 4
        likely = ripe & (points.evidence > 1.0) & (points.position[:, 1] > relief.horizon + 2.0)
        if likely.sum() < 2:
            return
        position = points.position
        windows, shown = windows_from_edges(relief, position[likely], NEAREST_SHARE * farthest, farthest)
        known = ripe & (np.abs(points.evidence) > 0.8)
        seen = position[known], moved[known], points.evidence[known]
        for window, value in zip(
            *propose(windows, shown, *seen, relief.horizon, least=LEAST, most=12), strict=True
        ):
            inside = _inside(position, window, 0.05) & (points.evidence > 0.5)
            window[1] = roof_row(relief, window[0], window[2], window[3], _body(position[inside], window)[1])
            shared = [_covered(window, one.box) for one in self.vehicles]
            if not shared or max(shared) < 0.3:
                self._try(window, clear(relief, window), points, ripe & (points.owner == 0), relief.horizon)
                continue
            # A better outline of a vehicle that is tracked already.
            rival = self.vehicles[int(np.argmax(shared))]
            if value > BETTER * max(worth(rival.box, relief, *seen), 0.0):
                rival.better += 1
                if rival.better >= 2:
                    rival.box, rival.better = window.copy(), 0
                    rival.log_width = float(np.log((window[2] - window[0]) / (window[3] - relief.horizon)))
            else:
                rival.better = 0

    def _try(
        self, box: Floats, shown: float, points: PointStore, free: NDArray[np.bool_], horizon: float
    ) -> None:
        if any(_covered(box, other.box) > 0.35 for other in self.vehicles):
            return
        members = _inside(points.position, box, 0.05) & free
        good = members & (points.evidence > 0.5)
        if good.sum() < 2 or (members & (points.evidence < -0.8)).sum() > 0.5 * good.sum():
            return
        vehicle = Vehicle(
            id=self._next_id,
            box=box,
            clear=shown,
            log_width=float(np.log((box[2] - box[0]) / (box[3] - horizon))),
        )
        self._next_id += 1
        vehicle.velocity = np.median(points.flow[good], axis=0)
        vehicle.members = int(good.sum())
        points.owner[good] = vehicle.id
        self.vehicles.append(vehicle)


def _body(position: Floats, box: Floats) -> Floats:
    """Return the box of a vehicle's points (N, 2).

    Or what is most likely of its own where they are too few.
    """
    if len(position) >= 3:
        inner: Floats = np.quantile(position, (0.1, 0.9), axis=0)
        return np.asarray(inner.reshape(-1), np.float64)
    wide = box[2] - box[0]
    return np.asarray(box + np.array([0.1, 0.15, -0.1, -0.15]) * wide)


def _inside(position: Floats, box: Floats, play: float) -> NDArray[np.bool_]:
    wide, tall = box[2] - box[0], box[3] - box[1]
    x, y = position.T
    result: NDArray[np.bool_] = (
        (x > box[0] - play * wide)
        & (x < box[2] + play * wide)
        & (y > box[1] - play * tall)
        & (y < box[3] + play * tall)
    )
    return result


def _covered(box: Floats, other: Floats) -> float:
    """Return the shared area over the smaller box's area."""
    wide = min(box[2], other[2]) - max(box[0], other[0])
    tall = min(box[3], other[3]) - max(box[1], other[1])
    if wide <= 0 or tall <= 0:
        return 0.0
    smaller = min((box[2] - box[0]) * (box[3] - box[1]), (other[2] - other[0]) * (other[3] - other[1]))
    return float(wide * tall / max(smaller, 1e-9))
