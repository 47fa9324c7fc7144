"""Errors of real hardware: phase noise, bent ramps, filters, converters."""
