// Private header.
