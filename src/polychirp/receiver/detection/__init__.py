"""From samples to detections: range-rate map, thresholds and side-lobe rejection."""
