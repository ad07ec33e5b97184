"""Riders in a lane without files: they keep distance, overtake, weave, stop at the kerb, come the wrong way.

Why not highway-env on narrow sublanes: its vehicles keep to the middle of a lane and change lanes whole, one
Python object each; motorcycles take any offset, squeeze through gaps that no sublane has, and ride abreast.
Here every rider has a continuous offset d. Along the lane it follows the nearest rider in its path by IDM
(Treiber, Hennecke, Helbing 2000). Across it picks, several times a second, the offset that promises most
acceleration, less what the way there and the distance from the favourite offset cost: MOBIL's trade with
offsets in place of lanes. Nobody moves toward a neighbour who could not brake for it, two who meet from both
sides share the gap, and a step that would still make two bodies touch is not taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sim.models import Model
from sim.params import RiderParams
from sim.riding import ACCELERATION, BRAKING, SIDE, Riders, ahead, apart, idm, space
from sim.rng import stream
from sim.world import FIRST_VEHICLE_ID, Bodies, Kind, Lamps, Role

Floats = NDArray[np.float64]

ENTRY = -5.0
"""s, metres, where riders come in: out of view, below the camera, which stands at s = 0."""
BEYOND = 14.0
"""Metres past the far end of the view after which riders are taken out."""
WARM_UP = 4.0
"""Seconds that the traffic has been riding when an episode begins."""

_HARDEST = 7.0  # m/s^2 of braking
_TURN = 0.12  # radians that a machine turns from the lane's direction at most
_ROOM = np.array([0.08, 0.13])  # metres that a turned, leaning body takes more, ahead and to each side
_VERGE = 0.35  # metres of the shoulder that who stands, or comes the wrong way, uses
_STEER = 2.2  # m/s^2 across the lane
_DECIDE = 6  # ticks between two choices of an offset
_OFFSETS = 15  # that are compared
_TRIES = 8  # places across the lane that a rider tries before it waits for the next tick
_WAY = 1.7  # metres that riders leave at the left edge to who comes the wrong way
_GRAVITY = 9.81

JACKETS = np.array(
    [
        (0.85, 0.85, 0.83),
        (0.12, 0.13, 0.16),
        (0.20, 0.28, 0.50),
        (0.62, 0.10, 0.11),
        (0.80, 0.66, 0.18),
        (0.18, 0.42, 0.30),
        (0.55, 0.57, 0.60),
        (0.76, 0.42, 0.52),
        (0.48, 0.36, 0.26),
        (0.82, 0.44, 0.14),
        (0.36, 0.60, 0.72),
    ]
)
"""Colours of jackets, sRGB."""


class RiderTraffic:
    """The traffic of one lane, from its parameters and a seed.

    Args:
        params: How many, how fast, and who does what.
        lane: Lowest and highest offset d of the lane, metres.
        far: s of the far end of the view, metres.
        models: All models of the scene; motorcycles are picked among them.
        seed: Of the episode.
        rate: Ticks a second.
    """

    def __init__(
        self,
        params: RiderParams,
        *,
        lane: tuple[float, float],
        far: float,
        models: tuple[Model, ...],
        seed: int,
        rate: int,
    ) -> None:
        self._params, self._lane, self._far, self._seed, self._rate = params, lane, far, seed, rate
        self._catalogue = models
        self._machines = [k for k, model in enumerate(models) if model.kind == Kind.MOTORCYCLE]
        self._drawn = 0
        self._tick = -round(WARM_UP * rate)
        self._arrivals = stream(seed, "riders", "arrivals")
        self._due = self._interval()
        self._riders = self._populated()
        self._next = self._draw(ENTRY, 0.5)
        self._stops = self._planned("parked", params.parked, params.parked_at)
        self._wrong = self._planned("wrong way", params.wrong_way, params.wrong_way_at)
        while self._tick < 0:
            self.step()

    def step(self) -> None:
        """Ride on for one tick."""
        self._tick += 1
        self._let_in()
        now = self._riders
        kept = (now.s < self._far + BEYOND) & (now.s > ENTRY - 3.0)
        now = now.take(kept)
        now = self._pulled_over(now)
        if self._tick % _DECIDE == 0:
            now = replace(now, aim=self._aims(now))
        self._riders = self._moved(now)

    def bodies(self) -> Bodies:
        """Return all riders, machine and rider one body each."""
        now, count = self._riders, len(self._riders)
        yaws = np.where(now.way > 0, now.yaw, np.pi - now.yaw)
        riding = now.leave == 0
        lamps = np.where(riding, Lamps.OFF, Lamps.TAIL).astype(np.uint8)
        velocities = np.stack([now.way * now.v, now.u, np.zeros(count)], axis=1)
        return Bodies(
            ids=now.ids,
            kinds=np.full(count, Kind.MOTORCYCLE, np.uint8),
            roles=np.where(now.way > 0, Role.SAME_WAY, Role.WRONG_WAY).astype(np.uint8),
            models=now.models,
            positions=np.stack([now.s, now.d, np.zeros(count)], axis=1),
            yaws=yaws,
            velocities=velocities,
            sizes=now.sizes,
            colours=now.colours,
            lamps=lamps,
            leans=np.stack([np.zeros(count), now.lean], axis=1),
        )

    def _interval(self) -> float:
        """Draw the seconds until the next rider wants to come in."""
        flow = self._params.riders * self._params.speed / (self._far - ENTRY)
        return float(self._arrivals.exponential(0.8 / flow))

    def _planned(self, what: str, count: int, first: float) -> list[int]:
        """Draw the ticks from which on ``count`` riders do something, the first after ``first`` seconds."""
        rng = stream(self._seed, "riders", what)
        gaps = rng.uniform(2.0, 3.5, count)
        return [round((first + t) * self._rate) for t in np.cumsum(gaps) - gaps]

    def _populated(self) -> Riders:
        """Spread riders over the lane."""
        rng = stream(self._seed, "riders", "start")
        riders = self._draw(ENTRY, 0.0).take(np.zeros(1, bool))
        wanted = round(0.9 * self._params.riders)
        for _ in range(40 * wanted):
            if len(riders) == wanted:
                break
            new = self._draw(float(rng.uniform(ENTRY, self._far + BEYOND)), float(rng.uniform()))
            if self._free(riders, new, headway=1.0):
                riders = riders.joined(new)
        return riders

    def _draw(self, s: float, place: float, way: float = 1.0) -> Riders:
        """Draw the next rider, at ``s`` and a share ``place`` of the lane's width."""
        rng = stream(self._seed, "riders", self._drawn)
        self._drawn += 1
        p, (low, high) = self._params, self._lane
        model = self._machines[int(rng.integers(len(self._machines)))]
        size = np.array(self._catalogue[model].size) * rng.uniform(0.95, 1.05, 3)
        half = 0.5 * size[:2] + _ROOM
        speed = max(p.speed + p.speed_spread * float(np.clip(rng.normal(), -2, 2)), 0.3 * p.speed)
        jacket = JACKETS[int(rng.integers(len(JACKETS)))] + rng.normal(0, 0.03, 3)
        weave = [
            p.weave * rng.uniform(0.4, 1.6),
            2 * np.pi / rng.uniform(4.0, 9.0),
            rng.uniform(0, 2 * np.pi),
        ]
        favourite = rng.uniform(low + half[1], high - half[1])
        d = low + half[1] + place * (high - low - 2 * half[1])
        one = np.ones(1)
        return Riders(
            ids=np.array([FIRST_VEHICLE_ID + self._drawn - 1], np.uint32),
            way=way * one,
            s=s * one,
            d=d * one,
            v=0.9 * speed * one,
            u=0 * one,
            yaw=0 * one,
            lean=0 * one,
            aim=d * one,
            wanted=speed * one,
            favourite=favourite * one,
            weave=np.array([weave]),
            stop=np.nan * one,
            leave=np.zeros(1, np.int64),
            half=half[None],
            sizes=size[None],
            models=np.array([model], np.int32),
            colours=np.clip(jacket, 0.02, 0.97)[None].astype(np.float32),
        )

    def _free(self, riders: Riders, new: Riders, *, headway: float) -> bool:
        """Whether a rider has its place to itself, and ``headway`` seconds to whoever rides before it."""
        gap = np.abs(riders.s - new.s) - riders.half[:, 0] - new.half[0, 0]
        side = np.abs(riders.d - new.d) - riders.half[:, 1] - new.half[0, 1]
        return not bool(((gap < 0.6 + headway * new.v) & (side < SIDE)).any())

    def _let_in(self) -> None:
        """Let riders in whose time has come, where the entry is free and the lane not full."""
        self._due -= 1 / self._rate
        riders = self._riders
        if self._wrong and self._tick >= self._wrong[0]:
            self._wrong.pop(0)
            new = self._draw(self._far + BEYOND - 6.0, 1.0, way=-1.0)
            new = replace(new, d=new.d + _VERGE, aim=new.d + _VERGE)
            # Out of view nobody is met where it comes in, nor in its way.
            near = np.abs(riders.s - new.s) < 5.0
            in_way = (riders.s > self._far) & (riders.d + riders.half[:, 1] > self._lane[1] - _WAY)
            riders = riders.take(~near & ~in_way)
            self._riders = riders = riders.joined(replace(new, favourite=new.d, weave=0 * new.weave))
        if self._due > 0 or int((riders.s < self._far).sum()) >= self._params.riders:
            return
        new, (low, high) = self._next, self._lane
        for place in self._arrivals.uniform(0, 1, _TRIES):
            d = low + new.half[:, 1] + place * (high - low - 2 * new.half[:, 1])
            new = replace(new, d=d, aim=d)
            path = (np.abs(riders.d - d) < riders.half[:, 1] + new.half[0, 1] + SIDE) & (riders.s < 15.0)
            # Nobody comes in faster than whoever it would have to brake for.
            new = replace(new, v=np.minimum(0.9 * new.wanted, riders.v[path].min(initial=np.inf) + 0.5))
            if self._free(riders, new, headway=0.6):
                self._riders = riders.joined(new)
                self._next = self._draw(ENTRY, 0.5)
                self._due = self._interval()
                return

    def _pulled_over(self, now: Riders) -> Riders:
        """Make riders choose a place at the kerb, stand there, and leave."""
        stop, leave, v, u = now.stop.copy(), now.leave.copy(), now.v.copy(), now.u.copy()
        if self._stops and self._tick >= self._stops[0]:
            # Whoever is near the kerb and far enough before a place that can be seen.
            room = now.v**2 / (2 * BRAKING) + 0.4 * now.v
            fit = np.isnan(stop) & (now.way > 0) & (now.s + room > 14.0) & (now.s + room < 0.62 * self._far)
            if fit.any():
                self._stops.pop(0)
                chosen = int(np.flatnonzero(fit)[np.argmin(now.d[fit])])
                stop[chosen] = now.s[chosen] + room[chosen]
        standing = leave > 0
        arrived = (now.s >= stop - 0.3) & (now.v < 0.3) & ~standing
        leave[arrived] = self._tick + round(self._params.stand * self._rate)
        gone = standing & (self._tick >= leave)
        stop[gone], leave[gone] = np.nan, 0
        v[leave > 0] = u[leave > 0] = 0.0
        return replace(now, stop=stop, leave=leave, v=v, u=u)

    def _kerb(self, now: Riders) -> Floats:
        return self._lane[0] - _VERGE + now.half[:, 1]

    def _aims(self, now: Riders) -> Floats:
        """Choose the offset that each rider steers for."""
        (low, high), t = self._lane, self._tick / self._rate
        make_way = np.where(now.way < 0, -_VERGE, _WAY * (now.way < 0).any())
        low_d, high_d = low + now.half[:, 1], high - make_way - now.half[:, 1]
        swing = now.favourite + now.weave[:, 0] * np.sin(now.weave[:, 1] * t + now.weave[:, 2])
        offsets = low_d[:, None] + np.linspace(0, 1, _OFFSETS) * (high_d - low_d)[:, None]
        swing = np.clip(swing, low_d, high_d)
        offsets = np.concatenate([offsets, swing[:, None]], axis=1)
        gap, closing = ahead(now)
        wide = now.half[:, None, 1] + now.half[None, :, 1] + SIDE
        in_path = np.abs(now.d[None, None, :] - offsets[:, :, None]) < wide[:, None, :]
        worth = idm(
            now.v[:, None, None],
            now.wanted[:, None, None],
            np.where(in_path, gap[:, None, :], np.inf),
            closing[:, None, :],
        ).min(axis=2, initial=ACCELERATION)
        right, left = space(now)
        outside = (offsets > (now.d + left)[:, None] + 1e-6) | (offsets < (now.d - right)[:, None] - 1e-6)
        worth = np.maximum(worth, -3.0) - 2.0 * outside
        worth -= 0.30 * np.abs(offsets - now.d[:, None]) + 0.22 * np.abs(offsets - swing[:, None])
        best = offsets[np.arange(len(now)), worth.argmax(axis=1)]
        return np.where(np.isnan(now.stop), best, self._kerb(now))

    def _moved(self, now: Riders) -> Riders:
        """Accelerate, steer and move, and leave out what would make two riders touch."""
        dt = 1 / self._rate
        standing = now.leave > 0
        gap, closing = ahead(now)
        across = now.d[None, :] - now.d[:, None]
        soon = across + 0.4 * (now.u[None, :] - now.u[:, None])
        # The slower they pass each other, the closer they dare.
        wide = now.half[:, None, 1] + now.half[None, :, 1] + np.clip(0.02 * closing, 0.02, 0.5 * SIDE)
        in_path = (np.minimum(np.abs(across), np.abs(soon)) < wide) | (across * soon < 0)
        before = np.where(in_path, gap, np.inf)
        rate = idm(now.v[:, None], now.wanted[:, None], before, closing).min(axis=1, initial=ACCELERATION)
        to_stop = np.where(np.isnan(now.stop), np.inf, np.maximum(now.stop - now.s, 0.0))
        rate = np.minimum(rate, (np.sqrt(2 * BRAKING * to_stop) - now.v) / 0.25)
        v = np.where(standing, 0.0, np.maximum(now.v + np.clip(rate, -_HARDEST, ACCELERATION) * dt, 0.0))
        fastest = np.minimum(0.12 * v + 0.3, 1.1)  # slow riders steer little
        wish = np.clip(1.4 * (now.aim - now.d), -fastest, fastest)
        u = now.u + np.clip(wish - now.u, -_STEER * dt, _STEER * dt)
        right, left = space(now)
        u = np.where(standing, 0.0, np.clip(u, -0.5 * right / dt, 0.5 * left / dt))
        s, d = apart(now, now.s + now.way * v * dt, now.d + u * dt)
        stayed = s == now.s
        v, moved = np.where(stayed, 0.0, v), (d - now.d) / dt
        yaw = np.clip(np.arctan2(moved, np.maximum(v, 2.5)), -_TURN, _TURN)
        lean = np.clip((moved - now.u) / dt / _GRAVITY, -0.25, 0.25)
        return replace(
            now,
            s=s,
            d=d,
            v=v,
            u=moved,
            yaw=now.yaw + (yaw - now.yaw) * min(1.0, 6 * dt),
            lean=now.lean + (lean - now.lean) * min(1.0, 5 * dt),
        )
