"""Procedural textures, one layer a `Surface`, the same in every run."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from sim.models import Surface
from sim.rng import stream

Floats = NDArray[np.float64]

SIZE = 256

PALETTE = {
    "black": (0.06, 0.06, 0.065),
    "grey": (0.24, 0.25, 0.27),
    "white": (0.90, 0.90, 0.88),
    "silver": (0.62, 0.63, 0.65),
    "red": (0.70, 0.08, 0.08),
    "blue": (0.12, 0.22, 0.55),
    "yellow": (0.86, 0.70, 0.12),
    "green": (0.10, 0.40, 0.24),
    "orange": (0.86, 0.40, 0.10),
    "pink": (0.86, 0.50, 0.58),
    "teal": (0.16, 0.52, 0.56),
    "skin": (0.70, 0.50, 0.39),
    "jeans": (0.20, 0.26, 0.38),
    "khaki": (0.55, 0.48, 0.35),
    "brown": (0.24, 0.17, 0.12),
    "cardboard": (0.64, 0.49, 0.32),
}
"""Colours of the surface PALETTE, sRGB: stripes of equal width, from u = 0 on."""
"""Texels along each side of a layer."""

_SEED = 20110601


@cache
def texture_array() -> NDArray[np.uint8]:
    """Make the texture of every surface.

    Row 0 is v = 0, the lower edge. All layers but SIGN, PLATE, TAIL_LAMP, HEAD_LAMP and RUBBER, which
    are shown once a face, and PALETTE repeat without a seam. What the colour and the alpha of a layer mean:

    - PAINT, CARGO, FABRIC, FOLIAGE, HILL: pale; they multiply the body's colour. Alpha: gloss.
    - SIGN: four faces, one a quarter (lower left: speed limit, lower right: warning, upper left: direction
      board, upper right: gantry board). Alpha: share of marking; shown is
      ``mix(body colour, texture, alpha)``.
    - FACADE: multiplies the body's colour, too. Alpha is the window mask: 1 on glass, which reflects by
      day and may be lit at night; 4 x 4 windows a repeat.
    - TAIL_LAMP: the plain lens; the glow is the renderer's. Faces with u >= 2 are the high lamp: lit by
      BRAKE only.
    - PALETTE: the stripes of `PALETTE`, each a colour of its own.
    - all others: the albedo itself. Alpha: gloss, 0 dull to 1 a mirror.

    Returns:
        (len(Surface), SIZE, SIZE, 4) uint8, sRGB colour and linear alpha, read-only.
    """
    layers: Floats = np.zeros((len(Surface), SIZE, SIZE, 4))
    for surface in Surface:
        layers[surface] = _PAINTERS[surface](stream(_SEED, "textures", surface.name))
    array: NDArray[np.uint8] = (np.clip(layers[:, ::-1], 0, 1) * 255 + 0.5).astype(np.uint8)
    array.flags.writeable = False
    return array


def _fbm(rng: np.random.Generator, cells: int, octaves: int, gain: float = 0.5, stretch: int = 1) -> Floats:
    """Make smooth noise that repeats without a seam.

    Args:
        rng: Of the lattice.
        cells: Lumps along a side in the first octave.
        octaves: How often the lumps are halved.
        gain: Weight of each octave against the one before.
        stretch: How many times longer the lumps are upward than across.

    Returns:
        (SIZE, SIZE), of zero mean and unit standard deviation.
    """
    total = np.zeros((SIZE, SIZE))
    for octave in range(octaves):
        count = cells << octave
        if count > SIZE:
            break
        lattice = rng.normal(size=(max(1, count // stretch), count))
        total += gain**octave * _smooth(lattice)
    return np.asarray((total - total.mean()) / total.std())


def _smooth(lattice: Floats) -> Floats:
    """Interpolate a periodic lattice over a layer, smoothly in both directions."""
    result = lattice
    for axis in (0, 1):
        count = result.shape[axis]
        place = np.arange(SIZE) * count / SIZE
        low = np.floor(place).astype(int)
        share = place - low
        share = share * share * (3 - 2 * share)
        share = share[:, None] if axis == 0 else share[None, :]
        result = result.take(low % count, axis) * (1 - share) + result.take((low + 1) % count, axis) * share
    return result


def _layer(colour: Floats, gloss: float | Floats) -> Floats:
    """Join (SIZE, SIZE, 3) or (3,) colour in [0, 1] and gloss into a layer."""
    layer = np.empty((SIZE, SIZE, 4))
    layer[..., :3] = colour
    layer[..., 3] = gloss
    return layer


def _tint(dark: tuple[float, float, float], light: tuple[float, float, float], share: Floats) -> Floats:
    """Blend two colours by a share (SIZE, SIZE), clipped to [0, 1]."""
    blend = np.clip(share, 0, 1)[..., None]
    return np.asarray(np.array(dark) * (1 - blend) + np.array(light) * blend)


def _rows() -> tuple[Floats, Floats]:
    """Return row (from the top) and column of each texel's middle, in [0, 1)."""
    row, column = np.meshgrid(*(2 * [(np.arange(SIZE) + 0.5) / SIZE]), indexing="ij")
    return row, column


