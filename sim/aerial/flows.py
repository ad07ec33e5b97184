"""The traffic of one network: who is there, who comes in and leaves, and what the lights say."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim.aerial.driving import RoutedDriver, StopLine
from sim.aerial.networks import Entry, Network, Path, Signals
from sim.aerial.waves import Waves
from sim.fleet import Draw, Fleet
from sim.indexed_road import IndexedRoad
from sim.rng import stream

LEAVE = 6.0
"""Metres before a path's end where vehicles leave."""
COMMITTED = 2.6
"""M/s^2: who would have to brake harder for a light that turns red drives on."""
FIRST_GREEN = (5.0, 10.0)
"""Seconds after the traffic's beginning in which an intersection's first phase begins, after one of red."""


@dataclass(slots=True, eq=False)
class Traveller:
    """A vehicle on a network.

    Attributes:
        number: Its number among all that were ever drawn on this network.
        draw: What does not change about it.
        driver: Its driver.
        entry: Where it came in.
        convoy: Its place in the convoy, from the front; -1 if it is in none.
        s: Metres along its path.
    """

    number: int
    draw: Draw
    driver: RoutedDriver
    entry: int
    convoy: int = -1
    s: float = 0.0


class Flows:
    """Fills a network with vehicles and moves them.

    Attributes:
        travellers: Who is there now.
        world: highway-env's road with its vehicles.
    """

    def __init__(
        self, network: Network, fleet: Fleet, waves: Waves, *, changes: bool, seed: int, name: str, rate: int
    ) -> None:
        """Populate the network.

        Args:
            network: The lanes, and where vehicles come in.
            fleet: Draws them.
            waves: How fast the streams are where and when.
            changes: Whether drivers change lanes.
            seed: The episode's.
            name: Of the network, for its random streams.
            rate: Ticks a second.
        """
        self._network, self._fleet, self._waves, self._changes = network, fleet, waves, changes
        self._seed, self._name, self._rate, self._tick = seed, name, rate, 0
        self.world = IndexedRoad(
            network.lanes, np_random=self._stream("highway"), neighbour_vehicles_connected_lanes=True
        )
        self.travellers: list[Traveller] = []
        self.collided = False
        self._number = 0
        self._gaps = [self._stream("entry", k) for k in range(len(network.entries))]
        self._room = [self._draw_gap(k) for k in range(len(network.entries))]
        self._lights = (
            Lights(network.signals, self.world, self._stream("lights")) if network.signals else None
        )

    def fill(self, *, spared: tuple[int, float, float] | None = None) -> None:
        """Populate every entry's paths as far as they are to be.

        Args:
            spared: An entry, and the metres along its path from where to where nobody is put.
        """
        for k, entry in enumerate(self._network.entries):
            if entry.density <= 0:
                continue
            s = float(self._gaps[k].uniform(0.0, 0.6)) * 1000 / entry.density
            while s < entry.filled - LEAVE:
                draw = self._draw(k)
                middle = s + draw.size[0] / 2
                if spared is None or k != spared[0] or not spared[1] < middle < spared[2]:
                    self.add(draw, k, self._way(k), middle, self._pace(draw, k, middle))
                s += draw.size[0] + self._draw_gap(k)

    def add(
        self, draw: Draw, entry: int, path: Path, s: float, speed: float, *, convoy: int = -1
    ) -> Traveller:
        """Put a vehicle on a path."""
        step = max(k for k, start in enumerate(path.starts) if start <= max(s, 0.0))
        index, along = path.lanes[step], s - path.starts[step]
        lane = self.world.network.get_lane(index)
        driver = RoutedDriver(
            self.world,
            lane.position(along, 0),
            heading=lane.heading_at(along),
            speed=speed,
            target_lane_index=index,
        )
        length, width, _ = draw.size
        driver.resize(length, width)
        driver.set_lateral(1.2, 0.3)
        driver.follow(path, step)
        driver.lane_index, driver.lane = index, lane
        driver.desired_speed = driver.target_speed = draw.speed
        driver.jam_gap, driver.TIME_WANTED = draw.jam_gap, draw.headway
        driver.COMFORT_ACC_MAX, driver.COMFORT_ACC_MIN = draw.acceleration, -draw.braking
        driver.POLITENESS, driver.ACC_MAX = draw.politeness, 7.0
        driver.LANE_CHANGE_DELAY, driver.LANE_CHANGE_MIN_ACC_GAIN = 2.0, 0.15
        driver.LANE_CHANGE_MAX_BRAKING_IMPOSED = driver.LANE_CHANGE_MAX_BRAKING
        driver.enable_lane_change = self._changes and not draw.heavy and convoy < 0
        self.world.vehicles.append(driver)
        traveller = Traveller(self._number, draw, driver, entry, convoy, s)
        self._number += 1
        self.travellers.append(traveller)
        return traveller

    def step(self) -> None:
        """Advance one tick."""
        t, dt = self._tick / self._rate, 1 / self._rate
        if self._lights is not None:
            self._lights.step(t, self.travellers)
        for each in self.travellers:
            each.driver.target_speed = self._wanted(each, t)
        self.world.act()
        self.world.step(dt)
        self.collided |= any(v.crashed for v in self.world.vehicles)
        self._tick += 1
        for each in self.travellers:
            each.s = each.driver.s
        self._leave()
        self._enter()

    def _wanted(self, each: Traveller, t: float) -> float:
        wish = each.draw.speed * each.draw.surge.at(t)
        entry = self._network.entries[each.entry]
        return min(wish * self._waves.factor(entry.stream, each.s, t), each.driver.path.allowed(each.s))

    def _leave(self) -> None:
        gone = {id(t.driver) for t in self.travellers if t.s > t.driver.path.length - LEAVE}
        if gone:
            self.travellers = [t for t in self.travellers if id(t.driver) not in gone]
            self.world.vehicles = [v for v in self.world.vehicles if id(v) not in gone]

    def _enter(self) -> None:
        """Let the next vehicle of an entry come in where the last has left it room."""
        last: dict[tuple[str, str, int], Traveller] = {}
        for each in self.travellers:
            edge = each.driver.target_lane_index[:2]
            for lane in each.driver.lanes:
                if (*edge, lane) not in last or each.s < last[*edge, lane].s:
                    last[*edge, lane] = each
        for k, entry in enumerate(self._network.entries):
            if entry.density <= 0:
                continue
            ahead = last.get(entry.paths[0].lanes[0])
            room = math.inf if ahead is None else ahead.s - ahead.driver.LENGTH / 2
            if room < self._room[k]:
                continue
            draw = self._draw(k)
            speed = self._pace(draw, k, 0.0)
            middle = draw.size[0] / 2
            if ahead is not None:
                speed = min(speed, ahead.driver.speed + 2.0)
                closing = max(speed**2 - ahead.driver.speed**2, 0.0) / 3.0
                if room - draw.size[0] < 3.0 + 0.8 * speed + closing:
                    continue
            self.add(draw, k, self._way(k), middle, speed)
            self._room[k] = self._draw_gap(k)

    def _draw(self, k: int) -> Draw:
        lane, lanes = self._network.entries[k].rank
        return self._fleet.draw(
            self._stream("vehicle", self._number),
            pace=self._fleet.lane_pace(lane, lanes),
            light=lane < lanes - 1,
        )

    def _way(self, k: int) -> Path:
        """Draw the path of the next vehicle of an entry."""
        entry: Entry = self._network.entries[k]
        roll = self._stream("way", self._number).random()
        return entry.paths[int(np.searchsorted(np.cumsum(entry.shares)[:-1], roll, side="right"))]

    def _pace(self, draw: Draw, k: int, s: float) -> float:
        """Speed at which a vehicle appears, m/s."""
        entry = self._network.entries[k]
        settled = max((1000 / entry.density - 8.0) / 1.3, 1.0)
        wish = draw.speed * self._waves.factor(entry.stream, s, self._tick / self._rate)
        return min(wish, entry.paths[0].allowed(s), settled)

    def _draw_gap(self, k: int) -> float:
        """Draw the free road before the next vehicle of an entry, bumper to bumper, metres."""
        density = self._network.entries[k].density
        if density <= 0:
            return math.inf
        mean = 1000 / density - 5.0
        shortest = min(8.0, 0.6 * mean)
        return shortest + float(self._gaps[k].exponential(max(mean - shortest, 1.0)))

    def _stream(self, *names: str | int) -> np.random.Generator:
        return stream(self._seed, "aerial", self._name, *names)


