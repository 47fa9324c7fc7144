"""From dechirped samples to detections."""
