"""Many trials of every point of a grid: drawn alike, stopped early, resumed, stored."""
