"""How the surfaces of bodies answer to light."""

from __future__ import annotations

import numpy as np

from sim.models import Surface

# Share of the body's colour (2: by the texture's alpha), reflection, more by the alpha, retro-reflection.
_GLOSS = {
    Surface.PAINT: (1.0, 0.055, 0.02, 0.0),
    Surface.GLASS: (0.0, 0.22, 0.0, 0.0),
    Surface.CHROME: (0.0, 0.45, 0.0, 0.0),
    Surface.RUBBER: (0.0, 0.0, 0.0, 0.0),
    Surface.PLASTIC: (0.0, 0.02, 0.0, 0.0),
    Surface.PLATE: (0.0, 0.02, 0.0, 6.0),
    Surface.TAIL_LAMP: (0.0, 0.05, 0.0, 0.0),
    Surface.HEAD_LAMP: (0.0, 0.12, 0.0, 3.0),
    Surface.CARGO: (1.0, 0.01, 0.0, 0.0),
    Surface.FOLIAGE: (1.0, 0.0, 0.0, 0.0),
    Surface.FACADE: (1.0, 0.0, 0.25, 0.0),
    Surface.HILL: (1.0, 0.0, 0.0, 0.0),
    Surface.FABRIC: (1.0, 0.0, 0.0, 0.0),
    Surface.PALETTE: (0.0, 0.025, 0.0, 0.0),
    Surface.SIGN: (2.0, 0.01, 0.0, 25.0),
}


def material_table() -> bytes:
    """Return the shader's uniform ``u_material``: a row of four numbers for each surface."""
    table = np.zeros((len(Surface), 4), "<f4")
    for surface, row in _GLOSS.items():
        table[surface] = row
    return table.tobytes()
