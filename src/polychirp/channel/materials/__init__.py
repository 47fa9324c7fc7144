"""Permittivities of materials, and the reflection and transmission of their layers."""
