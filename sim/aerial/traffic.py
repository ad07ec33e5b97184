"""All vehicles below the platform: those on the ground, those on the bridges, and the convoy among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sim.aerial.fleet import LookalikeFleet
from sim.aerial.flows import Flows, Traveller
from sim.aerial.networks import along_road
from sim.aerial.overpass import Overpass
from sim.aerial.site import Layout
from sim.aerial.waves import Waves
from sim.fleet import Surge
from sim.models import Model
from sim.params import AerialTrafficParams
from sim.rng import stream
from sim.world import FIRST_VEHICLE_ID, Bodies, Role

Floats = NDArray[np.float64]

WARM_UP = 6.0
"""Seconds of traffic before tick 0, in which gaps and lanes settle."""
LEVEL = 1 << 20
"""Numbers that each level has for its vehicles."""
CONVOY_LEAD = 75.0
"""Metres along its path of the convoy's last vehicle, when the traffic begins."""
HEADWAY = 1.15
"""Seconds between two vehicles of the convoy, in the mean."""


class AerialTraffic:
    """Vehicles level by level."""

    def __init__(
        self, params: AerialTrafficParams, layout: Layout, models: Sequence[Model], *, seed: int, rate: int
    ) -> None:
        """Populate the roads and let the traffic settle.

        Args:
            params: Who drives.
            layout: The roads and the bridges.
            models: Of the scene; vehicles' ``models`` point into it.
            seed: The episode's.
            rate: Ticks a second.
        """
        self._layout, self._seed = layout, seed
        fleet = LookalikeFleet(params, models, stream(seed, "aerial", "looks"))
        streams = 1 + max((entry.stream for entry in layout.network.entries), default=0)
        waves = Waves(params.waves, streams, stream(seed, "aerial", "waves"))
        ground = Flows(
            layout.network,
            fleet,
            waves,
            changes=layout.network.signals is None,
            seed=seed,
            name="ground",
            rate=rate,
        )
        if params.convoy:
            self._form_convoy(params, ground, fleet)
        ground.fill(spared=self._spared(params))
        self._levels: list[tuple[Flows, Overpass | None]] = [(ground, None)]
        calm = Waves(0.0, 1, stream(seed, "aerial", "calm"))
        for k, overpass in enumerate(layout.overpasses):
            if overpass.carries != "road" or params.bridge_density == 0:
                continue
            road = overpass.road(layout.beyond if overpass.ramps else 0.0)
            network = along_road(road, params.bridge_density, params.bridge_density)
            flows = Flows(network, fleet, calm, changes=False, seed=seed, name=f"bridge-{k}", rate=rate)
            flows.fill()
            self._levels.append((flows, overpass))
        for _ in range(round(WARM_UP * rate)):
            self.step()

    @property
    def collided(self) -> bool:
        """Whether any vehicle has ever touched another."""
        return any(flows.collided for flows, _ in self._levels)

    def step(self) -> None:
        """Advance one tick."""
        for flows, _ in self._levels:
            flows.step()

    def convoy_at(self) -> float | None:
        """Return where along the main road the middle of the convoy is, metres; None where there is none."""
        road = self._layout.road
        drivers = [t.driver for t in self._levels[0][0].travellers if t.convoy >= 0]
        if not drivers or road is None:
            return None
        plane = np.array([driver.position for driver in drivers])
        s, _ = road.locate(plane[:, 0], -plane[:, 1])
        return float(s.mean())

    def vehicles(self) -> Bodies:
        """Return all vehicles, those on the ground first."""
        parts = [
            _bodies(flows.travellers, overpass, level * LEVEL)
            for level, (flows, overpass) in enumerate(self._levels)
            if flows.travellers
        ]
        return Bodies.concatenate(*parts) if parts else Bodies.empty()

    def _spared(self, params: AerialTrafficParams) -> tuple[int, float, float] | None:
        if not params.convoy:
            return None
        run = params.convoy * (HEADWAY * params.speed + 9.0)
        return self._lane(params), CONVOY_LEAD - 30.0, CONVOY_LEAD + run + 30.0

    @staticmethod
    def _lane(params: AerialTrafficParams) -> int:
        """Number of the entry at which the convoy came in: the right lane, unless it is alone."""
        del params
        return 0

    def _form_convoy(self, params: AerialTrafficParams, flows: Flows, fleet: LookalikeFleet) -> None:
        """Put the convoy on its lane, the first farthest along; all have one pace, and most one look."""
        rng = stream(self._seed, "aerial", "convoy")
        entry = self._lane(params)
        path = self._layout.network.entries[entry].paths[0]
        gaps = rng.uniform(0.75, 1.35, params.convoy) * HEADWAY * params.speed
        surge = Surge.draw(rng, strength=0.22, periods=(9.0, 14.0))
        s = CONVOY_LEAD
        for k in reversed(range(params.convoy)):
            draw = fleet.draw(rng, light=True)
            if rng.random() < params.lookalikes:
                draw = fleet.look(draw, int(rng.integers(len(fleet.looks))))
            own = replace(surge, phase=surge.phase + float(rng.normal(0, 0.25)))
            draw = replace(draw, speed=params.speed * float(rng.uniform(1.0, 1.06)), surge=own)
            s += draw.size[0] / 2
            flows.add(draw, entry, path, s, params.speed, convoy=k)
            s += draw.size[0] / 2 + float(gaps[k])


def _bodies(travellers: Sequence[Traveller], overpass: Overpass | None, first: int) -> Bodies:
    """Turn the vehicles of one level into world bodies, as high as the bridge that they are on."""
    drivers = [t.driver for t in travellers]
    count = len(drivers)
    plane = np.array([d.position for d in drivers])
    headings = np.array([d.heading for d in drivers])
    speeds = np.array([d.speed for d in drivers])
    x, y, still = plane[:, 0], -plane[:, 1], np.zeros(count)
    height = still
    if overpass is not None:
        along = (x - overpass.x) * np.cos(overpass.heading) + (y - overpass.y) * np.sin(overpass.heading)
        height = overpass.height(along)
    return Bodies(
        ids=np.array([FIRST_VEHICLE_ID + first + t.number for t in travellers], np.uint32),
        kinds=np.array([t.draw.kind for t in travellers], np.uint8),
        roles=np.array([Role.NONE if t.convoy < 0 else Role.CONVOY for t in travellers], np.uint8),
        models=np.array([t.draw.model for t in travellers], np.int32),
        positions=np.column_stack([x, y, height]),
        yaws=-headings,
        velocities=np.column_stack([speeds * np.cos(headings), -speeds * np.sin(headings), still]),
        sizes=np.array([t.draw.size for t in travellers], float),
        colours=np.array([t.draw.colour for t in travellers], np.float32),
        lamps=np.zeros(count, np.uint8),
        leans=np.zeros((count, 2)),
    )
