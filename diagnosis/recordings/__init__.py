"""From files to recordings: mapping, time axis, units, plausible ranges, cleaning.

``read`` walks the whole way. ``names``: files and parts as people name them; ``file``: an opened file with its
``mapping`` and its clock (``time_axis``); ``rows``: its rows, with the quantities of ``columns`` in the units inside;
``cleaning`` and ``doubts``: values that count as missing, and others that are only noted; ``recording``: the result.
"""
