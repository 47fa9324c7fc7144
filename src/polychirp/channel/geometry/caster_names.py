"""Names of the ray casters, apart from the casters so that a tracer's spec loads no kernels."""

from typing import Literal

CasterName = Literal["numba", "embree", "auto"]
"""Names of the ray casters; `embree.caster_name` tells which of them "auto" means here."""
