"""The cut laboratory: plans of runs, their stored results, ledgers of cuts, and reports."""
