// Public header of a higher layer.
