"""The Explorer: a page in the browser that shows a vehicle's stability as you move its numbers.

``railenv explore`` opens it (extra ``explore``). :mod:`railenv.explorer.state` holds what is shown,
:mod:`railenv.explorer.computations` computes it with the functions of :mod:`design`, and
:mod:`railenv.explorer.page` draws it.
"""
