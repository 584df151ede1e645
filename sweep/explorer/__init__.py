"""The explorer: maps of a dataset in the browser, where a click runs the trajectory of a cell.

It needs the extra `explore` (Bokeh).  The rest of the program works without it.
"""
