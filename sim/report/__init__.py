"""The report of a core: data, plots, page."""
