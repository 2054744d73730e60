"""Figures from the results: one module a figure, found by `python -m analysis` by itself.

A figure's module has NAME (on the command line and of the file), PAPER (the dissertation's figure) and
``draw(store: Results) -> list[FigureResult]``, which raises NoDataError with what would feed the figure.
"""
