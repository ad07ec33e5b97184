"""Tables of statistics of one pixel's features: eqs. (5), (6), (8)-(16) of paper 3.

A table holds for each pixel the features seen most often, how often: p(v), and how often as background:
p(v|b), sorted by p(v), of equals the latest first. Every frame all entries fade by (1 - rate) and the one
seen grows by the rate. Fading all of them would touch the whole memory in each frame, so a common factor is
kept aside instead: an entry holds its value divided by that factor, grows by rate / factor, and all others
stay as they are. Values are the same up to rounding, and so is the order. The layout is plane by plane,
entry 0 of all pixels first: most pixels need no other.

Features are packed into 32 bits: three bytes of colour; two signed bytes of gradient; six times five bits of
colour before and now.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

COLOUR, GRADIENT, PAIR = 0, 1, 2

LATEST = np.float32(1.0001)
"""Of two entries as frequent the later one comes first; frequencies are the same up to this factor."""

# Three components of five bits, every ten bits: their places, bit 0, bits 0 to 7 and bit 8 of each.
LANES, ONES, REST, TOPS = (np.uint32(bits * 0x100401) for bits in (0x1F, 0x1, 0xFF, 0x100))


class Table(NamedTuple):
    """Statistics of one kind of feature, M entries for each of P pixels.

    Attributes:
        features: (M, P) uint32.
        seen: (M, P) float32, p(v) without the common factor; 0 is an empty entry.
        shared: (M, P) float32, p(v|b) without its factor.
    """

    features: NDArray[np.uint32]
    seen: NDArray[np.float32]
    shared: NDArray[np.float32]

    @classmethod
    def empty(cls, entries: int, pixels: int) -> Table:
        """Return a table without entries; memory is used as entries come."""
        shape = entries, pixels
        return cls(np.zeros(shape, np.uint32), np.zeros(shape, np.float32), np.zeros(shape, np.float32))

    @property
    def used(self) -> int:
        """How many entries the fullest pixel has; the memory beyond has not been touched."""
        return next((k for k, entry in enumerate(self.seen) if not entry.any()), len(self.seen))


@njit(cache=True)
def _near(a, b, tolerance):  # type: ignore[no-untyped-def]
    """Tell whether three components, each in five of ten bits, are all within a tolerance, in one go.

    Bit 8 of each ten is set by a + tolerance >= b, and in what is left again by a > b + tolerance.
    """
    offset = np.uint32(tolerance)
    above = a + (TOPS | ONES * offset) - b
    beyond = (above & REST) + ONES * (np.uint32(255) - offset - offset)
    return (above & ~beyond & TOPS) == TOPS


@njit(cache=True)
def same(kind, a, b, tolerance, floor):  # type: ignore[no-untyped-def]
    """Tell whether two features are identified with each other: eq. (8), for pairs (9).

    (8) is |a - b|^2 / (|a|^2 + |b|^2): a difference counts in proportion to the size. Below ``floor`` it is
    noise whatever the size, which also covers 0 / 0: two gradients of nothing but noise, in any direction,
    are the same.

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        a: uint32.
        b: uint32.
        tolerance: delta; of a pair the largest difference of a component, in levels.
        floor: Distance |a - b| up to which features are the same; not used for pairs.
    """
    if a == b:
        return True
    if kind == PAIR:
        return _near(a & LANES, b & LANES, tolerance) and _near(
            (a >> np.uint32(5)) & LANES, (b >> np.uint32(5)) & LANES, tolerance
        )
    # Written out: a loop over components of which there are two or three is not unrolled.
    middle = np.int32(128 if kind == GRADIENT else 0)
    p, q = np.int32(a & 255) - middle, np.int32(b & 255) - middle
    apart, size = (p - q) * (p - q), p * p + q * q
    p, q = np.int32((a >> 8) & 255) - middle, np.int32((b >> 8) & 255) - middle
    apart, size = apart + (p - q) * (p - q), size + p * p + q * q
    if kind == COLOUR:
        p, q = np.int32((a >> 16) & 255), np.int32((b >> 16) & 255)
        apart, size = apart + (p - q) * (p - q), size + p * p + q * q
    return apart <= max(tolerance * size, floor * floor)


@njit(cache=True)
def all_same(kind, entries, features, tolerance, floor):  # type: ignore[no-untyped-def]
    """Tell of (P,) pairs of features what `same` tells of one."""
    count = features.size
    found = np.empty(count, np.bool_)
    if kind == PAIR:
        for i in range(count):
            a, b = entries[i], features[i]
            early = _near(a & LANES, b & LANES, tolerance)
            found[i] = early & _near((a >> np.uint32(5)) & LANES, (b >> np.uint32(5)) & LANES, tolerance)
        return found
    # Whole numbers below 2^24: float32 holds them as they are.
    a, b, noise = entries.view(np.uint8), features.view(np.uint8), floor * floor
    middle = np.float32(128.0 if kind == GRADIENT else 0.0)
    third = np.float32(0.0 if kind == GRADIENT else 1.0)
    for i in range(count):
        p0, q0 = np.float32(a[4 * i]) - middle, np.float32(b[4 * i]) - middle
        p1, q1 = np.float32(a[4 * i + 1]) - middle, np.float32(b[4 * i + 1]) - middle
        p2, q2 = np.float32(a[4 * i + 2]) * third, np.float32(b[4 * i + 2]) * third
        apart = (p0 - q0) * (p0 - q0) + (p1 - q1) * (p1 - q1) + (p2 - q2) * (p2 - q2)
        size = p0 * p0 + q0 * q0 + p1 * p1 + q1 * q1 + p2 * p2 + q2 * q2
        found[i] = (apart <= tolerance * size) | (apart <= noise)
    return found


@njit(cache=True)
def evidence(kind, table, features, at, first, tolerance, floor):  # type: ignore[no-untyped-def]
    """Sum p(v) and p(v|b) over the first N entries that are identified with a feature: eqs. (15), (16).

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        table: Of P pixels.
        features: (P,) uint32.
        at: (K,) the pixels asked for.
        first: N.
        tolerance: As in `same`.
        floor: As in `same`.

    Returns:
        Two (K,) float32, both without their common factors.
    """
    entries, frequency, shared_frequency = table.features, table.seen, table.shared
    seen, shared = np.zeros(at.size, np.float32), np.zeros(at.size, np.float32)
    for a in range(at.size):
        i = at[a]
        for k in range(first):
            if frequency[k, i] == 0.0:
                break
            if same(kind, entries[k, i], features[i], tolerance, floor):
                seen[a] += frequency[k, i]
                shared[a] += shared_frequency[k, i]
    return seen, shared


@njit(cache=True)
def totals(table, at, first):  # type: ignore[no-untyped-def]
    """Sum p(v) and p(v|b) over all of the first N entries of pixels ``at``; two (K,) as in `evidence`."""
    frequency, shared_frequency = table.seen, table.shared
    seen, shared = np.zeros(at.size, np.float32), np.zeros(at.size, np.float32)
    for a in range(at.size):
        for k in range(first):
            if frequency[k, at[a]] == 0.0:
                break
            seen[a] += frequency[k, at[a]]
            shared[a] += shared_frequency[k, at[a]]
    return seen, shared


@njit(cache=True)
def approach(p_b, is_background, rate):  # type: ignore[no-untyped-def]
    """Let p(b) (P,) of each pixel follow whether it is background (P,), in place: eq. (10)."""
    for i in range(p_b.size):
        p_b[i] += rate * (np.float32(is_background[i]) - p_b[i])


@njit(cache=True, error_model="numpy")
def fade(factors, is_background, rate):  # type: ignore[no-untyped-def]
    """Let what was learnt of background pixels fade, in place, and return by how much the newest grows.

    Args:
        factors: (P,) float32, common factors of p(v|b).
        is_background: (P,) bool; the others stay as they are.
        rate: float32, alpha.

    Returns:
        (P,) float32, rate / factor of background pixels, 0 of others, as `learn` takes it.
    """
    nothing, whole = np.float32(0.0), np.float32(1.0)
    grow = np.empty(factors.size, np.float32)
    for i in range(factors.size):
        factors[i] *= whole - rate if is_background[i] else whole
        part = rate / factors[i]
        grow[i] = part if is_background[i] else nothing
    return grow


@njit(cache=True)
def learn(kind, table, features, grow, grow_shared, tolerance, floor):  # type: ignore[no-untyped-def]
    """Count one feature of each pixel: eqs. (10), (11), after the common factors have faded.

    Of several identified entries the most frequent grows. An unknown feature takes the last entry's place,
    with p(v|b) = rate only if it was background: as printed, (11) would make any new colour background at
    its second sight.

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        table: M >= 2 entries for each of P pixels.
        features: (P,) uint32.
        grow: float32, rate / factor of p(v).
        grow_shared: (P,) float32, rate / factor of p(v|b) where the pixel is background, else 0.
        tolerance: As in `same`.
        floor: As in `same`.
    """
    entries, frequency, shared_frequency = table.features, table.seen, table.shared
    last, nothing = entries.shape[0] - 1, np.float32(0.0)
    # Nearly all pixels show their first entry: that is told, and counted, without a branch.
    usual = all_same(kind, entries[0], features, tolerance, floor)
    for i in range(features.size):
        frequency[0, i] += grow if usual[i] else nothing
        shared_frequency[0, i] += grow_shared[i] if usual[i] else nothing
    for i in range(features.size):
        if usual[i]:
            continue
        feature = features[i]
        k, known = 1, False
        while frequency[k, i] > 0.0:
            known = same(kind, entries[k, i], feature, tolerance, floor)
            if known or k == last:
                break
            k += 1
        seen, shared = grow, grow_shared[i]
        if known:
            feature = entries[k, i]
            seen += frequency[k, i]
            shared += shared_frequency[k, i]
        while k > 0 and frequency[k - 1, i] <= seen * LATEST:
            entries[k, i] = entries[k - 1, i]
            frequency[k, i] = frequency[k - 1, i]
            shared_frequency[k, i] = shared_frequency[k - 1, i]
            k -= 1
        entries[k, i], frequency[k, i], shared_frequency[k, i] = feature, seen, shared


@njit(cache=True)
def turn(table, at, first, p_b, factor, factors_shared):  # type: ignore[no-untyped-def]
    """Make what was foreground background: eq. (14).

    What was background by eq. (4) stays so, as it is: as printed it would turn into foreground, and be a
    ghost for as long again when what has been absorbed leaves.

    Args:
        table: Of P pixels.
        at: (K,) the pixels to turn.
        first: N.
        p_b: (K,) their p(b) before.
        factor: Common factor of p(v).
        factors_shared: (K,) common factor of p(v|b).
    """
    frequency, shared_frequency = table.seen, table.shared
    for a in range(at.size):
        i, others = at[a], np.float32(1.0) - p_b[a]
        for k in range(first):
            if frequency[k, i] == 0.0:
                break
            seen, shared = frequency[k, i] * factor, shared_frequency[k, i] * factors_shared[a]
            if 2.0 * shared * p_b[a] <= seen:
                shared_frequency[k, i] = (seen - p_b[a] * shared) / (others * factors_shared[a])


@njit(cache=True)
def found_anew(kind, table, features, at, whole, tolerance, floor):  # type: ignore[no-untyped-def]
    """Take what pixels show for what their background always shows; what else it has shown stays known.

    Args:
        kind: COLOUR, GRADIENT or PAIR.
        table: Of P pixels.
        features: (P,) uint32, learnt already.
        at: (K,) the pixels.
        whole: (K,) float32, what p(v|b) becomes, without its common factor.
        tolerance: As in `same`.
        floor: As in `same`.
    """
    entries, frequency, shared_frequency = table.features, table.seen, table.shared
    for a in range(at.size):
        i = at[a]
        for k in range(entries.shape[0]):
            if frequency[k, i] == 0.0:
                break
            if same(kind, entries[k, i], features[i], tolerance, floor):
                shared_frequency[k, i] = whole[a]
                break
