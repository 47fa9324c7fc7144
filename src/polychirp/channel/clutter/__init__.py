"""Echoes with random phases: rough plates, foliage, and scatterers strewn over them."""
