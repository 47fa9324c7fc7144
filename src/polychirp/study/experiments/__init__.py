"""Experiments over many studies: diversity, ghosts, impairments, mitigation, mechanisms."""