def _paint(rng: np.random.Generator) -> Floats:
    return _layer(np.repeat((0.985 + 0.012 * _fbm(rng, 4, 3))[..., None], 3, 2), 0.85)


def _glass(rng: np.random.Generator) -> Floats:
    return _layer(np.array([0.045, 0.055, 0.06]) + 0.006 * _fbm(rng, 2, 3)[..., None], 0.95)


def _chrome(rng: np.random.Generator) -> Floats:
    return _layer(np.array([0.72, 0.73, 0.75]) + 0.03 * _fbm(rng, 4, 3)[..., None], 0.9)


def _rubber(rng: np.random.Generator) -> Floats:
    """Paint a wheel seen from the side: tyre, rim of five spokes, hub; the corners are plain tyre."""
    row, column = _rows()
    across, up = 2 * column - 1, 1 - 2 * row
    radius, turn = np.hypot(across, up), np.arctan2(up, across)
    tyre = 0.055 + 0.012 * _fbm(rng, 16, 3)
    spokes = np.cos(5 * turn) > -0.15
    rim = np.where(radius > 0.58, 0.60, np.where(spokes | (radius < 0.16), 0.50, 0.07))
    shade = np.where(radius < 0.66, rim, np.where(radius < 0.69, 0.03, tyre))
    return _layer(np.repeat(shade[..., None], 3, 2), np.where(radius < 0.66, 0.5, 0.05))


def _plastic(rng: np.random.Generator) -> Floats:
    row, _ = _rows()
    ribs = 0.012 * np.sign(np.sin(2 * np.pi * row * 12))
    return _layer(np.repeat((0.075 + ribs + 0.010 * _fbm(rng, 8, 4))[..., None], 3, 2), 0.25)


def _plate(rng: np.random.Generator) -> Floats:
    """Paint a number plate: light ground, dark rim, seven glyphs made of bars."""
    row, column = _rows()
    layer = _layer(np.array([0.93, 0.92, 0.86]), 0.3)
    ink = (np.minimum(row, 1 - row) < 0.06) | (np.minimum(column, 1 - column) < 0.015)
    for place in range(7):
        left = 0.08 + 0.122 * place + (0.03 if place > 2 else 0.0)
        inside = (column > left) & (column < left + 0.088) & (row > 0.2) & (row < 0.8)
        across, down = (column - left) / 0.088, (row - 0.2) / 0.6
        bars = (across < 0.24, across > 0.76, down < 0.16, abs(down - 0.5) < 0.09, down > 0.84)
        chosen = rng.random(5) < 0.66
        chosen[rng.integers(5)] = True
        for bar, on in zip(bars, chosen, strict=True):
            if on:
                ink |= inside & bar
    layer[ink, :3] = 0.10
    return layer


def _tail_lamp(rng: np.random.Generator) -> Floats:
    """Paint a lens: red, ribbed, an amber and a white chamber below."""
    row, column = _rows()
    ribs = 0.5 + 0.5 * np.cos(2 * np.pi * column * 14)
    colour = _tint((0.36, 0.015, 0.02), (0.66, 0.05, 0.05), 0.3 + 0.4 * ribs + 0.1 * _fbm(rng, 8, 2))
    colour[(row > 0.72) & (column > 0.10) & (column < 0.48)] = (0.80, 0.78, 0.76)
    colour[(row > 0.72) & (column >= 0.52) & (column < 0.9)] = (0.80, 0.38, 0.06)
    frame = (np.minimum(row, 1 - row) < 0.04) | (abs(row - 0.70) < 0.02)
    colour[frame] = (0.10, 0.02, 0.02)
    return _layer(colour, 0.8)