class Lights:
    """The lights of an intersection: they put stop lines into lanes and take them out."""

    def __init__(self, signals: Signals, world: IndexedRoad, rng: np.random.Generator) -> None:
        """Set them up with a stop line for each lane; the first phase begins within `FIRST_GREEN` seconds."""
        self._signals, self._world = signals, world
        self._spans = [green + signals.clearance for green in signals.greens]
        self._offset = -float(rng.uniform(*FIRST_GREEN))
        self._lines = {index: StopLine(world, index, along) for index, along in signals.lines.items()}
        self._red: set[tuple[str, str, int]] = set()

    def green(self, t: float) -> frozenset[tuple[str, str, int]]:
        """Lanes that may drive at ``t`` seconds."""
        into = (t + self._offset) % sum(self._spans)
        for phase, green, span in zip(self._signals.phases, self._signals.greens, self._spans, strict=True):
            if into < span:
                return frozenset(phase if into < green else ())
            into -= span
        return frozenset()

    def step(self, t: float, travellers: list[Traveller]) -> None:
        """Show what is green at ``t`` seconds to ``travellers``."""
        green = self.green(t)
        turned = [index for index in self._lines if index not in green and index not in self._red]
        if turned:
            for each in travellers:
                self._decide(each, turned)
        self._red = {index for index in self._lines if index not in green}
        self._world.objects = [line for index, line in self._lines.items() if index in self._red]

    def _decide(self, each: Traveller, turned: list[tuple[str, str, int]]) -> None:
        """Have who can no longer stop comfortably before a light that turns red drive on."""
        driver = each.driver
        index = driver.target_lane_index
        if index not in turned:
            return
        left = self._signals.lines[index] - driver.place_on(driver.road.network.get_lane(index))[0]
        left -= driver.LENGTH / 2
        if left < driver.speed**2 / (2 * COMMITTED):
            driver.running = self._lines[index]
