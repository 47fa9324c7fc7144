"""Radios that play and record: adapters to real ones, a loop without one, and what law asks."""