def _head_lamp(rng: np.random.Generator) -> Floats:
    """Paint a headlamp: clear glass over a bright reflector."""
    row, column = _rows()
    bulb = np.exp(-((column - 0.5) ** 2 + (row - 0.5) ** 2) / 0.05)
    shade = 0.42 + 0.45 * bulb + 0.05 * np.cos(2 * np.pi * column * 10) + 0.02 * _fbm(rng, 8, 2)
    shade[(np.minimum(row, 1 - row) < 0.06) | (np.minimum(column, 1 - column) < 0.05)] = 0.10
    return _layer(np.repeat(shade[..., None], 3, 2), 0.9)


def _cargo(rng: np.random.Generator) -> Floats:
    """Paint sheet metal or tarpaulin: seams every half metre, dirt running down."""
    _, column = _rows()
    seams = np.abs((column * 8) % 1 - 0.5) > 0.47
    shade = 0.93 - 0.035 * np.abs(_fbm(rng, 8, 4, stretch=8)) + 0.015 * _fbm(rng, 2, 3) - 0.10 * seams
    return _layer(np.repeat(shade[..., None], 3, 2), 0.3)


def _foliage(rng: np.random.Generator) -> Floats:
    """Paint leaves: pale, for the plant's colour to tint, with fine grain and dark gaps between twigs."""
    twigs, leaves = _fbm(rng, 7, 4, 0.8), _fbm(rng, 48, 3, 0.9)
    light = 0.46 + 0.24 * twigs + 0.16 * leaves
    colour = _tint((0.22, 0.24, 0.20), (0.94, 0.95, 0.82), light)
    colour[(twigs + 0.9 * leaves) < -1.25] = (0.10, 0.12, 0.09)
    return _layer(colour, 0.0)


def _bark(rng: np.random.Generator) -> Floats:
    grain = _fbm(rng, 32, 3, 0.7, stretch=8)
    return _layer(
        _tint((0.13, 0.10, 0.075), (0.45, 0.38, 0.30), 0.5 + 0.28 * grain + 0.1 * _fbm(rng, 4, 3)), 0.05
    )


def _concrete(rng: np.random.Generator) -> Floats:
    """Paint concrete: stains running down, joints every two metres, grain."""
    row, column = _rows()
    shade = 0.60 + 0.035 * _fbm(rng, 3, 4) + 0.025 * np.minimum(_fbm(rng, 16, 3, 0.6, stretch=8), 0.3)
    shade += 0.02 * rng.normal(size=shade.shape)
    shade[np.abs((column * 2) % 1 - 0.5) > 0.492] -= 0.22
    shade[np.abs((row * 2) % 1 - 0.5) > 0.494] -= 0.10
    return _layer(shade[..., None] * np.array([1.0, 0.975, 0.93]), 0.1)


def _steel(rng: np.random.Generator) -> Floats:
    shade = 0.56 + 0.05 * _fbm(rng, 4, 4) + 0.02 * _fbm(rng, 64, 2)
    return _layer(shade[..., None] * np.array([0.97, 0.99, 1.0]), 0.4)


