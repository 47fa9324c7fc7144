"""Receive-side mitigation: from an `IfFrame` to a cleaner one."""
