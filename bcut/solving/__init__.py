"""The whole way from an instance to a verified result."""
