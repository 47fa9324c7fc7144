"""Rays, boxes, nearest points and delays of moving points: geometry without waves."""
