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
    r"""A homogeneous medium, with the complex relative permittivity ε_r at angular frequency ω.

    .. math:: \varepsilon_r = \varepsilon' - j\,\sigma / \omega\varepsilon_0 \qquad (e^{+j\omega t})

    Parameters
    ----------
    relative_permittivity : ε′, ratio
    conductivity : σ, S/m; ``inf`` makes a perfect conductor
    thickness : m, of a sheet with air on both sides; 0 for a half-space
    roughness : m, rms height of the surface
    attenuation : 1/m, α of a cloud of small scatterers such as foliage, in which power falls as
        e^{−αx} over the length x; such a material fills the volume of its mesh and has no surface,
        and its other constants are those of a single leaf; 0 for every other material
    albedo : ratio 0…1, the part scattered of the power that a wave loses in a cloud
    lowest_frequency, highest_frequency : Hz, limits of the band in which the values are valid
    source : where the values come from, or the statement that they are assumed
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
        """True for a thin sheet, which transmits a part of a wave: neither conductor nor cloud."""
        return self.thickness > 0.0 and not self.is_conductor and not self.is_cloud

    @property
    def is_cloud(self) -> bool:
        """True for a cloud of small scatterers, which has no surface."""
        return self.attenuation > 0.0

    def permittivity(self, frequency: float) -> complex:
        """Complex relative permittivity ε_r at ``frequency`` (Hz)."""
        omega = 2 * np.pi * frequency
        return complex(
            self.relative_permittivity, -self.conductivity / (omega * VACUUM_PERMITTIVITY)
        )
