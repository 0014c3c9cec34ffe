"""Integer programs whose solutions are triangulations, as sparse rows without any solver."""