def _facade(rng: np.random.Generator) -> Floats:
    """Paint a wall of 4 x 4 windows with frames, sills and lintels; alpha marks the panes."""
    row, column = _rows()
    across, down = (4 * column) % 1, (4 * row) % 1
    plaster = 0.76 + 0.03 * _fbm(rng, 4, 5) + 0.03 * np.minimum(_fbm(rng, 16, 3, stretch=8), 0.2)
    brick_row = np.floor(row * 64)
    mortar = ((row * 64) % 1 < 0.22) | ((column * 32 + 0.5 * (brick_row % 2)) % 1 < 0.10)
    plaster = plaster - 0.05 * mortar
    colour = plaster[..., None] * np.array([1.0, 0.94, 0.84])
    x, y = np.abs(across - 0.5), np.abs(down - 0.46)
    colour[(x < 0.25) & (y < 0.32)] = (0.80, 0.79, 0.76)
    pane = (x < 0.215) & (y < 0.285) & (x > 0.012) & (np.abs(down - 0.36) > 0.012)
    colour[(x < 0.28) & (down > 0.77) & (down < 0.81)] = (0.58, 0.56, 0.53)
    colour[(x < 0.28) & (down > 0.81) & (down < 0.83)] = (0.34, 0.32, 0.30)
    blinds = rng.random((4, 4)) < 0.3
    closed = blinds[(4 * row).astype(int), (4 * column).astype(int)] & (down < 0.42)
    colour[pane] = (0.09, 0.11, 0.13)
    colour[pane & closed] = (0.55, 0.53, 0.48)
    return _layer(colour, np.where(pane & ~closed, 1.0, 0.0))


def _roof(rng: np.random.Generator) -> Floats:
    """Paint rows of tiles."""
    row, column = _rows()
    course = np.floor(row * 16)
    tile = (column * 16 + 0.5 * (course % 2)) % 1
    step = (row * 16) % 1
    shade = (
        0.5 + 0.12 * _fbm(rng, 16, 2) + 0.10 * _fbm(rng, 3, 3) - 0.25 * (step > 0.85) - 0.12 * (tile < 0.10)
    )
    return _layer(_tint((0.17, 0.09, 0.07), (0.55, 0.31, 0.23), shade), 0.05)


def _sign(rng: np.random.Generator) -> Floats:
    """Paint four signs, one a quarter; alpha 0 shows the body's colour instead."""
    layer = np.zeros((SIZE, SIZE, 4))
    half = SIZE // 2
    row, column = np.meshgrid(*(2 * [(np.arange(half) + 0.5) / half]), indexing="ij")
    across, down = 2 * column - 1, 2 * row - 1
    radius = np.hypot(across, down)
    # Lower left, a speed limit: red ring, white field, two digits.
    speed = np.zeros((half, half, 4))
    speed[...] = (0.93, 0.93, 0.91, 1)
    speed[(radius > 0.76) & (radius < 0.98)] = (0.72, 0.06, 0.07, 1)
    for centre, glyph in ((-0.27, "segments"), (0.27, "zero")):
        x = np.abs(across - centre)
        box = (x < 0.20) & (np.abs(down) < 0.40)
        hollow = (x < 0.09) & (np.abs(down) < 0.29)
        bar = np.abs(down) < 0.06 if glyph == "segments" else np.zeros_like(box)
        speed[box & (~hollow | bar)] = (0.05, 0.05, 0.05, 1)
    layer[half:, :half] = speed
    # Lower right, a warning: dark rim that follows the plate's edge is out of reach; a symbol in the middle.
    warning = np.zeros((half, half, 4))
    warning[(np.abs(across) < 0.09) & (down > -0.35) & (down < 0.28)] = (0.04, 0.04, 0.04, 1)
    warning[(np.abs(across) < 0.09) & (down > 0.38) & (down < 0.54)] = (0.04, 0.04, 0.04, 1)
    layer[half:, half:] = warning
    # Upper row, boards: a white rim and lines of letters.
    for column0, lines, arrow in ((0, 3, False), (half, 2, True)):
        board = np.zeros((half, half, 4))
        rim = np.maximum(np.abs(across), np.abs(down))
        board[(rim > 0.90) & (rim < 0.96)] = (0.95, 0.95, 0.95, 1)
        pitch = 1.5 / (lines + arrow)
        for line in range(lines):
            top = -0.72 + line * pitch
            place, stop = -0.74, rng.uniform(0.2, 0.75)
            while place < stop:
                width = rng.uniform(0.05, 0.10)
                letter = (
                    (across > place) & (across < place + width) & (down > top) & (down < top + 0.55 * pitch)
                )
                hole = (np.abs(across - place - width / 2) < 0.2 * width) & (
                    np.abs(down - top - 0.28 * pitch) < rng.uniform(0.06, 0.16) * pitch
                )
                board[letter & ~hole] = (0.95, 0.95, 0.95, 1)
                place += width + (0.03 if rng.random() < 0.85 else 0.12)
        if arrow:
            tip = (down > 0.45) & (down < 0.80) & (np.abs(across) < 0.8 * (0.80 - down))
            board[tip | ((np.abs(across) < 0.06) & (down > 0.25) & (down < 0.5))] = (0.95, 0.95, 0.95, 1)
        layer[:half, column0 : column0 + half] = board
    return layer


