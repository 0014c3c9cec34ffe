"""The built-in cut families, one file each; the file `odd_cycle.py` holds the family `odd-cycle`.

They are written against the same seam as a user's own separator (`bcut.separation.seam`) and import nothing
else but the geometry and the algorithms of `bcut.separation.graphs` and `bcut.separation.small_lp`. A file
dropped into this folder is found by its name without reinstalling.
"""
