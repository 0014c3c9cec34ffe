"""Exact re-checking of results: shares no geometry, no model and no solver with what found them."""