def _street_lamp(rng: np.random.Generator) -> Floats:
    return _layer(np.array([0.86, 0.84, 0.78]) + 0.02 * _fbm(rng, 8, 2)[..., None], 0.7)


def _grass(rng: np.random.Generator) -> Floats:
    """Paint a verge: green and dry patches, blades."""
    patches, blades = _fbm(rng, 4, 4), _fbm(rng, 64, 2)
    green = _tint((0.16, 0.20, 0.07), (0.40, 0.44, 0.18), 0.45 + 0.22 * blades)
    dry = _tint((0.42, 0.35, 0.18), (0.72, 0.63, 0.38), 0.5 + 0.22 * blades)
    share = np.clip(0.45 + 0.5 * patches, 0, 1)[..., None]
    return _layer(green * (1 - share) + dry * share, 0.02)


def _asphalt(rng: np.random.Generator) -> Floats:
    """Paint a road's surface: aggregate, worn and oily patches, cracks."""
    crack = np.abs(_fbm(rng, 3, 5, 0.6))
    shade = 0.37 + 0.018 * _fbm(rng, 3, 4) + 0.030 * rng.normal(size=crack.shape) + 0.02 * _fbm(rng, 64, 2)
    shade -= 0.07 * np.clip(1 - crack / 0.025, 0, 1)
    return _layer(shade[..., None] * np.array([0.985, 0.99, 1.01]), 0.15)


def _hill(rng: np.random.Generator) -> Floats:
    """Paint a far slope: woods, fields and bare ground, for the hill's colour to tint."""
    cover, detail = _fbm(rng, 5, 5, 0.65), _fbm(rng, 48, 3, 0.8)
    woods = _tint((0.16, 0.20, 0.13), (0.38, 0.42, 0.28), 0.5 + 0.3 * detail)
    fields = _tint((0.60, 0.58, 0.42), (0.92, 0.86, 0.68), 0.5 + 0.12 * detail + 0.2 * _fbm(rng, 3, 3))
    share = np.clip(0.35 + 1.6 * (cover - 0.2), 0, 1)[..., None]
    return _layer(woods * (1 - share) + fields * share, 0.0)


def _fabric(rng: np.random.Generator) -> Floats:
    """Paint cloth with folds."""
    shade = 0.86 + 0.10 * _fbm(rng, 4, 3, stretch=2)
    return _layer(np.repeat(shade[..., None], 3, axis=-1), 0.0)


def _palette(_rng: np.random.Generator) -> Floats:
    """Paint the palette's stripes."""
    stripes = np.array(list(PALETTE.values()))[np.arange(SIZE) * len(PALETTE) // SIZE]
    return _layer(np.broadcast_to(stripes, (SIZE, SIZE, 3)), 0.0)


_PAINTERS = {
    Surface.PAINT: _paint,
    Surface.GLASS: _glass,
    Surface.CHROME: _chrome,
    Surface.RUBBER: _rubber,
    Surface.PLASTIC: _plastic,
    Surface.PLATE: _plate,
    Surface.TAIL_LAMP: _tail_lamp,
    Surface.HEAD_LAMP: _head_lamp,
    Surface.CARGO: _cargo,
    Surface.FOLIAGE: _foliage,
    Surface.BARK: _bark,
    Surface.CONCRETE: _concrete,
    Surface.STEEL: _steel,
    Surface.FACADE: _facade,
    Surface.ROOF: _roof,
    Surface.SIGN: _sign,
    Surface.STREET_LAMP: _street_lamp,
    Surface.GRASS: _grass,
    Surface.ASPHALT: _asphalt,
    Surface.HILL: _hill,
    Surface.FABRIC: _fabric,
    Surface.PALETTE: _palette,
}
