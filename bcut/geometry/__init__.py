"""Exact geometry: coordinates, orientations, candidate simplices, crossings, triangulations. No solver in sight."""
