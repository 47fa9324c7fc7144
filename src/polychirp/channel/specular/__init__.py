"""Mirror images in large plates (road, walls) and in pairs of plates."""
