"""Figures of the documentation that no command draws."""
