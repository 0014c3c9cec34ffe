"""What a file of points holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bcut.errors import InputError
from bcut.geometry.configuration import PointConfiguration


@dataclass(frozen=True, slots=True)
class Contents:
    """Points as a reader found them, before they are checked to be a configuration.

    Attributes
    ----------
    points : array or nested sequences
        What `PointConfiguration.from_values` takes.
    name : str, optional
        Where the file has one.
    faces : sequence of faces, optional
        The vertices of each, where the file has any; as they stand in it.
    digest : str, optional
        What the digest of the points must be.
    """

    points: Any
    name: str | None = None
    faces: Any = None
    digest: str | None = None

    def configuration(self, origin: str, name: str) -> PointConfiguration:
        """Return the points as a configuration.

        Parameters
        ----------
        origin : str
            What to call the file in messages.
        name : str
            What to call the configuration where the file does not tell.

        Raises
        ------
        ConfigurationError
            They are none.
        InputError
            They have another digest than the file says.
        """
        configuration = PointConfiguration.from_values(self.points, name=self.name or name, origin=origin)
        if self.digest is not None and configuration.digest != self.digest:
            raise InputError(
                f"{origin}: instance.digest does not belong to instance.points: one of them was changed after the "
                "run; take the file as it was written, or give the points alone"
            )
        return configuration
