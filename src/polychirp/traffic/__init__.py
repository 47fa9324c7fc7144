"""Traffic: vehicles, roadside and street become a `Scene`."""
