"""The SCIP host: the only place that imports PySCIPOpt."""
