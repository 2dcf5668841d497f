"""Pictures of a world: its content (``scene``), the view (``camera``) and the drawing, with pygame, an extra.

Functions draw a ``scene`` on a ``surface``, as the camera's ``view`` shows it. Points (``at``, ``start``) are right and
down [px]; ``unit`` and ``line_px`` are pixels of the surface per pixel of a picture of the usual size, ``height`` is
that of letters [px], ``halo`` a white edge that keeps them readable on lines.
"""
