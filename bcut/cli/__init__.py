"""The command line: thin commands around library functions of the same names."""
