// Header outside every room.
