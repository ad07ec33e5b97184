"""Pictures that stand in the page itself."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture with words beneath it.

    Attributes:
        title: The words.
        data: The file's bytes.
        media: Its media type.
    """

    title: str
    data: bytes
    media: str = "image/png"

    @property
    def base64(self) -> str:
        """The bytes as text."""
        return base64.b64encode(self.data).decode()


def jpeg(image: NDArray[np.uint8]) -> bytes:
    """Code an RGB picture (H, W, 3)."""
    _, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 88])
    return data.tobytes()
