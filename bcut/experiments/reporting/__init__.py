"""Reports: from stored runs to tables, figures and one page."""
