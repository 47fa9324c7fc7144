"""Physical constants, in SI, exact by the definition of 2019 unless said otherwise."""

from __future__ import annotations

from typing import Final

SPEED_OF_LIGHT: Final = 299_792_458.0
"""m/s, CODATA 2018 (exact)."""

BOLTZMANN: Final = 1.380_649e-23
"""J/K, CODATA 2018 (exact)."""

REFERENCE_TEMPERATURE: Final = 290.0
"""K, the temperature to which a noise figure refers (IEEE Std 686)."""

VACUUM_PERMITTIVITY: Final = 8.854_187_8128e-12
"""F/m, CODATA 2018."""
