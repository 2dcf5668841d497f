"""Pictures of a world: what is seen (``scene``), from where (``camera``), and how it is drawn. pygame is an extra.

Functions put on a ``surface`` what a ``scene`` shows, as the camera's ``view`` sees it. Points (``at``, ``start``) go
right and down [px]; ``unit`` and ``line_px`` are pixels of the surface in one of a picture of the usual size,
``height`` is that of letters [px], ``halo`` a white edge that keeps them readable on lines.
"""
