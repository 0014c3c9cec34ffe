"""Algorithms on graphs whose nodes have weights, such as crossing graphs: what several cut families share."""
