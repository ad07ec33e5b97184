"""What a dataset is to hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from scenarios.export.frames import Coding
    from scenarios.spec import Scenario

Format = Literal["mot", "coco", "kitti"]

TRUTH = "truth"
"""Folder of what is true of the episodes; an episode that stands there is done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """What to generate.

    Attributes:
        scenario: What is driven.
        seeds: Which of its drives.
        format: Of the files.
        coding: Of the pictures.
    """

    scenario: Scenario
    seeds: range
    format: Format
    coding: Coding = "png"

    @property
    def frames(self) -> int:
        """Frames of all episodes together."""
        return len(self.seeds) * self.scenario.frames

    @property
    def names(self) -> list[str]:
        """Names of the sequences."""
        return [sequence_name(seed) for seed in self.seeds]


def sequence_name(seed: int) -> str:
    """Return the name of a seed's sequence, four digits or more, as KITTI has them."""
    return f"{seed:04d}"
