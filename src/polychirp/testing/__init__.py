"""Paths and bodies made by hand, for examples and for tests of polychirp and of its plug-ins.

`paths` writes propagation paths (`HandPath`, `paths_of`, `free_space_gain`); `shapes` makes
canonical bodies (`plate`, `sphere`, `box`, `dihedral`, `trihedral`), meshes of them (`mesh_of`),
scenes around them (`around`) and transfer matrices (`transfer_at`); `conformance` holds the laws of
waveforms (`check_waveform`), rules (`check_access`) and receivers (`check_receiver`). All these
names are public.
"""
