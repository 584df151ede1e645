"""Vectors of three components and symmetric matrices, so that equations look as they do in books.

Only functions that are traced (`sweep.models.symbols`) or called from Python use them.  Components are numbers, arrays
or symbols.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class Vector(NamedTuple):
    """A vector by its components."""

    x: Any
    y: Any
    z: Any

    def __add__(self, other: Vector) -> Vector:  # type: ignore[override]
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __neg__(self) -> Vector:
        return Vector(-self.x, -self.y, -self.z)

    def times(self, factor: Any) -> Vector:
        """The vector times a number."""
        return Vector(factor * self.x, factor * self.y, factor * self.z)

    def dot(self, other: Vector) -> Any:
        """The scalar product."""
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: Vector) -> Vector:
        """The vector product."""
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )


def along_turned(first: Any, second: Any, angle: Any) -> tuple[Any, Any, Any]:
    """Elements 11, 12 and 22 of the matrix diag(first, second) along axes that are turned by `angle` about z."""
    cos, sin = np.cos(angle), np.sin(angle)
    return first * cos**2 + second * sin**2, (second - first) * sin * cos, first * sin**2 + second * cos**2


class Symmetric(NamedTuple):
    """A symmetric matrix by its elements."""

    xx: Any
    yy: Any
    zz: Any
    xy: Any
    xz: Any
    yz: Any

    def of(self, v: Vector) -> Vector:
        """The matrix times a vector."""
        return Vector(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )

    def adjugate(self) -> tuple[Symmetric, Any]:
        """The inverse times the determinant, and the determinant."""
        xx, yy, zz = (
            self.yy * self.zz - self.yz * self.yz,
            self.xx * self.zz - self.xz * self.xz,
            self.xx * self.yy - self.xy * self.xy,
        )
        xy = self.xz * self.yz - self.xy * self.zz
        xz = self.xy * self.yz - self.xz * self.yy
        yz = self.xy * self.xz - self.xx * self.yz
        return Symmetric(xx, yy, zz, xy, xz, yz), self.xx * xx + self.xy * xy + self.xz * xz
