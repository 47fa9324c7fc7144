"""Azimuths: beamforming, and direction-of-arrival estimators."""
