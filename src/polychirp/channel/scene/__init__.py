"""The scene as rays meet it: its triangles, which of them block or weaken, and the truth."""
