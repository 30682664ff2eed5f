"""The Explorer: a page in the browser that shows a vehicle's stability while its numbers are moved.

``railenv explore`` opens it (extra ``explore``). :mod:`railenv.explorer.state` says what is shown,
:mod:`railenv.explorer.computations` computes it with the functions of :mod:`design`, and
:mod:`railenv.explorer.page` draws it.
"""
