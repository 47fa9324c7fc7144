"""Physical constants in SI units; those marked exact are exact by the SI's definitions of 2019."""

from typing import Final

SPEED_OF_LIGHT: Final = 299_792_458.0
"""Speed of light in vacuum, m/s, CODATA 2018 (exact)."""

BOLTZMANN: Final = 1.380_649e-23
"""Boltzmann constant, J/K, CODATA 2018 (exact)."""

REFERENCE_TEMPERATURE: Final = 290.0
"""Temperature to which a noise figure refers, K (IEEE Std 686)."""

VACUUM_PERMITTIVITY: Final = 8.854_187_8128e-12
"""Permittivity of vacuum, F/m, CODATA 2018."""
