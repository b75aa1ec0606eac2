"""The C-arm's plane: where points of the vessel are seen."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..scene import Scene

SOURCE_MM = 785.0      #: from the X-ray source to the isocentre, as the trainer's C-arm (sim/xray_tube.h)


class CArm:
    """Projects points from the X-ray source onto the plane through the isocentre that is parallel to the detector.

    Args:
        scene: gives the patient's axes and the angles.
        isocentre: (3,) mm, the origin of the plane.

    The plane's axes are those of the picture: from the front x leads to the patient's left and y to the head.
    """

    def __init__(self, scene: Scene, isocentre: ArrayLike) -> None:
        self.lao_deg, self.cra_deg, anterior, superior = scene.view
        self.isocentre = np.asarray(isocentre, np.float64)
        theta, phi = np.radians([self.lao_deg, self.cra_deg])
        left = -np.cross(anterior, superior)
        level = np.cos(theta) * anterior + np.sin(theta) * left
        self.right = np.cos(theta) * left - np.sin(theta) * anterior
        self.up = np.cos(phi) * superior - np.sin(phi) * level
        self.towards = np.cos(phi) * level + np.sin(phi) * superior

    def project(self, points: ArrayLike) -> NDArray[np.float64]:
        """Places in the plane, (…, 2) mm, of points, (…, 3) mm."""
        p = np.asarray(points, np.float64) - self.isocentre
        scale = SOURCE_MM / (SOURCE_MM + p @ self.towards)
        return np.stack([p @ self.right * scale, p @ self.up * scale], axis=-1)
