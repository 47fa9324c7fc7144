"""`Material`: electric properties of a surface."""

import math
from dataclasses import dataclass

import numpy as np

from polychirp.constants import VACUUM_PERMITTIVITY
from polychirp.errors import InputError
from polychirp.spec import Spec
from polychirp.units import Hertz, Metres, PerMetre, SiemensPerMetre


@dataclass(frozen=True, slots=True, kw_only=True)
class Material(Spec):
    r"""A homogeneous medium.

    .. math:: \varepsilon_r = \varepsilon' - j\,\sigma / \omega\varepsilon_0 \qquad (e^{+j\omega t})

    Parameters
    ----------
    relative_permittivity : ε′, ratio
    conductivity : σ, S/m; ``inf`` makes a perfect conductor
    thickness : m, of a sheet with air on both sides; 0 for a half-space
    roughness : m, rms height of the surface
    attenuation : 1/m, α of a cloud of small scatterers such as foliage, in which power falls as
        e^{−αx}; such a material fills its mesh, has no surface, and its other constants are those
        of its leaves
    albedo : share of the power lost in a cloud that is scattered, ratio 0…1
    lowest_frequency, highest_frequency : Hz, band in which the values are valid
    source : of the values; states it if they are an assumption
    """

    relative_permittivity: float = 1.0
    conductivity: SiemensPerMetre = 0.0
    thickness: Metres = 0.0
    roughness: Metres = 0.0
    attenuation: PerMetre = 0.0
    albedo: float = 0.0
    lowest_frequency: Hertz = 76e9
    highest_frequency: Hertz = 81e9
    source: str = "study file"

    def __post_init__(self) -> None:
        if not self.relative_permittivity >= 1.0:
            raise InputError("a material's relative permittivity must be at least 1")
        for what in ("conductivity", "thickness", "roughness", "attenuation"):
            if getattr(self, what) < 0:
                raise InputError(f"a material's {what} cannot be negative")
        if not 0.0 <= self.albedo <= 1.0:
            raise InputError("a material's albedo must be between 0 and 1")

    @property
    def is_conductor(self) -> bool:
        """True for a perfect conductor."""
        return math.isinf(self.conductivity)

    @property
    def is_sheet(self) -> bool:
        """True for a thin sheet, which transmits part of a wave."""
        return self.thickness > 0.0 and not self.is_conductor and not self.is_cloud

    @property
    def is_cloud(self) -> bool:
        """True for a cloud of small scatterers instead of a surface."""
        return self.attenuation > 0.0

    def permittivity(self, frequency: float) -> complex:
        """ε_r at ``frequency`` (Hz), complex."""
        omega = 2 * np.pi * frequency
        return complex(
            self.relative_permittivity, -self.conductivity / (omega * VACUUM_PERMITTIVITY)
        )
